"""What happens between controllers and B worlds at a decision, compiled: `senses.py` and `between.py` explain it.

Noise is drawn before, a block of rows for each world. Where a block is not the one that is needed nothing is done and
False returned: draw it and call again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import inner, kernel
from inhand.geometry import Array
from inhand.sim.disturbance import SOON

IN_SPACE = 7
"""Numbers of a pose in space: a place and a quaternion."""
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Drawn(NamedTuple):
    """Random numbers: rows of each world by their numbers."""

    rows: Array
    """A block of them `(B, D, k)`,"""
    block: Indices
    """and which block this is `(B,)`: row r of a world is in block r // D."""


class Now(NamedTuple):
    """What is measured of B worlds at a decision."""

    joint_angles: Array
    object_pose: Array
    object_velocity: Array
    link_gaps: Array
    gaps: Array
    contact_links: Indices
    finger_points: Array
    object_points: Array
    forces: Array


class Encoded(NamedTuple):
    """The encoders of B worlds with n joints."""

    past: Array
    """A ring of the last decisions' joint angles `(D, B, n)`."""
    late: Array
    """How many decisions late they are `(B,)`."""
    zero: Array
    """What they read at zero `(B, n)` [rad]."""
    noise: Drawn
    """Standard normal numbers for each decision `(B, D, n)`."""
    law: tuple[float, float, float]
    """Standard deviation of the noise [rad], resolution [rad], 0 for none, and time between two readings [s]."""


class Lens(NamedTuple):
    """What is the same for the cameras of all worlds."""

    period: float
    """Time between two decisions [s]."""
    rate: float
    """Frames in a second."""
    first: int
    """What is added to a frame's number to have one that is not negative."""
    spread: tuple[float, float, float]
    """Standard deviations of the noise of places, along x and y alike, and of rotations [m, m, rad]."""
    missing: float
    """Chance that after a frame a run of missing ones begins; 0 where none is missing."""
    fewest: int
    most: int
    """How many are then missing."""


class Filmed(NamedTuple):
    """The cameras of B worlds."""

    lens: Lens
    past: Array
    """A ring of what was measured at the last decisions, in the order of `Now` without joints `(D, B, W)`."""
    late: Array
    """How late frames arrive `(B,)` [s]."""
    bias: Array
    """What every frame adds to the pose `(B, 3)` [m, m, rad], in space a way and a rotation vector `(B, 6)`."""
    noise: Drawn
    """As many standard normal numbers and two from 0 to 1 for each frame `(B, D, 5)`, in space `(B, D, 8)`."""
    number: Indices
    """Number of the last frame in its episode, counted from 0, missing or not `(B,)`."""
    gone: Indices
    """How many of the next are missing `(B,)`."""


class Episodes(NamedTuple):
    """Where B worlds are in their episodes."""

    decision: Indices
    """The number of this one `(B,)`."""
    begun: Flags
    """Whether it is the first and nothing was before `(B,)`."""
    before: Array
    """What the encoders read a decision before `(B, n)`."""
    heads: Indices
    """The present places in the rings of encoders and camera `(2,)`."""


class Views(NamedTuple):
    """What is seen of B worlds: written where something new has come."""

    angles: Array
    velocities: Array
    """Readings of the encoders `(B, n)` [rad, rad/s]."""
    row: Array
    """What was measured when the last frame that is not missing was taken `(B, W)`; first the pose that it has,"""
    pose: Array
    """then that pose in the plane `(B, 3)` [m, m, rad], in space `(B, 7)`,"""
    time: Array
    """and when in the episode it was taken `(B,)` [s]."""


@kernel
def take_in(encoded: Encoded, filmed: Filmed, now: Now, episodes: Episodes, views: Views) -> bool:
    """Take in what is measured at a decision, and of each world at most one frame; return whether nothing is left."""
    if not _drawn(encoded, filmed, episodes.decision):
        return False
    done = True
    for b in range(len(episodes.decision)):
        _keep(encoded, filmed, now, b, episodes.heads)
        if episodes.begun[b]:
            _fill(encoded.past, b, episodes.heads[0])
            _fill(filmed.past, b, episodes.heads[1])
        _read(encoded, episodes, views, b)
        done = _look(filmed, episodes, views, b) and done
    return done


@inner
def _drawn(encoded: Encoded, filmed: Filmed, count: Indices) -> bool:
    """Return whether all noise is there that this decision and the next frame of each world need."""
    for b in range(len(count)):
        if encoded.law[0] > 0.0 and count[b] // encoded.noise.rows.shape[1] != encoded.noise.block[b]:
            return False
        number = filmed.number[b] + 1
        due = number <= _newest(filmed, b, count[b])
        if due and (number + filmed.lens.first) // filmed.noise.rows.shape[1] != filmed.noise.block[b]:
            return False
    return True


@inner
def _keep(encoded: Encoded, filmed: Filmed, now: Now, b: int, heads: Indices) -> None:
    """Write what is measured of a world into the present places."""
    _write(encoded.past[heads[0], b], 0, now.joint_angles[b])
    row = filmed.past[heads[1], b]
    at = _write(row, 0, now.object_pose[b])
    at = _write(row, at, now.object_velocity[b])
    at = _write(row, at, now.link_gaps[b])
    at = _write(row, at, now.gaps[b])
    at = _write(row, at, now.contact_links[b])
    for f in range(now.gaps.shape[1]):
        at = _write(row, at, now.finger_points[b, f])
    for f in range(now.gaps.shape[1]):
        at = _write(row, at, now.object_points[b, f])
    for f in range(now.gaps.shape[1]):
        at = _write(row, at, now.forces[b, f])


@inner
def _write(row: Array, at: int, numbers: Array) -> int:
    """Write numbers from a place in a row on; return the place behind them."""
    for k in range(len(numbers)):
        row[at + k] = numbers[k]
    return at + len(numbers)


@inner
def _fill(past: Array, b: int, head: int) -> None:
    """Let what is now have been so all along in a world."""
    for d in range(len(past)):
        for j in range(past.shape[2]):
            past[d, b, j] = past[head, b, j]


@inner
def _read(encoded: Encoded, episodes: Episodes, views: Views, b: int) -> None:
    """Read the encoders of a world."""
    spread, step, period = encoded.law
    drawn = episodes.decision[b] % encoded.noise.rows.shape[1]
    later, before, share = _place(encoded.past, episodes.heads[0], encoded.late[b])
    for j in range(views.angles.shape[1]):
        angle = _on_the_line(encoded.past[later, b, j], encoded.past[before, b, j], share) + encoded.zero[b, j]
        if spread > 0.0:
            angle += spread * encoded.noise.rows[b, drawn, j]
        if step > 0.0:
            angle = step * np.rint(angle / step)
        views.angles[b, j] = angle
        views.velocities[b, j] = 0.0 if episodes.begun[b] else (angle - episodes.before[b, j]) / period


@inner
def _look(filmed: Filmed, episodes: Episodes, views: Views, b: int) -> bool:
    """Take in the next frame of a world if it has arrived and is not missing; return whether no more is due."""
    lens, count = filmed.lens, episodes.decision[b]
    newest = _newest(filmed, b, count)
    if filmed.number[b] >= newest:
        return True
    filmed.number[b] += 1
    noise = filmed.noise.rows[b, (filmed.number[b] + lens.first) % filmed.noise.rows.shape[1]]
    even = filmed.bias.shape[1]
    if lens.missing == 0.0 or not _misses(filmed, b, count, (noise[even], noise[even + 1])):
        views.time[b] = filmed.number[b] / lens.rate
        back = max(count - views.time[b] / lens.period, 0.0)
        later, before, share = _place(filmed.past, episodes.heads[1], back)
        for j in range(views.row.shape[1]):
            views.row[b, j] = _on_the_line(filmed.past[later, b, j], filmed.past[before, b, j], share)
        if views.pose.shape[1] == IN_SPACE:
            _see_in_space(filmed, views, b, noise)
        else:
            _see(filmed, views, b, noise)
    return bool(filmed.number[b] >= newest)


@inner
def _newest(filmed: Filmed, b: int, count: int) -> int:
    """Return the number of the last frame that could have arrived at a decision; the first of an episode is 0."""
    frames: float = (count * filmed.lens.period - filmed.late[b]) * filmed.lens.rate
    return math.floor(frames + SOON)


@inner
def _misses(filmed: Filmed, b: int, count: int, drawn: tuple[float, float]) -> bool:
    """Return whether the next frame never arrives; once one is seen, runs of such begin by chance."""
    lens = filmed.lens
    if filmed.gone[b] == 0 and count > 0 and drawn[0] < lens.missing:
        filmed.gone[b] = lens.fewest + math.floor(drawn[1] * (lens.most - lens.fewest + 1))
    if filmed.gone[b] == 0:
        return False
    filmed.gone[b] -= 1
    return True


@inner
def _see(filmed: Filmed, views: Views, b: int, noise: Array) -> None:
    """Add bias and noise to the pose of an upright object in a frame."""
    row, pose = views.row[b], views.pose[b]
    w, x, y, z = row[3], row[4], row[5], row[6]
    pose[0], pose[1] = row[0], row[1]
    pose[2] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    for j in range(3):
        pose[j] += filmed.bias[b, j] + filmed.lens.spread[j] * noise[j]
    row[0], row[1] = pose[0], pose[1]
    row[3], row[4], row[5], row[6] = math.cos(pose[2] / 2.0), 0.0, 0.0, math.sin(pose[2] / 2.0)


@inner
def _see_in_space(filmed: Filmed, views: Views, b: int, noise: Array) -> None:
    """Add noise and then bias to the pose of an object in a frame."""
    row, bias, (along, _, about) = views.row[b], filmed.bias[b], filmed.lens.spread
    for j in range(3):
        row[j] += bias[j] + along * noise[j]
    # Between two decisions a quaternion is shorter than 1.
    size = math.sqrt(row[3] ** 2 + row[4] ** 2 + row[5] ** 2 + row[6] ** 2)
    for j in range(3, IN_SPACE):
        row[j] /= size
    _turn(row, (about * noise[3], about * noise[4], about * noise[5]))
    _turn(row, (bias[3], bias[4], bias[5]))
    for j in range(IN_SPACE):
        views.pose[b, j] = row[j]


@inner
def _turn(pose: Array, vector: tuple[float, float, float]) -> None:
    """Turn a pose on the spot by a rotation vector [rad]."""
    x, y, z = vector
    angle = math.sqrt(x * x + y * y + z * z)
    share = 0.5 if angle < SOON else math.sin(angle / 2.0) / angle
    w, x, y, z = math.cos(angle / 2.0), share * x, share * y, share * z
    a, b, c, d = pose[3], pose[4], pose[5], pose[6]
    pose[3], pose[4] = w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c
    pose[5], pose[6] = w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a


@inner
def _place(past: Array, head: int, decisions: float) -> tuple[int, int, float]:
    """Return the places between which so many decisions ago is, and the share of the way from the later one."""
    whole = math.floor(decisions + SOON)
    later = (head - whole) % len(past)
    return later, (later - 1) % len(past), decisions - whole


@inner
def _on_the_line(later: float, before: float, share: float) -> float:
    """Return a number between two decisions; at a decision it is that decision's, to the last bit."""
    return later if share < SOON else later + share * (before - later)
