"""Hands and objects in space by name or file: the one place that turns a text into a spec."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from inhand.errors import InputError
from inhand.hands import files
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.names import is_spatial, parse_spatial_name
from inhand.hands.spatial.objects import Solid, SolidSpec, parse_solid_name
from inhand.hands.toml_tables import check_keys, keyed, number_in, numbers_in, read_toml, text_in
from inhand.registry import Registry, describe

if TYPE_CHECKING:
    from inhand.hands.spatial.robots import RobotFinger

_SIZED_KEYS = ("name", "shape", "size_mm", "mass_kg", "friction")
_MESH_KEYS = ("name", "mesh", "unit", "hull", "mass_kg", "friction")
_FINGER_KEYS = ("name", "joints", "tip", "tip_radius_mm", "tip_offset_mm")
_ROBOT_KEYS = ("name", "robot", "palm", "palm_x", "palm_y", "origin_mm", "start_mm", "fingers", *files.SERVOS)
MESHES = (".stl", ".obj")
"""Endings of files that are objects by themselves."""


HANDS: Registry[SpatialHand] = Registry("hand", {}, partial(files.made, SpatialHand, "hand"))
"""Specs of hands in space that calls were given, by their names."""
SOLIDS: Registry[SolidSpec] = Registry("object", {}, partial(files.made, SolidSpec, "object"))
"""The same of their objects."""


def hand_name(given: object) -> str:
    """Return the name of what a call was given as a hand; a spec is taken up under its own.

    Raises:
        InputError: it is no hand.
    """
    return _named(given, "hand", {HandSpec: files.HANDS, SpatialHand: HANDS})


def object_name(given: object) -> str:
    """Return the same of an object."""
    return _named(given, "object", {ObjectSpec: files.OBJECTS, SolidSpec: SOLIDS})


def _named(given: object, what: str, registries: dict[type, Registry[Any]]) -> str:
    if isinstance(given, str | os.PathLike):
        return os.fspath(given)
    planar, *_ = registries.values()
    if type(given) not in registries and not callable(given):
        specs = " or ".join(kind.__name__ for kind in registries)
        raise InputError(f"{what} is {describe(given)}: give a name, the path of a file, or a spec ({specs})")
    return registries.get(type(given), planar).name_of(given)


def is_spatial_hand(given: str | Path | object) -> bool:
    """Return whether a hand's name, file or spec is of a hand in space, whose objects are solids.

    A TOML file with fingers as a list (`[[fingers]]`) is one.

    Raises:
        InputError: a TOML file that cannot be read.
    """
    if not isinstance(given, str | Path):
        return isinstance(given, SpatialHand)
    if str(given) in HANDS:
        return True
    if Path(given).suffix.lower() == ".toml":
        return isinstance(read_toml(Path(given), "hand").get("fingers"), list)
    return is_spatial(str(given))


def load_spatial_hand(given: str | Path | SpatialHand) -> SpatialHand:
    """Return the hand of a name (see `parse_spatial_name`) or of a TOML file of a robot; a spec stays as it is.

    Raises:
        InputError: no name of a hand in space, or no readable robot.
    """
    if isinstance(given, SpatialHand):
        return given
    if str(given) in HANDS:
        return HANDS[str(given)]
    if Path(given).suffix.lower() == ".toml":
        return load_spatial_robot(Path(given))[0]
    return parse_spatial_name(str(given))


def load_spatial_robot(path: Path) -> tuple[SpatialHand, tuple[str, ...]]:
    """Return the hand of a TOML file that names a robot file's palm and fingers, and notes, a sentence each.

    Raises:
        InputError: no such file, or no serial fingers of hinges on a palm in it.
    """
    from inhand.hands.spatial.robots import RobotParts, read_spatial_robot

    table, where = read_toml(path, "hand"), f"hand file {path}"
    check_keys(table, _ROBOT_KEYS, ("name", "robot", "palm", "fingers"), where)
    given = table["fingers"]
    if not isinstance(given, list) or not all(isinstance(each, dict) for each in given):
        raise InputError(f"{where}: fingers = {given!r}; give a table [[fingers]] for each")
    fingers = tuple(_finger_from(each, f"{where} [[fingers]] {k + 1}") for k, each in enumerate(given))
    parts = RobotParts(
        text_in(table, "palm", where),
        fingers,
        text_in({"palm_x": "x"} | table, "palm_x", where),
        text_in({"palm_y": "y"} | table, "palm_y", where),
        _place(table, "origin_mm", where) or (0.0, 0.0, 0.0),
        _place(table, "start_mm", where),
    )
    numbers = {field: number_in(table, key, where) for key, field in files.SERVOS.items() if key in table}
    robot = path.parent / text_in(table, "robot", where)
    return read_spatial_robot(robot, text_in(table, "name", where), parts, numbers)


def _finger_from(table: dict[str, Any], where: str) -> RobotFinger:
    from inhand.hands.spatial.robots import RobotFinger

    check_keys(table, _FINGER_KEYS, ("name", "joints", "tip", "tip_radius_mm"), where)
    return RobotFinger(
        text_in(table, "name", where),
        files.joints_in(table, where),
        text_in(table, "tip", where),
        number_in(table, "tip_radius_mm", where) / 1e3,
        _place(table, "tip_offset_mm", where) or (0.0, 0.0, 0.0),
    )


def _place(table: dict[str, Any], key: str, where: str) -> Vector | None:
    """Return a point of three numbers in mm, None where the table has none."""
    if key not in table:
        return None
    numbers = numbers_in(table, key, where)
    if len(numbers) != 3:
        raise InputError(f"{where}: {key} = {list(numbers)}; it must be [x, y, z] in mm")
    return (numbers[0] / 1e3, numbers[1] / 1e3, numbers[2] / 1e3)


def load_solid(given: str | Path | SolidSpec) -> SolidSpec:
    """Return the object in space of a name (see `parse_solid_name`), a TOML, STL or OBJ file; a spec stays as it is.

    After a mesh file keys of an object file may stand, as `part.stl:unit=mm:mass_kg=0.05`; after all others mass and
    friction.

    Raises:
        InputError: neither an object name nor a readable file.
    """
    if isinstance(given, SolidSpec):
        return given
    if str(given) in SOLIDS:
        return SOLIDS[str(given)]
    whole = str(given)
    stem, said = keyed(whole)
    path = Path(stem)
    if path.suffix.lower() in MESHES:
        return _mesh_from({"name": path.stem, "mesh": path.name} | said, path.parent, f"object {whole!r}")
    return files.with_keys(_solid_of(stem), said, (whole, stem))


def _solid_of(stem: str) -> SolidSpec:
    path = Path(stem)
    if path.suffix.lower() != ".toml":
        return parse_solid_name(stem)
    table, where = read_toml(path, "object"), f"object file {path}"
    return _mesh_from(table, path.parent, where) if "mesh" in table else _sized_from(table, where)


def _sized_from(table: dict[str, Any], where: str) -> SolidSpec:
    check_keys(table, _SIZED_KEYS, ("name", "shape", "size_mm"), where)
    size = numbers_in(table, "size_mm", where)
    if len(size) != 3:
        raise InputError(f"{where}: size_mm = {list(size)}; it must be [x, y, z] in mm")
    shape = cast("Solid", text_in(table, "shape", where))
    spec = SolidSpec(text_in(table, "name", where), shape, (size[0] / 1e3, size[1] / 1e3, size[2] / 1e3))
    return files.weighed(spec, table, where)


def _mesh_from(table: dict[str, Any], folder: Path, where: str) -> SolidSpec:
    from inhand.hands.spatial.meshes import mesh_object

    check_keys(table, _MESH_KEYS, ("name", "mesh"), where)
    hull = table.get("hull", False)
    if not isinstance(hull, bool):
        raise InputError(f"{where}: hull = {hull!r}; it must be true or false")
    unit = text_in(table, "unit", where) if "unit" in table else None
    spec = mesh_object(folder / text_in(table, "mesh", where), unit, hull=hull)
    return files.weighed(replace(spec, name=text_in(table, "name", where)), table, where)
