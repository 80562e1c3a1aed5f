"""Where a solid is nearest to a point: closest surface point, outward normal and signed distance, compiled.

Box, cylinder and sphere in closed form; an ellipsoid by Newton's method on one number, which rises towards its root; a
convex mesh by the face that sees the point from farthest, or by its edges where the foot lies beyond that face's rim.
All is in the solid's own frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from inhand.compiled import leaf
from inhand.geometry import Array
from inhand.hands.spatial.objects import SolidSpec

BOX, CYLINDER, SPHERE, ELLIPSOID, MESH = range(5)
"""Kinds of solids."""
_KINDS = {"box": BOX, "cylinder": CYLINDER, "sphere": SPHERE, "ellipsoid": ELLIPSOID, "mesh": MESH}
TINY = 1e-12
"""Distances below this are none [m]."""
ROUNDS = 50
"""Most steps of Newton's method; it needs about six."""
SHARP = 0.87
"""Faces whose normals have a larger cosine meet in no edge that a tip must keep off: 30 deg (guessed)."""


class Surface(NamedTuple):
    """A solid's surface as kernels read it; of K solids of a kind arrays have a first axis of K."""

    kind: int
    half: Array
    """Half extents `(3,)` [m]."""
    planes: Array
    """Outward normals and offsets of a mesh's faces `(F, 4)`: inside, n x + o is negative."""
    triangles: Array
    """Corners of a mesh's faces `(F, 9)` [m]."""


def surface_of(spec: SolidSpec) -> Surface:
    """Return an object's surface for kernels."""
    triangles = np.zeros((0, 9))
    if spec.mesh is not None:
        triangles = np.array(spec.mesh.corners)[np.array(spec.mesh.triangles)].reshape(-1, 9)
    a, b, c = triangles[:, :3], triangles[:, 3:6], triangles[:, 6:]
    normals = np.cross(b - a, c - a)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), TINY**2)
    planes = np.concatenate([normals, -(normals * a).sum(axis=-1, keepdims=True)], axis=-1)
    return Surface(_KINDS[spec.shape], np.array(spec.half), planes, np.ascontiguousarray(triangles))


def stacked_surfaces(specs: Sequence[SolidSpec]) -> Surface:
    """Return the surfaces of objects of one shape, their meshes of as many triangles."""
    each = [surface_of(spec) for spec in specs]
    half, planes, triangles = (np.stack(part) for part in zip(*(one[1:] for one in each), strict=True))
    return Surface(each[0].kind, half, planes, triangles)


@leaf
def nearest(surface: Surface, point: tuple[float, float, float], hit: Array) -> None:
    """Write distance, closest point and outward normal there into `hit` `(7,)`; negative inside."""
    if surface.kind == SPHERE:
        _nearest_sphere(surface.half, point, hit)
    elif surface.kind == BOX:
        _nearest_box(surface.half, point, hit)
    elif surface.kind == CYLINDER:
        _nearest_cylinder(surface.half, point, hit)
    elif surface.kind == ELLIPSOID:
        _nearest_ellipsoid(surface.half, point, hit)
    else:
        _nearest_mesh(surface, point, hit)


@leaf
def off_edges(surface: Surface, hit: Array, margin: float) -> bool:
    """Return whether a contact lies on a face, some way from its edges [m]; round surfaces have none."""
    half = surface.half
    if surface.kind == BOX:
        faces = 0
        for i in range(3):
            faces += abs(hit[1 + i]) < half[i] - margin
        return faces >= 2
    if surface.kind == CYLINDER:
        return bool(math.hypot(hit[1], hit[2]) < half[0] - margin or abs(hit[3]) < half[2] - margin)
    if surface.kind == MESH:
        for f in range(len(surface.planes)):
            plane = surface.planes[f]
            alike = plane[0] * hit[4] + plane[1] * hit[5] + plane[2] * hit[6]
            above = plane[0] * hit[1] + plane[1] * hit[2] + plane[2] * hit[3] + plane[3]
            if alike < SHARP and above > -margin:
                return False
    return True


@leaf
def _tell(hit: Array, distance: float, normal: tuple[float, float, float], point: tuple[float, float, float]) -> None:
    """Write down a hit by its distance and normal: the closest point is that far back along the normal."""
    hit[0] = distance
    for i in range(3):
        hit[1 + i] = point[i] - distance * normal[i]
        hit[4 + i] = normal[i]


@leaf
def _nearest_sphere(half: Array, point: tuple[float, float, float], hit: Array) -> None:
    size = math.sqrt(point[0] ** 2 + point[1] ** 2 + point[2] ** 2)
    normal = (0.0, 0.0, 1.0) if size < TINY else (point[0] / size, point[1] / size, point[2] / size)
    _tell(hit, size - half[0], normal, point)


@leaf
def _nearest_box(half: Array, point: tuple[float, float, float], hit: Array) -> None:
    square, face, depth = 0.0, 0, np.inf
    for i in range(3):
        over = max(abs(point[i]) - half[i], 0.0)
        square += over * over
        hit[4 + i] = math.copysign(over, point[i])
        if half[i] - abs(point[i]) < depth:
            face, depth = i, half[i] - abs(point[i])
    distance = math.sqrt(square)
    if distance < TINY:  # inside: out through the nearest face
        distance = -depth
        for i in range(3):
            hit[4 + i] = math.copysign(1.0, point[i]) if i == face else 0.0
    else:
        for i in range(3):
            hit[4 + i] /= distance
    _tell(hit, distance, (hit[4], hit[5], hit[6]), point)


@leaf
def _nearest_cylinder(half: Array, point: tuple[float, float, float], hit: Array) -> None:
    radius = math.hypot(point[0], point[1])
    x, y = (1.0, 0.0) if radius < TINY else (point[0] / radius, point[1] / radius)
    up = math.copysign(1.0, point[2])
    aside, above = radius - half[0], abs(point[2]) - half[2]
    across, along = max(aside, 0.0), max(above, 0.0)
    distance = math.hypot(across, along)
    if distance < TINY:
        distance = max(aside, above)
        across, along = (1.0, 0.0) if aside > above else (0.0, 1.0)
    else:
        across, along = across / distance, along / distance
    _tell(hit, distance, (x * across, y * across, up * along), point)


@leaf
def _nearest_ellipsoid(half: Array, point: tuple[float, float, float], hit: Array) -> None:
    """Find t with sum (a_i p_i / (t + a_i^2))^2 = 1; the foot is a_i^2 p_i / (t + a_i^2) (Eberly 2013).

    The sum falls and is convex right of -min a^2, and at the start it is 1 or more: Newton's steps never pass the root.
    """
    t, low = -np.inf, np.inf
    for i in range(3):
        t = max(t, half[i] * abs(point[i]) - half[i] ** 2)
        low = min(low, half[i] ** 2)
    t = max(t, -low * (1 - 1e-9))
    for _ in range(ROUNDS):
        value, slope = -1.0, 0.0
        for i in range(3):
            share = half[i] * point[i] / (t + half[i] ** 2)
            value += share * share
            slope -= 2 * share * share / (t + half[i] ** 2)
        if value < 1e-13 or slope == 0.0:
            break
        t -= value / slope
    size, square = 0.0, 0.0
    for i in range(3):
        foot = half[i] ** 2 * point[i] / (t + half[i] ** 2)
        hit[1 + i], hit[4 + i] = foot, foot / half[i] ** 2
        size += hit[4 + i] ** 2
        square += (point[i] - foot) ** 2
    size = max(math.sqrt(size), TINY)
    for i in range(3):
        hit[4 + i] /= size
    hit[0] = math.copysign(math.sqrt(square), t)


@leaf
def _nearest_mesh(surface: Surface, point: tuple[float, float, float], hit: Array) -> None:
    planes = surface.planes
    distance, face = -np.inf, 0
    for f in range(len(planes)):
        above = planes[f, 0] * point[0] + planes[f, 1] * point[1] + planes[f, 2] * point[2] + planes[f, 3]
        if above > distance:
            distance, face = above, f
    _tell(hit, distance, (planes[face, 0], planes[face, 1], planes[face, 2]), point)
    if distance <= 0:
        return
    for f in range(len(planes)):
        above = planes[f, 0] * hit[1] + planes[f, 1] * hit[2] + planes[f, 2] * hit[3] + planes[f, 3]
        if above > TINY:  # the foot lies beyond this face's rim
            _nearest_edge(surface, point, hit)
            return


@leaf
def _nearest_edge(surface: Surface, point: tuple[float, float, float], hit: Array) -> None:
    """Search the edges of the faces that see a point: where no face has the foot, the nearest point is on an edge."""
    best = np.inf
    planes, corners = surface.planes, surface.triangles
    for f in range(len(planes)):
        if planes[f, 0] * point[0] + planes[f, 1] * point[1] + planes[f, 2] * point[2] + planes[f, 3] > 0:
            for k in range(3):
                one, two = 3 * k, 3 * ((k + 1) % 3)
                size = along = 0.0
                for i in range(3):
                    side = corners[f, two + i] - corners[f, one + i]
                    size, along = size + side * side, along + side * (point[i] - corners[f, one + i])
                share = min(max(along / max(size, TINY**2), 0.0), 1.0)
                square = 0.0
                for i in range(3):
                    foot = corners[f, one + i] + share * (corners[f, two + i] - corners[f, one + i])
                    square += (point[i] - foot) ** 2
                if square < best:
                    best = square
                    for i in range(3):
                        hit[1 + i] = corners[f, one + i] + share * (corners[f, two + i] - corners[f, one + i])
    hit[0] = math.sqrt(best)
    if hit[0] > TINY:
        for i in range(3):
            hit[4 + i] = (point[i] - hit[1 + i]) / hit[0]
