"""Hands and objects from TOML files and outlines, and the one place that turns a name or a file into a spec.

What reads robot files is imported when there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from inhand.errors import InputError
from inhand.hands.hand import FINGER_NAMES, FingerSpec, HandSpec, build_hand
from inhand.hands.line_files import read_outline
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec, Shape, convex_pieces, parse_object_name, polygon_object
from inhand.hands.polylines import UNITS
from inhand.hands.spatial.names import is_spatial
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.toml_tables import WEIGHED, check_keys, keyed, number_in, numbers_in, read_toml, text_in
from inhand.registry import Registry, describe

if TYPE_CHECKING:
    from inhand.hands.robot_files import RobotHand

_FINGER_KEYS = ("links_mm", "limits_deg")
_HAND_LENGTHS = ("palm_depth", "link_width", "thickness", "joint_gap", "tip_length")
SERVOS = {
    "friction": "friction",
    "stiffness": "stiffness",
    "damping": "damping",
    "torque_nm": "torque",
    "armature_kg_m2": "armature",
}
"""Keys of a hand's file for numbers of its motors and its friction, and the fields that they are."""
_HAND_SCALARS = {"link_mass_kg": "link_mass"} | SERVOS
_HAND_KEYS = ("name", "palm_width_mm", *FINGER_NAMES, *(f"{key}_mm" for key in _HAND_LENGTHS), *_HAND_SCALARS)
_ROBOT_FINGER_KEYS = ("joints", "tip")
_ROBOT_KEYS = ("name", "robot", "palm", *FINGER_NAMES, "palm_x", "palm_y", "scale", "thickness_mm", *_HAND_SCALARS)
_OBJECT_KEYS = ("name", "shape", "size_mm", "mass_kg", "friction")
_POLYGON_KEYS = ("name", "shape", "corners_mm", "height_mm", "mass_kg", "friction")
_OUTLINE_KEYS = ("name", "shape", "outline", "unit", "height_mm", "mass_kg", "friction")
HEIGHT_MM = 100.0
"""Height of an object over an outline, as of the named ones [mm]."""
OUTLINES = (".csv", ".svg", ".dxf")
"""Endings of files that are objects by themselves."""
S = TypeVar("S")
"""A hand or an object."""
B = TypeVar("B", ObjectSpec, SolidSpec)
"""An object, in the plane or in space."""


def load_hand(name_or_file: str | Path | HandSpec) -> HandSpec:
    """Return the hand of a name (see `parse_hand_name`), a TOML file or `FILE.py:NAME`; a `HandSpec` stays as it is.

    Raises:
        InputError: neither a hand name nor a readable hand file.
    """
    if not isinstance(name_or_file, HandSpec):
        _check_planar(name_or_file)
    return _loaded(name_or_file, HANDS, HandSpec, (parse_hand_name, _hand_from))


def _check_planar(given: str | Path) -> None:
    """Refuse a hand in space, which only the Asterisk Test, sequences, reach and training take."""
    if isinstance(given, str) and is_spatial(given) and HANDS.find(given) is None:
        raise InputError(
            f"hand {given!r} is a hand in space: `inhand asterisk`, with straight paths and the controllers ik,"
            " ik-sensed and rl, `inhand robustness`, `inhand sweep`, `inhand trace`, `inhand reach`, `inhand record`,"
            " `inhand evaluate` and `inhand train --preset spatial` take one (docs/spatial.md); everything else is of"
            " hands in the plane, such as 2v2_50.50_50.50_1.1_53"
        )


def load_object(name_or_file: str | Path | ObjectSpec) -> ObjectSpec:
    """Return the object of a name (see `parse_object_name`), a TOML file, `FILE.py:NAME` or an outline.

    An outline is the path of a .csv, .svg or .dxf file, and after it keys of an object file, as
    `part.dxf:unit=mm:mass_kg=0.05`; it is called like its file. After all others `:mass_kg=` and `:friction=` may
    stand. An `ObjectSpec` is returned as it is.

    Raises:
        InputError: neither an object name nor a readable object file or outline.
    """
    if isinstance(name_or_file, ObjectSpec) or str(name_or_file) in OBJECTS:
        return _object_of(name_or_file)
    stem, said = keyed(str(name_or_file))
    path = Path(stem)
    if path.suffix.lower() in OUTLINES:
        return _object_from({"name": path.stem, "outline": path.name} | said, path)
    return with_keys(_object_of(stem if said else name_or_file), said, (str(name_or_file), stem))


def _object_of(given: str | Path | ObjectSpec) -> ObjectSpec:
    return _loaded(given, OBJECTS, ObjectSpec, (parse_object_name, _object_from))


def with_keys(spec: B, said: dict[str, Any], texts: tuple[str, str]) -> B:
    """Return an object of which mass and friction are said; the texts are all that was given, and its name or file.

    Raises:
        InputError: another key, or no number.
    """
    if not said:
        return spec
    (whole, stem), where = texts, f"object {texts[0]!r}"
    check_keys(said, WEIGHED, (), where)
    return weighed(replace(spec, name=spec.name + whole.removeprefix(stem)), said, where)


def assumed(hands: Iterable[str]) -> tuple[str, ...]:
    """Return what was left out of the robot files of hands, and which hands have no joint limits, a sentence each.

    Raises:
        InputError: not a hand.
    """
    notes: list[str] = []
    free = []
    for name in hands:
        path = _as_file(name, "hand") if HANDS.find(name) is None else None
        if path is not None and "robot" in (table := read_toml(path, "hand")):
            notes += _robot_from(table, path).notes
        elif (np.abs(load_hand(name).limits) == np.pi).all(axis=-1).any():
            free.append(name)
    if free:
        notes.append(
            f"No limits are given for joints of {', '.join(free)} (`limits_deg` in a hand file, `:lab-limits` after a"
            " name): they turn freely, +-180 deg, and only bodies stop them."
        )
    return tuple(notes)


def _loaded(
    given: str | Path | S,
    registry: Registry[S],
    kind: type[S],
    readers: tuple[Callable[[str], S], Callable[[dict[str, Any], Path], S]],
) -> S:
    """Return the spec of a name, a file or the spec itself; readers are those of a name and of a file's table."""
    if isinstance(given, kind):
        return given
    own = registry.find(str(given))
    if own is not None:
        return own
    path = _as_file(given, registry.kind)
    return readers[0](str(given)) if path is None else readers[1](read_toml(path, registry.kind), path)


def made(kind: type[S], what: str, name: str, given: object) -> S:
    """Return what a user gave under a name as a spec of a kind, or what his function makes.

    Raises:
        InputError: it is another thing.
    """
    spec = given() if callable(given) else given
    if not isinstance(spec, kind):
        raise InputError(
            f"{what} {name!r} is {describe(spec)}: it must be {'an' if what == 'object' else 'a'} {kind.__name__}, as"
            f" inhand.{what}(...) returns one"
        )
    return spec


HANDS: Registry[HandSpec] = Registry("hand", {}, partial(made, HandSpec, "hand"))
"""Hands that users add."""
OBJECTS: Registry[ObjectSpec] = Registry("object", {}, partial(made, ObjectSpec, "object"))
"""Objects that users add."""


def _as_file(name_or_file: object, what: str) -> Path | None:
    if not isinstance(name_or_file, str | Path):
        raise InputError(f"{what} = {name_or_file!r}: give a name, the path of a TOML file, or a spec")
    path = Path(name_or_file)
    is_file = isinstance(name_or_file, Path) or path.suffix.lower() == ".toml" or len(path.parts) > 1
    return path if is_file else None


def _sized_from(table: dict[str, Any], where: str) -> ObjectSpec:
    check_keys(table, _OBJECT_KEYS, ("name", "shape", "size_mm"), where)
    size = numbers_in(table, "size_mm", where)
    if len(size) != 3:
        raise InputError(f"{where}: size_mm = {list(size)}; it must be [x, y, height] in mm")
    shape = cast("Shape", text_in(table, "shape", where))
    return ObjectSpec(text_in(table, "name", where), shape, (size[0] / 1e3, size[1] / 1e3, size[2] / 1e3))


def _polygon_from(table: dict[str, Any], where: str) -> ObjectSpec:
    check_keys(table, _POLYGON_KEYS, ("name", "shape", "corners_mm", "height_mm"), where)
    rows = table["corners_mm"]
    if not isinstance(rows, list):
        raise InputError(f"{where}: corners_mm = {rows!r}; it must be a list of corners [x, y] in mm")
    corners = [numbers_in({"corners_mm": row}, "corners_mm", where) for row in rows]
    for place, corner in enumerate(corners, start=1):
        if len(corner) != 2:
            raise InputError(f"{where}: corner {place} of corners_mm is {list(corner)}; it must be [x, y] in mm")
    return _prism_from(table, [(x / 1e3, y / 1e3) for x, y in corners], where)


def _outlined_from(table: dict[str, Any], folder: Path, where: str) -> ObjectSpec:
    check_keys(table, _OUTLINE_KEYS, ("name", "outline"), where)
    if table.get("shape", "polygon") != "polygon":
        raise InputError(f"{where}: shape = {table['shape']!r}; with an outline it is 'polygon': leave it out")
    unit = table.get("unit")
    if unit is not None and unit not in UNITS:
        raise InputError(f"{where}: unit = {unit!r}; allowed are {', '.join(UNITS)}")
    corners = read_outline(folder / text_in(table, "outline", where), unit)
    return _prism_from({"height_mm": HEIGHT_MM} | table, corners.tolist(), where)


def _prism_from(table: dict[str, Any], corners: Sequence[Sequence[float]], where: str) -> ObjectSpec:
    """Return the object over corners [m]."""
    spec = polygon_object(text_in(table, "name", where), corners, number_in(table, "height_mm", where) / 1e3)
    convex_pieces(spec)  # refuses an outline of too many
    return spec


def _object_from(table: dict[str, Any], path: Path) -> ObjectSpec:
    where = f"object file {path}"
    if "outline" in table:
        spec = _outlined_from(table, path.parent, where)
    else:
        spec = (_polygon_from if table.get("shape") == "polygon" else _sized_from)(table, where)
    return weighed(spec, table, where)


def weighed(spec: B, table: dict[str, Any], where: str) -> B:
    """Return an object with the mass and the friction of its file's table, where that tells them."""
    mass = number_in(table, "mass_kg", where) if "mass_kg" in table else spec.mass
    friction = number_in(table, "friction", where) if "friction" in table else spec.friction
    return replace(spec, mass=mass, friction=friction)


def _hand_from(table: dict[str, Any], path: Path) -> HandSpec:
    where = f"hand file {path}"
    if "robot" in table:
        return _robot_from(table, path).hand
    check_keys(table, _HAND_KEYS, ("name", "palm_width_mm", *FINGER_NAMES), where)
    links = []
    for side in FINGER_NAMES:
        if not isinstance(table[side], dict):
            raise InputError(f"{where}: {side} = {table[side]!r}; it must be a table [{side}] with links_mm")
        check_keys(table[side], _FINGER_KEYS, ("links_mm",), f"{where} [{side}]")
        links.append(tuple(length / 1e3 for length in numbers_in(table[side], "links_mm", f"{where} [{side}]")))
    changes: dict[str, Any] = {
        key: number_in(table, f"{key}_mm", where) / 1e3 for key in _HAND_LENGTHS if f"{key}_mm" in table
    }
    changes |= {field: number_in(table, key, where) for key, field in _HAND_SCALARS.items() if key in table}
    name, palm_width = text_in(table, "name", where), number_in(table, "palm_width_mm", where) / 1e3
    try:
        hand = build_hand(name, links[0], links[1], palm_width, **changes)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    left, right = (
        _with_limits(f, table[side], f"{where} [{side}]") for f, side in zip(hand.fingers, FINGER_NAMES, strict=True)
    )
    return replace(hand, left=left, right=right)


def load_robot(path: Path) -> RobotHand:
    """Return the hand of a TOML file that names a robot file, with the signs and zeros of the robot's joint angles.

    Raises:
        InputError: no such file, or one that names no robot, or no hand in it.
    """
    table = read_toml(path, "hand")
    if "robot" not in table:
        raise InputError(f"hand file {path}: no 'robot'; a robot's hand names its URDF or MJCF file")
    return _robot_from(table, path)


def _robot_from(table: dict[str, Any], path: Path) -> RobotHand:
    from inhand.hands.robot_chains import FingerNames, RobotNames
    from inhand.hands.robot_files import read_robot

    where = f"hand file {path}"
    check_keys(table, _ROBOT_KEYS, ("name", "robot", "palm", *FINGER_NAMES), where)
    fingers = []
    for side in FINGER_NAMES:
        if not isinstance(table[side], dict):
            raise InputError(f"{where}: {side} = {table[side]!r}; it must be a table [{side}] with joints and tip")
        check_keys(table[side], _ROBOT_FINGER_KEYS, _ROBOT_FINGER_KEYS, f"{where} [{side}]")
        named = joints_in(table[side], f"{where} [{side}]")
        fingers.append(FingerNames(named, text_in(table[side], "tip", f"{where} [{side}]")))
    names = RobotNames(
        text_in(table, "palm", where),
        fingers[0],
        fingers[1],
        *(text_in({key: table.get(key, key[-1])}, key, where) for key in ("palm_x", "palm_y")),
    )
    numbers = {field: number_in(table, key, where) for key, field in _HAND_SCALARS.items() if key in table}
    if "thickness_mm" in table:
        numbers["thickness"] = number_in(table, "thickness_mm", where) / 1e3
    scale = number_in(table, "scale", where) if "scale" in table else 1.0
    if not scale > 0:
        raise InputError(f"{where}: scale = {scale:g}; it must be positive: metres in one of the robot file's units")
    robot = path.parent / text_in(table, "robot", where)
    return read_robot(robot, text_in(table, "name", where), names, numbers, scale)


def joints_in(table: dict[str, Any], where: str) -> tuple[str, ...]:
    """Return the names of a finger's joints in a table."""
    joints = table["joints"]
    if not isinstance(joints, list):
        raise InputError(f"{where}: joints = {joints!r}; it must be a list of names, the palm's first")
    return tuple(text_in({"joints": joint}, "joints", where) for joint in joints)


def _with_limits(finger: FingerSpec, table: dict[str, Any], where: str) -> FingerSpec:
    if "limits_deg" not in table:
        return finger
    rows = table["limits_deg"]
    if not isinstance(rows, list) or len(rows) != len(finger.links):
        raise InputError(f"{where}: limits_deg must give [low, high] for each of the {len(finger.links)} joints")
    limits = []
    for joint, row in enumerate(rows):
        pair = numbers_in({"limits_deg": row}, "limits_deg", where)
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise InputError(
                f"{where}: limits_deg of joint {joint} is {list(pair)}; it must be [low, high], low < high"
            )
        limits.append((float(np.deg2rad(pair[0])), float(np.deg2rad(pair[1]))))
    return replace(finger, limits=tuple(limits))
