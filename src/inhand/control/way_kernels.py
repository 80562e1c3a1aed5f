"""What happens to commands and objects between controllers and B worlds, compiled: `between.py` explains it.

As in `sense_kernels.py`, where a block of drawn numbers is not the one that is needed nothing is done.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from inhand.compiled import inner, kernel
from inhand.control.sense_kernels import Drawn, Flags, Indices
from inhand.geometry import Array
from inhand.sim.disturbance import SOON


class Line(NamedTuple):
    """Commands on their way to the servos of B worlds."""

    ring: Array
    """Those of the last decisions `(D, B, n)` [rad]."""
    zero: Array
    """What is taken from them `(B, n)` [rad]."""
    whole: Indices
    """How many decisions they take `(B,)`."""


class Pushes(NamedTuple):
    """The pushes of B worlds."""

    noise: Drawn
    """Numbers from 0 to 1 for each push: when, and in which direction, two `(B, D, 2)` or in space three."""
    come: Indices
    """How many have come `(B,)`."""
    held: Array
    """For how long the object has been held `(B,)` [s]."""
    next: Array
    """When in that time the next one comes `(B,)` [s],"""
    along: Array
    """and in which direction, a unit vector `(B, 3)`."""
    law: tuple[float, float, int]
    """Impulse [N s], how many come in a second, 0 for none, and how many at most, 0 for no end."""


@kernel
def send(line: Line, head: int, commands: Array, arriving: Array) -> None:
    """Put commands `(B, n)` on the line, at a place of its ring; write those that arrive now."""
    for b in range(len(commands)):
        place = (head - line.whole[b]) % len(line.ring)
        for j in range(commands.shape[1]):
            line.ring[head, b, j] = commands[b, j] - line.zero[b, j]
            arriving[b, j] = line.ring[place, b, j]


@kernel
def push(pushes: Pushes, period: float, impulse: Array, due: Flags) -> bool:
    """Hold objects for a decision [s]; write who is pushed at its begin `(B,)`, how `(B, 3)` [N s], and plan on."""
    for b in range(len(due)):
        due[b] = pushes.next[b] <= pushes.held[b] + SOON
        if due[b] and (pushes.come[b] + 1) // pushes.noise.rows.shape[1] != pushes.noise.block[b]:
            return False
    for b in range(len(due)):
        pushes.held[b] += period
        if due[b]:
            for j in range(3):
                impulse[b, j] = pushes.law[0] * pushes.along[b, j]
            pushes.come[b] += 1
            _plan(pushes, b)
    return True


@kernel
def plan(pushes: Pushes, worlds: Indices) -> bool:
    """Plan the first pushes of some worlds' episodes."""
    for b in worlds:
        if pushes.noise.block[b] != 0:
            return False
    for b in worlds:
        pushes.come[b], pushes.held[b], pushes.next[b] = 0, 0.0, 0.0
        _plan(pushes, b)
    return True


@inner
def _plan(pushes: Pushes, b: int) -> None:
    """Plan when, counted from the push before, and in which direction the next push of a world comes."""
    come, per_s, most = pushes.come[b], pushes.law[1], pushes.law[2]
    drawn = come % pushes.noise.rows.shape[1]
    around, up, flat = 2.0 * math.pi * pushes.noise.rows[b, drawn, 1], 0.0, 1.0
    if pushes.noise.rows.shape[2] > 2:  # evenly on the sphere
        up = 2.0 * pushes.noise.rows[b, drawn, 2] - 1.0
        flat = math.sqrt(1.0 - up * up)
    pushes.along[b, 0], pushes.along[b, 1], pushes.along[b, 2] = flat * math.cos(around), flat * math.sin(around), up
    if per_s == 0.0 or (most > 0 and come >= most):
        pushes.next[b] = np.inf
    else:
        pushes.next[b] -= math.log1p(-pushes.noise.rows[b, drawn, 0]) / per_s
