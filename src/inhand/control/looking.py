"""Closing where an object is seen: frames are averaged while fingers are placed, and the grasp follows them in part.

An object that stands off the plan is held off the plan: of all that `field` draws, the start takes most of the way that
a grip can be trusted with. How much the frames of an object that rests scatter tells how well it is seen.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import AnyTask
from inhand.control.grades import FIDUCIAL, FIDUCIAL_IN_SPACE, grade_of
from inhand.control.joint import JointPid
from inhand.control.seen import Seen, exact
from inhand.geometry import Array, wrap_angle
from inhand.rotations import change_between
from inhand.sim.state import State

FEWEST = 3
"""Frames of which a scatter is told."""
LOOKS = 0.3
"""Time for which fingers wait, where they are placed by what is seen [s]: of 9 frames, less what is late and missing,
one camera of `field` in a thousand seems to be of `bench`."""
FAR = 3.0
"""How far beside their plan objects are seen of which ways of the best grade, planned for starts of 1 mm and 1 deg,
lose many: the root of the mean square, in a fiducial's noise."""
LATE = 0.05
"""Age of frames from which objects turn and some are lost where the risk of the best grade is taken, which is chosen
where they are 20 ms old [s]."""


class Looking(JointPid):
    """Moves all joints to a goal `(B, n_joints)`, and sees on the way where objects stand."""

    def __init__(self, task: AnyTask, goal: Array, planned: Array) -> None:
        """Aim at joint angles [rad], with objects planned to stand at poses `(B, 3)`, or in space to be at `(B, 7)`."""
        super().__init__(task, goal)
        self._planned, self._noise = planned, FIDUCIAL if planned.shape[1] == 3 else FIDUCIAL_IN_SPACE

    def begin(self, state: State | Seen) -> None:
        """Start from where the joints are."""
        super().begin(state)
        self._frame, self._age = np.full(state.n_worlds, -np.inf), np.full(state.n_worlds, np.inf)
        self._count = np.zeros((state.n_worlds, 1))
        self._sum, self._squares = np.zeros((2, state.n_worlds, min(self._planned.shape[1], 6)))

    def act(self, state: State | Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._look(state if isinstance(state, Seen) else exact(state))
        return super().act(state)

    def finished(self, state: State | Seen) -> NDArray[np.bool_]:
        """Return which worlds have come to rest, and seen enough frames to tell a scatter `(B,)`."""
        return np.asarray(super().finished(state) & (self._count[:, 0] >= FEWEST))

    @property
    def off(self) -> Array:
        """How far objects are seen beside where they were planned to stand, on average `(B, 3)` [m, m, rad].

        In space it is a way and a rotation vector `(B, 6)`.
        """
        return np.asarray(self._sum / self._count)

    @property
    def scatter(self) -> Array:
        """How much frames scatter, in a fiducial's noise `(B,)`; infinitely where there are too few to tell."""
        count = self._count
        variance = np.maximum(self._squares - count * self.off**2, 0.0) / np.maximum(count - 1, 1)
        return np.where(count[:, 0] < FEWEST, np.inf, np.sqrt((variance / self._noise**2).mean(axis=-1)))

    def grade(self, count: int, *, soon: bool = False) -> NDArray[np.int64]:
        """Return which of so many grades is each world's `(B,)`, at best the usual one where objects are `FAR` off.

        Where who sees well must see `soon`, too, it is at best the usual one where no frame is younger than `LATE`.
        """
        doubted = np.sqrt(((self.off / self._noise) ** 2).mean(axis=-1)) > FAR
        if soon:
            doubted |= self._age > LATE
        grade = grade_of(self.scatter, count)
        return np.where(doubted, np.maximum(grade, count // 2), grade)

    def of_grade(self, each: Sequence[Array], *, soon: bool = False) -> Array:
        """Return of arrays `(B, ...)`, one for each grade of a camera or one for all, what belongs to each world's."""
        if len(each) == 1:
            return each[0]
        return np.stack(each)[self.grade(len(each), soon=soon), np.arange(len(self._age))]

    def _look(self, seen: Seen) -> None:
        off = _beside(seen.frame_pose, self._planned)
        fresh = (seen.frame_time > self._frame)[:, None]
        self._sum, self._squares = self._sum + fresh * off, self._squares + fresh * off**2
        self._count = self._count + fresh
        self._frame = np.maximum(self._frame, seen.frame_time)
        self._age = np.minimum(self._age, seen.time - self._frame)


class Choosing(Looking):
    """Waits for frames where fingers are, then goes, off the object, to where the grasp of what is seen begins."""

    def __init__(self, task: AnyTask, stops: Array, planned: Array) -> None:
        """Pass S stops for each of G grades `(G, S, B, n_joints)` [rad]; fingers are at the first of the usual one."""
        super().__init__(task, stops[len(stops) // 2, 0], planned)
        self._stops, self._worlds = stops, np.arange(stops.shape[2])

    def begin(self, state: State | Seen) -> None:
        """Start from where the joints are."""
        super().begin(state)
        self._began, self._grade = state.time, np.full(state.n_worlds, len(self._stops) // 2)
        self._passed = np.zeros(state.n_worlds, dtype=np.int64)

    def finished(self, state: State | Seen) -> NDArray[np.bool_]:
        """Return which worlds have come to their last stop and every joint to rest `(B,)`."""
        return np.asarray(super().finished(state) & (self._passed == self._stops.shape[1] - 1))

    def _look(self, seen: Seen) -> None:
        super()._look(seen)
        looked = seen.time - self._began >= LOOKS
        grade = np.where(looked, self.grade(len(self._stops)), self._grade)
        there = looked & (self._set_point == self._goal).all(axis=-1)
        further = np.minimum(self._passed + there, self._stops.shape[1] - 1)
        self._passed = np.where(grade == self._grade, further, 0)
        self._grade, self._goal = grade, self._stops[grade, self._passed, self._worlds]


def _beside(pose: Array, planned: Array) -> Array:
    """Return how far poses are beside others, `(B, 3)` or in space `(B, 6)`."""
    if pose.shape[1] > 3:
        return change_between(planned, pose)
    off = pose - planned
    off[:, 2] = wrap_angle(off[:, 2])
    return off


def slopes(closed: Callable[[Array], Array], shifts: Array) -> Array:
    """Return how joints that press `(B, n)` change with k numbers of a start `(B, n, k)`, by shifts `(k, k)`."""
    found = [(closed(shift) - closed(-shift)) / (2 * shift[k]) for k, shift in enumerate(shifts)]
    return np.stack(found, axis=-1)
