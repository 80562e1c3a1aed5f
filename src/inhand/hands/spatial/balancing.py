"""What `hands/spatial/forces.py` computes, compiled: one world after another, by alternating projections."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

from inhand.compiled import kernel, leaf
from inhand.geometry import Array

ARM = 0.03
"""Length by which moments are told as forces [m]: about the half width of the objects and a tip."""
ROUNDING = 1e-6
"""Share of a miss that rounding may change, and far more."""
Entries: TypeAlias = tuple[float, float, float, float, float, float]
"""Six numbers: those of a symmetric matrix, xx, xy, xz, yy, yz and zz, or a force and a moment."""
WEAK = 1e-9
"""Added to the contacts' moments, so that contacts on one line, which hold no moment about it, have an inverse."""


class Problem(NamedTuple):
    """B worlds of N contacts."""

    points: Array
    """Contacts `(B, N, 3)` [m]."""
    inward: Array
    """Unit normals into the object `(B, N, 3)`."""
    wanted: Array
    """Force [N] and moment about `centres` [N m] that the contacts together shall give `(B, 6)`."""
    centres: Array
    """Points that moments are about `(B, 3)` [m]."""
    grip: Array
    """Normal force that each contact would rather have `(B,)` [N]."""
    friction: Array
    """Coefficient that may be used `(B,)`."""
    forces: Array
    """Found forces on the object `(B, N, 3)` [N]: they balance."""
    inside: Array
    """The same brought inside the cones `(B, N, 3)` [N]; the start of the search too."""
    pulls: Array
    """What the search has learned `(B, N, 3)` [N]; 0 at a cold start."""
    misses: Array
    """How far the forces inside the cones are from balance `(B,)` [N]."""


@kernel
def balance_worlds(problem: Problem, rules: tuple[float, float, float]) -> None:
    """Fill in forces; rules are the least normal force [N], most rounds, and what may be missed [N]."""
    for b in range(len(problem.points)):
        balance_world(problem, b, rules, math.inf)


@leaf
def balance_world(problem: Problem, b: int, rules: tuple[float, float, float], most: float) -> None:
    """Fill in one world's forces, until it is clear that all in the cones miss more than `most` [N].

    Forces that balance are those nearest to a guess: f - a - b x r, with a = (sum f - F) / N and b = T^-1 (sum r x f -
    M), where r is seen from the contacts' middle (so that force and moment part) and T = sum |r|^2 - r r'.
    """
    n, middle = problem.points.shape[1], _middle(problem, b)
    t, wanted = _inertia(problem, b, middle), _wanted(problem, b, middle)
    fx, fy, fz, mx, my, mz = wanted
    pulls, forces, inside = problem.pulls[b], problem.forces[b], problem.inside[b]
    for turn in range(int(rules[1])):
        sx = sy = sz = tx = ty = tz = 0.0
        for j in range(n):
            for i in range(3):
                forces[j, i] = 0.5 * (problem.grip[b] * problem.inward[b, j, i] + inside[j, i] - pulls[j, i])
            rx, ry, rz = _arm(problem, b, j, middle)
            gx, gy, gz = forces[j, 0], forces[j, 1], forces[j, 2]
            sx, sy, sz = sx + gx, sy + gy, sz + gz
            tx, ty, tz = tx + ry * gz - rz * gy, ty + rz * gx - rx * gz, tz + rx * gy - ry * gx
        sx, sy, sz = (sx - fx) / n, (sy - fy) / n, (sz - fz) / n
        tx, ty, tz = tx - mx, ty - my, tz - mz
        ux, uy = t[0] * tx + t[1] * ty + t[2] * tz, t[1] * tx + t[3] * ty + t[4] * tz
        uz = t[2] * tx + t[4] * ty + t[5] * tz
        missed = 0.0
        for j in range(n):
            rx, ry, rz = _arm(problem, b, j, middle)
            forces[j, 0] -= sx + uy * rz - uz * ry
            forces[j, 1] -= sy + uz * rx - ux * rz
            forces[j, 2] -= sz + ux * ry - uy * rx
            for i in range(3):
                inside[j, i] = forces[j, i] + pulls[j, i]
            _into_cone(problem, b, j, rules[0])
            for i in range(3):
                pulls[j, i] += forces[j, i] - inside[j, i]
                missed += (forces[j, i] - inside[j, i]) ** 2
        if missed < rules[2] * rules[2]:
            break
        if turn & (turn - 1) == 0 and _least_miss(problem, b, (t, middle, wanted), rules[0]) > most:
            break
    problem.misses[b] = _miss(problem, b, middle, wanted)


@leaf
def _middle(problem: Problem, b: int) -> tuple[float, float, float]:
    n = problem.points.shape[1]
    x = y = z = 0.0
    for j in range(n):
        x, y, z = x + problem.points[b, j, 0], y + problem.points[b, j, 1], z + problem.points[b, j, 2]
    return x / n, y / n, z / n


@leaf
def _wanted(problem: Problem, b: int, middle: tuple[float, float, float]) -> Entries:
    """Return the wanted force [N], and the moment about the contacts' middle by `ARM` [N]."""
    fx, fy, fz = problem.wanted[b, 0], problem.wanted[b, 1], problem.wanted[b, 2]
    x, y, z = problem.centres[b, 0] - middle[0], problem.centres[b, 1] - middle[1], problem.centres[b, 2] - middle[2]
    return (
        fx,
        fy,
        fz,
        (problem.wanted[b, 3] + y * fz - z * fy) / ARM,
        (problem.wanted[b, 4] + z * fx - x * fz) / ARM,
        (problem.wanted[b, 5] + x * fy - y * fx) / ARM,
    )


@leaf
def _arm(problem: Problem, b: int, j: int, middle: tuple[float, float, float]) -> tuple[float, float, float]:
    return (
        (problem.points[b, j, 0] - middle[0]) / ARM,
        (problem.points[b, j, 1] - middle[1]) / ARM,
        (problem.points[b, j, 2] - middle[2]) / ARM,
    )


@leaf
def _inertia(problem: Problem, b: int, middle: tuple[float, float, float]) -> Entries:
    """Return the inverse of T by its entries xx, xy, xz, yy, yz, zz."""
    a = c = f = WEAK
    d = e = g = 0.0
    for j in range(problem.points.shape[1]):
        x, y, z = _arm(problem, b, j, middle)
        a, c, f = a + y * y + z * z, c + x * x + z * z, f + x * x + y * y
        d, e, g = d - x * y, e - x * z, g - y * z
    p, q, r = c * f - g * g, e * g - d * f, d * g - e * c
    determinant = a * p + d * q + e * r
    return (
        p / determinant,
        q / determinant,
        r / determinant,
        (a * f - e * e) / determinant,
        (d * e - a * g) / determinant,
        (a * c - d * d) / determinant,
    )


@leaf
def _into_cone(problem: Problem, b: int, j: int, least: float) -> None:
    """Bring a force to the nearest one inside its friction cone, with a least normal force."""
    force, normal, friction = problem.inside[b, j], problem.inward[b, j], problem.friction[b]
    along = force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]
    x, y, z = force[0] - along * normal[0], force[1] - along * normal[1], force[2] - along * normal[2]
    aside = math.sqrt(x * x + y * y + z * z)
    if aside > friction * along:
        along = max((along + friction * aside) / (1 + friction * friction), 0.0)
    along = max(along, least)
    kept = min(1.0, friction * along / max(aside, 1e-12))
    force[0], force[1], force[2] = (
        along * normal[0] + kept * x,
        along * normal[1] + kept * y,
        along * normal[2] + kept * z,
    )


@leaf
def _least_miss(
    problem: Problem, b: int, known: tuple[Entries, tuple[float, float, float], Entries], least: float
) -> float:
    """Return what forces in the cones miss at least [N], as far as a round of the search tells; 0 where it does not.

    What the forces inside the cones gave too much is a wrench (a, b). Where a + b x r is in the dual of every cone, no
    forces there have less along that wrench than their least normal forces.
    """
    (xx, xy, xz, yy, yz, zz), middle, (fx, fy, fz, mx, my, mz) = known
    n, mu = problem.points.shape[1], problem.friction[b]
    forces, inside = problem.forces[b], problem.inside[b]
    ax = ay = az = tx = ty = tz = 0.0
    for j in range(n):
        rx, ry, rz = _arm(problem, b, j, middle)
        x, y, z = inside[j, 0] - forces[j, 0], inside[j, 1] - forces[j, 1], inside[j, 2] - forces[j, 2]
        ax, ay, az = ax + x / n, ay + y / n, az + z / n
        tx, ty, tz = tx + ry * z - rz * y, ty + rz * x - rx * z, tz + rx * y - ry * x
    bx, by, bz = xx * tx + xy * ty + xz * tz, xy * tx + yy * ty + yz * tz, xz * tx + yz * ty + zz * tz
    given = 0.0
    for j in range(n):
        rx, ry, rz = _arm(problem, b, j, middle)
        x, y, z = ax + by * rz - bz * ry, ay + bz * rx - bx * rz, az + bx * ry - by * rx
        inward = problem.inward[b, j]
        along = x * inward[0] + y * inward[1] + z * inward[2]
        each = along - mu * math.sqrt(max(x * x + y * y + z * z - along * along, 0.0))
        if each <= 0:
            return 0.0
        given += least * each
    given -= ax * fx + ay * fy + az * fz + bx * mx + by * my + bz * mz
    return (1 - ROUNDING) * given / math.sqrt(ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz)


@leaf
def _miss(
    problem: Problem,
    b: int,
    middle: tuple[float, float, float],
    wanted: Entries,
) -> float:
    """Return how far the forces inside the cones are from balance [N], moments by `ARM`."""
    fx, fy, fz, mx, my, mz = wanted
    for j in range(problem.points.shape[1]):
        x, y, z = _arm(problem, b, j, middle)
        p, q, r = problem.inside[b, j, 0], problem.inside[b, j, 1], problem.inside[b, j, 2]
        fx, fy, fz = fx - p, fy - q, fz - r
        mx, my, mz = mx - (y * r - z * q), my - (z * p - x * r), mz - (x * q - y * p)
    return math.sqrt(fx * fx + fy * fy + fz * fz + mx * mx + my * my + mz * mz)
