"""Senses with a memory: encoders and a camera that are noisy, late and see less often than decisions are made.

All of it is for B worlds at once. The camera takes a frame every 1 / rate seconds of an episode, where the object is
between two decisions by the line between them, and a frame arrives when its delay is over. Before an episode began all
stood as it then stands.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.noise import Noise
from inhand.control.seen import Seen, exact
from inhand.geometry import Array, planar, spatial
from inhand.sim.disturbance import Camera, Disturbance, Encoders
from inhand.sim.drawn import Disturbed
from inhand.sim.state import State

SOON = 1e-6
"""Shares of a frame or of a decision that are nothing: what is due now has arrived."""
ENCODERS, CAMERA = 2, 3
"""What tells the generators of both from others of a world."""
LATE = (
    "object_pose", "object_velocity", "link_gaps", "finger_points", "object_points", "gaps", "forces", "contact_links"
)  # fmt: skip
"""What of a state privileged controllers see as late as the camera's frame."""


class History:
    """The last rows of numbers of B worlds, to look back in between two decisions."""

    def __init__(self, n_worlds: int, width: int, decisions: int) -> None:
        """Keep so many decisions before the present one."""
        self.rows = np.zeros((decisions + 2, n_worlds, width))
        self.head = 0

    def begin(self, worlds: NDArray[np.int64], row: Array) -> None:
        """Fill the past of some worlds with what is now `(K, width)`."""
        self.rows[:, worlds] = row

    def add(self, row: Array) -> None:
        """Go on by a decision to what is now `(B, width)`."""
        self.head = (self.head + 1) % len(self.rows)
        self.rows[self.head] = row

    def back(self, decisions: Array, worlds: NDArray[np.int64]) -> Array:
        """Return what was in some worlds `(K,)` so many decisions ago `(K,)`, on the line between two `(K, width)`."""
        whole = np.floor(decisions + SOON).astype(np.int64)
        share = decisions - whole
        place = self.head - whole
        later = self.rows[place % len(self.rows), worlds]
        if share.max() < SOON:
            return later
        return np.asarray(later + share[:, None] * (self.rows[(place - 1) % len(self.rows), worlds] - later))


class Encoded:
    """Joint angles as encoders read them."""

    def __init__(self, spec: Encoders, n_worlds: int, n_joints: int, period: float) -> None:
        """Read n joints of B worlds every period [s]."""
        self._spec, self._period = spec, period
        self._noise = Noise(n_worlds, ENCODERS, n_joints)
        self._past = History(n_worlds, n_joints, decisions_of(spec.delay_ms[1] / 1e3, period))
        self._late = np.zeros(n_worlds)
        self._zero = np.zeros((n_worlds, n_joints))
        self.angles = np.zeros((n_worlds, n_joints))
        """What they read now `(B, n)` [rad]."""
        self.velocities = np.zeros((n_worlds, n_joints))
        """Differences of two readings over the time between them `(B, n)` [rad/s]."""

    def begin(
        self,
        worlds: NDArray[np.int64],
        disturbed: Sequence[Disturbed],
        state: State,
        count: NDArray[np.int64],
    ) -> None:
        """Begin episodes in some worlds, which are at decision `count` `(B,)`, 0 there."""
        self._noise.begin(worlds, [each.drawn.key for each in disturbed])
        self._zero[worlds] = [each.drawn.zero for each in disturbed]
        self._late[worlds] = [each.drawn.encoder_s / self._period for each in disturbed]
        self._past.begin(worlds, state.joint_angles[worlds])
        angles, velocities = self.angles.copy(), self.velocities.copy()
        angles[worlds], velocities[worlds] = self._reading(count, worlds), 0.0
        self.angles, self.velocities = angles, velocities

    def take(self, state: State, count: NDArray[np.int64]) -> None:
        """Read the joints at a decision, the number `count` of its episode `(B,)`."""
        self._past.add(state.joint_angles)
        found = self._reading(count, np.arange(len(count)))
        self.velocities = (found - self.angles) / self._period
        self.angles = found

    def _reading(self, count: NDArray[np.int64], worlds: NDArray[np.int64]) -> Array:
        found = self._past.back(self._late[worlds], worlds) + self._zero[worlds]
        if self._spec.noise_deg:
            found += np.deg2rad(self._spec.noise_deg) * self._noise.rows(count[worlds], worlds)
        if self._spec.resolution_deg:
            step = np.deg2rad(self._spec.resolution_deg)
            found = step * np.round(found / step)
        return found


class Filmed:
    """The object as a camera's last frame has it."""

    def __init__(self, spec: Camera, state: State, period: float) -> None:
        """See the objects of a state's worlds, whose decisions are a period apart [s]."""
        n_worlds, latest = state.n_worlds, spec.delay_ms[1] / 1e3
        self._spec, self._period, self._rate = spec, period, spec.rate_hz or 1 / period
        shapes = [getattr(state, name).shape[1:] for name in LATE]
        ends = np.cumsum([math.prod(shape) for shape in shapes]).tolist()
        self._columns = list(zip(LATE, shapes, [0, *ends], ends, strict=False))
        self._past = History(n_worlds, ends[-1], decisions_of(latest + 1 / self._rate, period) + 1)
        self._noise = Noise(n_worlds, CAMERA, 3, 2)
        self._first = math.ceil(latest * self._rate) + 1
        self._spread = np.array([spec.noise_mm / 1e3, spec.noise_mm / 1e3, np.deg2rad(spec.noise_deg)])
        self._begin_run = spec.missing / (spec.missing + sum(spec.missing_run) / 2 * (1 - spec.missing))
        self._bias, self._late = np.zeros((n_worlds, 3)), np.zeros(n_worlds)
        self._frame, self._gone = np.zeros((2, n_worlds), dtype=np.int64)
        self._row, self._full, self._links = np.zeros((n_worlds, ends[-1])), state.object_pose, state.contact_links
        self.pose, self.time = np.zeros((n_worlds, 3)), np.zeros(n_worlds)
        """The pose in the last frame `(B, 3)` [m, m, rad], and when in the episode it was taken `(B,)` [s]."""

    def begin(
        self,
        worlds: NDArray[np.int64],
        disturbed: Sequence[Disturbed],
        state: State,
        count: NDArray[np.int64],
    ) -> None:
        """Begin episodes in some worlds: the last frame before shows all as it stands now."""
        self._noise.begin(worlds, [each.drawn.key for each in disturbed])
        self._bias[worlds] = [each.drawn.bias for each in disturbed]
        self._late[worlds] = [each.drawn.camera_s for each in disturbed]
        self._past.begin(worlds, _packed(state)[worlds])
        self._frame[worlds] = self._newest(count)[worlds] - 1
        self._gone[worlds] = 0
        self._look(count)

    def take(self, state: State, count: NDArray[np.int64]) -> None:
        """Take in the frames that have arrived at a decision, the number `count` of its episode `(B,)`."""
        self._past.add(_packed(state))
        self._look(count)

    def late(self) -> dict[str, Any]:
        """Return what is as late as the last frame, by name; the pose is the frame's."""
        found: dict[str, Any] = {}
        for name, shape, begin, end in self._columns:
            found[name] = self._row[:, begin:end].reshape(-1, *shape)
        found["object_pose"], found["contact_links"] = self._full, self._links
        return found

    def _newest(self, count: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the number of the last frame that could have arrived `(B,)`; the first of an episode is 0."""
        return np.floor((count * self._period - self._late) * self._rate + SOON).astype(np.int64)

    def _look(self, count: NDArray[np.int64]) -> None:
        newest = self._newest(count)
        for _ in range(int((newest - self._frame).max())):
            self._take_frame(np.flatnonzero(self._frame < newest), count)

    def _take_frame(self, worlds: NDArray[np.int64], count: NDArray[np.int64]) -> None:
        """Take in the next frame of some worlds, unless it is missing."""
        self._frame[worlds] += 1
        drawn = self._noise.rows(self._frame[worlds] + self._first, worlds)
        if self._spec.missing:
            there = ~self._misses(worlds, count, drawn[:, 3:])
            worlds, drawn = worlds[there], drawn[there]
        if len(worlds) == 0:
            return
        taken = self._frame[worlds] / self._rate
        row = self._past.back(np.maximum(count[worlds] - taken / self._period, 0.0), worlds)
        pose = planar(row[:, :7]) + self._bias[worlds] + self._spread * drawn[:, :3]
        # What was handed out before stays as it was.
        self._row, self.pose, self.time = self._row.copy(), self.pose.copy(), self.time.copy()
        self._full, self._links = self._full.copy(), self._links.copy()
        self._row[worlds], self.pose[worlds], self.time[worlds] = row, pose, taken
        self._full[worlds], self._full[worlds, 2] = spatial(pose, 0.0), row[:, 2]
        self._links[worlds] = np.rint(row[:, self._columns[-1][2] :]).astype(np.int64)

    def _misses(self, worlds: NDArray[np.int64], count: NDArray[np.int64], drawn: Array) -> NDArray[np.bool_]:
        """Return in which worlds the next frame never arrives; once one is seen, runs of such begin by chance."""
        low, high = self._spec.missing_run
        begins = (self._gone[worlds] == 0) & (drawn[:, 0] < self._begin_run) & (count[worlds] > 0)
        length = low + np.floor(drawn[:, 1] * (high - low + 1)).astype(np.int64)
        self._gone[worlds] = np.where(begins, length, self._gone[worlds])
        missing = self._gone[worlds] > 0
        self._gone[worlds] -= missing
        return np.asarray(missing)


class Senses:
    """Encoders and camera of B worlds; a part that a disturbance leaves alone is exact."""

    def __init__(self, spec: Disturbance, state: State, period: float) -> None:
        """Sense the worlds of a state, whose decisions are a period apart [s]; begin episodes before looking."""
        n_worlds, n_joints = state.joint_angles.shape
        exact_joints = spec.encoders == Encoders() and spec.differs.zero_deg == 0
        self._encoded = None if exact_joints else Encoded(spec.encoders, n_worlds, n_joints, period)
        self._filmed = None if spec.camera == Camera() else Filmed(spec.camera, state, period)
        self._count, self._begun = np.zeros(n_worlds, dtype=np.int64), np.zeros(n_worlds)

    def begin(self, worlds: NDArray[np.int64], disturbed: Sequence[Disturbed], state: State) -> None:
        """Begin episodes in some worlds, from a state of all."""
        self._count[worlds], self._begun[worlds] = 0, state.time[worlds]
        for part in (self._encoded, self._filmed):
            if part is not None:
                part.begin(worlds, disturbed, state, self._count)

    def take(self, state: State) -> None:
        """Take in what a decision led to."""
        self._count += 1
        for part in (self._encoded, self._filmed):
            if part is not None:
                part.take(state, self._count)

    def privileged(self, state: State, commands: Array) -> State:
        """Return all of a state `(B, ...)` that is measured now, seen through the senses.

        The object's pose is the last frame's and joints are the encoders'. Contacts, gaps, forces and the object's
        velocity are true, at the instant of the frame.
        """
        changed: dict[str, Any] = {"targets": commands}
        if self._encoded is not None:
            changed |= {"joint_angles": self._encoded.angles, "joint_velocities": self._encoded.velocities}
        if self._filmed is not None:
            changed |= self._filmed.late()
        return replace(state, **changed)

    def sensed(self, state: State, commands: Array) -> Seen:
        """Return what a hand can know of a state that is measured now."""
        seen = replace(exact(state), targets=commands)
        if self._encoded is not None:
            seen = replace(seen, joint_angles=self._encoded.angles, joint_velocities=self._encoded.velocities)
        if self._filmed is not None:
            seen = replace(seen, frame_pose=self._filmed.pose, frame_time=self._begun + self._filmed.time)
        return seen


def _packed(state: State) -> Array:
    return np.concatenate([getattr(state, name).reshape(state.n_worlds, -1) for name in LATE], axis=1)


def decisions_of(seconds: float, period: float) -> int:
    """Return how many decisions a time lasts, rounded up."""
    return math.ceil(seconds / period - SOON)
