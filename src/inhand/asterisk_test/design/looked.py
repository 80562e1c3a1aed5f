"""How far one hand could carry the objects of a study: its reach, its file, and what the aims come to."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from inhand.asterisk_test.design.asked import AIMS, Asked
from inhand.control.trial import write_json
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.fit import check_fit
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.records import read_json, read_record
from inhand.tasks.primitives import Primitive
from inhand.tasks.reach import limits

SLACK = 0.04
"""A hand is not looked at any further if another is better by this share in the coarse directions. What all directions
come to, of what these do, differs from hand to hand by 1.3 % (SD of 79 hands), and upwards by 2.3 % at most."""
OFF_MM, OFF_DEG, OFF_FRICTION = 1.0, 2.0, 0.2
"""By how much hands a little off differ: links, joint limits, the share of the friction."""
Bar: TypeAlias = tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]
"""Hands to be better than: what the aims come to in the coarse directions and in all; lengths are negative."""


@dataclass(frozen=True)
class Looked:
    """A hand that was looked at; the content of its file."""

    number: int
    """Which of the study it is, from 1; 0 of the catalogue."""
    hand: HandSpec
    reach: tuple[tuple[float | None, ...], ...]
    """Reach of each object in each direction [mm]; of one that was given up in the coarse directions only."""
    reasons: tuple[str, ...] = ()
    """Why it cannot hold objects, which count as a reach of 0."""
    aims: dict[str, float] = field(default_factory=dict)
    """What the aims come to [mm]; of one that was given up an estimate."""
    whole: bool = True
    """Whether it was looked at in all directions."""
    seconds: float = 0.0
    """Processor time it took [s]."""

    @property
    def table(self) -> Array:
        """Its reach `(O, D)` [mm]."""
        return np.array(self.reach, dtype=float)


@dataclass(frozen=True, eq=False)
class Look:
    """A hand to look at."""

    number: int
    hand: HandSpec
    asked: Asked
    bar: Bar
    path: Path
    """Its file."""


def look(job: Look) -> Looked:
    """Look at a hand and write its file: in the coarse directions, and in all if it may come to the front."""
    cpu, asked, hand = time.process_time(), job.asked, job.hand
    reach, reasons = reached(asked, hand, asked.coarse)
    better = _better(signed(asked, aims_of(asked, hand, reach, asked.coarse)), job.bar)
    if better is None:
        rest = [k for k in range(len(asked.primitives)) if k not in asked.coarse]
        reach[:, rest] = reached(asked, hand, rest)[0][:, rest]
        aims = aims_of(asked, hand, reach)
        if "tolerance" in asked.aims:
            aims["tolerance"] = min(asked.mean(reached(asked, each)[0]) for each in variants(hand).values())
    else:
        aims = dict(zip(asked.aims, np.abs(better).tolist(), strict=True))
    rows = tuple(tuple(None if np.isnan(x) else float(x) for x in row) for row in reach)
    found = Looked(job.number, hand, rows, reasons, aims, better is None, time.process_time() - cpu)
    write_json(found, job.path)
    return found


def reached(asked: Asked, hand: HandSpec, columns: Sequence[int] | None = None) -> tuple[Array, tuple[str, ...]]:
    """Return how far a hand could carry objects `(O, D)` [mm], NaN in other columns, and why it cannot hold some."""
    chosen = list(range(len(asked.primitives))) if columns is None else list(columns)
    found, reasons = np.full((len(asked.objects), len(asked.primitives)), np.nan), []
    for row, spec in zip(found, asked.objects, strict=True):
        try:
            row[chosen] = _ways(hand, spec, [asked.primitives[k] for k in chosen])
        except InputError as error:
            row[chosen] = 0.0
            reasons.append(str(error))
    return found, tuple(reasons)


def _ways(hand: HandSpec, spec: ObjectSpec, primitives: Sequence[Primitive]) -> list[float]:
    """Return the limits of directions [mm]; a turn on the spot counts as an arc at `TURN_ARM`."""
    check_fit(hand, spec)
    found = limits(hand, spec, primitives)
    return [1e3 * each.distance * (TURN_ARM if each.primitive.angle_deg is None else 1.0) for each in found]


def aims_of(asked: Asked, hand: HandSpec, reach: Array, columns: Sequence[int] | None = None) -> dict[str, float]:
    """Return what the aims come to [mm]; for tolerance the mean stands, until it is computed."""
    mean = asked.mean(reach, columns)
    all_of_them = {
        "mean": mean,
        "least": asked.least(reach, columns),
        "length": 1e3 * sum(finger.length for finger in hand.fingers),
        "tolerance": mean,
    }
    return {name: all_of_them[name] for name in asked.aims}


def signed(asked: Asked, aims: dict[str, float]) -> tuple[float, ...]:
    """Return what the aims come to, so that more is better."""
    return tuple(aims[name] if AIMS[name].larger else -aims[name] for name in asked.aims)


def front_of(asked: Asked, hands: Sequence[Looked]) -> list[Looked]:
    """Return the hands that no other is better than, or as good, in all aims; the best by the first aim first."""
    whole = sorted((each for each in hands if each.whole), key=lambda each: signed(asked, each.aims), reverse=True)
    front: list[Looked] = []
    for each in whole:
        own = signed(asked, each.aims)
        if not any(all(a <= b for a, b in zip(own, signed(asked, other.aims), strict=True)) for other in front):
            front.append(each)
    return front


def bar_of(asked: Asked, front: Sequence[Looked]) -> Bar:
    """Return what a hand has to be better than to be looked at in all directions."""
    return tuple(
        (signed(asked, aims_of(asked, each.hand, each.table, asked.coarse)), signed(asked, each.aims)) for each in front
    )


def _better(own: tuple[float, ...], bar: Bar) -> tuple[float, ...] | None:
    """Return an estimate of what a hand's aims would come to where one of the front is clearly better, else None."""
    for coarse, whole in bar:
        pairs = list(zip(own, coarse, strict=True))
        if all(mine + SLACK * max(mine, 0.0) <= other for mine, other in pairs):
            shares = [mine / other if other else 0.0 for mine, other in pairs]
            return tuple(share * value for share, value in zip(shares, whole, strict=True))
    return None


def variants(hand: HandSpec) -> dict[str, HandSpec]:
    """Return hands a little off one, by what is off; joints without limits stay so."""

    def longer(left: float, right: float) -> HandSpec:
        fingers = [
            replace(finger, links=tuple(link + more / 1e3 for link in finger.links))
            for finger, more in zip(hand.fingers, (left, right), strict=True)
        ]
        return replace(hand, left=fingers[0], right=fingers[1])

    def wider(degrees: float) -> HandSpec:
        left, right = (_wider(finger, math.radians(degrees)) for finger in hand.fingers)
        return replace(hand, left=left, right=right)

    found = {
        f"links {left:+g} mm" if left == right else f"left links {left:+g} mm, right {right:+g}": longer(left, right)
        for left in (OFF_MM, -OFF_MM)
        for right in (OFF_MM, -OFF_MM)
    }
    if not all(abs(angle) == math.pi for finger in hand.fingers for pair in finger.limits for angle in pair):
        found |= {f"joint limits {off:+g} deg": wider(off) for off in (OFF_DEG, -OFF_DEG)}
    shares = (OFF_FRICTION, -OFF_FRICTION)
    return found | {f"friction {100 * off:+g} %": replace(hand, friction=hand.friction * (1 + off)) for off in shares}


def _wider(finger: FingerSpec, angle: float) -> FingerSpec:
    """Return a finger whose joints go further by an angle [rad] at both ends."""
    pairs = ((low, high) if high - low >= 2 * math.pi else (low - angle, high + angle) for low, high in finger.limits)
    return replace(finger, limits=tuple(pairs))


def read_looked(path: Path) -> Looked | None:
    """Return the hand of a file; None where there is none, or none that can be read."""
    try:
        return read_record(read_json(path.read_bytes()), Looked)
    except (OSError, InputError):
        return None
