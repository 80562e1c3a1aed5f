"""One world's way through its plan: which primitive comes next, and what is done where one fails.

A primitive is aimed from where the object is to where it is planned to end, so that the error of one is not carried
into the next. What goes wrong is met in two steps: the grip is closed and the object held still (`recover`), then the
object is brought back to the planned line (`return`) and the primitive goes on.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from inhand.geometry import TURN_ARM
from inhand.tracing.plan import Leg, Plan
from inhand.tracing.poses import Pose, apart, between, place, plain, rotation

Mode = Literal["go", "return", "recover", "done", "stopped"]
"""What a world is doing."""
What = Literal["move", "turn", "press", "hold"]
"""Which part of the repertoire carries a primitive out."""


@dataclass(frozen=True)
class SequenceConfig:
    """When a primitive has arrived, when it has failed, and how often it is tried again."""

    arrive: float = 0.0008
    """The object has arrived within this of where a primitive ends [m],"""
    arrive_turn: float = math.radians(1.0)
    """and a turn within this of its angle [rad]."""
    stray: float = 0.005
    """Farther than this from the planned line [m], or"""
    stray_turn: float = math.radians(15.0)
    """turned away from the plan by more than this [rad], the object has left its path."""
    loose: int = 2
    """A finger that has been off the object for so many decisions has lost it; the loop ends an episode after 5."""
    gain: float = 0.0003
    """A primitive that has come less than this nearer to its end [m]"""
    patience: float = 1.0
    """in this time is stuck [s]."""
    settle: float = 0.4
    """Time for which the object is held still to recover [s]."""
    retries: int = 3
    """Times that a primitive is tried again before the world stops."""


@dataclass(frozen=True)
class Event:
    """Something that went wrong, or an end before the end."""

    time: float
    """Time since the plan began [s]."""
    leg: int
    """Number of the primitive, from 0."""
    place: tuple[float, ...]
    """Where the object was `(2,)`, in space `(3,)` [m]."""
    off: float
    """How far it was from the planned line [m]."""
    turned: float
    """How far it was turned out of what the primitive allows [rad]."""
    what: str
    """`lost a finger`, `left its path`, `stuck`, `grip ends` or `gave up`."""


@dataclass(frozen=True)
class Request:
    """A primitive to start now."""

    what: What
    """Which part of the repertoire carries it out."""
    start: Pose
    """Where it is planned to start: what the controller measures its errors from."""
    end: Pose
    """Where it is to end."""


@dataclass
class Walk:
    """One world and its plan."""

    plan: Plan
    """The plan."""
    config: SequenceConfig
    """When a primitive has arrived or failed."""
    period: float
    """Time between two decisions [s]."""
    limit: float = math.inf
    """How far along the plan the grip is predicted to carry the object [m]."""
    leg: int = 0
    """Number of the primitive under way; the number of all where the plan is done."""
    mode: Mode = "go"
    """What the world is doing."""
    events: list[Event] = field(default_factory=list)
    """What went wrong."""
    time: float = 0.0
    """Time since the plan began [s]."""
    _what: What = "move"
    _target: Pose = ()
    _begun: Pose | None = None
    _nearest: float = math.inf
    _timer: float = 0.0
    _stayed: float = -1.0
    _loose: int = 0
    _tries: int = 0

    @property
    def ended(self) -> bool:
        """Whether the world has nothing more to do."""
        return self.mode in {"done", "stopped"}

    @property
    def rested(self) -> bool:
        """Whether the object has been held still for long enough to go on."""
        return self.mode == "recover" and self._timer >= self.config.settle

    @property
    def now(self) -> Leg:
        """The primitive under way, or the last one."""
        return self.plan.legs[min(self.leg, len(self.plan.legs) - 1)]

    def begin(self, pose: Pose) -> Request:
        """Start the plan from a pose."""
        self._begun = pose
        return self._go(pose)

    def decide(self, pose: Pose, *, touching: bool) -> Request | None:
        """Return the primitive to start now, None where the one under way goes on."""
        if self.ended:
            return None
        self.time += self.period
        self._timer += self.period
        if self.mode == "recover":
            return self._resume(pose) if self.rested else None
        self._loose = 0 if touching else self._loose + 1
        left, off = self._left(pose), self.off(pose)
        if left < self._nearest - self.config.gain:
            self._nearest, self._timer = left, 0.0
        failure = self._failure(pose, off)
        if failure is not None:
            return self._fail(pose, off, failure)
        return self._arrive(pose, off) if self._arrived(left) else None

    def off(self, pose: Pose) -> float:
        """Return how far a pose is from the line of the primitive under way [m]."""
        start, end = self._line()
        return math.dist(place(pose), _nearest(pose, start, end))

    def come(self, pose: Pose) -> float:
        """Return the way along the plan that an object at a pose has come [m]."""
        return self.plan.come(self.leg, pose)

    def _line(self) -> tuple[Pose, Pose]:
        """Return both ends of the line that the object is to be on; the first one starts where the object stood."""
        leg = self.now
        return (self._begun if self.leg == 0 and self._begun is not None else leg.start), leg.end

    def _left(self, pose: Pose) -> float:
        if self._what == "turn":
            return TURN_ARM * apart(pose, self._target)
        return math.dist(place(pose), place(self._target))

    def _arrived(self, left: float) -> bool:
        """Return whether the primitive is over: at its end, and held there for as long as asked."""
        near = self.config.arrive_turn * TURN_ARM if self._what == "turn" else self.config.arrive
        if self._stayed < 0 and (self._what == "press" or left <= near):
            self._stayed = 0.0
        elif self._stayed >= 0:
            self._stayed += self.period
        return self._stayed >= (self.now.stay if self.mode == "go" else 0.0)

    def _failure(self, pose: Pose, off: float) -> str | None:
        config = self.config
        if self._loose >= config.loose:
            return "lost a finger"
        if self.mode == "go" and (off > config.stray or self.now.turned(pose) > config.stray_turn):
            return "left its path"
        return "stuck" if self._timer >= config.patience and self._stayed < 0 else None

    def _fail(self, pose: Pose, off: float, why: str) -> Request:
        self._tell(pose, off, why)
        self._tries += 1
        if self._tries > self.config.retries:
            return self._stop(pose, off, "gave up")
        self.mode = "recover"
        return self._request("hold", pose, pose)

    def _stop(self, pose: Pose, off: float, why: str) -> Request:
        self._tell(pose, off, why)
        self.mode = "stopped"
        return self._request("hold", pose, pose)

    def _resume(self, pose: Pose) -> Request:
        """Go on after the grip has been closed: first turned back if the object is turned far, then brought back."""
        if self.now.turned(pose) <= self.config.stray_turn / 2:
            return self._bring_back(pose)
        self.mode = "return"
        return self._request("turn", pose, (*place(pose), *self.now.allowed(pose)))

    def _bring_back(self, pose: Pose) -> Request:
        """Bring the object back to the planned line if it is off it, and go on."""
        if self.off(pose) <= self.config.arrive:
            return self._go(pose)
        self.mode = "return"
        start, end = self._line()
        turned = rotation(self.now.start)
        return self._request("move", (*place(pose), *turned), (*_nearest(pose, start, end), *turned))

    def _arrive(self, pose: Pose, off: float) -> Request | None:
        if self.mode == "return":
            return self._bring_back(pose) if self._what == "turn" else self._go(pose)
        if self.limit < self.plan.way[self.leg + 1] - self.config.arrive:
            return self._stop(pose, off, "grip ends")
        self.leg, self._tries = self.leg + 1, 0
        if self.leg == len(self.plan.legs):
            self.mode = "done"
            return None
        return self._go(pose)

    def _go(self, pose: Pose) -> Request:
        """Start the primitive under way from where the object is, no farther than the grip carries."""
        self.mode = "go"
        leg = self.now
        carried = (self.limit - self.plan.way[self.leg]) / max(leg.length, 1e-9)
        share = 1.0 if leg.kind == "press" else min(max(carried, 0.0), 1.0)
        end = plain(between(leg.start, leg.end, np.array([share]))[0])
        if leg.kind == "turn":
            return self._request("turn", (*place(leg.start), *rotation(pose)), end)
        return self._request(leg.kind, (*place(pose), *rotation(leg.start)), end)

    def _request(self, what: What, start: Pose, end: Pose) -> Request:
        self._what, self._target, self._nearest = what, end, math.inf
        self._timer, self._stayed, self._loose = 0.0, -1.0, 0
        return Request(what, start, end)

    def _tell(self, pose: Pose, off: float, what: str) -> None:
        self.events.append(Event(self.time, self.leg, place(pose), off, self.now.turned(pose), what))


def _nearest(pose: Pose, start: Pose, end: Pose) -> Pose:
    """Return the point of a straight line that is nearest to a pose [m]."""
    size, gone = 0.0, 0.0
    for here, first, last in zip(place(pose), start, end, strict=False):
        size += (last - first) * (last - first)
        gone += (here - first) * (last - first)
    share = min(max(gone / max(size, 1e-18), 0.0), 1.0)
    return tuple(first + share * (last - first) for first, last in zip(place(start), end, strict=False))
