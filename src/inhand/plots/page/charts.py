"""Lines, heat maps and estimates of a page, as the scripts beside this take them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from inhand.geometry import Array
from inhand.plots.heatmap import WHOLE, HeatMap
from inhand.plots.intervals import Estimates

MOST_POINTS = 400
"""Points of a line; of more each second, third, ... is left out."""
Numbers: TypeAlias = tuple[float | None, ...]
Symbol: TypeAlias = Literal["circle", "square", "triangle", "diamond"]


@dataclass(frozen=True)
class Axis:
    """An axis of a chart."""

    label: str
    low: float | None = None
    """The least that it shows, or less where there is less,"""
    high: float | None = None
    """and the most."""
    around: float = 0.06
    """Room beyond both ends, as a share."""
    log: bool = False
    digits: int = 1
    """Digits behind the point of what stands beside the pointer."""


@dataclass(frozen=True)
class Line:
    """A line of a chart, or points alone."""

    name: str
    x: Numbers
    y: Numbers
    series: int = 0
    """Which of the page's colours it has."""
    low: Numbers | None = None
    """Where a band about it begins, and where it ends."""
    high: Numbers | None = None
    dashes: bool = False
    faint: bool = False
    """Whether it stands behind, and the pointer passes it over."""
    dots: bool = False
    points: bool = False
    """Whether points alone are drawn."""
    names: tuple[str, ...] | None = None
    """What each point is called, in a chart of points."""
    hollow: bool = False
    symbol: Symbol | None = None
    size: float | None = None
    """Radius of a point [px]."""
    colour: str | None = None


@dataclass(frozen=True)
class Level:
    """A dashed line across a chart."""

    y: float
    series: int = 5


@dataclass(frozen=True)
class Chart:
    """Lines over one axis."""

    title: str
    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    levels: tuple[Level, ...] = ()
    height: int = 230
    digits: int = 2
    """Digits behind the point of a value beside the pointer."""
    scatter: bool = False
    """Whether the pointer tells of the nearest point, and not of all lines."""
    legend: bool = False
    """Whether there is a legend for one line too."""


@dataclass(frozen=True)
class Charts:
    """Charts side by side."""

    charts: tuple[Chart, ...]
    size: Literal["", "small", "wide", "wider"] = ""


@dataclass(frozen=True)
class Heat:
    """A heat map."""

    title: str
    told: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    values: tuple[Numbers, ...]
    notes: tuple[tuple[str, ...], ...]
    top: float
    """The number of the deepest colour."""
    digits: int


@dataclass(frozen=True)
class Heats:
    """Heat maps, one below the other."""

    maps: tuple[Heat, ...]


@dataclass(frozen=True)
class Estimate:
    """An estimate and its interval."""

    name: str
    middle: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Listing:
    """Estimates of one series, a line each."""

    title: str
    told: str
    rows: tuple[Estimate, ...]


@dataclass(frozen=True)
class Intervals:
    """Lists of estimates on one scale."""

    panels: tuple[Listing, ...]
    low: float
    high: float


def numbers(values: Iterable[float] | Array) -> Numbers:
    """Return numbers rounded to six digits, None for those that are not finite."""
    return tuple(float(f"{value:.6g}") if np.isfinite(value) else None for value in values)


def line(name: str, x: Array, y: Array, series: int = 0, *, dashes: bool = False, faint: bool = False) -> Line:
    """Return a line through points `(N,)`, thinned where they are many."""
    step = max(1, -(-len(x) // MOST_POINTS))
    return Line(name, numbers(x[::step]), numbers(y[::step]), series, dashes=dashes, faint=faint)


def heat_of(heat: HeatMap, title: str, told: str) -> Heat:
    """Return a heat map as the page takes it."""
    return Heat(
        title,
        told,
        heat.rows,
        heat.columns,
        tuple(numbers(row) for row in heat.values),
        tuple(map(tuple, heat.notes)),
        heat.top,
        0 if heat.top >= WHOLE else 2,
    )


def listing_of(names: Sequence[str], estimates: Estimates) -> Listing:
    """Return named estimates of one series."""
    columns = (numbers(values) for values in (estimates.middle, estimates.low, estimates.high))
    return Listing(estimates.name, estimates.note, tuple(Estimate(*row) for row in zip(names, *columns, strict=True)))
