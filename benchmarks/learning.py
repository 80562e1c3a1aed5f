"""What learns to move the object, and what each departure from the thesis is worth: one table over seeds.

Of a training the policy with the largest sum of rewards is tested, and what the last one came to in the training's own
evaluation stands beside it. Every controller is run through the whole Asterisk Test (place, grasp, manipulate) in 8 + 8
directions with start noise, 7 trials each, so 112 episodes, from starts that no training saw. Training times are wall
clock on this machine from the first grasp planned to the last checkpoint.

Groups: `privileged` (both variants), `ablations` (it less one departure, half its budget), `thesis`, and `given`: the
experts and the policy that ships, which `--engine mujoco` tests in three dimensions. `stages` is another table: what
each stage of `default` is worth undisturbed and under each level, beside `cloned`, which copies as many demonstrations
for as long, the experts, and what ships. All stages have the grasps and ways of what ships, so that trials are paired.
Bounds on two cores: `privileged` trained in 60 s, `thesis` in 180 s.
Run: python benchmarks/learning.py --groups privileged given --seeds 0 1 2
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd

import inhand
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import Result, result_of_trial
from inhand.asterisk_test.robustness.summary import retention, wilson
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.catalogue import ControllerEntry, find_controller, learned
from inhand.control.names import SHIPPED
from inhand.control.policy import load_policy
from inhand.learning.config import Training
from inhand.learning.presets import default, privileged, thesis
from inhand.learning.progress import BEST, IMITATED, LAST
from inhand.learning.runs import finished, train
from inhand.learning.train import SILENT
from inhand.sim.names import ENGINE, Engine
from inhand.tasks.primitives import TRAIN
from timing import environment

TRIALS, TEST_SEED = 7, 100
"""Trials of each direction, and the seed of their starts."""
Change = Callable[[Training], Training]


def _half(config: Training) -> Training:
    """Return a configuration with half the demonstrations and episodes."""
    return replace(
        config, recipe=replace(config.recipe, episodes=config.recipe.episodes // 2), episodes=config.episodes // 2
    )


EIGHT = replace(privileged(), directions="train")
"""The same trained on the 8 directions alone, as in the thesis."""
ABLATIONS: dict[str, Change] = {
    "privileged, half": lambda config: config,
    "no start from demonstrations": lambda config: replace(config, imitate=0),
    "start only, no learning after it": lambda config: replace(config, warm_up=0, episodes=1),
    "no imitation term": lambda config: replace(config, learning=replace(config.learning, imitation=0.0)),
    "no demonstrations in the batch": lambda config: replace(config, expert_share=0.0),
    "one critic": lambda config: replace(config, learning=replace(config.learning, critics=1)),
    "no pushes": lambda config: replace(config, recipe=replace(config.recipe, push=0.0)),
    "no starts midway": lambda config: replace(config, recipe=replace(config.recipe, midway=0.0)),
    "no other grips": lambda config: replace(config, recipe=replace(config.recipe, grip_spread=0.0)),
    "way left unseen": lambda config: replace(config, interface=replace(config.interface, observation="grip-open")),
    "observation of table 3.1": lambda config: replace(
        config, interface=replace(config.interface, observation="thesis")
    ),
    "actions as joint angles": lambda config: replace(config, interface=replace(config.interface, actions="angles")),
}
GROUPS: dict[str, dict[str, Training]] = {
    "privileged": {"privileged": privileged(), "privileged on 8 directions": EIGHT},
    "ablations": {name: change(_half(EIGHT)) for name, change in ABLATIONS.items()},
    "thesis": {"thesis": thesis()},
}


def cloned(config: Training) -> Training:
    """Return a training that copies as many demonstrations in as many updates, none of the actor's own states."""
    shown, fitted = config.rounds * config.relabelled, config.imitate + (config.rounds - 1) * config.refit
    recipe = replace(config.recipe, episodes=config.recipe.episodes + shown)
    return replace(config, recipe=recipe, imitate=config.imitate + fitted, rounds=0, warm_up=0, episodes=1)


SENSED = {"cloned": cloned(default()), "default": default(), "thesis": thesis()}
STAGES = {
    "cloned": ("cloned", BEST),
    "relabelled": ("default", IMITATED),
    "values": ("default", LAST),
    "thesis": ("thesis", BEST),
}
"""Stages, each with what is trained and the folder of its policy."""
BESIDE = ("rl", "ik-sensed", "rl-privileged", "ik", "ik-cautious", "thesis-ik")
LEVELS = ("none", "bench", "field", "hard")
STAGE_TRIALS = 21
"""Trials of each direction at each level: 336."""


def stages(out: Path, seeds: Sequence[int]) -> None:
    """Train what is not there yet, test every stage at all levels, and print the table."""
    for name, config in SENSED.items():
        for seed in seeds:
            folder = out / f"{name}-{seed}"
            if not finished(folder):
                train(replace(config, seed=seed), folder, SILENT, overwrite=True)
    entries = {stage: [_as_shipped(stage, out, seed) for seed in seeds] for stage in STAGES}
    every = [*BESIDE, *(each for group in entries.values() for each in group)]
    study = inhand.robustness(every, "levels", curves=(), trials=STAGE_TRIALS, seed=TEST_SEED, out=out / "stages")
    trials, whose = study.trials(), {each: [each] for each in BESIDE}
    for stage, group in entries.items():
        whose |= {each.name: [each.name] for each in group} | {f"{stage}, all": [each.name for each in group]}
    print(f"| controller | {' | '.join(LEVELS)} |\n" + "| --- " * (1 + len(LEVELS)) + "|")
    for name, mine in whose.items():
        rows = trials[trials.controller.isin(mine)]
        print(f"| {name} | {' | '.join(_at_level(rows[rows.disturb == level]) for level in LEVELS)} |", flush=True)


def _as_shipped(stage: str, out: Path, seed: int) -> ControllerEntry:
    """Return the policy of a stage, with the grasps of what ships where it is on real senses."""
    name, place = STAGES[stage]
    entry = learned(f"{stage}-{seed}", load_policy(out / f"{name}-{seed}" / place))
    return replace(entry, grasp=find_controller("rl").grasp) if entry.primitive else entry


def _at_level(trials: pd.DataFrame) -> str:
    """Return share of the limit, objects lost, and turn of 95 % of those kept, with 95 % intervals."""
    lost, share = int(trials.lost.sum()), retention(trials.way.to_numpy(), np.ones(len(trials)), TEST_SEED)
    low, high = (100 * end for end in wilson(lost, len(trials)))
    turn = trials[~trials.lost].rotation_max_deg.quantile(0.95)
    return f"{share[0]:.3f} ({share[1]:.3f} to {share[2]:.3f}), {lost} ({low:.1f} to {high:.1f} %), {turn:.1f}"


def tested(controller: str, engine: Engine) -> tuple[Result, ...]:
    """Return the results of a controller in all directions."""
    config = AsteriskConfig(controller=controller, trials=TRIALS, seed=TEST_SEED, engine=engine)
    return tuple(result_of_trial(trial) for trial in simulate(config, prepare(config)))


def summary(results: Sequence[Result]) -> dict[str, Any]:
    """Return the numbers of a table row."""
    seen = {primitive.name for primitive in TRAIN}
    told: dict[str, Any] = {}
    for group, mine in (
        ("trained", [r for r in results if r.direction in seen]),
        ("unseen", [r for r in results if r.direction not in seen]),
    ):
        by_direction: dict[str, list[float]] = {}
        for result in mine:
            by_direction.setdefault(result.direction, []).append(result.fraction or 0.0)
        means = {name: float(np.mean(values)) for name, values in by_direction.items()}
        kept = {name: all(r.kept for r in mine if r.direction == name) for name in means}
        told[group] = {
            "fraction": float(np.mean(list(means.values()))),
            "least": min(means.values()),
            "directions": means,
            "kept": sum(kept.values()),
            "dropped": sum(not r.kept for r in mine),
            "trials": len(mine),
        }
    told["lateral_mm"] = max(r.metrics.lateral_max_mm for r in results)
    told["rotation_deg"] = max(r.metrics.rotation_max_deg for r in results)
    told["contact"] = float(np.mean([r.metrics.contact_fraction for r in results]))
    return told


def trained(name: str, config: Training, out: Path, engine: Engine) -> dict[str, Any]:
    """Train a configuration unless its folder is finished, test it in an engine, and return its row."""
    row = out / "row.json"
    if row.is_file():
        return dict(json.loads(row.read_text()))
    if not finished(out):
        train(config, out, SILENT, overwrite=True)
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    tries = [line for line in lines if line["kind"] == "evaluation"]
    passed = next((line["seconds"] for line in tries if line["total"] > line["expert_total"]), None)
    told = summary(tested(str(out), engine)) | {
        "name": name,
        "seed": config.seed,
        "wall_s": json.loads((out / "finished.json").read_text())["last_sitting_s"],
        "learning_s": tries[-1]["seconds"],
        "passed_expert_s": passed,
        "last": {part: tries[-1][part] for part in ("fraction", "dropped", "trials")},
        "decisions": tries[-1]["decisions"],
        "updates": tries[-1]["updates"],
    }
    row.write_text(json.dumps(told, indent=1) + "\n")
    return told


def line_of(row: dict[str, Any]) -> str:
    """Return a row of the Markdown table."""
    a, b = row["trained"], row["unseen"]
    passed, last = row.get("passed_expert_s"), row.get("last")
    cells = [
        row["name"],
        str(row.get("seed", "-")),
        f"{a['fraction']:.3f}",
        f"{a['least']:.3f}",
        f"{a['kept']}",
        f"{b['fraction']:.3f}",
        f"{b['least']:.3f}",
        f"{b['kept']}",
        f"{a['dropped'] + b['dropped']} of {a['trials'] + b['trials']}",
        f"{row['lateral_mm']:.1f}",
        f"{row['rotation_deg']:.1f}",
        f"{row['contact']:.3f}",
        f"{row['wall_s']:.0f}" if row.get("wall_s") else "-",
        "-" if passed is None else f"{passed:.0f}",
        "-" if last is None else f"{last['fraction']:.3f}, {last['dropped']} of {last['trials']}",
    ]
    return "| " + " | ".join(cells) + " |"


HEADER = (
    "| controller | seed | trained: share | least | kept of 8 | unseen: share | least | kept of 8 | dropped"
    " | lateral [mm] | turn [deg] | contact | training [s] | passes the expert after [s]"
    " | last policy: share, dropped |\n" + "| --- " * 15 + "|"
)


def main() -> None:
    """Train, test and print the table as it grows."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--groups", nargs="+", default=["privileged", "given"], choices=[*GROUPS, "given", "stages"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--only", nargs="+", default=[], help="names of rows, all without it")
    parser.add_argument("--engine", default=ENGINE, choices=get_args(Engine), help="in which controllers are tested")
    parser.add_argument("--out", type=Path, default=Path("results/learning"))
    given = parser.parse_args()
    print(environment())
    for group in given.groups:
        if group == "stages":
            stages(given.out, given.seeds)
            continue
        print(HEADER)
        if group == "given":
            for name in ("ik", "thesis-ik", *SHIPPED):
                print(line_of(summary(tested(name, given.engine)) | {"name": name}), flush=True)
            continue
        for name, config in GROUPS[group].items():
            if given.only and name not in given.only:
                continue
            for seed in given.seeds:
                folder = given.out / f"{name.replace(' ', '-').replace(',', '')}-{seed}"
                print(line_of(trained(name, replace(config, seed=seed), folder, given.engine)), flush=True)


if __name__ == "__main__":
    main()
