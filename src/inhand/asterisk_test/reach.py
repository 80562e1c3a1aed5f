"""Reach as a function: how far a hand could carry an object, whatever controls it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from inhand.asterisk_test.config import ReachCommand
from inhand.asterisk_test.reached import MARK, Reached
from inhand.asterisk_test.spatial.reach import (
    SpatialAsked,
    SpatialReach,
    kept_in_space,
    reach_in_space,
    ready_in_space,
)
from inhand.errors import InputError
from inhand.hands.files import assumed, load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.reach.limits import Farthest, ReachConfig
from inhand.hands.spatial.files import hand_name, is_spatial_hand, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.records import read_record
from inhand.shown import listed, saved
from inhand.tasks.primitives import Primitive, parse_directions
from inhand.tasks.reach import Limit, limits, start_grip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEFAULT = ReachCommand()
"""What is computed where nothing else is asked for."""


@dataclass(frozen=True, eq=False)
class Reach(Reached):
    """How far a hand could carry an object."""

    held: Held
    limits: tuple[Limit, ...]
    start: Farthest = field(kw_only=True)
    """A grip at the start."""

    @property
    def subtitle(self) -> str:
        """What was assumed."""
        turn = self.config.rotation_deg
        bound = f", rotation up to {turn:g} deg" if turn else ""
        return f"{self.held[0].name}, {self.held[1].name}, friction {self.friction:g}{bound}"

    @property
    def twists(self) -> tuple[float, ...]:
        """Twists that translations hold [deg]; none where everything only rotates."""
        return tuple(dict.fromkeys(f.primitive.rotation_deg for f in self.limits if f.primitive.angle_deg is not None))

    def entries(self) -> list[dict[str, Any]]:
        """Return the limits as the JSON has them, each with the last grip."""
        return [_entry(limit) for limit in self.limits]

    def figure(self, twist: float | None = None) -> Figure:
        """Return the workspace: the asterisk of the limits that hold a twist [deg], by default the first.

        Raises:
            InputError: there are only rotations.
        """
        from inhand.asterisk_test.reach_figure import reach_figure

        if not self.twists:
            raise InputError("only rotations were asked for, which have no workspace to draw: add a direction")
        chosen = self.twists[0] if twist is None else twist
        shown = [f for f in self.limits if f.primitive.angle_deg is not None and f.primitive.rotation_deg == chosen]
        title = f"Reach{f', holding {chosen:+g} deg' if chosen else ''} [mm]"
        return reach_figure(self.held, self.start, shown, title, self.subtitle)

    def figures(self) -> dict[str, Figure]:
        """Return the workspace for each twist by the name of its file."""
        return {_figure_name(twist): self.figure(twist) for twist in self.twists}

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.reach_browser import planar_rows, planar_views, reach_page

        return reach_page(self, planar_views(self.held, self.start, self.limits), planar_rows(self.limits))


def _figure_name(twist: float) -> str:
    return f"reach_{'p' if twist < 0 else 'm'}{abs(twist):g}.png" if twist else "reach.png"


@dataclass(frozen=True, eq=False)
class Asked:
    """What a reach is computed from, checked."""

    held: Held
    """The hand and the object."""
    assumed: ReachConfig
    """Resolution, friction and bound of rotation."""
    primitives: tuple[Primitive, ...]
    notes: tuple[str, ...]
    """What a reader should know, a sentence each."""


def reach(
    hand: str | Path | HandSpec | SpatialHand = DEFAULT.hand,
    object: str | Path | ObjectSpec | SolidSpec = DEFAULT.object,
    *,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    twist: float = DEFAULT.twist,
    friction: float | None = None,
    rotation_deg: float = DEFAULT.rotation_deg,
    resolution_mm: float = DEFAULT.resolution_mm,
    gravity: str | None = None,
) -> Reach | SpatialReach:
    """Return how far a hand could carry an object in each direction; nothing is written before `save`.

    Args:
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file, an outline (`part.dxf:unit=mm:mass_kg=0.05`) or a spec.
        directions: words of the command line, names, or degrees counter-clockwise from +x.
        twist: rotation to hold, each way [deg].
        friction: coefficient between finger and object; None for the product of both bodies'.
        rotation_deg: largest rotation away from the path's own [deg].
        resolution_mm: step along path and outline [mm].
        gravity: of a hand in space: up, down, sideways or three numbers; None for up.

    Raises:
        InputError: anything that cannot be computed; the text says what, and what is allowed.
    """
    config = ReachCommand(
        hand=hand_name(hand),
        object=object_name(object),
        directions=listed(directions),
        twist=twist,
        friction=friction,
        rotation_deg=rotation_deg,
        resolution_mm=resolution_mm,
        gravity=gravity,
    )
    return compute_reach(config, ready_reach(config))


def ready_reach(config: ReachCommand) -> Asked | SpatialAsked:
    """Return what is asked for, looked at before anything is computed.

    Raises:
        InputError: anything in the configuration that cannot be computed.
    """
    if is_spatial_hand(config.hand):
        return ready_in_space(config)
    if config.gravity is not None:
        raise InputError(
            f"--gravity {config.gravity} with {config.hand}, a hand in the plane, whose object stands on a floor: leave"
            " it out, or use a hand in space (3f_60.60_40_10)"
        )
    held = Held(load_hand(config.hand), load_object(config.object))
    known = ReachConfig(
        resolution=config.resolution_mm / 1e3, friction=config.friction, rotation=np.deg2rad(config.rotation_deg)
    )
    primitives = parse_directions(config.directions, config.twist)
    check_fit(*held)
    return Asked(held, known, primitives, assumed([config.hand]))


def compute_reach(
    config: ReachCommand, asked: Asked | SpatialAsked, told: Callable[[str, int], None] | None = None
) -> Reach | SpatialReach:
    """Return the reach; `told` is told the name of each direction that is done, and how many there are.

    Raises:
        InputError: nothing holds the object at the start.
    """
    if isinstance(asked, SpatialAsked):
        return reach_in_space(config, asked, told)
    held, count = asked.held, len(asked.primitives)
    start = start_grip(*held, asked.assumed)
    tell = None if told is None else lambda name: told(name, count)
    return Reach(config, held, limits(*held, asked.primitives, asked.assumed, tell), asked.notes, start=start)


def load_reach(folder: Path) -> Reach | SpatialReach:
    """Return the reach of a folder as it was written.

    Raises:
        InputError: there is none that can be read.
    """
    config, content = saved(folder, MARK, ReachCommand, gravity=None)
    asked = ready_reach(config)
    try:
        if isinstance(asked, SpatialAsked):
            return kept_in_space(config, list(content.get("limits", ())))
        entries = [read_record(entry, _Entry) for entry in content.get("limits", ())]
    except InputError as error:
        raise InputError(f"{folder / MARK}: {error}; compute it again") from error
    if [entry.direction for entry in entries] != [primitive.name for primitive in asked.primitives]:
        raise InputError(
            f"{folder / MARK}: its limits are not those of the directions {config.directions}; compute it again"
        )
    found = tuple(entry.limit(primitive) for entry, primitive in zip(entries, asked.primitives, strict=True))
    return Reach(config, asked.held, found, asked.notes, start=start_grip(*asked.held, asked.assumed))


@dataclass(frozen=True)
class _Entry:
    direction: str
    angle_deg: float | None
    rotation_deg: float
    way_mm: float
    limit_mm: float | None
    limit_deg: float | None
    end_pose_mm_deg: tuple[float, float, float]
    end_contacts_mm: tuple[tuple[float, float], ...]
    end_joints_deg: tuple[float, ...]

    def limit(self, primitive: Primitive) -> Limit:
        """Return it as it was computed."""
        *place, turn = self.end_pose_mm_deg
        pose, contacts = np.array([*place, 0.0]) / 1e3, np.array(self.end_contacts_mm) / 1e3
        pose[2] = np.deg2rad(turn)
        end = Farthest(self.way_mm / 1e3, pose, np.deg2rad(self.end_joints_deg), contacts)
        far = np.deg2rad(self.limit_deg or 0.0) if self.limit_mm is None else self.limit_mm / 1e3
        return Limit(primitive, float(far), end)


def _entry(limit: Limit) -> dict[str, Any]:
    """Return a limit as the JSON has it, with the last grip."""
    turns, end = limit.primitive.angle_deg is None, limit.end
    return {
        "direction": limit.primitive.name,
        "angle_deg": limit.primitive.angle_deg,
        "rotation_deg": limit.primitive.rotation_deg,
        "way_mm": 1e3 * end.way,
        "limit_mm": None if turns else 1e3 * limit.distance,
        "limit_deg": float(np.rad2deg(limit.distance)) if turns else None,
        "end_pose_mm_deg": [*(1e3 * end.pose[:2]).tolist(), float(np.rad2deg(end.pose[2]))],
        "end_contacts_mm": (1e3 * end.contacts).tolist(),
        "end_joints_deg": np.rad2deg(end.joints).tolist(),
    }
