"""What the rigid parts of a robot file weigh, and the capsules that stand for their collision shapes."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.robot_outlines import collision_geoms
from inhand.hands.spatial.hand import Capsule, Vector

LIGHTEST = 1e-3
"""A link weighs at least this [kg]: files leave masses out."""
LEAST_INERTIA = 1e-7
"""And resists turning at least so much about each axis [kg m^2]."""
THINNEST = 1e-3
"""A capsule's radius is at least this [m]."""

SPLIT = 0.5
"""A mesh has two capsules where they have at most this share of the volume of one."""
Line: TypeAlias = tuple[Array, Array, float, float]
"""Middle, direction, half length and radius of a capsule."""

_Geom = mujoco.mjtGeom


def mass_of(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[int], frame: tuple[Array, Array]
) -> tuple[float, Array, Array]:
    """Return mass [kg], centre [m] and moments of inertia about it `(3, 3)` of bodies that move as one, in a frame.

    The frame is its origin and the columns of its rotation in the world.
    """
    origin, rotation = frame
    masses, centres = np.array(model.body_mass[bodies]), np.array(data.xipos[bodies])
    total = float(masses.sum())
    if total < LIGHTEST:
        return LIGHTEST, np.zeros(3), LEAST_INERTIA * np.eye(3)
    centre = masses @ centres / total
    moments = LEAST_INERTIA * np.eye(3)
    for body, mass, place in zip(bodies, masses, centres, strict=True):
        turned = np.array(data.ximat[body]).reshape(3, 3)
        away = place - centre
        moments = moments + turned @ np.diag(model.body_inertia[body]) @ turned.T
        moments = moments + mass * (away @ away * np.eye(3) - np.outer(away, away))
    return total, rotation.T @ (centre - origin), rotation.T @ moments @ rotation


def capsules_of(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[int], frame: tuple[Array, Array]
) -> tuple[Capsule, ...]:
    """Return a capsule for each collision shape of bodies that move as one, in a frame as of `mass_of`.

    Boxes, cylinders, ellipsoids and meshes have one along their longest side, as thick as their second: it covers them
    but for corners. A mesh that is much thicker at one end has two.
    """
    origin, rotation = frame
    found = []
    for geom in collision_geoms(model, bodies):
        for middle, axis, half, radius in _lines(model, geom):
            turned = np.array(data.geom_xmat[geom]).reshape(3, 3)
            place, along = np.array(data.geom_xpos[geom]) + turned @ middle, turned @ axis * half
            one, two = (rotation.T @ (place + sign * along - origin) for sign in (-1, 1))
            if np.linalg.norm(one) > np.linalg.norm(two):  # from the hinge outwards
                one, two = two, one
            found.append(Capsule(_vector(one), _vector(two), max(float(radius), THINNEST)))
    return tuple(found)


def _lines(model: mujoco.MjModel, geom: int) -> list[Line]:
    """Return the capsules of a shape in its own frame."""
    kind, size = _Geom(int(model.geom_type[geom])), np.array(model.geom_size[geom])
    if kind == _Geom.mjGEOM_SPHERE:
        return [(np.zeros(3), np.eye(3)[2], 0.0, float(size[0]))]
    if kind == _Geom.mjGEOM_CAPSULE:
        return [(np.zeros(3), np.eye(3)[2], float(size[1]), float(size[0]))]
    if kind == _Geom.mjGEOM_CYLINDER:
        return [_longest(np.zeros(3), np.eye(3), np.array([size[0], size[0], size[1]]))]
    if kind in {_Geom.mjGEOM_BOX, _Geom.mjGEOM_ELLIPSOID}:
        return [_longest(np.zeros(3), np.eye(3), size)]
    if kind != _Geom.mjGEOM_MESH:
        raise InputError(f"geom {model.geom(geom).name!r} is of type {kind.name}; use shapes that are solid")
    mesh = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    points = np.array(model.mesh_vert[first : first + count], dtype=float)
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return lines_of(points, np.array(model.mesh_face[first : first + count]))


def lines_of(points: Array, faces: NDArray[np.integer[Any]]) -> list[Line]:
    """Return the capsule of a mesh of corners `(N, 3)` and triangles `(T, 3)`, or two where those are much smaller.

    The second is of what lies beyond a cut across its longest side.
    """
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    seen = points @ axes.T
    whole, best = _around(seen, axes), SPLIT * _size_of(_around(seen, axes))
    found, longest = [whole], int(np.argmax(np.ptp(seen, axis=0)))
    edges = seen[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])]
    levels = np.unique(seen[:, longest].round(3))
    for cut in (levels[:-1] + levels[1:]) / 2:
        parts = [_around(part, axes) for part in _cut(seen, edges, longest, cut)]
        size = sum(map(_size_of, parts))
        if size < best:
            found, best = parts, size
    return found


def _cut(seen: Array, edges: Array, axis: int, cut: float) -> tuple[Array, Array]:
    """Return the points on either side of a cut across an axis, with those where edges `(E, 2, 3)` cross it."""
    off = edges[:, :, axis] - cut
    crossing = off.prod(axis=1) < 0
    (start, end), share = edges[crossing].swapaxes(0, 1), off[crossing, 0] / (off[crossing, 0] - off[crossing, 1])
    on = start + share[:, None] * (end - start)
    below, above = seen[seen[:, axis] <= cut], seen[seen[:, axis] >= cut]
    return np.concatenate([below, on]), np.concatenate([above, on])


def _around(seen: Array, axes: Array) -> Line:
    """Return the capsule around points `(N, 3)` that are given along axes."""
    return _longest((seen.max(axis=0) + seen.min(axis=0)) / 2 @ axes, axes, np.ptp(seen, axis=0) / 2)


def _size_of(line: Line) -> float:
    """Return a capsule's volume [m^3]."""
    _, _, half, radius = line
    return float(np.pi * radius**2 * (2 * half + 4 / 3 * radius))


def _longest(middle: Array, axes: Array, half: Array) -> Line:
    order = np.argsort(half)
    radius = float(half[order[1]])
    return middle, axes[order[2]], max(float(half[order[2]]) - radius, 0.0), radius


def _vector(numbers: Array) -> Vector:
    x, y, z = (float(number) for number in np.round(numbers, 12) + 0.0)
    return (x, y, z)
