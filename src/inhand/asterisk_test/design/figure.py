"""What a study found, in one figure: the front, hands drawn to scale, where the winner gains and loses."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from inhand.asterisk_test.design.asked import AIMS, Asked
from inhand.asterisk_test.design.found import Found
from inhand.asterisk_test.design.looked import Looked
from inhand.errors import InputError
from inhand.geometry import Array, unit
from inhand.hands.hand import HandSpec
from inhand.hands.names import LAB_LIMITS_SUFFIX
from inhand.hands.objects import ObjectSpec
from inhand.plots.scenes import scene_of
from inhand.plots.shapes import (
    CLEAR,
    Extent,
    SceneOutline,
    draw_scene,
    extent_of,
    joined,
    scene_points,
    show_extent,
    square_of,
)
from inhand.plots.sheet import halo, sheet, write_above
from inhand.plots.style import INK, MUTED, SERIES_LOOKS, TICK_POINTS, darker
from inhand.tasks.reach import start_grip

FRONT_IN, HAND_IN, ROUND_IN = (4.0, 2.9), 2.45, 2.9
"""Size of the front, width of a drawn hand, side of an object's directions [in]."""
MOST_OBJECTS = 4
"""Objects that are drawn, at most."""
GAIN, LOSS, BOTH = "#9ed8b9", "#f2b78f", "#e8ebee"
"""Where the winner reaches farther, where the other does, and where both do."""
OURS, THEIRS = SERIES_LOOKS[0].colour, SERIES_LOOKS[5].colour
SCALE_MM = 50.0
"""Length of the scale below the hands [mm]."""
SCALE_ROOM_MM = 16.0
"""Room for it [mm]."""


def design_figure(found: Found) -> Figure:
    """Return the figure of a study."""
    asked, winner, known = found.asked, found.winner.looked, found.known.looked
    others = [each for each in found.front if each.number != winner.number]
    hands = [known, winner, *others[len(others) // 2 : len(others) // 2 + 1]]  # the last from the front's middle
    scenes = [scene_with(each.hand, *asked.objects) for each in hands]
    left, right, bottom, top = joined([extent_of(scene_points(scene), 5.0) for scene in scenes])
    extent = left, right, bottom - SCALE_ROOM_MM, top
    size = HAND_IN, HAND_IN * (extent[3] - extent[2]) / (extent[1] - extent[0])
    around = [k for k, each in enumerate(asked.primitives) if each.angle_deg is not None and each.path is None]
    objects = range(min(len(asked.objects), MOST_OBJECTS)) if len(around) > 2 else range(0)
    rows = [[FRONT_IN, *[size] * len(hands)], [(ROUND_IN, ROUND_IN)] * len(objects)]
    share = asked.mean(winner.table) / max(asked.mean(known.table), 1e-9) - 1
    title = f"{label_of(winner.hand)}: mean reach {100 * share:+.1f} % beside the best of the catalogue"
    with sheet(
        [row for row in rows if row], title, _subtitle(found), gap=(0.55, 0.95), below=[_keys()] if objects else []
    ) as (
        figure,
        axes,
    ):
        _draw_front(axes[0], found)
        for ax, each, scene in zip(axes[1:], hands, scenes, strict=False):
            _draw_hand(ax, each, scene, extent)
        for k, ax in zip(objects, axes[1 + len(hands) :], strict=True):
            _draw_directions(ax, asked, k, (winner.table[k, around], known.table[k, around]), around)
    return figure


def label_of(hand: HandSpec) -> str:
    """Return a hand's name, in short, and its numbers of links where the name does not tell them."""
    form, name = "v".join(str(len(finger.links)) for finger in hand.fingers), hand.name
    return name.replace(LAB_LIMITS_SUFFIX, " (lab)") if form in name else f"{name} ({form})"


def _subtitle(found: Found) -> str:
    asked, carried = found.asked, []
    for controller, ours in found.winner.means.items():
        if controller in found.known.means:
            carried.append(f"{controller} {ours:.1f} mm, there {found.known.means[controller]:.1f}")
    told = f"{', '.join(thing.name for thing in asked.objects)}; {len(asked.primitives)} directions"
    return f"{told}; in simulation {'; '.join(carried)}" if carried else told


def _keys() -> list[Patch | Line2D]:
    return [
        Line2D([], [], color=OURS, linewidth=1.6, label="the study's hand"),
        Line2D([], [], color=THEIRS, linewidth=1.3, linestyle="--", label="the best of the catalogue"),
        Patch(facecolor=GAIN, label="reached by the study's hand alone (numbers: its gain [mm])"),
        Patch(facecolor=LOSS, label="by the other alone"),
    ]


def _draw_front(ax: Axes, found: Found) -> None:
    """Draw the first two aims of every hand; with one aim, the hands in their order."""
    asked, front = found.asked, found.front
    first, second = asked.aims[0], asked.aims[1] if len(asked.aims) > 1 else None

    def places(hands: Sequence[Looked]) -> Array:
        return np.array([(each.aims[second] if second else each.number, each.aims[first]) for each in hands]).T

    for whole, fill in ((False, "none"), (True, "#8a949e")):
        hands = [each for each in found.looked if each.whole == whole]
        if hands:
            x, y = places(hands)
            ax.scatter(x, y, s=14, linewidth=0.7, zorder=2.0, facecolor=fill, edgecolor="#8a949e")
    x, y = places(sorted(front, key=lambda each: each.aims[second] if second else each.number))
    ax.plot(x, y, color=OURS, linewidth=1.2, marker="o", markersize=4, zorder=3.0)
    known = [each for each in found.catalogue if not each.reasons]  # those that hold all objects
    if known:
        x, y = places(known)
        ax.scatter(x if second else np.zeros(len(y)), y, s=26, marker="P", color=THEIRS, linewidth=0, zorder=3.5)
    x, y = places([found.winner.looked])
    ax.scatter(x, y, s=120, marker="*", color=OURS, edgecolor="white", linewidth=0.6, zorder=4.0)
    ax.set(xlabel=AIMS[second].label if second else "Hand of the study", ylabel=AIMS[first].label)
    write_above(ax, "Front", "star: winner; plus: catalogue; hollow: given up early, estimated")


def scene_with(hand: HandSpec, *things: ObjectSpec) -> SceneOutline:
    """Return a hand that holds the first object that it can at its start, or is open where it holds none."""
    for thing in things:
        try:
            start = start_grip(hand, thing)
        except InputError:
            continue
        return scene_of(hand, thing, start.joints, start.pose, np.zeros(2))
    return scene_of(hand, things[0], np.zeros(hand.n_joints), hand.start_pose, np.zeros(2))


def _draw_hand(ax: Axes, looked: Looked, scene: SceneOutline, extent: Extent) -> None:
    """Draw a hand to the scale of the others, and what it measures."""
    draw_scene(ax, scene, CLEAR)
    show_extent(ax, extent)
    hand = looked.hand
    ax.set(xlabel="", ylabel="")
    ax.set_axis_off()
    left, bottom = extent[0] + 4, extent[2] + 4
    ax.plot([left, left + SCALE_MM], [bottom, bottom], color=INK, linewidth=1.6)
    ax.text(left + SCALE_MM / 2, bottom + 2, f"{SCALE_MM:g} mm", ha="center", va="bottom", fontsize=TICK_POINTS - 1)
    links = [" + ".join(f"{1e3 * link:.4g}" for link in finger.links) for finger in hand.fingers]
    write_above(ax, label_of(hand), links[0] if links[0] == links[1] else " | ".join(links))
    sizes = (
        f"palm {1e3 * hand.palm_width:.4g}, links {1e3 * hand.link_width:.4g} wide, tips {1e3 * hand.tip_length:.3g}"
    )
    ax.text(extent[0], extent[2] - 2, f"{sizes} [mm]", va="top", color=MUTED)


def _draw_directions(ax: Axes, asked: Asked, thing: int, reach: tuple[Array, Array], columns: Sequence[int]) -> None:
    """Draw how far two hands could carry an object in each direction, and what the first one gains [mm]."""
    angles = np.array([asked.primitives[k].angle_deg for k in columns], dtype=float)
    order = np.argsort(angles % 360.0)
    turned = np.deg2rad(angles[order] % 360.0)
    ours, theirs = (each[order] for each in reach)
    fine = np.linspace(0.0, 2 * np.pi, 721)
    one, other = (star(turned, lengths, fine) for lengths in (ours, theirs))
    for lengths, colour in ((one, GAIN), (other, LOSS), (np.minimum(one, other), BOTH)):
        ax.fill(*(lengths[:, None] * unit(fine)).T, color=colour, linewidth=0, zorder=1.5)
    ax.plot(*(other[:, None] * unit(fine)).T, color=THEIRS, linewidth=1.3, linestyle="--", zorder=2.5)
    ax.plot(*(one[:, None] * unit(fine)).T, color=OURS, linewidth=1.6, zorder=3.0)
    for angle, mine, its in zip(turned, ours, theirs, strict=True):
        x, y = (max(mine, its) + 9.0) * unit(angle)
        text = ax.text(x, y, f"{mine - its:+z.0f}", ha="center", va="center", path_effects=halo(), zorder=4.0)
        text.set(fontsize=TICK_POINTS - 1, color=darker(GAIN if mine >= its else LOSS, 0.6))
    far = max(ours.max(), theirs.max()) + 16.0
    show_extent(ax, square_of(np.array([(-far, -far), (far, far)]), 0.0))
    ax.set(xlabel="", ylabel="")
    mean = [float(np.mean(each)) for each in (ours, theirs)]
    write_above(ax, asked.objects[thing].name, f"mean {mean[0]:.1f} mm, there {mean[1]:.1f} mm")


def star(angles: Array, lengths: Array, fine: Array) -> Array:
    """Return how far the polygon through tips reaches along directions.

    Args:
        angles: directions of the tips `(D,)`, growing [rad].
        lengths: their distances from the origin `(D,)`.
        fine: the directions `(N,)` that are asked for [rad].

    Returns:
        Distances `(N,)`; between two tips that lie half a turn apart or more, 0.
    """
    after = np.searchsorted(angles, fine, side="right") % len(angles)
    before = after - 1
    start, end = (fine - angles[before]) % (2 * np.pi), (angles[after] - fine) % (2 * np.pi)
    first, second = lengths[before], lengths[after]
    weight = first * np.sin(start) + second * np.sin(end)
    between = first * second * np.sin(start + end) / np.where(weight > 0, weight, 1.0)
    return np.where((start + end < np.pi - 1e-9) & (weight > 0), between, np.where(start == 0, first, 0.0))
