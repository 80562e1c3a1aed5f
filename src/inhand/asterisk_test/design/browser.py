"""The page of a design study for a browser: the front, and how far the winner could carry each object."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inhand.asterisk_test.design.asked import AIMS, Asked
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.figure import MOST_OBJECTS, label_of, scene_with
from inhand.asterisk_test.design.found import Found
from inhand.asterisk_test.design.looked import Looked
from inhand.geometry import Array, unit
from inhand.hands.hand import HandSpec
from inhand.pages import Part, spread
from inhand.plots.curves import PathCurve
from inhand.plots.page.charts import Axis, Chart, Charts, Line, Symbol, numbers
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import Star, View, panels_of

HINT = "Point at a direction for its numbers."
COMPARED = "First the winner, then the best of the catalogue."


def design_page(parts: Sequence[Part], config: DesignConfig, found: Found) -> str:
    """Return the page of a study; its parts are those without figures."""
    title, intro, answer, *rest = parts
    return html_of("A design study", [title, intro, answer, _front(found), *_reach(found), *rest, settings_of(config)])


def _front(found: Found) -> View:
    """Return the first two aims of every hand; with one aim, the hands in their order."""
    asked = found.asked
    first, second = asked.aims[0], asked.aims[1] if len(asked.aims) > 1 else None

    def points(name: str, hands: Sequence[Looked], series: int, symbol: Symbol = "circle", size: float = 3.0) -> Line:
        x = numbers(each.aims[second] if second else max(each.number, 0) for each in hands)
        y = numbers(each.aims[first] for each in hands)
        names = tuple(label_of(each.hand) for each in hands)
        return Line(name, x, y, series, names=names, points=True, symbol=symbol, size=size)

    whole, given_up = ([each for each in found.looked if each.whole is state] for state in (True, False))
    known = [each for each in found.catalogue if not each.reasons]
    lines = [
        points("looked at", whole, 5),
        replace(points("given up early, estimated", given_up, 5), hollow=True),
        points("front", found.front, 0, size=4.5),
        points("catalogue", known, 1, "square"),
        points("winner", [found.winner.looked], 2, "diamond"),
    ]
    axis = Axis(AIMS[second].label if second else "hand of the study")
    shown = Chart("", axis, Axis(AIMS[first].label), tuple(each for each in lines if each.x), height=380, scatter=True)
    return View(
        "charts", Charts((shown,), "wide"), "Hands by their aims", "Every hand that was looked at, by its aims."
    )


def _reach(found: Found) -> list[View]:
    """Return how far the winner and the best of the catalogue could carry the first objects, as asterisks."""
    asked = found.asked
    around = [k for k, each in enumerate(asked.primitives) if each.angle_deg is not None and each.path is None]
    objects = range(min(len(asked.objects), MOST_OBJECTS)) if len(around) > 2 else range(0)
    hands = (found.winner.looked, found.known.looked)
    views = []
    for k in objects:
        others = [each.table[k, around] for each in reversed(hands)]
        stars = [
            _star(asked, (each.hand, k), around, (each.table[k, around], other))
            for each, other in zip(hands, others, strict=True)
        ]
        title = f"How far {asked.objects[k].name} could go [mm]"
        views.append(View("asterisks", panels_of(stars, HINT), title, COMPARED))
    return views


def _star(asked: Asked, held: tuple[HandSpec, int], around: Sequence[int], reach: tuple[Array, Array]) -> Star:
    """Return the reach of a hand with an object of a number, beside another's."""
    hand, thing = held
    curves, told = [], []
    for column, mine, its in zip(around, *reach, strict=True):
        primitive = asked.primitives[column]
        angle = primitive.angle_deg or 0.0
        points = np.stack([np.zeros(2), mine * unit(np.deg2rad(angle))])
        curves.append(PathCurve(angle, primitive.name, points, float(mine), limit_mm=float(mine)))
        told.append([f"{spread(mine)} mm; the other {spread(its)} mm ({mine - its:+z.1f})"])
    scene = replace(scene_with(hand, asked.objects[thing]), origin_mm=1e3 * hand.start_pose[:2])
    return Star(label_of(hand), f"mean {spread(float(reach[0].mean()))} mm", curves, told, scene)
