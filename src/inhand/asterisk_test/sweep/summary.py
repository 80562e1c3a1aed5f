"""What a sweep found: one case for each hand, object and direction, and the means that compare hands."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from inhand.asterisk_test.sweep.cells import CellFile
from inhand.control.trial import KEPT
from inhand.geometry import Array
from inhand.tasks.primitives import Primitive


@dataclass(frozen=True)
class Case:
    """One hand with one object along one direction, over its trials."""

    hand: str
    """Name of the hand."""
    object: str
    """Name of the object."""
    direction: str
    """Name of the primitive."""
    rotates: bool
    """Whether it only rotates; then what was reached and the limit are in degrees."""
    reached: float
    """Mean counted distance [mm] or angle [deg]."""
    limit: float
    """How far the hand could carry or turn the object [mm or deg]."""
    failures: tuple[str, ...]
    """How trials ended that did not keep the object, one text each."""

    @property
    def fraction(self) -> float:
        """What was reached as a share of the limit; NaN where the limit leaves nothing to reach."""
        return self.reached / self.limit if self.limit else float("nan")

    @property
    def kept(self) -> bool:
        """Whether every trial carried the object and had both fingers on it at the end."""
        return not self.failures


@dataclass(frozen=True)
class Cell:
    """One hand with one object."""

    hand: str
    """Name of the hand."""
    object: str
    """Name of the object."""
    reason: str | None
    """Why it could not be run, None where it ran."""
    seconds: float
    """How long it took [s]."""
    cpu_seconds: float
    """Processor time it took [s]."""
    cases: tuple[Case, ...]
    """Its directions."""


@dataclass(frozen=True)
class Sweep:
    """All cells of a sweep."""

    hands: tuple[str, ...]
    """Names of the hands, in the order asked for."""
    objects: tuple[str, ...]
    """Names of the objects."""
    directions: tuple[str, ...]
    """Names of the directions."""
    cells: tuple[Cell, ...]
    """Every hand with every object."""

    @property
    def cases(self) -> tuple[Case, ...]:
        """Every direction of every cell that ran."""
        return tuple(case for cell in self.cells for case in cell.cases)


def sweep_of(contents: Iterable[CellFile], primitives: Sequence[Primitive]) -> Sweep:
    """Return the sweep that the contents of its cells' files make up, directions clockwise from Out, turns last."""
    directions = [each.name for each in sorted(primitives, key=_clockwise)]
    cells = tuple(_cell(content) for content in contents)
    hands, objects = (tuple(dict.fromkeys(names)) for names in zip(*((c.hand, c.object) for c in cells), strict=True))
    return Sweep(hands, objects, tuple(directions), cells)


def median_fraction(cases: Iterable[Case]) -> float:
    """Return the median share of the limit over cases; NaN where none has one."""
    known = _known(case.fraction for case in cases)
    return float(np.median(known)) if len(known) else float("nan")


def mean_fraction(cases: Iterable[Case]) -> float:
    """Return the mean share of the limit over cases; NaN where none has one."""
    known = _known(case.fraction for case in cases)
    return float(known.mean()) if len(known) else float("nan")


def least_fraction(cases: Iterable[Case]) -> float:
    """Return the least share of the limit over cases; NaN where none has one."""
    return float(min(_known(case.fraction for case in cases), default=float("nan")))


def kept_share(cases: Sequence[Case]) -> float:
    """Return the share of cases that kept the object; NaN where there is none."""
    return float(np.mean([case.kept for case in cases])) if cases else float("nan")


def mean_reached(cases: Sequence[Case], out_of: int) -> float:
    """Return what was reached on average, cases that could not be run counting as nothing.

    Args:
        cases: those that ran, either translations [mm] or rotations [deg].
        out_of: how many there would be if every one had run.
    """
    return sum(case.reached for case in cases) / out_of if out_of else float("nan")


def comparable(cases: Sequence[Case]) -> list[Case]:
    """Return the translations among cases, or all where all rotate: mm and degrees have no common mean."""
    return [case for case in cases if not case.rotates] or list(cases)


def grouped(cases: Iterable[Case], key: Callable[[Case], str]) -> dict[str, list[Case]]:
    """Return cases by a name, such as that of their hand."""
    groups: dict[str, list[Case]] = {}
    for case in cases:
        groups.setdefault(key(case), []).append(case)
    return groups


def _clockwise(primitive: Primitive) -> float:
    return 360.0 if primitive.angle_deg is None else (90.0 - primitive.angle_deg) % 360.0


def _known(values: Iterable[float]) -> Array:
    array = np.array(list(values), dtype=float)
    finite: Array = array[np.isfinite(array)]
    return finite


def _cell(content: CellFile) -> Cell:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for entry in content.trials:
        groups.setdefault(entry["direction"], []).append(entry)
    cases = tuple(_case(content.hand, content.object, entries) for entries in groups.values())
    return Cell(content.hand, content.object, content.reason, content.seconds, content.cpu_seconds, cases)


def _case(hand: str, thing: str, entries: Sequence[Mapping[str, Any]]) -> Case:
    first = entries[0]
    rotates = first["angle_deg"] is None
    reached = [entry["rotation_final_deg" if rotates else "distance_mm"] for entry in entries]
    limit = first["limit_deg" if rotates else "limit_mm"]
    failures = tuple(_failure(entry) for entry in entries if entry["outcome"] not in KEPT)
    return Case(hand, thing, first["direction"], rotates, float(np.mean(reached)), limit, failures)


def _failure(entry: Mapping[str, Any]) -> str:
    """Return how a trial ended: `lost contact by the left finger`."""
    finger = f" by the {entry['first_lost']} finger" if entry["first_lost"] else ""
    return f"{entry['outcome']}{finger}"
