"""The accelerations that constraints allow: MuJoCo's cost, and Newton's method on it; compiled.

MuJoCo's documentation, "Computation", section "Optimization problem". The cost is convex, smooth and made of
quadratic pieces, so that its minimum does not depend on how it is searched for.
"""

from __future__ import annotations

import math

from inhand.compiled import inner
from inhand.geometry import Array
from inhand.sim.planar.dynamics import factorise, solve
from inhand.sim.planar.parts import Model, Work, Worlds

TOLERANCE = 1e-8
"""Scaled gain or gradient at which the search ends, MuJoCo's own."""
MOST_ITERATIONS = 100
MOST_STEPS = 20
"""Steps of one search along a direction."""
FLAT = 0.1
"""Share of the first slope at which a search along a direction ends, if the cost is less there."""


@inner
def contact_law(work: Work, number: int, along: float, across: float) -> None:
    """Write cost, slopes and curvatures of a contact at residuals along its normal and its tangent.

    Its force leaves the cone nowhere: it is 0 where the contact opens, springs where it sticks, and lies on the cone
    where it slips.
    """
    law = work.law
    law[:] = 0.0
    hardness, friction = work.contact[number, 0], work.contact[number, 1]
    normal, tangent = work.contact[number, 2], work.contact[number, 3]
    n, t = hardness * along, friction * abs(across)
    if n >= hardness * t:
        return
    if hardness * n + t <= 0.0:
        law[0] = 0.5 * (normal * along * along + tangent * across * across)
        law[1], law[2], law[3], law[5] = normal * along, tangent * across, normal, tangent
        return
    middle = normal / (hardness * hardness * (1.0 + hardness * hardness))
    x, slip = n - hardness * t, -hardness * friction * (1.0 if across > 0.0 else -1.0)
    law[0] = 0.5 * middle * x * x
    law[1], law[2] = middle * x * hardness, middle * x * slip
    law[3], law[4], law[5] = middle * hardness * hardness, middle * hardness * slip, middle * slip * slip


@inner
def floor_law(work: Work, axis: int, residual: float) -> None:
    """Write cost, slope and curvature of the floor's friction at a residual: a spring up to the largest force."""
    law = work.law
    hold, most = work.floor[axis, 0], work.floor[axis, 2]
    if abs(residual) * hold < most:
        law[0], law[1], law[3] = 0.5 * hold * residual * residual, hold * residual, hold
    else:
        law[0], law[3] = most * (abs(residual) - 0.5 * most / hold), 0.0
        law[1] = most if residual > 0.0 else -most


@inner
def accelerate(model: Model, worlds: Worlds, b: int, work: Work, contacts: int) -> None:
    """Find the accelerations of a world, starting from the last ones or the free ones, whichever costs less."""
    k, acceleration = worlds.kind[b], worlds.acceleration[b]
    size = len(acceleration)
    factorise(work.inertia, model.first, work.factor)
    for i in range(size):
        work.free[i] = work.force[i]
    solve(work.factor, model.first, work.free)
    for i in range(size):
        work.direction[i] = acceleration[i] - work.free[i]
        acceleration[i] = work.free[i]
    smooth = _aim(work, acceleration, contacts)
    _start(work, acceleration, contacts)
    cost, _, _ = _along(work, acceleration, contacts, 0.0)
    warm, _, _ = _along(work, acceleration, contacts, 1.0)
    if 0.5 * smooth[1] + warm < cost:
        _go(work, acceleration, contacts, 1.0)
        cost = warm
    for _ in range(MOST_ITERATIONS):
        _differentiate(work, acceleration, contacts)
        squared = 0.0
        for i in range(size):
            squared += work.gradient[i] * work.gradient[i]
            work.direction[i] = -work.gradient[i]
        if math.sqrt(squared) * model.scale[k] < TOLERANCE:
            break
        factorise(work.hessian, work.skyline, work.factor)
        solve(work.factor, work.skyline, work.direction)
        smooth = _aim(work, acceleration, contacts)
        slope = 0.0
        for i in range(size):
            slope += work.gradient[i] * work.direction[i]
        if -0.5 * slope * model.scale[k] < TOLERANCE:  # all that is left to gain
            _go(work, acceleration, contacts, 1.0)
            break
        step, after = _search(work, acceleration, contacts, (slope, *smooth, cost))
        _go(work, acceleration, contacts, step)
        if (cost - after - step * (smooth[0] + 0.5 * step * smooth[1])) * model.scale[k] < TOLERANCE:
            break
        cost = after


@inner
def _start(work: Work, acceleration: Array, contacts: int) -> None:
    """Write the contacts' residuals."""
    for r in range(2 * contacts):
        total = -work.contact[r // 2, 4 + r % 2]
        for j in range(len(acceleration)):
            total += work.jacobian[r, j] * acceleration[j]
        work.residual[r] = total


@inner
def _aim(work: Work, acceleration: Array, contacts: int) -> tuple[float, float]:
    """Write how the direction changes forces and residuals; return slope and curvature of the cost of inertia."""
    slope, curvature, size = 0.0, 0.0, len(acceleration)
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += work.inertia[i, j] * work.direction[j]
        slope += total * (acceleration[i] - work.free[i])
        curvature += total * work.direction[i]
    for r in range(2 * contacts):
        total = 0.0
        for j in range(size):
            total += work.jacobian[r, j] * work.direction[j]
        work.change[r] = total
    return slope, curvature


@inner
def _go(work: Work, acceleration: Array, contacts: int, step: float) -> None:
    """Go a step along the direction."""
    for i in range(len(acceleration)):
        acceleration[i] += step * work.direction[i]
    for r in range(2 * contacts):
        work.residual[r] += step * work.change[r]


@inner
def _along(work: Work, acceleration: Array, contacts: int, step: float) -> tuple[float, float, float]:
    """Return cost, slope and curvature of the constraints a step along the direction."""
    cost, slope, curvature = 0.0, 0.0, 0.0
    n, law, direction = len(acceleration) - 3, work.law, work.direction
    for c in range(contacts):
        dn, dt = work.change[2 * c], work.change[2 * c + 1]
        contact_law(work, c, work.residual[2 * c] + step * dn, work.residual[2 * c + 1] + step * dt)
        cost += law[0]
        slope += law[1] * dn + law[2] * dt
        curvature += law[3] * dn * dn + 2.0 * law[4] * dn * dt + law[5] * dt * dt
    for i in range(n):
        side = work.limit[i, 0]
        residual = side * (acceleration[i] + step * direction[i]) - work.limit[i, 2]
        if side != 0.0 and residual < 0.0:
            cost += 0.5 * work.limit[i, 1] * residual * residual
            slope += work.limit[i, 1] * residual * side * direction[i]
            curvature += work.limit[i, 1] * direction[i] * direction[i]
    for i in range(3):
        change = direction[n + i]
        floor_law(work, i, acceleration[n + i] + step * change - work.floor[i, 1])
        cost += law[0]
        slope += law[1] * change
        curvature += law[3] * change * change
    return cost, slope, curvature


@inner
def _search(
    work: Work, acceleration: Array, contacts: int, smooth: tuple[float, float, float, float]
) -> tuple[float, float]:
    """Return the step along the direction at which the cost is least, and the constraints' cost there.

    Newton's method on the slope, between bounds; where it leaves them, the secant between the bounds, with the slope of
    a bound that stays halved (the Illinois rule). `smooth` are the slope of the whole cost where the search starts,
    slope and curvature of the cost of inertia, and the constraints' cost at the start.
    """
    step, low, high = 1.0, 0.0, math.inf
    low_slope, high_slope = smooth[0], 0.0
    for _ in range(MOST_STEPS):
        cost, slope, curvature = _along(work, acceleration, contacts, step)
        slope += smooth[1] + step * smooth[2]
        change = cost + step * (smooth[1] + 0.5 * step * smooth[2]) - smooth[3]
        if abs(slope) <= FLAT * abs(smooth[0]) and change < 0.0:
            break
        if slope < 0.0:
            low, low_slope, high_slope = step, slope, 0.5 * high_slope
        else:
            high, high_slope, low_slope = step, slope, 0.5 * low_slope
        step -= slope / (curvature + smooth[2])
        if not low < step < high:
            step = low + (high - low) * low_slope / (low_slope - high_slope) if high < math.inf else 2.0 * low
    return step, cost


@inner
def _differentiate(work: Work, acceleration: Array, contacts: int) -> None:
    """Write gradient and Hessian of the cost; of the Hessian its lower half."""
    size = len(acceleration)
    n, law, gradient, hessian = size - 3, work.law, work.gradient, work.hessian
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += work.inertia[i, j] * (acceleration[j] - work.free[j])
            hessian[i, j] = work.inertia[i, j]
        gradient[i] = total
    for c in range(contacts):
        contact_law(work, c, work.residual[2 * c], work.residual[2 * c + 1])
        _add_rows(work, 2 * c, size)
    for i in range(n):
        side = work.limit[i, 0]
        residual = side * acceleration[i] - work.limit[i, 2]
        if side != 0.0 and residual < 0.0:
            gradient[i] += work.limit[i, 1] * residual * side
            hessian[i, i] += work.limit[i, 1]
    for i in range(3):
        floor_law(work, i, acceleration[n + i] - work.floor[i, 1])
        gradient[n + i] += law[1]
        hessian[n + i, n + i] += law[3]


@inner
def _add_rows(work: Work, row: int, size: int) -> None:
    """Add a contact's slopes and curvatures, in `work.law`, to gradient and Hessian."""
    law, along, across = work.law, work.jacobian[row], work.jacobian[row + 1]
    for i in range(size):
        a, b = along[i], across[i]
        if a == 0.0 and b == 0.0:
            continue
        work.gradient[i] += law[1] * a + law[2] * b
        one, other = law[3] * a + law[4] * b, law[4] * a + law[5] * b
        for j in range(i + 1):
            work.hessian[i, j] += one * along[j] + other * across[j]
