"""Draws docs/frames.png: the palm frame, the task frame, the joint angles, and the sixteen directions.

Run: python docs/draw_frames.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc

from inhand.geometry import Array, unit
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import hand_positions, joint_positions, link_angles
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name, polygon
from inhand.hands.shapes import link_polygons, palm_outline
from inhand.hands.touch import touch
from inhand.plots.save import save_figure
from inhand.plots.shapes import CLEAR, SceneOutline, draw_scene
from inhand.plots.sheet import sheet, write_above
from inhand.plots.style import (
    INK,
    LABEL_POINTS,
    MUTED,
    RULE,
    SERIES_LOOKS,
    TICK_POINTS,
    darker,
    direction_colour,
)
from inhand.tasks.primitives import TRAIN, UNSEEN, Primitive

HAND, OBJECT = "2v2_50.50_50.50_1.1_53", "cube_39"
PALM, TASK, JOINT = INK, SERIES_LOOKS[0].colour, SERIES_LOOKS[1].colour
PICTURE = Path(__file__).with_name("frames.png")
EXTENT = (-104.0, 104.0, -58.0, 134.0)
"""What the left half shows: left, right, bottom, top [mm]."""
WHEEL = 1.7
"""Half width of the right half, in lengths of an arrow."""


def start_joints(hand: HandSpec, half_width: float) -> Array:
    """Return the joint angles `(n_joints,)` [rad] that touch the middle of the object's sides at the start."""
    joints = np.empty(hand.n_joints)
    for sign, finger, place in zip((-1.0, 1.0), hand.fingers, hand.slices, strict=True):
        normal = np.array([sign, 0.0])
        joints[place] = touch(hand, finger, np.array(hand.start_position) + half_width * normal, normal).joints
    return joints


def scene(hand: HandSpec, joints: Array) -> SceneOutline:
    """Return hand and object at the start in the palm frame [mm]."""
    links: list[Array] = []
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        links += link_polygons(hand, finger, joints[place])
    return SceneOutline(
        links=tuple(1e3 * link for link in links),
        palm=1e3 * palm_outline(hand),
        object=1e3 * (polygon(parse_object_name(OBJECT)) + np.array(hand.start_position)),
        joints=1e3 * hand_positions(hand, joints),
        origin_mm=np.zeros(2),
    )


def write(
    ax: Axes, place: Array, text: str, colour: str, *, points: float = TICK_POINTS, rotation: float = 0.0
) -> None:
    """Write a text around a place `(2,)` with a white rim, so that lines behind it do not cross it."""
    rim = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    where = (float(place[0]), float(place[1]))
    ax.text(
        *where, text, color=colour, fontsize=points, rotation=rotation, ha="center", va="center", zorder=6, bbox=rim
    )


def arrow(ax: Axes, start: Array, end: Array, colour: str, *, line: float = 2.0, style: str = "-|>") -> None:
    """Draw an arrow from start to end `(2,)`."""
    look = {"arrowstyle": style, "color": colour, "lw": line, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12}
    ax.annotate("", (float(end[0]), float(end[1])), (float(start[0]), float(start[1])), arrowprops=look, zorder=5)


def out_of_paper(ax: Axes, place: Array, colour: str) -> None:
    """Draw a z axis seen from its end."""
    x, y = float(place[0]), float(place[1])
    ax.plot(x, y, "o", markersize=8, markerfacecolor="white", markeredgecolor=colour, markeredgewidth=1.6, zorder=6)
    ax.plot(x, y, "o", markersize=2.5, color=colour, zorder=7)


def frame(ax: Axes, origin: Array, length: float, colour: str, name: str) -> None:
    """Draw a frame's axes, each with its name."""
    for axis, way, beside in (("x", unit(0.0), np.array([2.0, -7.5])), ("y", unit(np.pi / 2), np.array([10.0, 0.0]))):
        arrow(ax, origin, origin + length * way, colour)
        text = f"${axis}_{{\\mathrm{{{name}}}}}$"
        write(ax, origin + length * way + beside, text, colour, points=LABEL_POINTS + 2)
    out_of_paper(ax, origin, colour)


def degrees(angle_deg: float, form: str) -> str:
    """Return an angle as text with a true minus sign."""
    return f"{angle_deg:{form}}".replace("-", "\N{MINUS SIGN}") + "\N{DEGREE SIGN}"


def joint_angle(ax: Axes, joint: Array, before_deg: float, after_deg: float, number: int) -> None:
    """Draw the angle from the straight finger to where the link points, both counter-clockwise from +x [deg]."""
    straight, turn = unit(np.deg2rad(before_deg)), after_deg - before_deg
    ax.plot(*np.stack([joint, joint + 34 * straight]).T, color=JOINT, linewidth=1.1, linestyle=(0, (3, 2)), zorder=4)
    low, high = sorted((before_deg, after_deg))
    around = (float(joint[0]), float(joint[1]))
    ax.add_patch(Arc(around, 48, 48, theta1=low, theta2=high, color=JOINT, linewidth=1.6, zorder=5))
    end, way = joint + 24 * unit(np.deg2rad(after_deg)), np.sign(turn) * unit(np.deg2rad(after_deg + 90))
    arrow(ax, end - 2.0 * way, end + 0.5 * way, JOINT, line=1.2)
    above = np.array([np.sign(joint[0]) * (7.0 if number % 2 == 0 else 4.0), 41.0 if number % 2 == 0 else 46.0])
    write(ax, joint + above, f"$q_{number}$ = {degrees(turn, '+.0f')}", darker(JOINT, 0.1))


def draw_lengths(ax: Axes, hand: HandSpec) -> None:
    """Draw the distance between the proximal joints, and from there to the task frame."""
    start, half = 1e3 * hand.start_position[1], 1e3 * hand.palm_width / 2
    across = np.array([[-half, -18.0], [half, -18.0]])
    up = np.array([[-9.0, 0.0], [-9.0, start]])
    for ends in (across, up):
        arrow(ax, ends[0], ends[1], MUTED, line=0.9, style="<|-|>")
    write(ax, across.mean(axis=0), f"{2 * half:.1f} mm", MUTED)
    length = f"0.65 \N{MULTIPLICATION SIGN} {1e3 * hand.finger_length:.0f} = {start:.1f} mm"
    write(ax, up.mean(axis=0) + np.array([-5.0, -9.0]), length, MUTED, rotation=90.0)


def draw_hand(ax: Axes, hand: HandSpec) -> None:
    """Draw hand, object, frames, joint angles and lengths."""
    joints = start_joints(hand, parse_object_name(OBJECT).size[0] / 2)
    draw_scene(ax, scene(hand, joints), CLEAR)
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        points = 1e3 * joint_positions(finger, joints[place])
        heading = np.concatenate([[90.0], 90.0 + np.rad2deg(link_angles(joints[place]))])
        for i, joint in enumerate(points[:-1]):
            joint_angle(ax, joint, heading[i], heading[i + 1], place.start + i)
    draw_lengths(ax, hand)
    frame(ax, np.zeros(2), 19.0, PALM, "palm")
    frame(ax, 1e3 * np.array(hand.start_position), 34.0, TASK, "task")
    for spot, text in (((0.0, -38.0), "palm"), ((-88.0, 22.0), "left finger"), ((88.0, 22.0), "right finger")):
        write(ax, np.array(spot), text, MUTED)
    ax.set_xlim(EXTENT[:2])
    ax.set_ylim(EXTENT[2:])


def draw_direction(ax: Axes, primitive: Primitive, line: float, weight: str) -> None:
    """Draw one direction of the wheel with its name and angle."""
    colour, way = direction_colour(primitive.angle_deg or 0.0), primitive.unit
    arrow(ax, 0.12 * way, way, colour, line=line)
    side: Literal["left", "right", "center"] = "left" if way[0] > 0.2 else "right" if way[0] < -0.2 else "center"
    height: Literal["bottom", "top", "center"] = "bottom" if way[1] > 0.95 else "top" if way[1] < -0.95 else "center"
    text = f"{primitive.name}  {degrees(primitive.angle_deg or 0.0, 'g')}"
    place = (1.07 * float(way[0]), 1.07 * float(way[1]))
    ink = darker(colour, 0.35)
    ax.text(*place, text, color=ink, fontsize=TICK_POINTS + 0.5, fontweight=weight, ha=side, va=height, zorder=6)


def draw_wheel(ax: Axes) -> None:
    """Draw the sixteen directions."""
    ax.plot(*unit(np.linspace(0, 2 * np.pi, 181)).T, color=RULE, linewidth=0.8, zorder=1)
    for primitive in UNSEEN:
        draw_direction(ax, primitive, 1.2, "normal")
    for primitive in TRAIN:
        draw_direction(ax, primitive, 2.6, "bold")
    out_of_paper(ax, np.zeros(2), TASK)
    ax.set_xlim(-WHEEL, WHEEL)
    ax.set_ylim(-1.295, 1.295)


def main() -> None:
    """Draw the picture and write it beside this file."""
    with sheet([[(4.75, 4.38), (5.75, 4.38)]], gap=(0.3, 0.0)) as (figure, (left, right)):
        draw_hand(left, parse_hand_name(HAND))
        draw_wheel(right)
        for ax in (left, right):
            ax.set_aspect("equal")
            ax.set_axis_off()
        write_above(
            left, "Frames and joint angles", "seen from above, z out of the paper; angles count counter-clockwise"
        )
        write_above(right, "The sixteen directions", "angles from $x_{\\mathrm{task}}$; bold: trained on, thin: unseen")
    save_figure(figure, PICTURE)


if __name__ == "__main__":
    main()
