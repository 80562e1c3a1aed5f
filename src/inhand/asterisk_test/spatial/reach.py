"""Reach in space as a function: how far a hand could carry an object along every direction, whatever controls it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from inhand.asterisk_test.config import ReachCommand
from inhand.asterisk_test.reached import Reached
from inhand.errors import InputError
from inhand.hands.spatial.farthest import SpatialFarthest, SpatialReachConfig
from inhand.hands.spatial.files import load_solid, load_spatial_hand
from inhand.hands.spatial.fit import check_solid_fit
from inhand.hands.spatial.gravity import USUAL_PALM, gravity_of
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.records import read_record
from inhand.tasks.spatial.primitives import SpatialPrimitive, parse_spatial_directions
from inhand.tasks.spatial.reach import SpatialLimit, limits_in_space

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FINEST_MM = 0.5
"""A resolution in space is no finer [mm]: contacts are tried in tuples."""


@dataclass(frozen=True, eq=False)
class SpatialAsked:
    """What a reach in space is computed from, checked."""

    held: tuple[SpatialHand, SolidSpec]
    """The hand and the object."""
    gravity: Vector
    """Gravity in the palm frame [m/s^2]."""
    assumed: SpatialReachConfig
    """Resolution and friction."""
    primitives: tuple[SpatialPrimitive, ...]


@dataclass(frozen=True, eq=False)
class SpatialReach(Reached):
    """How far a hand in space could carry an object."""

    held: tuple[SpatialHand, SolidSpec]
    limits: tuple[SpatialLimit, ...]

    @property
    def subtitle(self) -> str:
        """What was assumed."""
        palm = self.config.gravity or USUAL_PALM
        return f"{self.held[0].name}, {self.held[1].name}, friction {self.friction:g}, gravity {palm}"

    def entries(self) -> list[dict[str, Any]]:
        """Return the limits as the JSON has them, each with the last grip."""
        return [_entry(limit) for limit in self.limits]

    def figure(self) -> Figure:
        """Return the limits in three planes, on maps of all directions, and of turns."""
        from inhand.asterisk_test.spatial.scenes import limits_drawn
        from inhand.plots.spatial_asterisk import spatial_figure

        return spatial_figure(*limits_drawn(self.limits), "Reach [mm, deg]", self.subtitle)

    def figures(self) -> dict[str, Figure]:
        """Return it by the name of its file."""
        return {"reach.png": self.figure()}

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.reach_browser import reach_page
        from inhand.asterisk_test.spatial.browser import limit_rows, limit_views

        return reach_page(self, limit_views(self.held[0].name, self.limits), limit_rows(self.limits))


def ready_in_space(config: ReachCommand) -> SpatialAsked:
    """Return what is asked for, looked at before anything is computed.

    Raises:
        InputError: anything in the configuration that cannot be computed.
    """
    held = load_spatial_hand(config.hand), load_solid(config.object)
    if config.rotation_deg:
        raise InputError(
            f"--rotation-deg {config.rotation_deg:g} with {config.hand}, a hand in space: a bound on rotation is of the"
            " plane; leave it out, and hold rotations as in Up@+x@15"
        )
    if not config.resolution_mm >= FINEST_MM:
        raise InputError(f"--resolution-mm {config.resolution_mm:g}: give {FINEST_MM:g} or more for a hand in space")
    if config.friction is not None and not 0 <= config.friction < np.inf:
        raise InputError(f"--friction {config.friction:g}: friction must be 0 or more")
    step = config.resolution_mm / 1e3
    assumed = SpatialReachConfig(3 * step, step, np.deg2rad(1.5 * config.resolution_mm), config.friction)
    primitives = parse_spatial_directions(config.directions, config.twist)
    gravity = gravity_of(config.gravity or USUAL_PALM)
    check_solid_fit(*held)
    return SpatialAsked(held, gravity, assumed, primitives)


def reach_in_space(
    config: ReachCommand, asked: SpatialAsked, told: Callable[[str, int], None] | None = None
) -> SpatialReach:
    """Return the reach; `told` is told the name of each direction that is done, and how many there are.

    Raises:
        InputError: nothing holds the object at the start.
    """
    count = len(asked.primitives)
    tell = None if told is None else lambda name: told(name, count)
    found = limits_in_space(asked.held, asked.primitives, np.array([asked.gravity]), asked.assumed, tell)
    return SpatialReach(config, asked.held, found)


def kept_in_space(config: ReachCommand, entries: list[Any]) -> SpatialReach:
    """Return the reach of a configuration and the entries of its JSON.

    Raises:
        InputError: they are not those of its directions.
    """
    asked = ready_in_space(config)
    read = [read_record(entry, _Entry) for entry in entries]
    if [entry.direction for entry in read] != [primitive.name for primitive in asked.primitives]:
        raise InputError(f"its limits are not those of the directions {config.directions}; compute it again")
    found = tuple(entry.limit(primitive) for entry, primitive in zip(read, asked.primitives, strict=True))
    return SpatialReach(config, asked.held, found)


@dataclass(frozen=True)
class _Entry:
    direction: str
    vector: tuple[float, float, float] | None
    rotation_deg: tuple[float, float, float]
    way_mm: float
    limit_mm: float | None
    limit_deg: float | None
    end_pose: tuple[float, ...]
    end_contacts_mm: tuple[tuple[float, float, float], ...]
    end_joints_deg: tuple[float, ...]

    def limit(self, primitive: SpatialPrimitive) -> SpatialLimit:
        """Return it as it was computed."""
        far = np.deg2rad(self.limit_deg or 0.0) if self.limit_mm is None else self.limit_mm / 1e3
        contacts, joints = np.array(self.end_contacts_mm) / 1e3, np.deg2rad(self.end_joints_deg)
        end = SpatialFarthest(self.way_mm / 1e3, np.array(self.end_pose), joints, contacts) if self.end_pose else None
        return SpatialLimit(primitive, float(far), end)


def _entry(limit: SpatialLimit) -> dict[str, Any]:
    """Return a limit as the JSON has it, with the last grip: its pose in m and as a quaternion w, x, y, z."""
    turns, end = limit.primitive.direction is None, limit.end
    return {
        "direction": limit.primitive.name,
        "vector": limit.primitive.direction,
        "rotation_deg": np.rad2deg(limit.primitive.rotation).tolist(),
        "way_mm": 1e3 * end.way if end else 0.0,
        "limit_mm": None if turns else 1e3 * limit.distance,
        "limit_deg": float(np.rad2deg(limit.distance)) if turns else None,
        "end_pose": end.pose.tolist() if end else [],
        "end_contacts_mm": (1e3 * end.contacts).tolist() if end else [],
        "end_joints_deg": np.rad2deg(end.joints).tolist() if end else [],
    }
