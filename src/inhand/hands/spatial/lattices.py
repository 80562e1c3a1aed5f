"""Points all over a solid's surface, on lattices that have the solid's own symmetry."""

import numpy as np

from inhand.geometry import Array, unit
from inhand.hands.spatial.objects import SolidSpec


def surface_points(spec: SolidSpec, spacing: float, edge: float) -> tuple[Array, Array]:
    """Return points `(K, 3)` [m] and outward normals `(K, 3)` in the object's frame, about a spacing apart [m].

    On boxes and cylinders none is nearer to an edge than `edge` [m]; on other solids rays from the middle through the
    lattice of a cube give the points, and those of a mesh may lie anywhere on its faces.
    """
    half = np.array(spec.half)
    if spec.shape == "box":
        return _box_points(half, spacing, edge)
    if spec.shape == "cylinder":
        return _cylinder_points(float(half[0]), float(half[2]), spacing, edge)
    count = max(int(np.pi / 2 * half.max() / spacing), 1)
    cube, _ = _box_points(np.ones(3), 2 / (count + 1), 1 / (count + 1))
    rays = cube / np.linalg.norm(cube, axis=-1, keepdims=True)
    if spec.mesh is None:
        points, normals = rays * half, rays / half
        return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    a, b, c = (np.array(spec.mesh.corners)[np.array(spec.mesh.triangles)[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    faces = faces / np.linalg.norm(faces, axis=-1, keepdims=True)
    steep = rays @ faces.T / np.maximum((faces * a).sum(axis=-1), 1e-12)
    return rays / steep.max(axis=-1, keepdims=True), faces[steep.argmax(axis=-1)]


def _box_points(half: Array, spacing: float, edge: float) -> tuple[Array, Array]:
    points, normals = [], []
    for k in range(3):
        i, j = (m for m in range(3) if m != k)
        rows, columns = np.meshgrid(_evenly(half[i] - edge, spacing), _evenly(half[j] - edge, spacing))
        for sign in (-1.0, 1.0):
            face, normal = np.zeros((rows.size, 3)), np.zeros((rows.size, 3))
            face[:, i], face[:, j], face[:, k], normal[:, k] = rows.ravel(), columns.ravel(), sign * half[k], sign
            points.append(face)
            normals.append(normal)
    return np.concatenate(points), np.concatenate(normals)


def _cylinder_points(radius: float, height: float, spacing: float, edge: float) -> tuple[Array, Array]:
    around = 4 * max(int(np.pi / 2 * radius / spacing), 2)
    angles, heights = np.meshgrid(np.arange(around) * 2 * np.pi / around, _evenly(height - edge, spacing))
    out = np.concatenate([unit(angles.ravel()), np.zeros((angles.size, 1))], axis=-1)
    points, normals = [radius * out + heights.ravel()[:, None] * [0, 0, 1]], [out]
    x, y = (each.ravel() for each in np.meshgrid(_evenly(radius - edge, spacing), _evenly(radius - edge, spacing)))
    on = np.hypot(x, y) < radius - edge
    for sign in (-1.0, 1.0):
        lid = np.stack([x[on], y[on], np.full(on.sum(), sign * height)], axis=-1)
        points.append(lid)
        normals.append(np.tile([0.0, 0.0, sign], (len(lid), 1)))
    return np.concatenate(points), np.concatenate(normals)


def _evenly(reach: float, spacing: float) -> Array:
    """Return places from -reach to reach, at most about a spacing apart and 0 alone where there is no room."""
    return np.linspace(-1.0, 1.0, int(2 * reach / spacing) + 1) * reach if reach > spacing / 2 else np.zeros(1)
