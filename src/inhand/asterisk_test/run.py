"""Run the Asterisk Test in simulation: one batch of worlds, one world for each direction and trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.endings import ended
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.people.paths import human_path
from inhand.control.catalogue import ControllerEntry, check_known, find_controller
from inhand.control.controller import SUBSTEPS, Task
from inhand.control.draws import check_count, check_draws, start_noise
from inhand.control.loop import run_worlds
from inhand.control.recording import cut_trials
from inhand.control.trial import Passport, Trial
from inhand.errors import InputError
from inhand.geometry import Path
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.engines import check_engine, make_simulator
from inhand.tasks.paths import ReferencePath, path_of, stacked, twist_poses, whole_path
from inhand.tasks.primitives import Primitive, parse_directions, twisted_name, with_twists
from inhand.tasks.reach import limits
from inhand.versions import versions


@dataclass(frozen=True, eq=False)
class Assignment:
    """What one world has to do."""

    primitive: Primitive
    """The primitive."""
    path: ReferencePath
    """The path to follow."""
    trial: int
    """Number of the trial in its direction, from 1."""


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything a run needs, checked before anything is written."""

    hand: HandSpec
    """The hand."""
    object: ObjectSpec
    """The object."""
    controller: ControllerEntry
    """The controller of the manipulation phase."""
    assignments: tuple[Assignment, ...]
    """What each world does."""


def prepare(config: AsteriskConfig, people: Sequence[HumanTrial] = ()) -> Setup:
    """Return a run's setup.

    Args:
        config: what to run.
        people: human trials; their paths are followed where `config.paths` is human.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    if config.trials < 1:
        raise InputError(f"--trials {config.trials}: give at least one trial for each direction")
    check_draws(config)
    hand, spec = load_hand(config.hand), load_object(config.object)
    entry = find_controller(config.controller)
    primitives = parse_directions(config.directions)
    if config.twist:
        primitives = with_twists(primitives, config.twist)
    count = config.trials * len(primitives)
    check_count(count, f"--trials {config.trials} in each of {len(primitives)} directions")
    check_fit(hand, spec)
    check_engine(config.engine)
    assignments = []
    for primitive in primitives:
        paths = _paths(config, primitive, people)
        assignments += [Assignment(primitive, paths[k % len(paths)], k + 1) for k in range(config.trials)]
    check_known(entry, hand, stacked([whole_path(each.path) for each in assignments]))
    return Setup(hand, spec, entry, tuple(assignments))


def simulate(
    config: AsteriskConfig,
    setup: Setup,
    progress: Callable[[str, int, int], None] | None = None,
    threads: int = 0,
) -> tuple[Trial, ...]:
    """Run every assignment at once and return the trials in the same order.

    The hand's own limit along each primitive is computed first and kept in the trials' passports. MuJoCo steps on
    `threads` threads, 0 for every core; the trials are the same for any number.
    """
    hand, count = setup.hand, len(setup.assignments)
    primitives = tuple(dict.fromkeys(each.primitive for each in setup.assignments))
    told = None if progress is None else lambda name: progress(f"reach {name}", count, 0)
    reach = {limit.primitive: limit.distance for limit in limits(hand, setup.object, primitives, progress=told)}
    simulator = make_simulator(config.engine, hand, [setup.object] * count, threads=threads)
    paths = stacked([each.path.poses for each in setup.assignments])
    whole = stacked([whole_path(each.path) for each in setup.assignments])
    whose = [(each.primitive.angle_deg, each.primitive.rotation_deg, each.trial) for each in setup.assignments]
    start = hand.start_pose + start_noise(config, whose)
    grasp = setup.controller.grasp(hand, setup.object, hand.start_pose + whole, start, engine=config.engine)
    task = Task(hand, simulator.objects, Path(paths), simulator.timestep)
    twists = stacked([twist_poses(each.path) for each in setup.assignments])
    manipulate = setup.controller.manipulate
    recording = run_worlds(simulator, task, grasp, start, manipulate, twists=twists, progress=progress)
    trials = cut_trials(recording, _passports(config, setup, simulator.timestep, reach), paths)
    return tuple(ended(trial) for trial in trials)


def _passports(config: AsteriskConfig, setup: Setup, timestep: float, reach: dict[Primitive, float]) -> list[Passport]:
    found = versions()
    return [
        Passport(
            hand=setup.hand,
            object=setup.object,
            controller=setup.controller.name,
            primitive=each.primitive.name,
            angle_deg=each.primitive.angle_deg,
            rotation_deg=each.primitive.rotation_deg,
            path=each.path.name,
            trial=each.trial,
            seed=config.seed,
            substeps=SUBSTEPS,
            timestep=timestep,
            versions=found,
            engine=config.engine,
            limit=reach[each.primitive],
        )
        for each in setup.assignments
    ]


def _paths(config: AsteriskConfig, primitive: Primitive, people: Sequence[HumanTrial]) -> list[ReferencePath]:
    if config.paths == "straight":
        return [path_of(primitive)]
    trials = [t for t in people if twisted_name(t.primitive, t.twist_deg) == primitive.name]
    if not trials:
        have = sorted({t.primitive for t in people if t.angle_deg is not None})
        raise InputError(
            f"--paths human: no human trial of direction {primitive.name!r}; the folder has"
            f" {', '.join(have) or 'none'}: ask for those with --directions, or use --paths straight"
        )
    return [human_path(trial) for trial in trials]
