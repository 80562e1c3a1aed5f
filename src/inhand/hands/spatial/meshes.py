"""Convex meshes from STL and OBJ files: closed, convex, about their centre of mass; anything else is refused."""

import re
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.polylines import UNITS
from inhand.hands.spatial.objects import Mesh, SolidSpec

SUFFIXES = (".stl", ".obj")
"""Endings of mesh files."""
CONVEX = 1e-3
"""A corner may lie this share of the largest side inside of its mesh's hull (guessed: what exporters round)."""
SAME = 1e-6
"""Corners nearer than this share of the largest side are one."""
LARGEST_MESH = 2000
"""Triangles that a convex mesh may have: each costs time at every step of planning."""


def mesh_object(path: Path, unit: str | None = None, *, hull: bool = False) -> SolidSpec:
    """Return the object of a mesh file, of the default mass and friction, called like the file.

    Args:
        path: an STL or OBJ file.
        unit: its unit of length, mm where none is given: neither kind of file says it.
        hull: whether to take the convex hull of a mesh that is open or not convex.

    Raises:
        InputError: no such file, one that cannot be read, or a mesh that is open or not convex.
    """
    if unit is not None and unit not in UNITS:
        raise InputError(f"mesh file {path}: unit = {unit!r}; allowed are {', '.join(UNITS)}")
    corners, triangles = _welded(*_read(path))
    corners = corners * UNITS[unit or "mm"]
    if not hull:
        _check_closed(path, triangles)
    return solid_of(path.stem, corners, None if hull else triangles)


def solid_of(name: str, corners: Array, triangles: NDArray[np.int64] | None = None) -> SolidSpec:
    """Return the convex object of corners `(V, 3)` [m]: their hull, or triangles `(F, 3)` that must be convex.

    Raises:
        InputError: no volume, more than `LARGEST_MESH` triangles, or triangles that are not their own hull.
    """
    try:
        found = ConvexHull(corners)
    except (QhullError, ValueError) as error:
        raise InputError(f"object {name!r}: its {len(corners)} corners enclose no volume; give a solid mesh") from error
    if triangles is not None:
        deepest = _deepest(found, corners, triangles)
        largest = float(np.ptp(corners, axis=0).max())
        if deepest > CONVEX * largest:
            raise InputError(
                f"object {name!r} is not convex: its surface lies up to {1e3 * deepest:.3g} mm inside of its hull; give"
                " hull=true to take the hull, or a convex mesh"
            )
    if len(found.simplices) > LARGEST_MESH:
        raise InputError(
            f"object {name!r} has {len(found.simplices)} triangles; a convex mesh may have {LARGEST_MESH}: simplify it"
        )
    return _about_its_middle(name, found)


def _about_its_middle(name: str, hull: ConvexHull) -> SolidSpec:
    """Return a hull as an object: even density, origin at the centre of mass.

    A solid is the sum of tetrahedra from an inner point to its triangles, of second moments V / 20 (sum of corners'
    squares and of their sum's square).
    """
    used, faces = np.unique(hull.simplices, return_inverse=True)
    corners, faces = hull.points[used], faces.reshape(-1, 3)
    inner = corners.mean(axis=0)
    a, b, c = (corners[faces[:, k]] - inner for k in range(3))
    signed = np.einsum("fi,fi->f", a, np.cross(b, c)) / 6
    faces = np.where((signed < 0)[:, None], faces[:, ::-1], faces)
    volumes = np.abs(signed)
    middle = (volumes[:, None] * (a + b + c) / 4).sum(axis=0) / volumes.sum()
    total = a + b + c
    second = sum(np.einsum("f,fi,fj->ij", volumes / 20, each, each) for each in (a, b, c, total)) / volumes.sum()
    second = second - np.outer(middle, middle)
    moments = np.trace(second) * np.eye(3) - second
    corners = corners - inner - middle
    inertia = (moments[0, 0], moments[1, 1], moments[2, 2], moments[0, 1], moments[0, 2], moments[1, 2])
    xx, yy, zz, xy, xz, yz = (float(each) for each in inertia)
    x, y, z = (float(each) for each in np.ptp(corners, axis=0))
    mesh = Mesh(
        tuple((float(p), float(q), float(r)) for p, q, r in corners),
        tuple((int(i), int(j), int(k)) for i, j, k in faces),
        (xx, yy, zz, xy, xz, yz),
    )
    return SolidSpec(name, "mesh", (x, y, z), mesh=mesh)


def _deepest(hull: ConvexHull, corners: Array, triangles: NDArray[np.int64]) -> float:
    """Return how deep the middle of a triangle or a corner lies inside of the hull [m]."""
    points = np.concatenate([corners[np.unique(triangles)], corners[triangles].mean(axis=1)])
    above = points @ hull.equations[:, :3].T + hull.equations[:, 3]
    return float(-above.max(axis=1).min())


def _check_closed(path: Path, triangles: NDArray[np.int64]) -> None:
    """Refuse a surface with an edge that does not belong to two triangles."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    if (counts != 2).any():
        raise InputError(
            f"mesh file {path} is open: {int((counts != 2).sum())} of its {len(counts)} edges do not belong to two"
            " triangles; close it, or give hull=true to take its convex hull"
        )


def _welded(points: Array, triangles: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return corners that stand for one another once, and triangles without those of no area."""
    grid = max(float(np.ptp(points, axis=0).max()) * SAME, 1e-15)
    _, first, number = np.unique(np.round(points / grid), axis=0, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[triangles]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return points[first], faces[distinct]


def _read(path: Path) -> tuple[Array, NDArray[np.int64]]:
    """Return points `(V, 3)` in the file's unit and triangles `(F, 3)`."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"no mesh file {path} that can be read: give the path of an STL or OBJ file") from error
    try:
        points, triangles = _obj(content) if path.suffix.lower() == ".obj" else _stl(content)
    except (ValueError, IndexError, struct.error) as error:
        raise InputError(f"{path} is not a mesh file that can be read: {error}; mend it") from error
    if len(triangles) < 4 or not np.isfinite(points).all():
        raise InputError(f"mesh file {path} has {len(triangles)} triangles; give a solid of four or more, finite")
    return points, triangles


def _stl(content: bytes) -> tuple[Array, NDArray[np.int64]]:
    """Return the triangles of an STL file; a binary one is known by its length, as its header may say `solid` too."""
    if len(content) >= 84 and len(content) == 84 + 50 * struct.unpack_from("<I", content, 80)[0]:
        rows = np.frombuffer(content, dtype=np.uint8, offset=84).reshape(-1, 50)[:, 12:48]
        points = np.ascontiguousarray(rows).view("<f4").reshape(-1, 3).astype(float)
    else:
        number = rb"[-+.0-9eE]+"
        found = re.findall(rb"vertex\s+(" + number + rb")\s+(" + number + rb")\s+(" + number + rb")", content)
        points = np.array(found, dtype=float).reshape(-1, 3)
    if not len(points) or len(points) % 3:
        raise ValueError("it holds no triangles")
    return points, np.arange(len(points)).reshape(-1, 3)


def _obj(content: bytes) -> tuple[Array, NDArray[np.int64]]:
    """Return the corners and faces of an OBJ file; faces of more corners are cut into triangles."""
    points: list[list[float]] = []
    faces: list[list[int]] = []
    for line in content.decode("utf-8", errors="replace").splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append([float(number) for number in rest[:3]])
        elif word == "f":
            given = [int(each.split("/")[0]) for each in rest]
            corners = [k - 1 if k > 0 else len(points) + k for k in given]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not points or not len(triangles) or triangles.max() >= len(points) or triangles.min() < 0:
        raise ValueError("its faces name corners that it has not")
    return np.array(points), triangles
