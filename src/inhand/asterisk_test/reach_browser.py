"""The page of a reach for a browser: how far the hand could carry the object, as asterisks and as a table."""

import shlex
from collections.abc import Sequence

import numpy as np

from inhand.asterisk_test.reach_figure import limit_curve
from inhand.asterisk_test.reached import Reached
from inhand.hands.fit import Held
from inhand.hands.reach.limits import Farthest
from inhand.pages import Table, again, listed, options, spread, table_of
from inhand.plots.page.document import WebPart, html_of, settings_of
from inhand.plots.page.views import Star, View, panels_of
from inhand.plots.scenes import scene_of
from inhand.tasks.reach import Limit

HINT = "Point at a direction for its limit."
TOLD = "How far the hand could carry the object along each direction, whatever controls it [mm]."


def reach_page(found: Reached, views: Sequence[View], table: Table) -> str:
    """Return the page of a reach with what is drawn of it, and the table of its limits."""
    hand, spec = found.held
    config = found.config
    command = shlex.join(["inhand", "reach", *options(config)])
    parts: list[WebPart] = [*views, table, listed(found.notes), again(command), settings_of(config)]
    return html_of("A reach", [f"# Reach of {hand.name} with {spec.name}", found.subtitle, *parts])


def planar_views(held: Held, start: Farthest, limits: Sequence[Limit]) -> list[View]:
    """Return the asterisks of limits, one for each twist, over the grip at the start."""
    moves = [limit for limit in limits if limit.primitive.angle_deg is not None]
    scene = scene_of(*held, start.joints, start.pose, start.pose[:2])
    views = []
    for twist in dict.fromkeys(limit.primitive.rotation_deg for limit in moves):
        mine = [limit for limit in moves if limit.primitive.rotation_deg == twist]
        curves = [limit_curve(limit, start.pose[:2]) for limit in mine]
        stars = [Star(held.hand.name, held.object.name, curves, [[f"{1e3 * e.distance:.1f} mm"] for e in mine], scene)]
        title = f"Reach, holding {twist:+g} deg" if twist else "Reach"
        views.append(View("asterisks", panels_of(stars, HINT), title, TOLD))
    return views


def planar_rows(limits: Sequence[Limit]) -> Table:
    """Return the table of limits, with the last pose of each."""
    rows = []
    for limit in limits:
        turns = limit.primitive.angle_deg is None
        far = np.rad2deg(limit.distance) if turns else 1e3 * limit.distance
        x, y = 1e3 * limit.end.pose[:2]
        turned = float(np.rad2deg(limit.end.pose[2]))
        rows.append((limit.primitive.name, spread(far) + " deg" * turns, spread(x), spread(y), spread(turned)))
    return table_of(("Direction", "Limit [mm]", "Last x [mm]", "Last y [mm]", "Last turn [deg]"), rows, "Limits")
