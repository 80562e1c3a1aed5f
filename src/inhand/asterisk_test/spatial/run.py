"""Run the Asterisk Test with a hand in space: one batch of worlds, one world for each direction and trial."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.endings import ended
from inhand.control.controller import SpatialTask
from inhand.control.draws import (
    check_count,
    check_draws,
    check_worlds,
    disturbed_worlds,
    keys_in_space,
    start_noise_in_space,
)
from inhand.control.loop import Bench, Told, simulate
from inhand.control.recording import cut_trials, passports
from inhand.control.seen import SENSED
from inhand.control.spatial_catalogue import (
    SpatialEntry,
    check_known_in_space,
    find_spatial_controller,
    refuse_of_plane,
)
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.spatial_weight import check_carried
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.files import load_solid, load_spatial_hand
from inhand.hands.spatial.gravity import USUAL_PALM, gravity_of
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import pose_from
from inhand.sim.drawn import Disturbed
from inhand.sim.engines import engine_in_space
from inhand.tasks.spatial.paths import SpatialReference, hold_path, spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import SpatialPrimitive, parse_spatial_directions
from inhand.tasks.spatial.reach import limits_in_space


@dataclass(frozen=True, eq=False)
class SpatialAssignment:
    """What one world has to do."""

    primitive: SpatialPrimitive
    path: SpatialReference
    trial: int
    """Number of the trial in its direction, from 1."""


@dataclass(frozen=True, eq=False)
class SpatialSetup:
    """Everything a run needs, checked before anything is written."""

    hand: SpatialHand
    object: SolidSpec
    controller: SpatialEntry
    """The controller of the manipulation phase."""
    gravity: Vector
    """Gravity in the palm frame [m/s^2]."""
    assignments: tuple[SpatialAssignment, ...]
    """What each world does."""


def prepare_in_space(config: AsteriskConfig) -> SpatialSetup:
    """Return a run's setup.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    if config.trials < 1:
        raise InputError(f"--trials {config.trials}: give at least one trial for each direction")
    check_draws(config)
    _check_known(config)
    hand, spec = load_spatial_hand(config.hand), load_solid(config.object)
    entry = find_spatial_controller(config.controller)
    check_known_in_space(entry, hand)
    if config.one_grasp and entry.reads == SENSED:
        raise InputError(
            f"--one-grasp with --controller {entry.name}, whose grasps are planned path by path: leave it out, or use"
            " ik or rl-privileged"
        )
    if config.one_grasp:
        entry = entry.whole or entry
    gravity = gravity_of(config.gravity or USUAL_PALM)
    primitives = parse_spatial_directions(config.directions, config.twist)
    check_count(config.trials * len(primitives), f"--trials {config.trials} in each of {len(primitives)} directions")
    check_carried(hand, spec, config.engine)
    check_worlds(config, hand, spec)
    paths = [spatial_path_of(primitive) for primitive in primitives]
    assignments = tuple(
        SpatialAssignment(primitive, path, k + 1)
        for primitive, path in zip(primitives, paths, strict=True)
        for k in range(config.trials)
    )
    return SpatialSetup(hand, spec, entry, gravity, assignments)


def _check_known(config: AsteriskConfig) -> None:
    """Refuse options that a hand in space has no meaning for yet."""
    asked = {
        "--paths human": config.paths == "human",
        "--human": config.human is not None,
        "--compatible": config.compatible,
        "--phases": bool(config.phases),
        "--metrics": bool(config.metrics),
    }
    refuse_of_plane(config.hand, asked)


def simulate_asterisk_in_space(
    config: AsteriskConfig, setup: SpatialSetup, progress: Told | None = None, threads: int = 0
) -> tuple[SpatialTrial, ...]:
    """Run every assignment at once and return the trials in the same order.

    The hand's own limit along each primitive is computed first and kept in the trials' passports.
    """
    hand, spec, assignments = setup.hand, setup.object, setup.assignments
    count, engine = len(assignments), engine_in_space(config.engine)
    bench = Bench(engine, threads=threads, progress=progress)
    told = None if progress is None else lambda name: progress(f"reach {name}", count, 0)
    primitives = tuple(dict.fromkeys(each.primitive for each in assignments))
    reach = limits_in_space((hand, spec), primitives, np.array([setup.gravity]), progress=told)
    limits = {limit.primitive: limit.distance for limit in reach}
    starts = pose_from(hand.start_pose, *starts_of(config, assignments))
    disturbed = disturbed_worlds(config, keys_in_space(config, *_whose(assignments)), hand.n_joints, space=True)
    gravity = np.tile(setup.gravity, (count, 1))
    paths = [each.path for each in assignments]
    grasp = setup.controller.grasp(hand, spec, paths, gravity, starts, bench=bench, shared=config.one_grasp)
    path = stacked_paths(paths)
    task = SpatialTask(hand, (spec,) * count, path, gravity=gravity, distance=grasp.way)
    _, recording = simulate(
        task,
        grasp,
        starts,
        setup.controller.manipulate,
        bench,
        twists=stacked_paths([hold_path(each) for each in paths]),
        holds=setup.controller.holds,
        disturbed=disturbed,
    )
    references = path.path.poses
    found = _passports(config, setup, limits, disturbed or [None] * count)
    return tuple(ended(trial) for trial in cut_trials(SpatialTrial, recording, found, references))


def _passports(
    config: AsteriskConfig,
    setup: SpatialSetup,
    reach: dict[SpatialPrimitive, float],
    disturbed: Sequence[Disturbed | None],
) -> list[SpatialPassport]:
    hand, spec, entry = setup.hand, setup.object, setup.controller
    same = {"hand": hand, "object": spec, "controller": entry.name, "reads": entry.reads, "gravity": setup.gravity}
    signed = passports(SpatialPassport, **same, seed=config.seed, engine=engine_in_space(config.engine))
    return [
        signed(
            primitive=each.primitive.name,
            along=each.primitive.direction,
            about=_axis(each.primitive),
            trial=each.trial,
            limit=reach[each.primitive],
            disturbed=world,
        )
        for each, world in zip(setup.assignments, disturbed, strict=True)
    ]


def starts_of(config: AsteriskConfig, whose: Sequence[SpatialAssignment]) -> tuple[Array, Array]:
    """Return how far each object's start is moved [m] and turned [rad] from where it should be, `(B, 3)` each."""
    return start_noise_in_space(config, *_whose(whose))


def _whose(assignments: Sequence[SpatialAssignment]) -> tuple[list[int], list[tuple[float, ...]]]:
    """Return what the draws of each world follow from: its trial's number, and its direction and rotation."""
    goals: list[tuple[float, ...]] = [
        (*(each.primitive.direction or (0.0, 0.0, 0.0)), *each.primitive.rotation) for each in assignments
    ]
    return [each.trial for each in assignments], goals


def _axis(primitive: SpatialPrimitive) -> Vector | None:
    if primitive.angle == 0:
        return None
    x, y, z = primitive.axis.tolist()
    return (x, y, z)
