"""Run the Asterisk Test in simulation: one batch of worlds, one world for each direction and trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.endings import ended
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.people.paths import human_path
from inhand.asterisk_test.regrasped import farthest, regrasping
from inhand.control import loop
from inhand.control.catalogue import ControllerEntry, check_known, find_controller
from inhand.control.controller import Controller, Task
from inhand.control.draws import check_count, check_draws, check_worlds, disturbed_worlds, keys_of, start_noise
from inhand.control.loop import Told
from inhand.control.phases import PHASES
from inhand.control.recording import cut_trials, passports
from inhand.control.trial import Passport, Trial
from inhand.errors import InputError
from inhand.geometry import Path
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.drawn import Disturbed
from inhand.sim.engines import check_engine
from inhand.tasks.paths import ReferencePath, path_of, stacked, twist_poses, whole_path
from inhand.tasks.primitives import Primitive, parse_directions, twisted_name
from inhand.tasks.reach import limits


@dataclass(frozen=True, eq=False)
class Assignment:
    """What one world has to do."""

    primitive: Primitive
    path: ReferencePath
    trial: int
    """Number of the trial in its direction, from 1."""


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything a run needs, checked before anything is written."""

    hand: HandSpec
    object: ObjectSpec
    controller: ControllerEntry
    """The controller of the manipulation phase."""
    assignments: tuple[Assignment, ...]
    """What each world does."""


def prepare(config: AsteriskConfig, people: Sequence[HumanTrial] = ()) -> Setup:
    """Return a run's setup.

    `people` are the human trials whose paths are followed where `config.paths` is human.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    if config.trials < 1:
        raise InputError(f"--trials {config.trials}: give at least one trial for each direction")
    check_draws(config)
    hand, spec = load_hand(config.hand), load_object(config.object)
    entry = find_controller(config.controller, Held(hand, spec))
    entry = regrasping(entry, config) if config.regrasp else entry
    primitives = parse_directions(config.directions, config.twist)
    count = config.trials * len(primitives)
    check_count(count, f"--trials {config.trials} in each of {len(primitives)} directions")
    check_fit(hand, spec)
    check_engine(config.engine)
    check_worlds(config, hand, spec)
    for name in config.phases:
        PHASES.known(name)
    assignments = []
    for primitive in primitives:
        paths = _paths(config, primitive, people)
        assignments += [Assignment(primitive, paths[k % len(paths)], k + 1) for k in range(config.trials)]
    check_known(entry, Held(hand, spec), stacked([whole_path(each.path) for each in assignments]))
    return Setup(hand, spec, entry, tuple(assignments))


def simulate(config: AsteriskConfig, setup: Setup, progress: Told | None = None, threads: int = 0) -> tuple[Trial, ...]:
    """Run every assignment at once and return the trials in the same order.

    The hand's own limit along each primitive is computed first and kept in the trials' passports. The engine steps on
    `threads` threads, 0 for every core; the trials are the same for any number.
    """
    hand, assignments = setup.hand, setup.assignments
    primitives = tuple(dict.fromkeys(each.primitive for each in assignments))
    told = None if progress is None else lambda name: progress(f"reach {name}", len(assignments), 0)
    reach = {limit.primitive: limit.distance for limit in limits(hand, setup.object, primitives, progress=told)}
    whole = stacked([whole_path(each.path) for each in assignments])
    whose = [(each.primitive.angle_deg, each.primitive.rotation_deg, each.trial) for each in assignments]
    start = hand.start_pose + start_noise(config, whose)
    disturbed = disturbed_worlds(config, keys_of(config, whose), hand.n_joints)
    path = Path(stacked([each.path.poses for each in assignments]))
    grasp = setup.controller.grasp(hand, setup.object, hand.start_pose + whole, start, engine=config.engine)
    # What was planned is the whole way; a twist before the path has its part of it.
    way = None if grasp.way is None else np.maximum(grasp.way - (Path(whole).length - path.length), 0.0)
    task = Task(hand, (setup.object,) * len(assignments), path, distance=way)
    found = _passports(config, setup, reach, disturbed or [None] * len(whose))

    def carry(manipulate: Callable[[Task], Controller], **how: Any) -> tuple[Trial, ...]:
        _, recording = loop.simulate(
            task,
            grasp,
            start,
            manipulate,
            loop.Bench(config.engine, threads=threads, progress=progress),
            twists=Path(stacked([twist_poses(each.path) for each in assignments])),
            between=[PHASES.known(name) for name in config.phases],
            disturbed=disturbed,
            **how,
        )
        return tuple(ended(trial) for trial in cut_trials(Trial, recording, found, task.path.poses))

    return farthest(carry) if config.regrasp else carry(setup.controller.manipulate)


def _passports(
    config: AsteriskConfig, setup: Setup, reach: dict[Primitive, float], disturbed: Sequence[Disturbed | None]
) -> list[Passport]:
    hand, spec, entry = setup.hand, setup.object, setup.controller
    same = {"hand": hand, "object": spec, "controller": entry.name, "reads": entry.reads}
    signed = passports(Passport, **same, seed=config.seed, engine=config.engine)
    return [
        signed(
            primitive=each.primitive.name,
            angle_deg=each.primitive.angle_deg,
            rotation_deg=each.primitive.rotation_deg,
            path=each.path.name,
            trial=each.trial,
            limit=reach[each.primitive],
            disturbed=world,
        )
        for each, world in zip(setup.assignments, disturbed, strict=True)
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
