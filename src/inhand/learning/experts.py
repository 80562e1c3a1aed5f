"""Who shows how it is done: a controller of the catalogue, or a teacher that knows every world as it was drawn."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from inhand.control import loop
from inhand.control.catalogue import find_controller
from inhand.control.controller import Controller
from inhand.control.seen import reads_of
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.spatial_teacher import SpatialTeacher
from inhand.control.teacher import Teacher, TeacherConfig
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.learning.space import task_in_space
from inhand.learning.starts import Starts, expert_task
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.sim.state import select
from inhand.tasks.decisions import actions_of
from inhand.tasks.spatial.rows import gravity_in

TEACHERS = {
    "teacher": TeacherConfig(),
    "mild-teacher": TeacherConfig(proportional=0.7, lead=0.03, damping=0.01),
    "soft-teacher": TeacherConfig(proportional=0.4, lead=0.03),
}
"""Teachers among experts by name. On objects whose contacts slide a little, soft feedback loses fewer, as they turn."""
SHOWN_IN_SPACE = ("ik", "teacher")
"""Experts among them that know hands in space."""
ON_ROUTES = (0.004, 0.04)
"""What they ask for at most in a decision on routes [m, rad], whose aims are turned ahead of the object."""
FARTHEST = 0.2
"""Way that no hand carries an object [m]."""
LONGEST = 200
"""Decisions in which the teacher has gone as far as any grip holds."""
KEPT = 0.004
"""What is kept from where the teacher lost the object [m]: as much as a policy keeps from a predicted end."""


def expert_of(name: str, held: AnyPair, starts: Starts, worlds: ManipulationWorlds) -> Callable[[], Array]:
    """Return what gives the joint targets `(B, n)` [rad] of an expert in worlds that stand at their starts."""
    if isinstance(held, SpatialPair):
        return _in_space(name, held, starts, worlds)
    if name in TEACHERS and starts.pairs is not None:
        return _teachers(starts, worlds, TEACHERS[name])
    if name in TEACHERS:
        config = TEACHERS[name] if starts.routes is None else replace(TEACHERS[name], most=ON_ROUTES)
        teacher = Teacher(*held, starts.disturbed, len(starts), config)
        return lambda: teacher.act(worlds.state, worlds.asked)
    if starts.pairs is not None:
        raise InputError(f"expert {name!r} knows one hand: hands that differ are shown by 'teacher'")
    return _controlled(find_controller(name).manipulate(expert_task(held, starts)), worlds)


def _in_space(name: str, held: SpatialPair, starts: Starts, worlds: ManipulationWorlds) -> Callable[[], Array]:
    """Return the same of a hand in space."""
    if name in TEACHERS:
        teacher = SpatialTeacher(held, starts.disturbed, len(starts))
        return lambda: teacher.act(worlds.state, worlds.asked, gravity_in(worlds.scene))
    task = task_in_space(held, starts.asked_in_space, starts.distance)
    return _controlled(find_spatial_controller(name).manipulate(task), worlds)


def _controlled(expert: Controller, worlds: ManipulationWorlds) -> Callable[[], Array]:
    """Return what gives the joint targets of a controller."""
    reads = reads_of(expert)
    expert.begin(loop.sense(worlds.state, worlds.between, reads))
    return lambda: expert.act(loop.sense(worlds.state, worlds.between, reads))


def _teachers(starts: Starts, worlds: ManipulationWorlds, config: TeacherConfig) -> Callable[[], Array]:
    """Return what gives the joint targets of worlds whose hands differ, each pair's by a teacher of its own."""
    each = [] if starts.pairs is None else starts.pairs.apart()
    drawn = [None if starts.disturbed is None else [starts.disturbed[row] for row in rows] for _, rows in each]
    teachers = [(rows, Teacher(*held, own, len(rows), config)) for (held, rows), own in zip(each, drawn, strict=True)]

    def act() -> Array:
        state, aim = worlds.state, worlds.asked
        targets = np.empty_like(state.targets)
        for rows, teacher in teachers:
            targets[rows] = teacher.act(select(state, rows), aim.take(rows))
        return targets

    return act


def taught_reach(held: AnyPair, starts: Starts, rng: np.random.Generator, teacher: str) -> Array:
    """Return how far a teacher carries the object of each start in its own world, before it is lost `(N,)` [m]."""
    far = replace(starts, distance=np.full(len(starts), FARTHEST), legs=None)
    interface = Interface("grip" if starts.space is None else "space", "steps", "gain", horizon=LONGEST)
    worlds = ManipulationWorlds(held, far, len(far), interface, rng)
    worlds.reset(np.arange(len(far)))
    teach = expert_of(teacher, held, far, worlds)
    going, best = np.ones(len(far), dtype=bool), np.zeros(len(far))
    for _ in range(LONGEST - 1):
        step = worlds.step(actions_of(teach(), interface.actions, worlds.limited, worlds.seen))
        going = going & ~step.terminated
        here = going & step.after.touching.all(axis=-1)
        best = np.where(here, np.maximum(best, worlds.asked.come(step.shift)), best)
        if not going.any():
            break
    return np.maximum(best - KEPT, 0.0)
