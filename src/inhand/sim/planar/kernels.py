"""What Python calls: steps of worlds, and what is measured of them."""

from __future__ import annotations

from inhand.compiled import inner, kernel
from inhand.geometry import Array
from inhand.sim.planar.contacts import find_constraints
from inhand.sim.planar.dynamics import integrate, place_bodies, weigh
from inhand.sim.planar.outlines import FAR, above, lowest, overlap, place_outline, to_point
from inhand.sim.planar.parts import Model, Work, Worlds
from inhand.sim.planar.solver import accelerate, contact_law


@kernel
def step_worlds(model: Model, worlds: Worlds, work: Work, steps: int) -> None:
    """Move active worlds some steps on, in place."""
    for b in range(len(worlds.kind)):
        if not worlds.active[b]:
            continue
        for i in range(steps):
            if i == worlds.lag[b]:
                for j in range(len(model.finger)):
                    worlds.target[b, j] = worlds.coming[b, j]
            place_bodies(model, worlds, b, work)
            weigh(model, worlds, b, work)
            contacts = find_constraints(model, worlds, b, work)
            accelerate(model, worlds, b, work, contacts)
            if i == steps - 1:
                _add_forces(worlds, b, work, contacts)
            integrate(model, worlds, b, work)


@inner
def _add_forces(worlds: Worlds, b: int, work: Work, contacts: int) -> None:
    """Write the force of each finger on the object."""
    worlds.force[b] = 0.0
    for c in range(contacts):
        finger = work.finger[c]
        if finger >= 0:
            contact_law(work, c, work.residual[2 * c], work.residual[2 * c + 1])
            along, across = work.law[1], work.law[2]
            nx, ny = work.where[c, 0], work.where[c, 1]
            worlds.force[b, finger, 0] += along * nx - across * ny
            worlds.force[b, finger, 1] += along * ny + across * nx


@kernel
def measure_worlds(model: Model, worlds: Worlds, work: Work, links: Array) -> None:
    """Write of every link its distance to the object [m] and the nearest points of both `(B, n, 7)`, but no heights.

    Those of worlds that are not active stay.
    """
    n = len(model.finger)
    for b in range(len(worlds.kind)):
        if not worlds.active[b]:
            continue
        k = worlds.kind[b]
        place_bodies(model, worlds, b, work)
        for i in range(n):
            links[b, i, 0] = FAR
            for s in range(n, len(model.body)):
                if model.body[s] == n and model.corners[k, s] > 0:
                    gap = _distance(model, k, work, (i, s))
                    if gap < links[b, i, 0]:
                        links[b, i, 0] = gap
                        links[b, i, 1], links[b, i, 2] = work.hit[1], work.hit[2]
                        links[b, i, 4], links[b, i, 5] = work.hit[3], work.hit[4]


@inner
def _distance(model: Model, k: int, work: Work, pair: tuple[int, int]) -> float:
    """Return the signed distance of a link and a piece of the object; `work.hit[1:]` becomes their nearest points."""
    s, o = pair
    place_outline(model, k, work, s)
    place_outline(model, k, work, o)
    count, hit = model.corners[k, s], work.hit
    if model.corners[k, o] == 1:
        x, y, radius = work.shapes.corners[o, 0, 0], work.shapes.corners[o, 0, 1], model.radius[k, o]
        away, nx, ny = to_point(work.shapes, count, s, x, y)
        hit[1], hit[2] = x - away * nx, y - away * ny
        hit[3], hit[4] = x - radius * nx, y - radius * ny
        return float(away - radius)
    counts = count, model.corners[k, o]
    gap, owner, edge = overlap(work.shapes, counts, pair)
    if gap > 0.0:
        return _apart(work, counts, pair)
    one, other, at = (o, s, 1) if owner == 1 else (s, o, 3)
    corner = lowest(work.shapes, one, edge, (other, counts[1 - owner]))
    hit[at], hit[at + 1] = work.shapes.corners[other, corner, 0], work.shapes.corners[other, corner, 1]
    hit[4 - at], hit[5 - at] = (
        hit[at] - gap * work.shapes.outward[one, edge, 0],
        hit[at + 1] - gap * work.shapes.outward[one, edge, 1],
    )
    return gap


@inner
def _apart(work: Work, counts: tuple[int, int], pair: tuple[int, int]) -> float:
    """Return the distance of two polygons that do not overlap: of a corner of one to the other."""
    best, hit = FAR, work.hit
    for turn in range(2):
        s, o = pair[turn], pair[1 - turn]
        for i in range(counts[turn]):
            x, y = work.shapes.corners[s, i, 0], work.shapes.corners[s, i, 1]
            if above(work.shapes, counts[1 - turn], o, x, y) < best:
                away, nx, ny = to_point(work.shapes, counts[1 - turn], o, x, y)
                if away < best:
                    best = away
                    hit[1 + 2 * turn], hit[2 + 2 * turn] = x, y
                    hit[3 - 2 * turn], hit[4 - 2 * turn] = x - away * nx, y - away * ny
    return best
