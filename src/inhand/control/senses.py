"""Senses with a memory: encoders and a camera that are noisy, late and see less often than decisions are made.

All of it is for B worlds at once. The camera takes a frame every 1 / rate seconds of an episode, where the object is
between two decisions by the line between them, and a frame arrives when its delay is over. Before an episode began all
stood as it then stands. What is done at a decision is compiled (`sense_kernels.py`).
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.noise import Noise
from inhand.control.seen import Seen
from inhand.control.sense_kernels import Encoded, Episodes, Filmed, Lens, Now, Views, take_in
from inhand.geometry import Array
from inhand.sim.disturbance import SOON, Camera, Disturbance, Encoders
from inhand.sim.drawn import Disturbed
from inhand.sim.state import State, seen_at

ENCODERS, CAMERA = 2, 3
"""What tells the generators of both from others of a world."""
LATE = (
    "object_pose", "object_velocity", "link_gaps", "gaps", "contact_links", "finger_points", "object_points", "forces"
)  # fmt: skip
"""What of a state privileged controllers see as late as the camera's frame, in the order of `Now`."""
PARTS = (Encoded, Filmed, Episodes, Views)
"""What they consist of that has a memory."""


class Senses:
    """Encoders and camera of B worlds; a part that a disturbance leaves alone is exact."""

    def __init__(self, spec: Disturbance, state: State, period: float) -> None:
        """Sense the worlds of a state, whose decisions are a period apart [s]; begin episodes before looking."""
        count, joints = state.joint_angles.shape
        self._exact_joints = spec.encoders == Encoders() and spec.differs.zero_deg == 0
        self._exact_frames = spec.camera == Camera()
        size = state.pose.shape[1]  # of a pose: 3 in the plane, 7 in space, where a camera is off by 6 numbers
        self._noise = Noise(count, ENCODERS, joints), Noise(count, CAMERA, min(size, 6), 2)
        self._encoded = _encoded(spec.encoders, self._noise[0], joints, period)
        shapes = [getattr(state, name).shape[1:] for name in LATE]
        ends = np.cumsum([math.prod(shape) for shape in shapes]).tolist()
        self._columns = list(zip(LATE, shapes, [0, *ends], ends, strict=False))
        self._filmed = _filmed(spec.camera, self._noise[1], ends[-1], period)
        number, heads = np.zeros(count, dtype=np.int64), np.zeros(2, dtype=np.int64)
        self._episodes = Episodes(number, np.zeros(count, dtype=bool), np.zeros((count, joints)), heads)
        angles, velocities = np.zeros((2, count, joints))
        self._views = Views(angles, velocities, np.zeros((count, ends[-1])), np.zeros((count, size)), np.zeros(count))
        self._begun = np.zeros(count)

    def begin(self, worlds: NDArray[np.int64], disturbed: Sequence[Disturbed], state: State) -> None:
        """Begin episodes in some worlds, from a state of all: what was before shows all as it stands now."""
        drawn, episodes, filmed = [each.drawn for each in disturbed], self._episodes, self._filmed
        for noise in self._noise:
            noise.begin(worlds, [each.key for each in drawn])
        self._encoded.zero[worlds] = [each.zero for each in drawn]
        self._encoded.late[worlds] = [each.encoder_s / filmed.lens.period for each in drawn]
        filmed.bias[worlds], filmed.late[worlds] = [each.bias for each in drawn], [each.camera_s for each in drawn]
        filmed.number[worlds] = np.floor(SOON - filmed.late[worlds] * filmed.lens.rate).astype(np.int64) - 1
        filmed.gone[worlds], episodes.decision[worlds], self._begun[worlds] = 0, 0, state.time[worlds]
        episodes.begun[worlds] = True
        self._take_in(state)
        episodes.begun[:] = False
        episodes.before[worlds] = self._views.angles[worlds]

    def take(self, state: State) -> None:
        """Take in what a decision led to."""
        episodes = self._episodes
        episodes.decision[:] += 1
        episodes.heads[:] = (episodes.heads + 1) % (len(self._encoded.past), len(self._filmed.past))
        episodes.before[:] = self._views.angles
        self._take_in(state)

    def privileged(self, state: State, commands: Array) -> State:
        """Return all of a state `(B, ...)` that is measured now, seen through the senses.

        The object's pose is the last frame's and joints are the encoders'. Contacts, gaps, forces and the object's
        velocity are true, at the instant of the frame.
        """
        changed: dict[str, Any] = {"targets": commands}
        views = self._views
        if not self._exact_joints:
            changed |= {"joint_angles": views.angles, "joint_velocities": views.velocities}
        if self._exact_frames:
            return replace(state, **changed)
        for name, shape, begin, end in self._columns:
            changed[name] = views.row[:, begin:end].reshape(-1, *shape)
        changed["contact_links"] = np.rint(changed["contact_links"]).astype(np.int64)
        return seen_at(views.pose, replace(state, **changed))

    def sensed(self, state: State, commands: Array) -> Seen:
        """Return what a hand can know of a state that is measured now."""
        views, joints, film = self._views, (state.joint_angles, state.joint_velocities), (state.pose, state.time)
        if not self._exact_joints:
            joints = views.angles, views.velocities
        if not self._exact_frames:
            film = views.pose, self._begun + views.time
        return Seen(state.time, *joints, commands, *film)

    def _take_in(self, state: State) -> None:
        """Take in a state and all frames that have arrived; what was handed out before stays as it was."""
        old, episodes, filmed = self._views, self._episodes, self._filmed
        angles, velocities = np.empty((2, *old.angles.shape))
        self._views = views = Views(angles, velocities, old.row.copy(), old.pose.copy(), old.time.copy())
        now = Now(*[np.ascontiguousarray(getattr(state, name)) for name in ("joint_angles", *LATE)])
        while not take_in(self._encoded, filmed, now, episodes, views):
            self._noise[0].draw(episodes.decision)
            self._noise[1].draw(filmed.number + (filmed.lens.first + 1))


def _encoded(spec: Encoders, noise: Noise, n_joints: int, period: float) -> Encoded:
    count = len(noise.block)
    past = np.zeros((decisions_of(spec.delay_ms[1] / 1e3, period) + 2, count, n_joints))
    law = math.radians(spec.noise_deg), math.radians(spec.resolution_deg), period
    return Encoded(past, np.zeros(count), np.zeros((count, n_joints)), noise.drawn, law)


def _filmed(spec: Camera, noise: Noise, width: int, period: float) -> Filmed:
    count, latest, rate = len(noise.block), spec.delay_ms[1] / 1e3, spec.rate_hz or 1 / period
    begins = spec.missing / (spec.missing + sum(spec.missing_run) / 2 * (1 - spec.missing))
    spread = spec.noise_mm / 1e3, spec.noise_mm / 1e3, math.radians(spec.noise_deg)
    lens = Lens(period, rate, math.ceil(latest * rate) + 1, spread, begins, *spec.missing_run)
    past = np.zeros((decisions_of(latest + 1 / rate, period) + 3, count, width))
    number, gone = np.zeros((2, count), dtype=np.int64)
    bias = np.zeros((count, noise.rows.shape[2] - 2))
    return Filmed(lens, past, np.zeros(count), bias, noise.drawn, number, gone)


def decisions_of(seconds: float, period: float) -> int:
    """Return how many decisions a time lasts, rounded up."""
    return math.ceil(seconds / period - SOON)
