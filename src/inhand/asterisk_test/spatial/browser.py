"""What pages show of runs in space: distances in three planes, on maps and as bars, a replay that turns, tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.browser import HINT, told_of, told_of_all
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import by_direction
from inhand.asterisk_test.spatial.scenes import Drawn, drawn, limits_drawn
from inhand.control.replays import Shown
from inhand.control.spatial_replays import solid_replays
from inhand.pages import Part, Table, spread, table_of
from inhand.plots.curves import PathCurve
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.solids import Bars, Disc, Dot, Maps, Way, Ways
from inhand.plots.page.views import Star, View, panels_of
from inhand.plots.spatial_asterisk import AXES, HALVES, PLANES, SpatialCurve, colour_of, in_plane, on_half, on_map
from inhand.tasks.spatial.reach import SpatialLimit

KIND = "A run of the Asterisk Test in space"
TURNS = "var(--series-1)"
"""Colour of angles."""
HALF = "Half of all directions on each disc, which keeps areas: the palm's normal is in the middle. Numbers are "
RUN = (
    "Mean object paths of the directions that lie in a plane, and mean distances at the first loss of contact, or at"
    " the end [mm]. Thin outline: how far the hand could carry the object, whatever controls it.",
    f"{HALF}distances [mm], colours shares of the limit, dark at 0.5 to bright at 1; a red rim marks a lost object.",
    "Means up to the first loss of contact, of the hand's limit where it is known; click one to replay it below.",
)
"""What is told of planes, maps and bars of a run,"""
REACH = (
    "How far the hand could carry the object along each direction, whatever controls it [mm].",
    f"{HALF}limits [mm].",
    "",
)
"""and of a reach."""


@dataclass(frozen=True, eq=False)
class Group:
    """What is drawn of one of the runs that stand side by side."""

    name: str
    drawn: Drawn
    told: Mapping[str, Sequence[str]]
    """What stands beside the pointer, for each direction by its name."""


def spatial_page(parts: Sequence[Part], groups: Sequence[Beside], config: AsteriskConfig) -> str:
    """Return the page of a run.

    Args:
        parts: of its page, the figures left out.
        groups: the trials of runs beside it, and last its own.
        config: of the run.
    """
    title, intro, *told = parts
    shown = spatial_views(groups, [groups[-1], *groups[:-1]])
    return html_of(KIND, [title, intro, *shown, "## Results", *told, settings_of(config)])


def spatial_views(groups: Sequence[Beside], replayed: Sequence[Beside]) -> list[View]:
    """Return what of groups of trials is drawn, and the player of their trials in another order."""
    shown = [
        Shown(trial, group.name, told_of(result))
        for group in replayed
        for trial, result in zip(group.trials, group.results, strict=True)
    ]
    return [*direction_views([_group(each) for each in groups], RUN), *solid_replays(shown)]


def _group(group: Beside) -> Group:
    told = {name: told_of_all(results) for name, results in by_direction(group.results).items()}
    return Group(group.name, drawn(group.trials, group.results), told)


def direction_views(groups: Sequence[Group], told: tuple[str, str, str]) -> list[View]:
    """Return distances and angles of groups in planes, on maps and as bars, and what is told of each."""
    lists = [_bars(group, len(groups) > 1) for group in groups]
    bars = tuple(each for both in zip(*lists, strict=True) for each in both if each.curves)
    maps = _discs(groups)
    found = [View("maps", Maps(tuple(maps)), "Maps of directions", told[1])] if maps else []
    return [*_planes(groups, told[0]), *found, View("bars", Bars(bars), "Distances", told[2])]


def _planes(groups: Sequence[Group], told: str) -> list[View]:
    """Return the planes that have directions: of one group side by side, of several each with a panel for every one."""
    rows = [(f"{AXES[a][1]} and {AXES[b][1]}", [_star(group, (a, b)) for group in groups]) for a, b in PLANES]
    rows = [(name, stars) for name, stars in rows if any(star.curves for star in stars)]
    if len(groups) > 1:
        return [
            View("asterisks", panels_of(stars, HINT), name, told * (k == 0)) for k, (name, stars) in enumerate(rows)
        ]
    alone = [replace(star, title=name) for name, (star,) in rows]
    return [View("asterisks", panels_of(alone, HINT), "Planes", told)] if alone else []


def _star(group: Group, plane: tuple[int, int]) -> Star:
    curves = [_flat(curve, plane) for curve in group.drawn[0] if in_plane(curve, plane)]
    axes = ", ".join(" to ".join(AXES[axis]) for axis in plane)
    return Star(group.name, axes, curves, [group.told[curve.name] for curve in curves])


def _flat(curve: SpatialCurve, plane: tuple[int, int]) -> PathCurve:
    """Return a direction that lies in a plane as one of the plane."""
    a, b = plane
    angle = float(np.rad2deg(np.arctan2(curve.direction[b], curve.direction[a])))
    points = curve.points_mm[:, [a, b]]
    return PathCurve(angle, curve.name, points, curve.distance_mm, failed=curve.failed, limit_mm=curve.limit_mm)


def _discs(groups: Sequence[Group]) -> list[Disc]:
    """Return the maps of both halves of the sphere that have directions, those of one half side by side."""
    found = []
    for way, half in HALVES.items():
        for group in groups:
            dots = [_dot(curve, way, group.told[curve.name]) for curve in group.drawn[0] if on_half(curve, way)]
            title = f"{group.name}, {half}" if len(groups) > 1 else half
            found += [Disc(title, group.name, (*AXES[0], *AXES[1]), tuple(dots))] * bool(dots)
    return found


def _dot(curve: SpatialCurve, way: float, told: Sequence[str]) -> Dot:
    x, y = np.round(on_map(curve.direction, way), 4).tolist()
    return Dot(curve.name, x, y, curve.distance_mm, colour_of(curve), curve.failed, tuple(told))


def _bars(group: Group, several: bool) -> tuple[Ways, Ways]:
    curves, turns = group.drawn
    after = f", {group.name}" * several
    moves = tuple(Way(each.name, each.distance_mm, each.limit_mm) for each in curves)
    angles = tuple(Way(each.name, each.mean_deg, each.limit_deg, TURNS) for each in turns)
    return Ways(f"Distance [mm]{after}", moves, group.name), Ways(f"Angle [deg]{after}", angles, group.name)


def limit_views(name: str, limits: Sequence[SpatialLimit]) -> list[View]:
    """Return what of the limits of a hand is drawn."""
    curves, turns = limits_drawn(limits)
    told = {curve.name: [f"{curve.distance_mm:.1f} mm"] for curve in curves}
    return direction_views([Group(name, (curves, turns), told)], REACH)


def limit_rows(limits: Sequence[SpatialLimit]) -> Table:
    """Return the table of limits."""
    rows = []
    for limit in limits:
        turns = limit.primitive.direction is None
        far = np.rad2deg(limit.distance) if turns else 1e3 * limit.distance
        rows.append((limit.primitive.name, spread(far) + " deg" * turns))
    return table_of(("Direction", "Limit [mm]"), rows, "Limits")
