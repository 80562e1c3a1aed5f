"""What a policy of the family reaches of each hand's own expert, and what a new hand costs it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from family_config import STANDARD, FamilyConfig
from inhand.asterisk_test.spread import Compute
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.run import run_sweep
from inhand.control.catalogue import find_controller
from inhand.control.seen import PRIVILEGED, SENSED
from inhand.control.trial import LOST
from inhand.errors import InputError
from inhand.learning.presets import hand_of_family, privileged_family
from inhand.learning.progress import BEST
from inhand.learning.train import begin

EXPERT, ALONE = "ik", {SENSED: "rl", PRIVILEGED: "rl-privileged"}
"""Each hand's own expert, and the policy that was trained with the standard hand and cube alone, by what it reads."""
LEAST = 5.0
"""Cases in which the expert itself comes less far have no share [mm or deg]."""
CASE = ["hand", "object", "direction"]
Told = Callable[[str], None]


def measured(config: FamilyConfig, compute: Compute, told: Told) -> pd.DataFrame:
    """Return a row for each hand, object and direction: what the policy and the expert reached, and their share.

    Raises:
        InputError: a hand or an object outside of the policy's family, or what a sweep refuses.
    """
    told(f"the expert with {len(config.hands)} hands and {len(config.objects)} objects, undisturbed")
    expert = cases_of(replace(config, disturb="none"), EXPERT, compute)
    told(f"{config.policy} with the same")
    return joined(cases_of(config, config.policy, compute), expert)


def joined(policy: pd.DataFrame, expert: pd.DataFrame) -> pd.DataFrame:
    """Return cases of a policy with those of the expert beside: `reached`, `expert`, `share`, `kept`, `expert_kept`.

    A case that is `lost` had lost its object; one that is not kept may also not have moved.
    """
    found = policy.merge(expert[[*CASE, "reached", "kept"]], on=CASE, suffixes=("", "_expert"))
    found = found.rename(columns={"reached_expert": "expert", "kept_expert": "expert_kept"})
    lost = [any(end in why for end in LOST) for why in found.why]
    return found.assign(share=(found.reached / found.expert.where(found.expert >= LEAST)), lost=lost)


def cases_of(
    config: FamilyConfig,
    controller: str,
    compute: Compute,
    held: tuple[Sequence[str], Sequence[str]] | None = None,
    directions: str | None = None,
) -> pd.DataFrame:
    """Return the cases of a controller, with the study's hands and objects unless others are given.

    They are kept in the study's folder.
    """
    hands, objects = held or (config.hands, config.objects)
    place = Path(controller).resolve()
    name = controller if not place.is_dir() else f"{place.parent.name}-{place.name}"
    name = name if config.disturb == "none" else f"{name}-{config.disturb}"
    asked = SweepConfig(
        hands=tuple(hands),
        objects=tuple(objects),
        controller=controller,
        directions=directions or config.directions,
        disturb=config.disturb,
        seed=config.seed,
        jobs=config.jobs,
        out=config.out / name,
    )
    parts = [asked] if config.sample == 1 else list(sampled(asked, config.sample))
    return pd.concat([run_sweep(part, compute).sweep.cases for part in parts], ignore_index=True)


def sampled(asked: SweepConfig, every: int) -> Iterator[SweepConfig]:
    """Give the sweeps, a hand and a folder each, that try one of so many pairs, other objects with each hand."""
    for row, hand in enumerate(asked.hands):
        if objects := asked.objects[-row % every :: every]:
            yield replace(asked, hands=(hand,), objects=objects, out=asked.out / str(row))


def standard(config: FamilyConfig, cases: pd.DataFrame, compute: Compute, told: Told) -> pd.DataFrame:
    """Return the standard hand and cube along the directions: the policy, and the one trained with them alone."""
    told("the policy of the standard pair alone")
    mine = cases[(cases.hand == STANDARD) & (cases.object == "cube_39") & ~cases.rotates]
    known = ALONE[find_controller(config.policy).reads]
    alone = cases_of(config, known, compute, ((STANDARD,), ("cube_39",)), ",".join(mine.direction))
    return mine.merge(alone[["direction", "reached", "kept"]], on="direction", suffixes=("", "_alone"))


def fitted(config: FamilyConfig, cases: pd.DataFrame, compute: Compute, told: Told) -> pd.DataFrame:
    """Return what few demonstrations of a new hand give: a row for each hand and number, 0 of the policy as it is."""
    rows = []
    for hand in config.new:
        own = cases[(cases.hand == hand) & (cases.object == config.new_object) & ~cases.rotates]
        rows.append((hand, 0, own.share.mean(), own.kept.mean()))
        for count in config.demonstrations:
            told(f"{hand} from {count} demonstrations")
            policy = _fit(config, hand, count)
            found = cases_of(config, str(policy), compute, ((hand,), (config.new_object,)), ",".join(own.direction))
            both = joined(found, own[[*CASE, "expert", "expert_kept"]].rename(columns=EXPERTS))
            rows.append((hand, count, both.share.mean(), both.kept.mean()))
    return pd.DataFrame(rows, columns=["hand", "demonstrations", "share", "kept"])


EXPERTS = {"expert": "reached", "expert_kept": "kept"}


def _fit(config: FamilyConfig, hand: str, count: int) -> Path:
    """Return the folder of the policy that so many demonstrations of a hand make of the family's, trained once."""
    out = config.out / "new" / f"{config.new.index(hand)}-{count}"
    if not (out / "report.md").is_file():
        sensed = find_controller(config.policy).reads == SENSED
        training = hand_of_family(None if sensed else privileged_family())
        training = replace(training, hand=hand, object=config.new_object, start=config.policy, rounds=0)
        begin(replace(training, recipe=replace(training.recipe, episodes=count)), out, overwrite=out.exists())
    return out / BEST


def by_hand(cases: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each hand: cases, kept, mean and least mean share of an object, and the share of turns."""
    return _grouped(cases, "hand")


def by_object(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the same for each object."""
    return _grouped(cases, "object")


def _grouped(cases: pd.DataFrame, key: str) -> pd.DataFrame:
    straight = cases[~cases.rotates].groupby(key, sort=False)
    found = straight.agg(
        cases=("kept", "size"),
        kept=("kept", "mean"),
        lost=("lost", "sum"),
        expert_kept=("expert_kept", "mean"),
        share=("share", "mean"),
        median=("share", "median"),
    )
    found["turns"] = cases[cases.rotates].groupby(key, sort=False).share.mean()
    return found


def overall(cases: pd.DataFrame) -> dict[str, float]:
    """Return what the study asks: kept, mean share, the worst hand's, and that of turns."""
    straight, turns = cases[~cases.rotates], cases[cases.rotates]
    return {
        "kept": float(straight.kept.mean()),
        "lost": float(straight.lost.mean()),
        "expert_kept": float(straight.expert_kept.mean()),
        "share": float(straight.share.mean()),
        "worst_hand": float(straight.groupby("hand").share.mean().min()),
        "turns": float(turns.share.mean()) if len(turns) else float("nan"),
        "turns_lost": float(turns.lost.mean()) if len(turns) else float("nan"),
        "turns_kept": float(turns.kept.mean()) if len(turns) else float("nan"),
    }


def check_study(config: FamilyConfig) -> None:
    """Refuse new hands that the study does not run, and samples that are none.

    Raises:
        InputError: the text names them.
    """
    if config.sample < 1 or (config.sample > 1 and config.new):
        raise InputError(
            f"--sample {config.sample} with --new {' '.join(config.new)}: give 1 for all pairs or a larger number, and"
            " then leave --new empty: what few demonstrations teach is told of pairs that may be left out"
        )
    unknown = [hand for hand in config.new if hand not in config.hands]
    if unknown or (config.new and config.new_object not in config.objects):
        raise InputError(
            f"new hands {', '.join(unknown) or config.new_object} are not among those of the study: add them to --hands"
            " and --objects, or leave them out of --new"
        )


def shares(cases: pd.DataFrame) -> tuple[tuple[str, ...], tuple[str, ...], np.ndarray, list[list[str]]]:
    """Return hands, objects, the mean share of each pair, and how many of its cases were lost, for a heat map."""
    hands, objects = (tuple(dict.fromkeys(cases[key])) for key in ("hand", "object"))
    grid = pd.MultiIndex.from_product([hands, objects])
    pairs = cases[~cases.rotates].groupby(["hand", "object"], sort=False)
    share = pairs.share.mean().reindex(grid).to_numpy().reshape(len(hands), len(objects))
    lost = pairs.lost.sum().reindex(grid).fillna(0).to_numpy().reshape(share.shape)
    return hands, objects, share, [[f"{count:.0f} lost" if count else "" for count in row] for row in lost]
