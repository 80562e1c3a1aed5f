"""Drawings in space: those of the plane in a plane of the palm frame, one after another, and a helix."""

import re
from dataclasses import replace

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tracing.drawing import Drawing
from inhand.tracing.drawings import find_drawing

PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""Axes of the palm frame along which a drawing's x and y lie, by the plane's name: right and out as in the plane, right
and up, out and up."""
WINDINGS, POINTS = 2, 48
"""How often a helix goes round, and points of one time round."""
HELIX = "helix"
"""A line round the normal of its plane, as high as it is wide."""


def find_spatial_drawing(text: str) -> Drawing:
    """Return the drawing that a text names, whose way-points are places and rotation vectors `(N, 6)`.

    Args:
        text: a drawing of the plane or `helix`, with the plane that it lies in after an @, `xy` where none is given:
            `A@xz`; drawings that follow each other, each about the object's start, are joined by +: `A@xy+B@xz`.

    Raises:
        InputError: no such drawing or plane, or drawings with and without a size are joined.
    """
    parts = [_part(word) for word in text.split("+")]
    if len({part.sized for part in parts}) > 1:
        raise InputError(f"{text}: some of these drawings have a size of their own, others have not: join those alike")
    poses = np.concatenate([part.poses for part in parts])
    return Drawing(" + ".join(part.name for part in parts), poses, parts[0].sized)


def _part(text: str) -> Drawing:
    word, _, plane = text.strip().partition("@")
    plane = plane.lower() or "xy"
    if plane not in PLANES:
        raise InputError(f"{text!r}: unknown plane {plane!r}; allowed are {', '.join(PLANES)} of the palm frame")
    first, second = PLANES[plane]
    drawing = _helix() if word.lower() == HELIX else find_drawing(word)
    normal = np.cross(np.eye(3)[first], np.eye(3)[second])
    poses = np.zeros((len(drawing.poses), 6))
    poses[:, first], poses[:, second] = drawing.poses[:, 0], drawing.poses[:, 1]
    poses[:, 3:] = drawing.poses[:, -1:] * normal
    if len(drawing.poses[0]) > 3:
        poses[:, :3] += drawing.poses[:, 2:3] * normal
    shown = re.sub("^letter ", "", drawing.name)
    return replace(drawing, name=drawing.name if plane == "xy" else f"{shown} in {plane}", poses=poses)


def _helix() -> Drawing:
    """Return a helix of size 1 in x, y, z, theta `(N, 4)`, whose middle is at the origin."""
    share = np.linspace(0.0, 1.0, WINDINGS * POINTS + 1)
    angle: Array = 2 * np.pi * WINDINGS * share
    poses = np.stack([np.cos(angle) / 2, np.sin(angle) / 2, share - 0.5, 0 * share], axis=-1)
    return Drawing(HELIX, poses, sized=False)
