"""Names of hands in space, such as `3f_60.60_40_10`, and those kept in the catalogue."""

import re
from dataclasses import replace
from itertools import combinations

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array, unit
from inhand.hands.sizes import check_length
from inhand.hands.spatial.hand import Box, Link, Quaternion, SpatialFinger, SpatialHand, Vector, rod

FORM = "Nf_links_places_tip in mm, for example 3f_60.60_40_10"
STANDARD = "3f_60.60_40_10"
"""The hand that the figures of this project are told of."""
CATALOGUE = (
    STANDARD,
    "3f_70.50_40_10",
    "3f_50.70_40_10",
    "3f_60.60_2v1.40.80_10",
    "3f_45.45.30_40_10",
    "4f_60.60_40_10",
)
"""Hands that `inhand hands` lists; any other name of the form is a hand too."""

MOST_FINGERS, MOST_LINKS = 6, 5
SPREAD, PROXIMAL, DISTAL = (-1.05, 1.05), (-1.4, 1.6), (-0.2, 2.3)
"""Limits of the abduction, of the first and of every other flexion [rad]: guessed, those of common robot hands."""
LINK_RADIUS = 0.007
"""Radius of the links' capsules [m], guessed: slimmer than the tip."""
LINK_MASS, HINGE_MASS, TIP_MASS = 0.025, 0.0125, 0.004
"""Masses of a link, of the abduction's hinge and of a fingertip [kg], guessed."""
START = 85 / 120
"""Height of the object at its start over the length of the fingers."""
RIM = 0.01
"""How far the palm reaches beyond the fingers' bases, and half its thickness [m], guessed."""
SUNK = 0.002
"""How far the palm's surface lies below the first hinges [m], guessed."""

_NUMBER = r"[0-9]+(?:\.[0-9]+)?"
_HEAD = re.compile(r"([0-9]+)f")
_ROWS = re.compile(r"([0-9])v([0-9])((?:\.[0-9]+){2})")
_PLACES = re.compile(r"[0-9]+(?:\.[0-9]+)*")


def is_spatial(name: str) -> bool:
    """Return whether a text has the beginning of the name of a hand in space."""
    return _HEAD.fullmatch(name.partition("_")[0]) is not None


def parse_spatial_name(name: str) -> SpatialHand:
    """Return the hand in space that a name describes.

    The parts are the number of fingers; the links of every finger in mm joined by dots, each finger with an abduction
    before them; where the fingers stand; and the radius of the tips in mm (10 where it is left out). Fingers stand

    * on a circle round the palm's middle: its radius in mm, evenly from the top on, or with angles in degrees
      counter-clockwise from +x, one a finger (`40.60.120.270`); they bend towards the middle;
    * or in two rows that face each other: `2v1.40.80` are two fingers 40 mm apart against one, the rows 80 mm apart.

    Raises:
        InputError: the name has not this form; the text says which part is wrong.
    """
    parts = name.split("_")
    head = _HEAD.fullmatch(parts[0])
    if head is None or len(parts) not in {3, 4}:
        near = near_matches(name, CATALOGUE)
        raise InputError(
            f"unknown hand {name!r}: the name of a hand in space has three or four parts joined by underscores, {FORM},"
            f" and this one has {len(parts)}{near}"
        )
    count = int(head[1])
    if not 2 <= count <= MOST_FINGERS:
        raise _wrong(name, parts[0], f"is not a number of fingers from 2f to {MOST_FINGERS}f")
    links = _lengths(name, parts[1])
    tip = float(parts[3]) / 1e3 if len(parts) == 4 and re.fullmatch(_NUMBER, parts[3]) else 0.01
    if len(parts) == 4 and not re.fullmatch(_NUMBER, parts[3]):
        raise _wrong(name, parts[3], "is not the radius of the fingertips in mm, such as 10")
    check_length(f"hand {name!r}: the radius of its fingertips", tip)
    bases = _bases(name, parts[2], count)
    _check_apart(name, parts[2], np.array([place for place, _ in bases]))
    fingers = tuple(_finger(f"finger {k + 1}", base, links, tip) for k, base in enumerate(bases))
    reach = np.abs([place for place, _ in bases]).max(axis=0) + RIM
    palm = Box((0.0, 0.0, -SUNK - RIM), (float(reach[0]), float(reach[1]), RIM))
    return SpatialHand(name, fingers, palm, (0.0, 0.0, START * sum(links)))


def _finger(name: str, base: tuple[tuple[float, float], float], links: tuple[float, ...], tip: float) -> SpatialFinger:
    """Return a finger that bends along a heading [rad] from +x: about x it spreads, about y it bends."""
    (x, y), heading = base
    turn: Quaternion = (float(np.cos(heading / 2)), 0.0, 0.0, float(np.sin(heading / 2)))
    hinge = Link((x, y, 0.0), (1.0, 0.0, 0.0), SPREAD, turn, mass=HINGE_MASS)
    parts, offset = [hinge], 0.0
    for k, length in enumerate(links):
        last = k == len(links) - 1
        body = rod(length, LINK_RADIUS, LINK_MASS, (tip, TIP_MASS) if last else (0.0, 0.0))
        origin: Vector = (0.0, 0.0, offset)
        parts.append(replace(body, origin=origin, limits=DISTAL if k else PROXIMAL))
        offset = length
    return SpatialFinger(name, tuple(parts), (0.0, 0.0, offset), tip)


def _lengths(name: str, part: str) -> tuple[float, ...]:
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)*", part):
        raise _wrong(name, part, "is not lengths of links in whole mm joined by dots, such as 60.60")
    links = tuple(int(length) / 1e3 for length in part.split("."))
    if len(links) > MOST_LINKS:
        raise _wrong(name, part, f"has {len(links)} links; a finger has at most {MOST_LINKS}")
    for length in links:
        check_length(f"hand {name!r}: a link", length)
    return links


def _bases(name: str, part: str, count: int) -> list[tuple[tuple[float, float], float]]:
    """Return where each finger stands [m] and along which heading it bends [rad]."""
    rows = _ROWS.fullmatch(part)
    if rows is not None:
        apart, across = (int(number) / 1e3 for number in rows[3].split(".")[1:])
        if int(rows[1]) + int(rows[2]) != count or "0" in rows.groups():
            raise _wrong(
                name,
                part,
                f"places {rows[1]} against {rows[2]} fingers, and {name.partition('_')[0]!r} asks for {count}",
            )
        upper = [((x, across / 2), -np.pi / 2) for x in _row(int(rows[1]), apart)]
        return upper + [((x, -across / 2), np.pi / 2) for x in _row(int(rows[2]), apart)]
    if not _PLACES.fullmatch(part):
        raise _wrong(
            name,
            part,
            "is not where fingers stand: a radius in mm such as 40, with angles in degrees as"
            " 40.60.120.270, or two rows as 2v1.40.80",
        )
    radius, *degrees = (float(number) for number in part.split("."))
    angles = np.deg2rad(degrees or [90.0 + 360.0 * k / count for k in range(count)])
    if len(angles) != count:
        raise _wrong(name, part, f"has {len(angles)} angles, and {name.partition('_')[0]!r} asks for {count}")
    check_length(f"hand {name!r}: the radius of the circle of its fingers", radius / 1e3)
    places = radius / 1e3 * unit(angles)
    return [((float(x), float(y)), float(angle + np.pi)) for (x, y), angle in zip(places, angles, strict=True)]


def _check_apart(name: str, part: str, places: Array) -> None:
    """Refuse fingers at places `(F, 2)` [m] where their links would be in each other."""
    for one, other in combinations(range(len(places)), 2):
        apart = float(np.linalg.norm(places[one] - places[other]))
        if apart < 2 * LINK_RADIUS:
            why = f"places fingers {one + 1} and {other + 1} {1e3 * apart:.1f} mm apart; links are"
            raise _wrong(name, part, f"{why} {2e3 * LINK_RADIUS:g} mm thick")


def _row(count: int, apart: float) -> list[float]:
    return [(k - (count - 1) / 2) * apart for k in range(count)]


def _wrong(name: str, part: str, why: str) -> InputError:
    return InputError(f"malformed hand name {name!r}: {part!r} {why}; the form is {FORM}")
