"""The scene of the benchmarks: the 39 mm cube held by the 2v2 hand with the contacts searched for 'Right'."""

from __future__ import annotations

import numpy as np

from inhand.control.catalogue import planned_grasp
from inhand.control.controller import Task
from inhand.control.loop import run_episodes
from inhand.control.phases import Grasp, placed_joints, standard_phases
from inhand.geometry import Array, Path
from inhand.hands.hand import HandSpec
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec, parse_object_name
from inhand.sim.engine import Simulator
from inhand.sim.state import State
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import parse_directions


def scene() -> tuple[HandSpec, ObjectSpec]:
    """Return hand and object."""
    return parse_hand_name("2v2_50.50_50.50_1.1_53"), parse_object_name("cube_39")


def task_right(simulator: Simulator) -> tuple[Task, Grasp]:
    """Return the task of carrying every world's object along 'Right', and the grasp planned for it."""
    hand, count = simulator.hand, len(simulator.objects)
    path = straight_path(parse_directions("Right")[0])
    origin = hand.start_pose
    grasp = planned_grasp(hand, simulator.objects[0], np.tile(origin + path.poses, (count, 1, 1)))
    return Task(hand, simulator.objects, Path(np.tile(path.poses, (count, 1, 1))), simulator.timestep), grasp


def hold(simulator: Simulator) -> tuple[State, Array]:
    """Close the fingers on the object of every world; return the state and the targets that hold it.

    Raises:
        RuntimeError: a finger does not touch.
    """
    task, grasp = task_right(simulator)
    origin = np.tile(simulator.hand.start_pose, (task.n_worlds, 1))
    start = simulator.reset(origin, placed_joints(simulator.hand, grasp))
    state = run_episodes(simulator, task, standard_phases(grasp, None), start).states[-1]
    if not state.touching.all():
        raise RuntimeError("the grip does not hold; the benchmark would time falling objects")
    return state, state.targets
