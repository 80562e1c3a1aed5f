"""A robot file's text before the engine reads it: what no hand has is refused by its line, ROS's meshes are found.

From a URDF the shapes for show only and those of no size are left out. An MJCF file is only checked, with the files
that it includes.
"""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder, tostring
from xml.parsers.expat import ExpatError, ParserCreate

from inhand.errors import InputError
from inhand.folders import is_file

BODIES = 1000
"""Bodies and shapes that a robot file may have, counted with their replicas."""
DEPTH = 100
"""Elements that may lie in each other."""
MESHES = (".obj", ".stl", ".msh")
"""Endings of meshes that MuJoCo reads."""
PARENTS = 3
"""Folders above the file in which a package is looked for too."""
_TEXTS = ("name", "class", "childclass", "file", "filename", "link", "joint", "mesh", "material", "body", "site")
_COUNTED = ("body", "geom", "link", "collision")


@dataclass(frozen=True)
class RobotText:
    """A robot file that is ready for the engine."""

    text: str
    """XML."""
    meshes: dict[str, bytes]
    """Meshes of a URDF by the names that the text has for them."""
    notes: tuple[str, ...]
    """What was left out, a sentence each."""


@dataclass(frozen=True)
class _Xml:
    path: Path
    root: Element
    lines: dict[Element, int] = field(default_factory=dict)

    def wrong(self, element: Element, why: str) -> InputError:
        """Return the error to raise for an element."""
        return InputError(f"robot file {self.path}, line {self.lines[element]}: <{element.tag}> {why}")


def read_text(path: Path, joints: tuple[str, ...]) -> RobotText:
    """Return the text of a URDF or MJCF file, checked.

    Args:
        path: the file.
        joints: names of the fingers' joints, which must be able to move.

    Raises:
        InputError: no XML, an unexpanded xacro, a number that is not finite, a named joint that cannot move, more than
            `BODIES` bodies, or a mesh that is not there or of a kind that MuJoCo does not read.
    """
    xml = _parse(path)
    if _count(xml, depth=0) > BODIES:
        raise InputError(
            f"robot file {path} has more than {BODIES} bodies and shapes, with the replicas of <replicate>, <composite>"
            " and <flexcomp>; a hand has fewer: leave out what is not the hand"
        )
    _check_joints(xml, joints)
    meshes: dict[str, bytes] = {}
    notes: tuple[str, ...] = ()
    if xml.root.tag == "robot":
        notes = _without_show(xml)
        meshes = {
            name: data for number, mesh in enumerate(xml.root.iter("mesh")) for name, data in [_mesh(xml, mesh, number)]
        }
    return RobotText(tostring(xml.root, encoding="unicode"), meshes, notes)


def _parse(path: Path) -> _Xml:
    builder, parser, lines = TreeBuilder(), ParserCreate(), {}
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEPTH:
            raise InputError(f"robot file {path}: more than {DEPTH} elements lie in each other; a hand has fewer")
        lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def entity(*given: object) -> None:
        raise InputError(f"robot file {path} declares the entity {given[0]!r}; write out what it stands for")

    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = start, end, entity
    try:
        parser.Parse(path.read_bytes(), True)
    except (ExpatError, ValueError, LookupError, OSError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path} is not a robot that MuJoCo reads: {error}; mend the file") from error
    xml = _Xml(path, builder.close(), lines)
    for element in lines:
        _check_attributes(xml, element)
    return xml


def _check_attributes(xml: _Xml, element: Element) -> None:
    for key, value in element.items():
        if element.tag.startswith("xacro:") or "${" in value or "$(" in value:
            raise xml.wrong(
                element,
                f"is xacro that was not expanded ({key} = {value!r}): run `xacro {xml.path.name} > robot.urdf` and name"
                " that file",
            )
        if key not in _TEXTS and not all(map(_finite, value.split())):
            raise xml.wrong(element, f"has {key} = {value!r}: give finite numbers")


def _finite(word: str) -> bool:
    """Return whether a word is anything but a number that is not finite."""
    try:
        return math.isfinite(float(word))
    except ValueError:
        return True


def _count(xml: _Xml, depth: int) -> int:
    """Return how many bodies and shapes a file has, at most about `BODIES`, with replicas and included files."""
    found = 0
    stack = [(xml.root, 1)]
    while stack and found <= BODIES:
        element, times = stack.pop()
        if element.tag in {"replicate", "composite", "flexcomp"}:
            times *= math.prod(_counts(xml, element))
        found += times if element.tag in {*_COUNTED, "replicate", "composite", "flexcomp"} else 0
        other = element.get("file", "") if element.tag in {"include", "model"} else ""
        beside = xml.path.parent / other
        if other and beside.suffix.lower() != ".urdf" and is_file(beside):
            if depth == PARENTS:
                raise xml.wrong(element, f"is the file in {depth} files that include each other: put them into one")
            found += times * _count(_parse(beside), depth + 1)
        stack += [(child, times) for child in element]
    return found


def _counts(xml: _Xml, element: Element) -> list[int]:
    try:
        return [max(int(word), 1) for word in element.get("count", "1").split()]
    except ValueError as error:
        raise xml.wrong(element, f"has count = {element.get('count')!r}: give whole numbers") from error


def _check_joints(xml: _Xml, joints: tuple[str, ...]) -> None:
    for joint in xml.root.iter("joint"):
        limit = joint.find("limit")
        urdf = xml.root.tag == "robot"
        if joint.get("name") not in joints or (urdf and joint.get("type") not in {"revolute", "prismatic"}):
            continue
        given = [limit.get("lower", "0"), limit.get("upper", "0")] if limit is not None else ["0", "0"] * urdf
        given = given if urdf else joint.get("range", "").split()
        try:
            low, high = map(float, given)
        except ValueError:
            continue  # no limits in an MJCF file, or no numbers, which MuJoCo refuses
        if low >= high:
            free = 'type="continuous"' if urdf else "no range"
            raise xml.wrong(
                joint,
                f"{joint.get('name')!r} has the limits {low:g} to {high:g}, between which it cannot move: give"
                f" lower < upper, or {free} if it turns freely",
            )


def _without_show(xml: _Xml) -> tuple[str, ...]:
    """Leave out of a URDF what is for show only, and collision shapes of no size; return what was left out."""
    shown = empty = 0
    for link in xml.root.iter("link"):
        for visual in link.findall("visual"):
            shown += sum(1 for _ in visual.iter("mesh"))
            link.remove(visual)
        for collision in link.findall("collision"):
            if _is_empty(collision):
                empty += 1
                link.remove(collision)
    return left_out(xml.path, shown, empty)


def left_out(path: Path, shown: int, empty: int) -> tuple[str, ...]:
    """Return how many meshes for show only and collision shapes of no size were left out of a file."""
    counts = ((shown, "meshes for show only are"), (empty, "collision shapes of no size are"))
    return tuple(f"{path.name}: {count} {what} left out." for count, what in counts if count)


def _is_empty(collision: Element) -> bool:
    shape = next(iter(collision.find("geometry") or ()), None)
    words = [] if shape is None or shape.tag == "mesh" else " ".join(value for _, value in shape.items()).split()
    try:
        return bool(words) and not any(map(float, words))
    except ValueError:
        return False


def _mesh(xml: _Xml, mesh: Element, number: int) -> tuple[str, bytes]:
    named = mesh.get("filename", "")
    suffix = Path(named).suffix.lower()
    if suffix not in MESHES:
        raise xml.wrong(
            mesh,
            f"is {named!r}, a kind of mesh that MuJoCo does not read; allowed are {', '.join(MESHES)}: convert it (for"
            " example in Blender or MeshLab), or give boxes and cylinders as <collision>",
        )
    places = list(_places(xml, named))
    found = next((place for place in places if is_file(place)), None)
    if found is None:
        looked = ", ".join(dict.fromkeys(str(place) for place in places))
        raise xml.wrong(
            mesh,
            f"{named!r} is not there, looked for as {looked}: put it there, or name the folder of its package in"
            " ROS_PACKAGE_PATH",
        )
    name = f"{number}_{found.stem}{suffix}"
    mesh.set("filename", name)
    return name, found.read_bytes()


def _places(xml: _Xml, named: str) -> Iterator[Path]:
    folder = xml.path.parent
    scheme, is_uri, rest = named.partition("://")
    if not is_uri or scheme == "file":
        inner = Path(rest if is_uri else named)
        yield folder / inner
        for compiler in xml.root.iter("compiler"):
            yield folder / compiler.get("meshdir", "") / inner
            yield folder / compiler.get("meshdir", "") / inner.name
        yield folder / inner.name
        return
    package, _, inner_name = rest.partition("/")
    above = (folder, *folder.resolve().parents[:PARENTS])
    listed = [Path(part) for part in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if part]
    for base in (*above, *listed):
        yield base / package / inner_name
    for base in (*above[:2], *(base for base in listed if base.name == package)):
        yield base / inner_name
