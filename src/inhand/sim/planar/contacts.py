"""Constraints of an instant: contacts, joint limits and the floor, with MuJoCo's references and impedances; compiled.

MuJoCo's documentation, "Computation", sections "Constraint model" and "Parameters"; default `solimp`, contacts with
`solref` of two steps, the limits' of 20 ms, elliptic cones with `impratio` 10.
"""

from __future__ import annotations

import math

from inhand.compiled import inner
from inhand.sim.planar.outlines import clip, meet, near
from inhand.sim.planar.parts import Model, Work, Worlds

SOFTEST, STIFFEST, WIDTH = 0.9, 0.95, 0.001
"""Impedance at no depth, and from a depth [m] on."""
LIMIT_TIME = 0.02
"""Time constant of joint limits [s]."""
IMPRATIO = 10.0
"""How much stiffer friction is than the normal."""
LEAST = 1e-15
"""Least regularisation of a constraint, as MuJoCo has it."""


@inner
def impedance(depth: float) -> float:
    """Return how much of a constraint's acceleration is asked for at a depth [m or rad]."""
    x = min(abs(depth) / WIDTH, 1.0)
    share = 2.0 * x * x if x <= 0.5 else 1.0 - 2.0 * (1.0 - x) * (1.0 - x)
    return SOFTEST + share * (STIFFEST - SOFTEST)


@inner
def asked(time: float, depth: float, rate: float) -> float:
    """Return the acceleration that brings a constraint back, critically damped, within a time constant [s]."""
    return -2.0 / (STIFFEST * time) * rate - impedance(depth) * depth / (STIFFEST * time) ** 2


@inner
def stiffness(depth: float, weight: float) -> float:
    """Return the inverse regularisation of a constraint on bodies of an inverse weight, added up."""
    part = impedance(depth)
    return 1.0 / max(LEAST, (1.0 - part) / part * weight)


@inner
def find_constraints(model: Model, worlds: Worlds, b: int, work: Work) -> int:
    """Write every constraint of an instant; return the number of contacts."""
    k, count = worlds.kind[b], 0
    for j in range(len(model.finger)):
        work.skyline[j] = model.first[j]
    for pair in range(len(model.pairs)):
        if not near(model, k, work, pair):
            continue
        owner, edge, corner = meet(model, k, work, pair)
        if owner < 0:
            continue
        first, second, ends = model.pairs[pair, 0], model.pairs[pair, 1], 0
        if model.flat[k, pair] and owner < 2:
            one, other = (second, first) if owner == 1 else (first, second)
            ends = clip(model, k, work, (one, other, edge, corner))
        for end in range(ends):
            work.hit[0], work.hit[3], work.hit[4] = work.law[3 * end], work.law[3 * end + 1], work.law[3 * end + 2]
            _add_contact(model, worlds, b, work, (pair, count))
            count += 1
        if ends == 0:
            _add_contact(model, worlds, b, work, (pair, count))
            count += 1
    _limit_joints(model, worlds, b, work)
    _lay_on_floor(model, worlds, b, work)
    return count


@inner
def _add_contact(model: Model, worlds: Worlds, b: int, work: Work, named: tuple[int, int]) -> None:
    """Write the contact in `work.hit` of a pair as rows of a number; `named` is pair and number."""
    pair, number = named
    k, n, row = worlds.kind[b], len(model.finger), 2 * number
    gap = work.hit[0]
    for j in range(n + 3):
        work.jacobian[row, j] = work.jacobian[row + 1, j] = 0.0
    first, second = model.body[model.pairs[pair, 0]], model.body[model.pairs[pair, 1]]
    _move(model, work, row, (first, 1.0))
    _move(model, work, row, (second, -1.0))
    along, across = 0.0, 0.0
    for j in range(n + 3):
        along += work.jacobian[row, j] * worlds.velocity[b, j]
        across += work.jacobian[row + 1, j] * worlds.velocity[b, j]
    weight = 0.0
    for body in (first, second):
        if body <= n:
            weight += model.weight[k, body]
    hold = model.share[k, pair] * stiffness(gap, weight)
    friction, contact = model.friction[k, pair], work.contact[number]
    contact[0], contact[1] = friction / math.sqrt(IMPRATIO), friction
    contact[2], contact[3] = hold, IMPRATIO * hold
    contact[4] = asked(2.0 * model.timestep, gap, along)
    contact[5] = -2.0 / (STIFFEST * 2.0 * model.timestep) * across
    work.where[number, 0], work.where[number, 1] = work.hit[1], work.hit[2]
    work.finger[number] = model.finger[first] if first < n and second == n else -1
    if second < n:
        for j in range(n):  # fingers press on each other
            work.skyline[j] = 0


@inner
def _move(model: Model, work: Work, row: int, part: tuple[int, float]) -> None:
    """Add how a body, with a sign, moves at the contact in `work.hit`, along its normal and its tangent."""
    body, sign = part
    n, frame = len(model.finger), work.frame
    nx, ny, x, y = work.hit[1], work.hit[2], work.hit[3], work.hit[4]
    if body < n:
        for j in range(model.first[body], body + 1):
            jx, jy = frame[j, 3] - y, x - frame[j, 2]
            work.jacobian[row, j] += sign * (jx * nx + jy * ny)
            work.jacobian[row + 1, j] += sign * (jy * nx - jx * ny)
    elif body == n:
        jx, jy = frame[n, 3] - y, x - frame[n, 2]
        work.jacobian[row, n] += sign * nx
        work.jacobian[row, n + 1] += sign * ny
        work.jacobian[row, n + 2] += sign * (jx * nx + jy * ny)
        work.jacobian[row + 1, n] -= sign * ny
        work.jacobian[row + 1, n + 1] += sign * nx
        work.jacobian[row + 1, n + 2] += sign * (jy * nx - jx * ny)


@inner
def _limit_joints(model: Model, worlds: Worlds, b: int, work: Work) -> None:
    """Write the limits that joints are beyond."""
    k, time = worlds.kind[b], max(LIMIT_TIME, 2.0 * model.timestep)
    for i in range(len(model.finger)):
        low = worlds.position[b, i] - model.limits[k, i, 0]
        high = model.limits[k, i, 1] - worlds.position[b, i]
        side = 1.0 if low < 0.0 else -1.0 if high < 0.0 else 0.0
        work.limit[i, 0] = side
        if side != 0.0:
            depth = min(low, high)
            work.limit[i, 1] = stiffness(depth, model.joint_weight[k, i])
            work.limit[i, 2] = asked(time, depth, side * worlds.velocity[b, i])


@inner
def _lay_on_floor(model: Model, worlds: Worlds, b: int, work: Work) -> None:
    """Write the floor's friction on each of the object's freedoms."""
    k, n = worlds.kind[b], len(model.finger)
    for i in range(3):
        work.floor[i, 0] = stiffness(0.0, model.joint_weight[k, n + i])
        work.floor[i, 1] = asked(2.0 * model.timestep, 0.0, worlds.velocity[b, n + i])
        work.floor[i, 2] = model.loss[k, i]
