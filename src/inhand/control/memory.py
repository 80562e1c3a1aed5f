"""What a learned controller on real senses remembers: readings of a short while, and an estimate of the object."""

import numpy as np
from numpy.typing import NDArray

from inhand.control.estimator import SOON, Estimator, PoseFilter, waited
from inhand.control.kept import Remembered, remember, remembered
from inhand.control.seen import Seen
from inhand.control.spatial_estimator import SpatialEstimator
from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.sim.state import State
from inhand.tasks.past import LAGS, Past


class Memory:
    """What is remembered of B worlds, in each since its primitive began. It waits at first, to learn where that is."""

    def __init__(self, held: AnyPair, seen: Seen) -> None:
        """Begin in every world with what is seen."""
        (count, joints), size = seen.joint_angles.shape, seen.frame_pose.shape[1]
        self._joints, self._head = joints, 0
        self._rows = np.zeros((max(LAGS) + 1, count, 2 * joints + size + 1))
        self._first, self._start, self._believed = np.zeros((count, joints)), *np.zeros((2, count, size))
        self._frames, self._began, self._newest = np.zeros((3, count))
        self._waiting = np.ones(count, dtype=bool)
        self._estimator: PoseFilter = SpatialEstimator(*held) if isinstance(held, SpatialPair) else Estimator(*held)
        self._estimator.begin(seen)
        self.begin(np.arange(count), seen)

    def begin(self, worlds: NDArray[np.int64], seen: Seen) -> None:
        """Begin a primitive in some worlds `(K,)`, from what is seen of all."""
        self._rows[:, worlds] = _row(seen)[worlds]
        self._estimator.begin(seen, worlds)
        now = (
            (self._first, seen.joint_angles),
            (self._start, seen.frame_pose),
            (self._began, seen.time),
            (self._newest, seen.frame_time),
            (self._believed, self._estimator.pose),
        )
        for kept, given in now:
            kept[worlds] = given[worlds]
        self._frames[worlds], self._waiting[worlds] = 1.0, True

    def go_on(self, worlds: NDArray[np.int64], turned: Array) -> None:
        """Begin another primitive in some worlds `(K,)`, where objects are believed, without forgetting anything.

        They are to be held as the primitive before did, which turned them by so much in all `(K,)` [rad]; of the plane.
        """
        pose = self._estimator.pose[worlds]
        pose[:, 2] = self._believed[worlds, 2] + turned
        for kept in (self._start, self._believed):
            kept[worlds] = pose
        self._first[worlds] = self._rows[self._head][worlds, : self._joints]

    def take(self, seen: Seen) -> None:
        """Go on by a decision, unless what is seen is known."""
        if self._estimator.knows(seen):
            return
        self._head = (self._head + 1) % len(self._rows)
        self._rows[self._head] = _row(seen)
        self._estimator.take(seen)
        fresh = self._waiting & (seen.frame_time > self._newest + SOON)
        away = self._estimator.off(seen.frame_pose, self._start)
        self._frames = self._frames + fresh
        self._start = self._estimator.moved(self._start, np.where(fresh[:, None], away / self._frames[:, None], 0.0))
        self._newest = np.where(fresh, seen.frame_time, self._newest)
        self._believed = np.where(self._waiting[:, None], self._estimator.pose, self._believed)
        self._waiting = self._waiting & ~waited(self._began, seen)

    def state(self, seen: Seen) -> State:
        """Return what is believed of the worlds now, for the law that needs poses and contacts."""
        return self._estimator.state(seen)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Which hands wait for frames `(B,)`."""
        return self._waiting

    @property
    def past(self) -> Past:
        """What is remembered now."""
        n, rows = self._joints, self._rows[[(self._head - lag) % len(self._rows) for lag in LAGS]]
        points, askew = self._estimator.grip
        return Past(
            joints=rows[..., :n],
            commands=rows[..., n : 2 * n],
            frames=rows[..., 2 * n : -1],
            ages=rows[..., -1],
            first=self._first.copy(),
            start=self._start.copy(),
            waiting=self._waiting.copy(),
            pose=self._estimator.pose,
            believed=self._believed.copy(),
            velocity=self._estimator.velocity,
            points=points,
            askew=askew,
        )

    def state_dict(self) -> Remembered:
        """Return everything that `load_state_dict` needs, arrays by name."""
        return {f"memory.{name}": array for name, array in remembered(self, (PoseFilter,)).items()}

    def load_state_dict(self, kept: Remembered) -> None:
        """Go on from what `state_dict` returned, among others, byte for byte."""
        mine = "memory."
        own = {name.removeprefix(mine): array for name, array in kept.items() if name.startswith(mine)}
        remember(self, (PoseFilter,), own)


def _row(seen: Seen) -> Array:
    return np.concatenate([seen.joint_angles, seen.targets, seen.frame_pose, seen.age[:, None]], axis=-1)
