"""Starts of a family: hands and objects drawn of it, grasps planned for each, and pools of hands of one form.

Worlds of one pool differ in hands and objects and are stepped as one batch; hands of other numbers of joints are in
another pool.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.loop import Told
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.pair_family import PairFamily
from inhand.learning.config import Training
from inhand.learning.demonstrations import told_reach
from inhand.learning.pairs import Pairs
from inhand.learning.recipe import Recording
from inhand.learning.starts import Grips, Starts, gripped, grips_along, joined
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN, TURNS, UNSEEN, primitive_at

DIRECTIONS = 8
"""Directions that grasps of a pair are planned for, beside both turns."""
TURNED = 1 / 6
"""Share of the starts that are to turn the object."""
TESTED = 6
"""Pairs that evaluations run with, drawn after those that are learned with."""
SHORTEST = 0.004
"""Grasps that are predicted to carry an object less far are not learned or tested with [m]."""


@dataclass(frozen=True)
class Planned:
    """A pair with grasps for some directions and for both turns."""

    held: Held
    plans: tuple[Grips, ...]
    angle_deg: Array
    """Direction of each grasp [deg], 0 of a turn."""
    turn: Array
    """Side that it is to turn to, 0 of a direction."""


def planned_pairs(config: Training, told: Told) -> tuple[list[Planned], list[Planned]]:
    """Return the pairs to learn with and those to be tested with; each is drawn and planned by its own seed.

    A pair that no grasp holds is passed over.
    """
    family, recording = PairFamily(), config.recording
    learned, tested = list[Planned](), list[Planned]()
    count, total, number = 0, config.pairs + TESTED, 0
    while count < total:
        told("planning grasps of the family", count, total)
        rng = np.random.default_rng((config.seed, 5, number))
        number += 1
        try:
            held = family.drawn(rng, number)
            if count < config.pairs:
                learned.append(_planned(held, recording.draw(rng, DIRECTIONS), TURNS_TOO, recording))
            else:
                tested.append(_planned(held, np.array(SIXTEEN), (), recording))
        except InputError:
            continue
        count += 1
    return learned, tested


TURNS_TOO = tuple(float(np.sign(each.rotation_deg)) for each in TURNS)
"""Sides of the turns."""
SIXTEEN = tuple(each.angle_deg for each in (*TRAIN, *UNSEEN) if each.angle_deg is not None)
"""Directions of the test [deg]."""


def _planned(held: Held, angles: Array, sides: tuple[float, ...], recording: Recording) -> Planned:
    paths = [[primitive_at(angle) for angle in angles.tolist()], [*TURNS] if sides else []]
    plans: list[Grips] = []
    for some in filter(None, paths):
        poses = np.stack([held.start + straight_path(each).poses for each in some])
        plans += grips_along(held, poses, recording.recipe.grasp, recording.engine)
    if not all(plans):
        raise InputError(f"no grasp holds {held.object.name!r} along some directions")
    turn = np.concatenate([np.zeros(len(angles)), sides])
    return Planned(held, tuple(plans), np.concatenate([angles, np.zeros(len(sides))]), turn)


def pools_of(config: Training, pairs: list[Planned], rng: np.random.Generator, told: Told) -> list[Starts]:
    """Return pools of starts for demonstrations, hands of one form in each, and how far each is to go."""
    recipe, each = config.recipe, max(config.recipe.episodes // max(len(pairs), 1), 1)
    found = list[Starts]()
    for number, pair in enumerate(pairs):
        told("gripping objects", number, len(pairs))
        turned = rng.random(each) < TURNED
        rows = np.where(turned, DIRECTIONS + rng.integers(len(TURNS), size=each), rng.integers(DIRECTIONS, size=each))
        spread = recipe.grip_spread * rng.standard_normal(each) * (rng.random(each) < 0.5)
        angles = np.where(turned, 0.0, pair.angle_deg[rows] + spread)
        with suppress(InputError):
            found.append(_gripped(config, pair, (rows, angles), rng))
    return [_to_go(config.recording, pool, rng) for pool in by_form(found)]


def tests_of(config: Training, pairs: list[Planned], rng: np.random.Generator) -> list[Starts]:
    """Return pools of starts for evaluations: `trials` in each of the 16 directions, as far as their grips reach."""
    found = []
    for pair in pairs:
        rows = np.repeat(np.arange(len(SIXTEEN)), max(config.trials // TESTED, 1))
        found.append(_gripped(config, pair, (rows, pair.angle_deg[rows]), rng))
    return [far_enough(config.recording, pool, rng) for pool in by_form(found)]


def midway(recording: Recording, kept: Starts, count: int, rng: np.random.Generator) -> Starts:
    """Return some states on the way of other episodes as starts, with new directions and ways to go."""
    rows = rng.choice(len(kept), min(count, len(kept)), replace=False)
    return _to_go(recording, kept.take(rows, recording.draw(rng, len(rows))), rng)


def _to_go(recording: Recording, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return those of the starts that go far enough, some of them told to stop before the end of their way."""
    far = far_enough(recording, starts, rng)
    return replace(far, distance=recording.recipe.shares(len(far), rng) * far.distance)


def far_enough(recording: Recording, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return the starts whose grip carries the object at least `SHORTEST`, as is predicted, told to go so far."""
    reach = told_reach(recording, starts, rng)
    rows = np.flatnonzero(reach >= SHORTEST)
    return replace(starts.rows(rows), distance=reach[rows])


def by_form(starts: list[Starts]) -> list[Starts]:
    """Return starts of pairs as one pool for each form of hand."""
    forms: dict[tuple[int, ...], list[Starts]] = {}
    for each in starts:
        if each.pairs is not None and len(each):
            form = tuple(len(finger.links) for finger in each.pairs.held[0].hand.fingers)
            forms.setdefault(form, []).append(each)
    return [joined(forms[form]) for form in sorted(forms)]


def _gripped(
    config: Training, pair: Planned, asked: tuple[NDArray[np.int64], Array], rng: np.random.Generator
) -> Starts:
    rows, angles = asked
    plans = [pair.plans[row] for row in rows.tolist()]
    disturb = config.recording.disturb
    starts = gripped(*pair.held, (plans, angles), rng, config.noise, engine=config.engine, disturb=disturb)
    return replace(starts, turn=pair.turn[rows], pairs=Pairs((pair.held,), np.zeros(len(rows), dtype=np.int64)))
