"""Learning curves: rewards and losses over the episodes (thesis figures 4.7 to 4.9), and what evaluations reached."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from inhand.geometry import Array
from inhand.learning.progress import Evaluated, Group, Learned
from inhand.plots.sheet import sheet
from inhand.plots.style import INK, MUTED, RULE, TICK_POINTS, direction_colour, series_look
from inhand.tasks.primitives import TRAIN, UNSEEN

SMOOTHING = 0.7
"""How much of the smoothed value before is left in the next (thesis 4.2)."""
MOST_POINTS = 400
"""Longer records are smoothed over means of neighbouring points: this many of them fit a figure."""
SHOWN_SHARE = 2.0
"""Raw values below this percentile and above the one as far from the top may lie outside the axes."""
WIDE = 100.0
"""Losses whose largest values are this many times their small ones are drawn over a logarithmic axis."""
LEAST = -0.1
"""Shares of the limit below this are drawn at it: objects that went backwards would press all others together."""
LOST = "#c1121f"
"""Lost objects."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One quantity over the episodes."""

    title: str
    """What it is, written above."""
    unit: str
    """The label of its axis."""
    episodes: Array
    """Episodes `(N,)`."""
    numbers: Array
    """Its values `(N,)`; those that are not finite are left out."""
    end: float
    """The last episode."""
    wide: bool = False
    """Whether its axis may be logarithmic."""


def smoothed(values: Array, weight: float = SMOOTHING) -> Array:
    """Return values `(N,)` smoothed as TensorBoard does: exponentially, without pull towards zero at the start."""
    return pd.Series(values).ewm(alpha=1.0 - weight).mean().to_numpy()


def spread(at: Array, end: float) -> Array:
    """Return the episodes of rounds `(M,)`, those between two ends of episodes spread evenly, up to the last episode.

    Worlds that run side by side end side by side, so that many rounds in a row have the same count of episodes.
    """
    ends, first, count = np.unique(at, return_index=True, return_counts=True)
    step = (np.append(ends[1:], max(end, at[-1] if len(at) else 0.0)) - ends) / np.maximum(count, 1)
    number = np.arange(len(at)) - np.repeat(first, count)
    return np.asarray(np.repeat(ends, count) + number * np.repeat(step, count))


def shown_range(raw: Array, smooth: Array) -> tuple[float, float]:
    """Return the ends of an axis that shows the smoothed values whole, and the raw ones but for their outliers."""
    low, high = np.percentile(raw, [SHOWN_SHARE, 100.0 - SHOWN_SHARE])
    low, high = float(min(low, smooth.min())), float(max(high, smooth.max()))
    margin = 0.06 * (high - low) or 0.5 * max(abs(high), 1e-3)
    return low - margin, high + margin


def curves_of(found: Learned) -> list[Curve]:
    """Return rewards and losses over the episodes; no losses where nothing was learned."""
    count = len(found.total)
    episodes, rounds = np.arange(1.0, count + 1.0), spread(found.at, float(count))
    curves = [
        Curve("Sum of the rewards", "return", episodes, found.total, count),
        Curve("Last reward of an episode", "reward", episodes, found.last, count),
        Curve("Loss of the critic", "loss", rounds, found.critic_loss, count, wide=True),
        Curve("Loss of the actor", "loss", rounds, found.actor_loss, count, wide=True),
    ]
    return curves if len(rounds) else curves[:2]


def learning_figure(found: Learned, title: str = "", subtitle: str = "") -> Figure:
    """Return the figure of rewards and losses over the episodes (thesis figures 4.7 to 4.9)."""
    curves = curves_of(found)
    handles = [
        Line2D([], [], color=INK, linewidth=1.8, label=f"smoothed by {SMOOTHING:g}"),
        Line2D([], [], color=INK, linewidth=0.6, marker=".", markersize=3, alpha=0.35, label="as recorded"),
    ]
    rows = [[(3.6, 1.95)] * 2] * (len(curves) // 2)
    with sheet(rows, title, subtitle, gap=(1.1, 0.85), below=[handles]) as (figure, axes):
        for number, (ax, curve) in enumerate(zip(axes, curves, strict=True)):
            draw_curve(ax, curve, series_look(number).colour)
    return figure


def draw_curve(ax: Axes, curve: Curve, colour: str) -> None:
    """Draw a quantity as recorded, faintly, and smoothed; outliers outside the axes are counted above them."""
    ax.set(xlabel="episode", ylabel=curve.unit)
    ax.set_title(curve.title, loc="left")
    finite = np.isfinite(curve.numbers)
    at, values = curve.episodes[finite], curve.numbers[finite]
    if len(values) == 0:
        ax.text(0.5, 0.5, "nothing recorded", transform=ax.transAxes, ha="center", color=MUTED)
        return
    places, means = thinned(at, values)
    smooth = smoothed(means)
    if len(places) < len(values):
        ax.plot(at, values, color=colour, linestyle="none", marker=".", markersize=1.8, alpha=0.3, zorder=2.0)
    else:
        ax.plot(at, values, color=colour, linewidth=0.6, alpha=0.35, zorder=2.0)
    ax.plot(places, smooth, color=colour, linewidth=1.8, zorder=3.0)
    if curve.wide and _scaled(ax, values):
        ax.margins(y=0.06)
    else:
        low, high = shown_range(values, smooth)
        ax.set_ylim(low, high)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.5g}".replace("-", "\N{MINUS SIGN}")))
        _count_outliers(ax, int(((values < low) | (values > high)).sum()), len(values))
    ax.set_xlim(0, max(curve.end, float(at[-1]), 1.0))
    ax.xaxis.set_major_locator(MaxNLocator(5, integer=True))


def progress_figure(found: Learned, title: str = "", subtitle: str = "") -> Figure:
    """Return the figure of what evaluations reached: return, share of the hand's limit, and lost objects."""
    groups = found.groups
    handles = [
        Line2D([], [], color=look.colour, marker=look.marker, markersize=4, linewidth=1.6, label=group.counted)
        for look, group in zip(map(series_look, range(len(groups))), groups, strict=True)
    ]
    handles.append(Line2D([], [], color=MUTED, linestyle="--", linewidth=1.1, label="the expert"))
    handles.append(Line2D([], [], color=RULE, linewidth=1.1, label="best policy"))
    with sheet([[(2.4, 2.15)] * 3], title, subtitle, gap=(0.75, 0.0), below=[handles]) as (figure, axes):
        for number, group in enumerate(found.groups):
            _draw_group(axes, found.evaluations, group, number)
        _dress_progress(axes, found)
    return figure


def directions_figure(found: Learned, title: str = "", subtitle: str = "") -> Figure:
    """Return the figure of the share of the hand's limit over the episodes, one small plot for each direction."""
    names = found.names
    fractions = [each.directions[name].fraction for each in found.evaluations for name in names]
    ends = (LEAST if min(fractions) < LEAST else min(0.0, *fractions)) - 0.06, max(1.12, *fractions)
    rows = [[(1.95, 1.2)] * len(names[first : first + 4]) for first in range(0, len(names), 4)]
    handles = _direction_handles(found, low=min(fractions) < LEAST)
    with sheet(rows, title, subtitle, gap=(0.2, 0.42), below=[handles]) as (figure, axes):
        for number, (ax, name) in enumerate(zip(axes, names, strict=True)):
            _draw_direction(ax, found, name)
            left, lowest = number % 4 == 0, number + 4 >= len(names)
            ax.set(ylim=ends, xlabel="episode" if lowest else "", ylabel="of limit" if left else "")
            ax.tick_params(labelleft=left, labelbottom=lowest)
    return figure


def _direction_handles(found: Learned, *, low: bool) -> list[Artist]:
    """Return the legend of the directions; only what is drawn."""
    handles: list[Artist] = [Line2D([], [], color=INK, marker="o", markersize=3, linewidth=1.6, label="policy")]
    if np.isfinite([reached.expert_fraction for reached in found.best.directions.values()]).any():
        handles.append(Line2D([], [], color=INK, linestyle="--", linewidth=1.1, label="the expert"))
    handles += [
        Line2D([], [], color=MUTED, linewidth=0.9, label="the hand's limit"),
        Line2D([], [], color=RULE, linewidth=1.1, label="best policy, and its share"),
        Line2D([], [], color=LOST, marker="x", linestyle="none", label="some trials lost the object"),
    ]
    if low:
        handles.append(Line2D([], [], color=INK, marker="v", linestyle="none", markersize=5, label="lower still"))
    return handles


def thinned(at: Array, values: Array) -> tuple[Array, Array]:
    """Return places and means of neighbouring values, so many that a figure shows them apart."""
    each = -(-len(values) // MOST_POINTS)
    cuts = np.arange(0, len(values), each)
    counts = np.diff(np.append(cuts, len(values)))
    return np.add.reduceat(at, cuts) / counts, np.add.reduceat(values, cuts) / counts


def _scaled(ax: Axes, values: Array) -> bool:
    """Give an axis of values over many orders of magnitude a logarithmic scale; return whether it has one."""
    sizes = np.abs(values)
    usual = float(np.percentile(sizes, SHOWN_SHARE))
    if usual <= 0 or sizes.max() < WIDE * usual:
        return False
    if values.min() > 0:
        ax.set_yscale("log")
    else:
        ax.set_yscale("symlog", linthresh=float(10.0 ** np.floor(np.log10(usual))))
    return True


def _count_outliers(ax: Axes, outside: int, count: int) -> None:
    if outside:
        text = ax.text(0.99, 1.02, f"{outside} of {count} outside", transform=ax.transAxes, ha="right", va="bottom")
        text.set(fontsize=TICK_POINTS - 1, color=MUTED)


def colour_of(name: str) -> str:
    """Return the colour of a direction: of the plane that of its angle."""
    angles = {each.name: each.angle_deg or 0.0 for each in (*TRAIN, *UNSEEN)}
    return direction_colour(angles[name]) if name in angles else INK


def _draw_group(axes: Sequence[Axes], evaluations: Sequence[Evaluated], group: Group, number: int) -> None:
    """Draw a group of directions: mean return and the expert's, mean share of the limit, lost objects."""
    look, at = series_look(number), [each.episode for each in evaluations]
    reached = [each.over(group.names) for each in evaluations]
    values = (
        [each.total for each in reached],
        [each.fraction for each in reached],
        [100.0 * each.dropped / each.trials for each in reached],
    )
    for ax, drawn in zip(axes, values, strict=True):
        ax.plot(at, drawn, color=look.colour, marker=look.marker, markersize=3.5, linewidth=1.6, zorder=3.0 + number)
    for ax, level in zip(axes, (reached[-1].expert_total, reached[-1].expert_fraction), strict=False):
        if np.isfinite(level):
            ax.axhline(level, color=look.colour, linewidth=1.1, linestyle="--", alpha=0.8, zorder=2.0)


def _dress_progress(axes: Sequence[Axes], found: Learned) -> None:
    names = (("Return", "mean return"), ("Distance", "share of the hand's limit"), ("Lost objects", "trials lost [%]"))
    last = max(found.evaluations[-1].episode, 1)
    for ax, (title, unit) in zip(axes, names, strict=True):
        ax.set(xlabel="episode", ylabel=unit, xlim=(-0.03 * last, 1.03 * last))
        ax.set_title(title, loc="left")
        ax.xaxis.set_major_locator(MaxNLocator(4, integer=True))
        ax.axvline(found.best.episode, color=RULE, linewidth=1.1, zorder=1.0)
    bottom, top = axes[0].get_ylim()
    bottom, top = min(bottom, 0.0), max(top, 0.0)
    axes[0].set_ylim(bottom - 0.05 * (top - bottom) * (bottom < 0), top + 0.05 * (top - bottom) * (top > 0))
    axes[1].axhline(1.0, color=MUTED, linewidth=0.9, zorder=1.5)
    low, high = axes[1].get_ylim()
    axes[1].set_ylim(min(low, 0.0), max(high, 1.05))
    most = max(axes[2].get_ylim()[1], 10.0)
    axes[2].set_ylim(-0.03 * most, most)


def _draw_direction(ax: Axes, found: Learned, name: str) -> None:
    """Draw one direction: the share of its limit, the limit, the expert's share if known, and lost objects."""
    colour, best = colour_of(name), found.best
    at = np.array([each.episode for each in found.evaluations])
    reached = [each.directions[name] for each in found.evaluations]
    fraction = np.array([each.fraction for each in reached])
    shown, lost = np.maximum(fraction, LEAST), np.array([each.dropped > 0 for each in reached])
    ax.axvline(best.episode, color=RULE, linewidth=1.1, zorder=1.0)
    ax.axhline(1.0, color=MUTED, linewidth=0.9, zorder=1.5)
    if np.isfinite(reached[-1].expert_fraction):
        ax.axhline(reached[-1].expert_fraction, color=INK, linewidth=1.1, linestyle="--", zorder=2.0)
    ax.plot(at, shown, color=colour, marker="o", markersize=2.6, linewidth=1.6, zorder=3.0)
    ax.plot(at[shown > fraction], shown[shown > fraction], color=colour, marker="v", markersize=6, linestyle="none")
    ax.plot(at[lost], shown[lost], color=LOST, marker="x", markersize=6, linestyle="none", zorder=4.0)
    ax.set_title(name, loc="left", fontsize=TICK_POINTS, pad=3)
    share = ax.set_title(f"{best.directions[name].fraction:.2f}", loc="right", pad=3)
    share.set(fontsize=TICK_POINTS, fontweight="normal", color=MUTED)
    ax.set_xlim(-0.04 * max(at[-1], 1), 1.04 * max(at[-1], 1))
    ax.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    ax.set_yticks([0.0, 0.5, 1.0])
