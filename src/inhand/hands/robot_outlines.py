"""Outlines of a robot file's rigid parts: the convex hull of their collision geoms, seen along the palm's z axis."""

from collections.abc import Iterable

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from inhand.errors import InputError
from inhand.geometry import Array, unit
from inhand.hands.hand import Corners

ROUND_CORNERS = 32
"""Corners of the polygon that stands for a circle."""
FLATTENING = 1e-5
"""A corner this close to the line between its neighbours is left out [m]; meshes have hundreds of those."""
DECIMALS = 9
"""Lengths are rounded to nanometres, so that two files of the same hand give the same numbers."""
LARGEST = 1e6
"""No geom is so large or far away [m]: beyond, squares of its numbers may be too large to compute with."""

_Kind = mujoco.mjtGeom
_ROUND = (_Kind.mjGEOM_SPHERE, _Kind.mjGEOM_ELLIPSOID, _Kind.mjGEOM_CAPSULE, _Kind.mjGEOM_CYLINDER)


def collision_geoms(model: mujoco.MjModel, bodies: Iterable[int]) -> list[int]:
    """Return the geoms of some bodies that can touch something; those for show only are left out."""
    wanted = set(bodies)
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    solid = model.geom_type != _Kind.mjGEOM_PLANE
    return [int(g) for g in np.flatnonzero(touching & solid) if int(model.geom_bodyid[g]) in wanted]


def solid_points(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int], axes: Array) -> Array:
    """Return points `(K, 3)` [m] whose convex hull is that of the geoms as seen along the last of `axes`.

    The robot's kinematics are computed. Rows of `axes` `(3, 3)` are the wanted frame's, about the world's origin.

    Raises:
        InputError: a geom has no outline, such as a height field, or is too large to be of any hand.
    """
    geoms = list(geoms)
    for geom in geoms:
        largest = np.abs([model.geom_size[geom], data.geom_xpos[geom]]).max()
        if not largest < LARGEST:
            raise InputError(
                f"geom {model.geom(geom).name!r} is {largest:g} m large, or as far away: check its numbers"
            )
    points = [_geom_points(model, data, geom, axes) for geom in geoms]
    return np.concatenate(points) @ axes.T


def _geom_points(model: mujoco.MjModel, data: mujoco.MjData, geom: int, axes: Array) -> Array:
    kind, size = _Kind(int(model.geom_type[geom])), np.array(model.geom_size[geom])
    place, turn = np.array(data.geom_xpos[geom]), np.array(data.geom_xmat[geom]).reshape(3, 3)
    if kind == _Kind.mjGEOM_BOX:
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3)
        return np.asarray(place + (signs * size) @ turn.T)
    if kind == _Kind.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return np.asarray(place + model.mesh_vert[first : first + count].astype(float) @ turn.T)
    if kind not in _ROUND:
        raise InputError(
            f"geom {model.geom(geom).name!r} is of type {kind.name}, which has no outline; use boxes, cylinders,"
            " capsules, spheres, ellipsoids or meshes"
        )
    return _round_points(kind, size, place, turn, axes)


def _round_points(kind: mujoco.mjtGeom, size: Array, place: Array, turn: Array, axes: Array) -> Array:
    """Return the points of round geoms that lie farthest along `ROUND_CORNERS` directions of the plane and +-z.

    An ellipsoid c + A u, |u| <= 1, reaches farthest along d at c + A A' d / |A' d|. A capsule is two spheres, a
    cylinder two discs (ellipsoids with one axis of zero).
    """
    around = unit(np.arange(ROUND_CORNERS) * 2 * np.pi / ROUND_CORNERS)
    directions = np.concatenate([around @ axes[:2], axes[2:], -axes[2:]])
    along = size[1] * turn[:, 2]
    radii, centres = np.array([size[0]] * 3), [place - along, place + along]
    if kind == _Kind.mjGEOM_SPHERE:
        centres = [place]
    elif kind == _Kind.mjGEOM_ELLIPSOID:
        radii, centres = size, [place]
    elif kind == _Kind.mjGEOM_CYLINDER:
        radii = np.array([size[0], size[0], 0.0])
    matrix = turn * radii
    pulled = directions @ matrix
    shift = pulled @ matrix.T / np.maximum(np.linalg.norm(pulled, axis=-1, keepdims=True), 1e-12)
    return np.concatenate([centre + shift for centre in centres])


def convex_outline(points: Array) -> Corners:
    """Return the convex hull of points `(K, 2)` [m], counter-clockwise from its lowest corner, without flat corners.

    Raises:
        InputError: the points enclose no area.
    """
    try:
        corners = points[ConvexHull(points).vertices]
    except QhullError as error:
        raise InputError("its collision geoms enclose no area in the plane; give them a width and a length") from error
    while len(corners) > 3:
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        chord, edge = after - before, corners - before
        away = np.abs(chord[:, 0] * edge[:, 1] - chord[:, 1] * edge[:, 0]) / np.linalg.norm(chord, axis=-1)
        if away.min() > FLATTENING:
            break
        corners = np.delete(corners, int(away.argmin()), axis=0)
    tidy = np.round(corners, DECIMALS) + 0.0  # the sum makes -0.0 a 0.0
    lowest = int(np.lexsort((tidy[:, 0], tidy[:, 1]))[0])
    return tuple((float(x), float(y)) for x, y in np.roll(tidy, -lowest, axis=0))
