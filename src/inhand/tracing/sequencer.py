"""High-level control: every world goes through its plan, one primitive of a low-level controller after another.

To the loop the sequencer is a controller like any other. Worlds do not wait for each other; those that start a
primitive at the same decision share one low-level controller.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import AnyTask, Controller
from inhand.control.seen import SENSED, Seen, View, reads_of
from inhand.control.sensed_policy import PolicyPrimitive
from inhand.geometry import Array
from inhand.sim.state import State, select
from inhand.tasks.past import Past
from inhand.tracing.plan import STEP, Plan
from inhand.tracing.poses import Pose
from inhand.tracing.walk import Event, Request, SequenceConfig, Walk, What
from inhand.tracing.ways import rest_held, straight, where

Repertoire = Mapping[What, Callable[[Any], Controller]]
"""What makes the low-level controllers: to move the object straight on, to turn it on the spot, to press it on against
what resists, and to hold it where it is when something went wrong."""


@dataclass(frozen=True)
class End:
    """How one world's plan ended."""

    done: bool
    """Whether all of it was done."""
    come: float
    """Way along it that the object has come [m]."""
    events: tuple[Event, ...]
    """What went wrong on the way."""


@dataclass(frozen=True, eq=False)
class _Group:
    controller: Controller
    worlds: NDArray[np.int64]


class Sequencer:
    """Takes every world through its plan, on states as they are, or as they are believed to be."""

    def __init__(
        self, task: AnyTask, plans: Sequence[Plan], repertoire: Repertoire, config: SequenceConfig | None = None
    ) -> None:
        """Take worlds through plans, one each, given in the palm frame.

        Each goes as far as the task says; where it says nothing, as far as its grip is predicted to carry: the whole
        way on real senses, since nothing is predicted from a noisy look.
        """
        self._task, self._repertoire, self._period = replace(task, distance=None), repertoire, task.control_period
        self._planned = task.distance is not None
        ways = np.full(len(plans), np.inf) if task.distance is None else task.distance
        config = config or SequenceConfig()
        self.walks = [Walk(plan, config, self._period) for plan in plans]
        """The way of each world through its plan."""
        for walk, way in zip(self.walks, ways.tolist(), strict=True):
            walk.limit = np.inf if way >= walk.plan.way[-1] - STEP / 10 else way
        self.seen: Seen | None = None
        """What is sensed now, for low-level controllers that read that,"""
        self.past: Past | None = None
        """and what is remembered, for those of a policy that reads that."""
        self.legs: list[NDArray[np.int64]] = []
        """The primitive that each world was on, at every decision `(T, B)`."""

    def begin(self, state: State) -> None:
        """Start every plan from where the object is."""
        every = np.arange(state.n_worlds)
        self._groups: dict[int, _Group] = {}
        self._group = np.full(state.n_worlds, -1)
        self._made = 0
        self._predict(state, every)
        for walk in self.walks:
            walk.time = self._period * len(self.legs)
        poses = where(self._task, state)
        self._start(state, {world: walk.begin(poses[world]) for world, walk in enumerate(self.walks)})

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        rested = [world for world, walk in enumerate(self.walks) if walk.rested]
        if rested:
            self._predict(state, np.array(rested))
        both = np.asarray(state.touching.all(axis=-1))
        requests = {
            world: self.walks[world].decide(pose, touching=bool(both[world]))
            for world, pose in enumerate(where(self._task, state))
        }
        self._start(state, {world: asked for world, asked in requests.items() if asked is not None})
        self.legs.append(np.array([walk.leg for walk in self.walks]))
        targets = np.empty_like(state.targets)
        for number, group in self._groups.items():
            mine = self._group[group.worlds] == number
            targets[group.worlds[mine]] = group.controller.act(self.view(group.controller, state, group.worlds))[mine]
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have come to the end of their plan or have stopped for good `(B,)`."""
        del state
        return np.array([walk.ended for walk in self.walks])

    def end_of(self, world: int, decisions: int, pose: Pose) -> End:
        """Return how one world's plan ended after some decisions, its object last at a pose.

        What was decided later, while other worlds went on, was decided on nothing.
        """
        plan, leg = self.walks[world].plan, int(self.legs[decisions - 1][world])
        events = [event for event in self.walks[world].events if event.time < (decisions + 0.5) * self._period]
        return End(leg == len(plan.legs), plan.come(leg, pose), tuple(events))

    def _predict(self, state: State, worlds: NDArray[np.int64]) -> None:
        """Predict how far along the rest of its plan the grip of each of some worlds will carry its object."""
        if self._planned or self.seen is not None:
            return
        poses, rest, begins = where(self._task, state), [], []
        for world in worlds.tolist():
            walk, pose = self.walks[world], poses[world]
            come = walk.come(pose)
            rest.append(np.concatenate([[pose], walk.plan.path.beyond(come).poses]))
            begins.append(come)
        path, limit = rest_held(self._task, state, worlds, rest)
        for world, begin, way, found in zip(worlds.tolist(), begins, path.way, limit, strict=True):
            whole = found >= way[-1] - STEP / 10
            self.walks[world].limit = np.inf if whole else begin + max(float(found - way[1]), 0.0)

    def _start(self, state: State, requests: dict[int, Request]) -> None:
        """Start the primitives that are asked for, one controller for all of one kind."""
        for what in self._repertoire:
            worlds = np.array([world for world, asked in requests.items() if asked.what == what], dtype=np.int64)
            if len(worlds) == 0:
                continue
            task = straight(self._task, worlds, [requests[world] for world in worlds.tolist()])
            controller = self._repertoire[what](task)
            controller.begin(self.view(controller, state, worlds))
            self._groups[self._made] = _Group(controller, worlds)
            self._group[worlds] = self._made
            self._made += 1
        used = set(self._group.tolist())
        self._groups = {number: group for number, group in self._groups.items() if number in used}

    def view(self, controller: Controller, state: State, worlds: NDArray[np.int64]) -> View:
        """Return what a low-level controller of some worlds sees: what is true or believed, sensed or remembered."""
        if self.past is not None and isinstance(controller, PolicyPrimitive):
            return self.past.select(worlds)
        if self.seen is not None and reads_of(controller) == SENSED:
            return self.seen.select(worlds)
        return select(state, worlds)
