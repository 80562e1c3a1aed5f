"""The expert that may let go: where a grip ends the object rests on the floor, and fingers are placed anew.

Where the search (`hands/grasp_search.py`) ends a grip another one often begins that goes on: slanted sides carry to one
side only, or a link was in the way. A hand whose object lies on a floor may open there, go round it, and close where
the search finds the grip that goes farthest along what is left of the path. The object stays where it is meanwhile, by
the floor's friction. A world whose grip has ended opens at once and waits so for the others of its batch. The path goes
on from where the set point had come, so that what an object moves or turns by as it is let go and gripped is made up
for.

That is not the standard test, which forbids to let go. Whether it is worth it is tried in the same world first
(`asterisk_test/regrasped.py`), as grasps are (`control/rehearsal.py`).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.ik import IkController
from inhand.control.joint import JointPid
from inhand.control.phases import Grasp, placed_joints
from inhand.control.rehearsal import closing_joints
from inhand.control.seen import PRIVILEGED
from inhand.errors import InputError
from inhand.geometry import Array, Path, way_along
from inhand.hands.grasp_search import GraspPlan, moved_along, plan_grasps
from inhand.sim.state import State

GAIN = 0.008
"""Way that a new grip has to promise [m]: of less its margins leave little."""
SEARCHED = 0.003
"""Distance between the poses at which a new grip is looked for [m]."""
OFF = 0.012
"""How far fingers move off where they let go [m]."""
CARRIED, MOVED = 8.0, 1.2
"""How long is waited at most for objects that are carried, and for fingers on each part of their way [s]."""
STOPS = 4
"""Parts of the way of fingers that are placed anew: aside, beside the new grip, to it, closed."""


class RegraspingController:
    """Carries the object of every world as the expert does, and places fingers anew where that goes farther."""

    reads = PRIVILEGED

    def __init__(self, task: Task, allowed: int) -> None:
        """Carry objects, all of one kind, along the task's paths; fingers are placed anew so often at most."""
        self._task, self._allowed = task, allowed
        self.rounds = 0
        """How often fingers have let go of objects."""

    def begin(self, state: State) -> None:
        """Start from the grip that holds the object now."""
        n = state.n_worlds
        self._origin, self._come = self._task.origin(state), np.zeros(n)
        self._expert = IkController(self._task)
        self._expert.begin(state)
        self._over, self._off = np.zeros((2, n), dtype=bool)
        self.rounds = self._times = self._stop = 0
        self._time = 0.0
        self._plans: dict[int, GraspPlan] = {}
        self._aim(state.joint_angles, state)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._time += self._task.control_period
        targets = np.where(self._off[:, None], self._fingers.act(state), self._expert.act(state))
        carried = ~self._over & ~self._off
        if self._stop:
            if self._time > MOVED or (self._fingers.finished(state) | ~self._off).all():
                self._move_on(state)
        elif (ended := self._expert.finished(state) & carried).any():
            self._let_go(np.flatnonzero(ended), state)
        elif self._off.any() and (self._time > CARRIED or not carried.any()):
            self._come[carried] += self._expert.progress[carried]
            self._move_on(state)
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds hold their object where no other grip goes farther `(B,)`."""
        return np.asarray(self._over & state.touching.all(axis=-1))

    def _aim(self, goal: Array, state: State) -> None:
        """Move fingers that are off their objects to joint angles `(B, n_joints)` [rad]."""
        self._goal, self._fingers = goal, JointPid(self._task, goal)
        self._fingers.begin(state)

    def _let_go(self, worlds: NDArray[np.int64], state: State) -> None:
        """End the grips of some worlds: fingers open where another grip goes farther, and else all is over."""
        goal, opened = self._goal.copy(), self._opened(state)
        self._come[worlds] += self._expert.progress[worlds]
        for world in worlds:
            plan = self._farther(world) if self._times < self._allowed else None
            if plan is None:
                self._over[world] = True
            else:
                self._plans[int(world)], self._off[world], goal[world] = plan, True, opened[world]
                self.rounds = self._times + 1
        self._aim(goal, state)

    def _farther(self, world: int) -> GraspPlan | None:
        """Return the grip that goes farthest along what is left of a world's path, None where none gains enough."""
        path = Path(self._task.path.poses[world])
        poses = self._origin[world] + path.at(np.arange(self._come[world], float(path.length), SEARCHED))
        if len(poses) < 2:
            return None
        try:
            plans = plan_grasps(self._task.hand, self._task.objects[world], poses[None])[0]
        except InputError:
            return None
        best = max(plans, key=lambda plan: plan.reach)
        return best if way_along(poses)[best.reach - 1] > GAIN else None

    def _opened(self, state: State) -> Array:
        """Return joint angles `(B, n_joints)` [rad] of fingers that have moved off, away from each other."""
        hand, opened = self._task.hand, state.joint_angles.copy()
        away = state.finger_xy - state.finger_xy.mean(axis=1, keepdims=True)
        away *= OFF / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)
        for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
            opened[:, place] = moved_along(finger, state.joint_angles[:, place], state.finger_xy[:, i], away[:, i])
        return opened

    def _move_on(self, state: State) -> None:
        """Send fingers that are off to their next stop; from the last one on they carry."""
        self._time, self._stop = 0.0, self._stop + 1
        if self._stop > STOPS:
            self._carry_on(state)
            return
        goal, hand = self._goal.copy(), self._task.hand
        worlds = np.flatnonzero(self._off)
        if self._stop == 1:
            self._aim(placed_joints(hand, Grasp(goal, goal)), state)
            return
        plans = [self._plans[int(world)] for world in worlds]
        planned = (self._origin + self._task.path.at(self._come))[worlds]
        grasp = closing_joints(hand, self._task.objects[0], plans, planned, state.pose[worlds])
        goal[worlds] = (placed_joints(hand, grasp), grasp.opened, grasp.closed)[self._stop - 2]
        self._aim(goal, state)

    def _carry_on(self, state: State) -> None:
        """Carry objects on along what is left of their paths."""
        self._stop, self._times = 0, self._times + 1
        path = self._task.path
        ways = np.linspace(self._come, path.length, path.poses.shape[1])
        left = np.stack([path.at(way) for way in ways], axis=1)
        task = replace(self._task, path=Path(left - left[:, :1]), start=self._origin + left[:, 0], distance=None)
        self._expert = IkController(task)
        self._expert.begin(state)
        self._off[:] = False
