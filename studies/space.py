"""A policy of a hand in space beside the expert, from the same grasps and starts: `python studies/space.py --help`.

Directions and turns that were learned, directions drawn anywhere on the sphere, and gravities that no training shows.
A policy on real senses plans its own grasps: so it is set beside an expert on senses, undisturbed and at `field`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tyro
from numpy.typing import NDArray
from pandas import DataFrame

from inhand.asterisk_test.results import turning
from inhand.asterisk_test.robustness.run import robustness
from inhand.asterisk_test.robustness.summary import wilson
from inhand.cli.terminal import print_table, say
from inhand.control.controller import SpatialTask
from inhand.control.loop import Bench, simulate
from inhand.control.seen import SENSED
from inhand.control.spatial_catalogue import check_known_in_space, find_spatial_controller
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_policy import shorter
from inhand.control.spatial_rehearsal import planned_in_space
from inhand.control.trial import NO_GRASP, REACHED, TIME_OUT
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.files import load_solid, load_spatial_hand
from inhand.hands.spatial.gravity import GRAVITY, PALMS, USUAL_PALM
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.space import space_of
from inhand.learning.space_pools import NEVER, NEVER_DEG, drawn_vectors
from inhand.rotations import pose_from
from inhand.sim.names import SPATIAL
from inhand.tasks.spatial.aims import SpatialAim
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import SpatialPrimitive, along, parse_spatial_directions

HEADER = ("Starts", "Trials", "Kept", "Expert keeps", "Share of the expert", "Off the line [mm]", "Turned off [deg]")
SENSED_HEADER = (
    "Trials",
    "Level",
    "Controller",
    "Kept, 95 %",
    "No grasp",
    "Share of the limit: all, moves, turns",
    "Off",
)
"""The head of the table of a policy on real senses; off are 95 % of the moves [mm, deg]."""
AT_ONCE = 40
"""Drawn directions that are run at a time, and then kept."""
KEPT = (REACHED, TIME_OUT)
"""Ends of episodes in which nothing was lost."""
NOISE = 1e-3, float(np.deg2rad(1.0))
"""Standard deviations of the object's start [m, rad]."""


@dataclass(frozen=True)
class SpaceConfig:
    """Set a policy of a hand in space beside the expert."""

    controller: str = "rl-privileged"
    """The policy: rl, or the folder of a run."""
    hand: str = "3f_60.60_40_10"
    """Hand in space."""
    object: str = "cube_50"
    """Object."""
    anywhere: int = 200
    """Directions drawn anywhere on the sphere, a quarter of them under each palm and under a gravity never shown."""
    directions: str = "all,turns"
    """Named directions and turns."""
    trials: int = 1
    """Starts of each of them under each gravity."""
    seed: int = 0
    """Seed of the starts and of the directions."""
    beside: tuple[str, ...] = ("ik-sensed",)
    """Controllers to set a policy on real senses beside."""
    gravities: int = 12
    """Gravities that it is tried under: one in three is near one that no training shows, the others are anywhere."""
    paths: int = 8
    """Named directions and turns that are tried under each of them, all in turn."""
    out: Path = Path("results/space-study")
    """Folder that keeps its trials, so that what was stopped goes on."""


@dataclass(frozen=True, eq=False)
class Compared:
    """What both reached from N starts."""

    kept: Array
    """Whether the policy and the expert kept the object `(2, N)`."""
    come: Array
    """How far they came along what was asked `(2, N)` [m]; a turn counts as an arc."""
    off: Array
    """How far the policy was off it [m], and turned from it [rad], at its end `(2, N)`."""

    def some(self, rows: NDArray[np.bool_]) -> Compared:
        """Return what both reached from some starts `(N,)`."""
        return Compared(self.kept[:, rows], self.come[:, rows], self.off[:, rows])


def compared(
    held: SpatialPair, config: SpaceConfig, primitives: Sequence[SpatialPrimitive], gravity: Array, case: int
) -> Compared:
    """Return what policy and expert reach along primitives under one gravity `(3,)` [m/s^2], from the same grasps.

    Each `case` has noise of its own.
    """
    count, rng = len(primitives), np.random.default_rng((config.seed, case))
    off = NOISE[0] * rng.standard_normal((count, 3)), NOISE[1] * rng.standard_normal((count, 3))
    starts, pulls = pose_from(held.hand.start_pose, *off), np.tile(gravity, (count, 1))
    paths, bench = [spatial_path_of(each) for each in primitives], Bench(SPATIAL)
    grasp = planned_in_space(*held, paths, pulls, starts, bench=bench)
    path, way = stacked_paths(paths), np.asarray(grasp.way)
    space, found = space_of(primitives, pulls), []
    for name, told_way in ((config.controller, shorter(path, way)), ("ik", way)):
        task = SpatialTask(held.hand, (held.object,) * count, path, distance=told_way, gravity=pulls)
        make = find_spatial_controller(name).manipulate
        _, left = simulate(task, grasp, starts, make, bench, holds=SpatialIkController)
        begun = left.states[int(np.argmax(left.phase == len(left.phases) - 1)) - 1]
        last = np.stack([left.states[row].object_pose[k] for k, row in enumerate(left.last)])
        shift = SpatialAim(space.along, space.about, begun.object_pose).shift(last)
        found.append((np.isin(left.outcomes, KEPT), shift))
    (mine, shift), (experts, expert_shift) = found
    return Compared(np.stack([mine, experts]), np.stack([shift[:, 0], expert_shift[:, 0]]), shift[:, 1:].T)


def told(name: str, parts: Sequence[Compared]) -> tuple[str, ...]:
    """Return the row of some starts; the share is that of the mean way, and a lost object has come nowhere."""
    kept, come, off = (np.concatenate([getattr(part, key) for part in parts], axis=1) for key in vars(parts[0]))
    way = np.where(kept, come, 0.0).mean(axis=1)
    across, turned = (np.percentile(each[kept[0]], [50, 95]) for each in (1e3 * off[0], np.rad2deg(off[1])))
    return (
        name,
        str(kept.shape[1]),
        *(f"{each.sum()} ({100 * each.mean():.1f} %)" for each in kept),
        f"{way[0] / way[1]:.3f}",
        f"{across[0]:.2f}, {across[1]:.2f}",
        f"{turned[0]:.2f}, {turned[1]:.2f}",
    )


@dataclass(frozen=True)
class Case:
    """Primitives that are tried under one gravity, along which it pulls."""

    name: str
    place: str
    primitives: tuple[SpatialPrimitive, ...]
    gravity: str = USUAL_PALM


def sensed_cases(config: SpaceConfig) -> list[Case]:
    """Return what a policy on real senses is tried in: directions anywhere, and named ones under drawn gravities."""
    drawn = np.random.default_rng(config.seed).standard_normal((config.anywhere, 3))
    parts = [tuple(along(each) for each in drawn[k : k + AT_ONCE]) for k in range(0, len(drawn), AT_ONCE)]
    cases = [Case("directions anywhere", f"directions-{k}", part) for k, part in enumerate(parts)]
    rng = np.random.default_rng((config.seed, 1))
    named = parse_spatial_directions(config.directions)
    named = tuple(named[k] for k in rng.permutation(len(named)))
    corners, none = np.array(NEVER) / np.sqrt(3), np.zeros((1, 3))
    for k in range(config.gravities):
        mine = tuple(named[(k * config.paths + j) % len(named)] for j in range(min(config.paths, len(named))))
        pull = drawn_vectors(rng, 1, none, 0.0)[0]
        while k % 3 == 0 and (corners @ pull).max() < np.cos(np.deg2rad(NEVER_DEG)):
            pull = drawn_vectors(rng, 1, none, 0.0)[0]
        name = "gravities never shown" if k % 3 == 0 else "gravities anywhere"
        cases.append(Case(name, f"gravity-{k}", mine, ",".join(f"{part:.6f}" for part in pull)))
    return cases


def run_sensed(config: SpaceConfig) -> None:
    """Run a policy on real senses in all cases, and then those that it is set beside, and print the table."""
    rows: dict[tuple[str, str, str], list[DataFrame]] = {}
    for controller in (config.controller, *config.beside):
        for case in sensed_cases(config):
            say(f"{controller}, {case.name}: {len(case.primitives)} under {case.gravity}")
            names = [each.name for each in case.primitives]
            asked: dict[str, Any] = {
                "controllers": [controller],
                "disturbances": "field",
                "curves": "none",
                "gravity": case.gravity,
            }
            asked |= {"hand": config.hand, "object": config.object, "trials": config.trials, "seed": config.seed}
            found = robustness(
                directions=names, out=config.out / f"{Path(controller).name}-{case.place}", **asked
            ).trials()
            for disturb, some in found.groupby("disturb", sort=False):
                rows.setdefault((case.name, str(disturb), controller), []).append(some)
    order = sorted(rows, key=lambda key: [each[:2] for each in rows].index(key[:2]))
    print_table(f"{config.controller} on real senses", SENSED_HEADER, [sensed_row(key, rows[key]) for key in order])


def sensed_row(key: tuple[str, str, str], parts: Sequence[DataFrame]) -> tuple[str, ...]:
    """Return the row of a controller's trials; what no fingers ever held is lost."""
    trials = pd.concat(parts)
    count, kept, none = len(trials), int((~trials.lost).sum()), int((trials.outcome == NO_GRASP).sum())
    low, high = (100 * share for share in wilson(kept, count))
    turns = turning(trials)
    shares = [f"{trials.way[which].mean():.3f}" for which in (turns | ~turns, ~turns, turns) if which.any()]
    moves = trials[~trials.lost & ~turns]
    across, turned = (moves[name].quantile(0.95) for name in ("lateral_max_mm", "rotation_max_deg"))
    told_kept = f"{kept} of {count}, {low:.1f} to {high:.1f} %"
    return (*key, told_kept, str(none), ", ".join(shares), f"{across:.1f}, {turned:.1f}")


def run_space(config: SpaceConfig) -> None:
    """Run all cases and print the table."""
    if find_spatial_controller(config.controller).reads == SENSED:
        run_sensed(config)
        return
    held = SpatialPair(load_spatial_hand(config.hand), load_solid(config.object))
    check_known_in_space(find_spatial_controller(config.controller), held.hand)
    palms, never = (GRAVITY * np.array(each, dtype=float) for each in (list(PALMS.values()), NEVER))
    never /= np.sqrt(3)
    rng = np.random.default_rng(config.seed)
    drawn = [along(each) for each in rng.standard_normal((config.anywhere, 3))]
    named = parse_spatial_directions(config.directions) * config.trials
    cases: list[tuple[str, Sequence[SpatialPrimitive], Array]] = [
        *[("named, palm up, down, sideways", named, pull) for pull in palms],
        *[("anywhere on the sphere", drawn[k::4], pull) for k, pull in enumerate([*palms, never[0]])],
        *[("named, gravity never shown", named, pull) for pull in never],
    ]
    parts: dict[str, list[Compared]] = {}
    for case, (name, primitives, pull) in enumerate(cases):
        if not primitives:
            continue
        say(f"{name}: {len(primitives)} starts")
        found, turns = (
            compared(held, config, primitives, pull, case),
            np.array([each.direction is None for each in primitives]),
        )
        for word, rows in (("directions", ~turns), ("turns", turns)):
            if rows.any():
                parts.setdefault(f"{word}, {name}", []).append(found.some(rows))
    print_table(f"{config.controller} beside ik", HEADER, [told(name, some) for name, some in parts.items()])


if __name__ == "__main__":
    try:
        run_space(tyro.cli(SpaceConfig, description=SpaceConfig.__doc__))
    except InputError as error:
        sys.exit(f"space: {error}")
