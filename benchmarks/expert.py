"""How the expert does on several hands and objects: 16 directions, three seeds of three noisy starts each.

Prints one Markdown row for each pair. For the standard pair, with the laboratory's joint limits beside it, one row for
each direction, twist and direction with a held twist, against the hand's own limit and people's means.
`make study` runs it; docs/benchmarks.md records what it printed.
"""

from __future__ import annotations

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import Result, by_direction, mean_fraction, result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.table import failures
from inhand.versions import versions

SEEDS = (0, 1, 2)
STANDARD = "2v2_50.50_50.50_1.1_53"
PAIRS = ((STANDARD, "cube_39"), (f"{STANDARD}:lab-limits", "cube_39"))
"""Hands and objects; `inhand sweep` has many more, one trial a direction."""
HUMAN_MEANS_MM = {
    "Out": 49.5, "Out-Right": 60.9, "Right": 72.7, "In-Right": 52.5,
    "In": 44.3, "In-Left": 48.7, "Left": 78.4, "Out-Left": 59.9,
}  # fmt: skip
"""One person, three trials, on the real 2v2 hand [mm]."""
HUMAN_TURNS_DEG = {"cw": 43.0, "ccw": 44.0}
"""Means of people on the real 2v2 hand [deg]."""


def results_of(hand: str, thing: str, seed: int, directions: str = "all", twist: float = 0.0) -> list[Result]:
    """Return the results of one run."""
    config = AsteriskConfig(hand=hand, object=thing, seed=seed, directions=directions, twist=twist)
    return [result_of_trial(trial) for trial in simulate(config, prepare(config))]


def row(hand: str, thing: str, runs: list[list[Result]]) -> str:
    """Return the Markdown row of one pair."""
    kept = [sum(all(r.kept for r in group) for group in by_direction(run).values()) for run in runs]
    every = [result for run in runs for result in run]
    distance = [result.metrics.distance_mm for result in every]
    shares = [mean_fraction(group) or 0.0 for group in by_direction(every).values()]
    cells = (
        hand,
        thing,
        ", ".join(str(count) for count in kept),
        f"{sum(result.kept for result in every)} of {len(every)}",
        f"{np.mean(distance):.1f}",
        f"{np.mean(shares):.3f}",
        f"{min(shares):.3f}",
        f"{max(result.metrics.lateral_max_mm for result in every):.1f}",
        f"{max(result.metrics.rotation_max_deg for result in every):.1f}",
        f"{min(result.metrics.contact_fraction or 0.0 for result in every):.3f}",
    )
    return "| " + " | ".join(cells) + " |"


def directions(runs: list[list[Result]]) -> list[str]:
    """Return one Markdown row for each direction of the standard pair."""
    rows = []
    for name, group in by_direction([result for run in runs for result in run]).items():
        values = [result.reached for result in group]
        human = HUMAN_MEANS_MM.get(name, HUMAN_TURNS_DEG.get(name))
        cells = (
            name,
            f"{min(values):.1f}",
            f"{np.mean(values):.1f}",
            f"{max(values):.1f}",
            f"{group[0].limit:.1f}",
            f"{mean_fraction(group):.3f}",
            "-" if human is None else f"{human:.1f}",
            f"{max(result.metrics.lateral_max_mm for result in group):.2f}",
            f"{max(result.metrics.rotation_max_deg for result in group):.2f}",
            f"{max(result.metrics.longest_gap_s or 0 for result in group):.2f}",
        )
        rows.append("| " + " | ".join(cells) + " |")
    return rows


def main() -> None:
    """Run every pair and print the tables."""
    print(", ".join(f"{name} {version}" for name, version in versions().items()))
    print("\n| hand | object | kept of 16 | trials kept | mean mm | of limit | least | lateral | turn | contact |")
    print("| --- " * 10 + "|")
    tables: dict[str, list[list[Result]]] = {}
    lost: list[str] = []
    for hand, thing in PAIRS:
        runs = [results_of(hand, thing, seed) for seed in SEEDS]
        if thing == "cube_39" and hand.startswith(STANDARD):
            tables[hand] = runs
        print(row(hand, thing, runs), flush=True)
        for seed, run in zip(SEEDS, runs, strict=True):
            lost += [f"* {hand}, {thing}, seed {seed}: {sentence}" for sentence in failures(run)]
    print("\nWhat was lost:\n" + "\n".join(lost))
    tables["twists"] = [results_of(STANDARD, "cube_39", seed, "twist") for seed in SEEDS]
    tables["held twists"] = [results_of(STANDARD, "cube_39", seed, "train", 15.0) for seed in SEEDS]
    for name, runs in tables.items():
        print(
            f"\n{name}, cube_39\n\n| direction | least | mean | most | limit | share | human | lateral | turn | gap |"
        )
        print("| --- " * 10 + "|")
        print("\n".join(directions(runs)), flush=True)


if __name__ == "__main__":
    main()
