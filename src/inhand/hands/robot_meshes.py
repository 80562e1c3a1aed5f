"""What an MJCF file may lack: meshes for show only that cannot be read, and geoms of no size, are left out."""

from pathlib import Path

import mujoco
import numpy as np

from inhand.errors import InputError
from inhand.folders import is_file
from inhand.hands.robot_text import MESHES, left_out

_Kind = mujoco.mjtGeom
SIZES = {
    _Kind.mjGEOM_SPHERE: ("sphere", 1),
    _Kind.mjGEOM_CAPSULE: ("capsule", 2),
    _Kind.mjGEOM_CYLINDER: ("cylinder", 2),
    _Kind.mjGEOM_ELLIPSOID: ("ellipsoid", 3),
    _Kind.mjGEOM_BOX: ("box", 3),
}
"""What the shapes that have a size are called, and how many numbers it has."""


def leave_out(spec: mujoco.MjSpec, path: Path) -> tuple[str, ...]:
    """Leave out of an MJCF file what a hand does not need and the engine would refuse; return what, a sentence each.

    Raises:
        InputError: a mesh that a finger or the palm touches with cannot be read, or a geom has only a part of a size.
    """
    missing = {mesh.name: why for mesh in spec.meshes if (why := _unreadable(spec, mesh, path))}
    shown = empty = 0
    for geom in list(spec.geoms):
        if geom.type == _Kind.mjGEOM_MESH and geom.meshname in missing:
            if geom.contype or geom.conaffinity:
                raise InputError(f"robot file {path}: the mesh {geom.meshname!r} {missing[geom.meshname]}")
            spec.delete(geom)
            shown += 1
        elif _is_empty(geom, path):
            spec.delete(geom)
            empty += 1
    for mesh in [mesh for mesh in spec.meshes if mesh.name in missing]:
        spec.delete(mesh)
    return left_out(path, shown, empty)


def _unreadable(spec: mujoco.MjSpec, mesh: mujoco.MjsMesh, path: Path) -> str:
    """Return why a mesh cannot be read; empty if it can."""
    if not mesh.file:
        return ""
    file = Path(mesh.file)
    if file.suffix.lower() not in MESHES:
        return (
            f"is {mesh.file!r}, a kind of mesh that MuJoCo does not read; allowed are {', '.join(MESHES)}: convert it"
            " (for example in Blender or MeshLab), or give boxes and cylinders"
        )
    places = [path.parent / spec.meshdir / file, path.parent / spec.meshdir / file.name]
    if any(is_file(place) for place in places):
        return ""
    return f"{mesh.file!r} is not there, looked for as {places[0]}: put it there"


def _is_empty(geom: mujoco.MjsGeom, path: Path) -> bool:
    """Return whether every number of a shape's size is zero; refuse one of which some are."""
    what, count = SIZES.get(geom.type, ("", 0))
    size = np.array(geom.size[: count if np.isnan(geom.fromto).any() else 1])
    if (size > 0).all() or np.isnan(size).any():
        return False
    if not size.any():
        return True
    raise InputError(
        f"robot file {path}: a {what} of body {geom.parent.name!r} has the size {size.tolist()}: give positive numbers,"
        " or leave it out"
    )
