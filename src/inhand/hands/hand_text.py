"""A hand as text: TOML, and URDF or MJCF with the TOML that names their parts; `files` reads them back.

The outlines of links and palm are convex, so that each is one mesh: a prism over the outline.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES, FingerSpec, HandSpec
from inhand.hands.shapes import link_outline, palm_outline

ROUND = 6
"""Decimals of a length in mm: nanometres."""


def write_hand(hand: HandSpec, folder: Path, stem: str) -> list[Path]:
    """Write a hand as TOML, URDF and MJCF into a folder, and return the three TOML files that `load_hand` reads.

    Raises:
        InputError: its links or its palm have outlines of their own, which a TOML file cannot say.
    """
    if hand.palm is not None or any(finger.outlines or finger.masses for finger in hand.fingers):
        raise InputError(
            f"hand {hand.name!r} has outlines or masses of its own: a hand file tells those by a robot file"
        )
    texts = {f"{stem}.toml": toml_of(hand)}
    for kind, robot in (("urdf", _urdf(hand, stem)), ("mjcf", _mjcf(hand))):
        ending = "urdf" if kind == "urdf" else "xml"
        texts |= {f"{stem}.{ending}": robot, f"{stem}_{kind}.toml": _robot_toml(hand, f"{stem}.{ending}")}
    texts |= {f"{stem}_{name}.obj": _obj(points, hand.thickness) for name, points in _outlines(hand).items()}
    for name, text in texts.items():
        with in_place(folder / name) as part:
            part.write_text(text, encoding="utf-8")
    return [folder / name for name in texts if name.endswith(".toml")]


def toml_of(hand: HandSpec) -> str:
    """Return a hand file of a hand whose links are those of the laboratory's form."""
    lengths = ("palm_width", "palm_depth", "link_width", "thickness", "joint_gap", "tip_length")
    rows = [f'name = "{hand.name}"', *(f"{name}_mm = {_mm(getattr(hand, name))}" for name in lengths)]
    rows += [f"link_mass_kg = {hand.link_mass!r}", *_servo(hand)]
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        limits = ", ".join(f"[{_deg(low)}, {_deg(high)}]" for low, high in finger.limits)
        rows += ["", f"[{side}]", f"links_mm = [{', '.join(map(_mm, finger.links))}]", f"limits_deg = [{limits}]"]
    return "\n".join(rows) + "\n"


def _servo(hand: HandSpec) -> list[str]:
    """Return what robot files leave out or tell of other things than servos."""
    numbers = {"torque_nm": hand.torque, "armature_kg_m2": hand.armature}
    numbers = {"friction": hand.friction, "stiffness": hand.stiffness, "damping": hand.damping} | numbers
    return [f"{key} = {value!r}" for key, value in numbers.items()]


def _robot_toml(hand: HandSpec, robot: str) -> str:
    rows = [f'name = "{hand.name}"', f'robot = "{robot}"', 'palm = "palm"', f"thickness_mm = {_mm(hand.thickness)}"]
    rows += [f"link_mass_kg = {hand.link_mass!r}", *_servo(hand)]
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        joints = ", ".join(f'"{side}_{k}"' for k in range(1, len(finger.links) + 1))
        rows += ["", f"[{side}]", f"joints = [{joints}]", f'tip = "{side}_tip"']
    return "\n".join(rows) + "\n"


def _mjcf(hand: HandSpec) -> str:
    meshes = [
        f'    <mesh name="{name}" vertex="{" ".join(f"{x:.9g}" for x in _prism(points, hand.thickness).ravel())}"/>'
        for name, points in _outlines(hand).items()
    ]
    rows = ['    <body name="palm">', '      <geom type="mesh" mesh="palm"/>']
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        rows += _mjcf_links(hand, finger, side)
    head = [f'<mujoco model="{hand.name}">', '  <compiler angle="radian"/>', "  <asset>", *meshes, "  </asset>"]
    return "\n".join([*head, "  <worldbody>", *rows, "    </body>", "  </worldbody>", "</mujoco>"]) + "\n"


def _mjcf_links(hand: HandSpec, finger: FingerSpec, side: str) -> list[str]:
    rows, ends = list[str](), list[str]()
    place = finger.base
    for k, (length, limit) in enumerate(zip(finger.links, finger.limits, strict=True), start=1):
        name, pad = f"{side}_{k}", "  " * (k + 2)
        servo = f'damping="{hand.damping!r}" armature="{hand.armature!r}"'
        servo += f' actuatorfrcrange="{-hand.torque!r} {hand.torque!r}"'
        rows += [
            f'{pad}<body name="{name}" pos="{place[0]!r} {place[1]!r} 0">',
            f'{pad}  <joint name="{name}" axis="0 0 1" range="{limit[0]!r} {limit[1]!r}" {servo}/>',
            f'{pad}  <geom type="mesh" mesh="{name}" mass="{hand.link_mass!r}"/>',
        ]
        place = (0.0, length)
        ends.insert(0, f"{pad}</body>")
    return [*rows, f'{"  " * (len(finger.links) + 3)}<site name="{side}_tip" pos="0 {place[1]!r} 0"/>', *ends]


def _urdf(hand: HandSpec, stem: str) -> str:
    def link(name: str) -> str:
        mesh = f'<geometry><mesh filename="{stem}_{name}.obj"/></geometry>'
        shape = f"<visual>{mesh}</visual><collision>{mesh}</collision>"
        inertia = f'<inertia ixx="{TURN}" iyy="{TURN}" izz="{TURN}" ixy="0" ixz="0" iyz="0"/>'
        return f'  <link name="{name}"><inertial><mass value="{hand.link_mass!r}"/>{inertia}</inertial>{shape}</link>'

    rows = [link("palm")]
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        parent, place = "palm", finger.base
        for k, (length, limit) in enumerate(zip(finger.links, finger.limits, strict=True), start=1):
            name = f"{side}_{k}"
            bounds = f'<limit lower="{limit[0]!r}" upper="{limit[1]!r}" effort="{hand.torque!r}" velocity="10"/>'
            bounds += f'<dynamics damping="{hand.damping!r}"/>'
            rows += [link(name), _urdf_joint(name, "revolute", (parent, name), place, bounds)]
            parent, place = name, (0.0, length)
        rows += [f'  <link name="{side}_tip"/>', _urdf_joint(f"to_{side}_tip", "fixed", (parent, f"{side}_tip"), place)]
    return "\n".join([f'<robot name="{hand.name}">', *rows, "</robot>"]) + "\n"


TURN = 1e-5
"""Moments of inertia that a URDF file tells of each link [kg m^2], guessed: `files` takes those of the prism."""


def _urdf_joint(name: str, kind: str, ends: Sequence[str], place: Sequence[float], more: str = "") -> str:
    links = f'<parent link="{ends[0]}"/><child link="{ends[1]}"/><axis xyz="0 0 1"/>'
    return f'  <joint name="{name}" type="{kind}"><origin xyz="{place[0]!r} {place[1]!r} 0"/>{links}{more}</joint>'


def _outlines(hand: HandSpec) -> dict[str, Array]:
    """Return the outlines `(K, 2)` [m] of all parts by their names, each in its part's frame."""
    found = {"palm": palm_outline(hand)}
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        found |= {f"{side}_{k + 1}": link_outline(hand, finger, k) for k in range(len(finger.links))}
    return found


def _prism(points: Array, height: float) -> Array:
    """Return the corners `(2 K, 3)` [m] of a prism over an outline, the lower ones first."""
    ends = [np.column_stack([points, np.full(len(points), z)]) for z in (-height / 2, height / 2)]
    return np.concatenate(ends)


def _obj(points: Array, height: float) -> str:
    """Return a prism over a convex outline as a Wavefront mesh, its faces triangles seen from outside."""
    count = len(points)
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in _prism(points, height)]
    for k in range(1, count - 1):
        rows += [f"f 1 {k + 2} {k + 1}", f"f {count + 1} {count + k + 1} {count + k + 2}"]
    for k in range(count):
        low, after = k + 1, (k + 1) % count + 1
        rows += [f"f {low} {after} {count + after}", f"f {low} {count + after} {count + low}"]
    return "\n".join(rows) + "\n"


def _mm(length: float) -> str:
    return repr(round(1e3 * length, ROUND))


def _deg(angle: float) -> str:
    return repr(float(np.rad2deg(angle)))
