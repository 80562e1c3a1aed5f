"""Frames, mass matrix and forces of the fingers and the object, and small linear algebra; compiled.

Featherstone 2008, "Rigid body dynamics algorithms", for chains in a plane written out.
"""

from __future__ import annotations

import math

from inhand.compiled import inner, leaf
from inhand.geometry import Array
from inhand.sim.planar.parts import Indices, Model, Work, Worlds


@inner
def place_bodies(model: Model, worlds: Worlds, b: int, work: Work) -> None:
    """Write every body's frame in the palm frame; the object's origin is its centre of mass."""
    k, n = worlds.kind[b], len(model.finger)
    frame = work.frame
    for i in range(n):
        if model.first[i] == i:
            angle = 0.0
            x, y = model.base[k, i, 0], model.base[k, i, 1]
        else:
            length = model.length[k, i - 1]
            x, y = x - frame[i - 1, 1] * length, y + frame[i - 1, 0] * length
        angle += worlds.position[b, i]
        frame[i, 0], frame[i, 1], frame[i, 2], frame[i, 3] = math.cos(angle), math.sin(angle), x, y
    frame[n, 0], frame[n, 1] = math.cos(worlds.position[b, n + 2]), math.sin(worlds.position[b, n + 2])
    frame[n, 2], frame[n, 3] = worlds.position[b, n], worlds.position[b, n + 1]
    frame[n + 1, 0], frame[n + 1, 1], frame[n + 1, 2], frame[n + 1, 3] = 1.0, 0.0, 0.0, 0.0
    work.placed[:] = False


@inner
def weigh(model: Model, worlds: Worlds, b: int, work: Work) -> None:
    """Write mass matrix and forces without constraints: servos, damping, and what turning links need."""
    k, n = worlds.kind[b], len(model.finger)
    work.inertia[:] = 0.0
    work.force[:] = 0.0
    for i in range(n):
        _add_link(model, worlds, b, work, i)
    for i in range(n):
        work.inertia[i, i] += model.servo[k, i, 0]
        torque = model.servo[k, i, 2] * (worlds.target[b, i] - worlds.position[b, i])
        most = model.servo[k, i, 3]
        work.force[i] += min(max(torque, -most), most) - model.servo[k, i, 1] * worlds.velocity[b, i]
        for j in range(i):
            work.inertia[j, i] = work.inertia[i, j]
    work.inertia[n, n] = work.inertia[n + 1, n + 1] = model.mass[k, n]
    work.inertia[n + 2, n + 2] = model.inertia[k, n]


@inner
def _add_link(model: Model, worlds: Worlds, b: int, work: Work, i: int) -> None:
    """Add a link to the mass matrix of its finger, and the force that turns its centre of mass round the joints."""
    k, first, frame = worlds.kind[b], model.first[i], work.frame
    c, s = frame[i, 0], frame[i, 1]
    x = frame[i, 2] + c * model.centre[k, i, 0] - s * model.centre[k, i, 1]
    y = frame[i, 3] + s * model.centre[k, i, 0] + c * model.centre[k, i, 1]
    # The centre's acceleration while the joints turn evenly: towards every joint on the way.
    rate, ax, ay = 0.0, 0.0, 0.0
    for j in range(first, i + 1):
        rate += worlds.velocity[b, j]
        ahead_x = x if j == i else frame[j + 1, 2]
        ahead_y = y if j == i else frame[j + 1, 3]
        ax -= rate * rate * (ahead_x - frame[j, 2])
        ay -= rate * rate * (ahead_y - frame[j, 3])
    mass = model.mass[k, i]
    for j in range(first, i + 1):
        jx, jy = frame[j, 3] - y, x - frame[j, 2]
        work.force[j] -= mass * (jx * ax + jy * ay)
        for m in range(first, j + 1):
            lx, ly = frame[m, 3] - y, x - frame[m, 2]
            work.inertia[j, m] += mass * (jx * lx + jy * ly) + model.inertia[k, i]


@inner
def integrate(model: Model, worlds: Worlds, b: int, work: Work) -> None:
    """Move a world one step by the accelerations that were found, its damping at the step's end (`implicitfast`)."""
    k, n, step = worlds.kind[b], len(model.finger), model.timestep
    for i in range(n + 3):
        total = 0.0
        for j in range(n + 3):
            total += work.inertia[i, j] * worlds.acceleration[b, j]
        work.force[i] = total
    for i in range(n):
        work.inertia[i, i] += step * model.servo[k, i, 1]
    factorise(work.inertia, model.first, work.factor)
    solve(work.factor, model.first, work.force)
    for i in range(n + 3):
        worlds.velocity[b, i] += step * work.force[i]
        worlds.position[b, i] += step * worlds.velocity[b, i]


@leaf
def factorise(matrix: Array, skyline: Indices, out: Array) -> None:
    """Write the lower Cholesky factor of a positive definite matrix, both `(m, m)`, of which the lower half is used.

    `skyline` says of each row where its first number stands; nothing before it is read or written.
    """
    for i in range(len(matrix)):
        for j in range(skyline[i], i):
            total = matrix[i, j]
            for m in range(max(skyline[i], skyline[j]), j):
                total -= out[i, m] * out[j, m]
            out[i, j] = total / out[j, j]
        total = matrix[i, i]
        for m in range(skyline[i], i):
            total -= out[i, m] * out[i, m]
        out[i, i] = math.sqrt(total)


@leaf
def solve(factor: Array, skyline: Indices, vector: Array) -> None:
    """Solve for a vector `(m,)` in place, given the matrix's Cholesky factor `(m, m)`."""
    size = len(vector)
    for i in range(size):
        total = vector[i]
        for j in range(skyline[i], i):
            total -= factor[i, j] * vector[j]
        vector[i] = total / factor[i, i]
    for i in range(size - 1, -1, -1):
        vector[i] /= factor[i, i]
        for j in range(skyline[i], i):
            vector[j] -= factor[i, j] * vector[i]
