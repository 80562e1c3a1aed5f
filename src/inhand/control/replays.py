"""Trials as a page replays them: hand and object once, what moves packed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from inhand.control.episode import Episode
from inhand.control.trial import KEPT, Trial
from inhand.geometry import Array, planar
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import hand_positions
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.shapes import link_outline, palm_outline
from inhand.plots.page.packed import packed, packed_flags
from inhand.plots.page.views import Body, Finger, Flat, Hand, Motion, Panel, Player, View, colour_of, flat
from inhand.plots.shapes import extent_of, joined

MOST_ROWS = 40_000
"""Rows that a page holds, some 45 bytes each; of more each second, third, ... is left out."""
MOST_TRIALS = 200
"""Trials that a page holds; of more those that failed come first."""
FAR = 1.0
"""Positions farther away are drawn at that distance [m]: an object that was thrown goes on."""
AFTER = 15
"""Rows after the end of contact that the stage still shows whole."""
MARGIN_MM = 12.0
T = TypeVar("T", bound=Episode[Any])
M = TypeVar("M")


@dataclass(frozen=True, eq=False)
class Shown(Generic[T]):
    """A trial to replay."""

    trial: T
    group: str
    """Whose it is: a controller, or a run."""
    told: str
    """How it ended, in a few words."""
    name: str = ""
    """What it is called; without it direction and number."""
    target: Array | None = None
    """The path it was to take `(M, 2)` [mm] in the palm frame; None for its reference, up to the hand's limit."""


EXPLAINED = (
    "Drawn from what was recorded, every 0.02 s. Filled dots touch; where manipulation begins the time is 0. Space or k"
    " plays, comma and full stop go a step."
)


def replays(shown: Sequence[Shown[Trial]], *, picker: Panel | None = None, walls: Sequence[Flat] = ()) -> list[View]:
    """Return the player of trials as a part of a page; nothing where none has a row."""
    return views_of(shown, EXPLAINED, lambda there: player_of(there, picker=picker, walls=walls))


def views_of(shown: Sequence[Shown[T]], explained: str, player: Callable[[Sequence[Shown[T]]], object]) -> list[View]:
    """Return the player of trials that have rows as a part of a page, and how it is used; nothing where none has."""
    there = [each for each in shown if len(each.trial.time)]
    many = f" Of {len(there)} trials {MOST_TRIALS} are here, those that failed first." * (len(there) > MOST_TRIALS)
    return [View("player", player(there), "Replay", explained + many)] if there else []


def player_of(shown: Sequence[Shown[Trial]], *, picker: Panel | None = None, walls: Sequence[Flat] = ()) -> Player:
    """Return a player of trials; of many those that failed, and the first of the others."""
    kept, hands, objects, trials = chosen(shown, _motion)
    extent = joined([extent_of(_corners(each.trial), MARGIN_MM) for each in kept])
    return Player(tuple(map(_hand, hands)), tuple(map(_body, objects)), trials, extent, tuple(walls), picker)


def chosen(
    shown: Sequence[Shown[T]], motion: Callable[[Shown[T], tuple[int, int], int], M]
) -> tuple[list[Shown[T]], list[Any], list[Any], tuple[M, ...]]:
    """Return which trials a page holds, of many those that failed first, their hands and objects, and their motions.

    A `motion` is told the trial, the numbers of its hand and its object, and of how many rows one is kept.
    """
    order = sorted(range(len(shown)), key=lambda k: (shown[k].trial.outcome in KEPT, shown[k].trial.passport.trial))
    kept = [shown[k] for k in sorted(order[:MOST_TRIALS])]
    step = -(-sum(len(each.trial.time) for each in kept) // MOST_ROWS)
    pairs = [(each.trial.passport.hand, each.trial.passport.object) for each in kept]
    hands, objects = (list(dict.fromkeys(each)) for each in zip(*pairs, strict=True))
    numbers = [(hands.index(hand), objects.index(thing)) for hand, thing in pairs]
    return kept, hands, objects, tuple(motion(*each, step) for each in zip(kept, numbers, strict=True))


def replayed(shown: Shown[T], numbers: tuple[int, int], step: int, columns: Array) -> dict[str, Any]:
    """Return what a page is told of any trial besides its target; of its rows `(T, k)` each so many is kept."""
    trial, rows = shown.trial, slice(None, None, step)
    passport = trial.passport
    return {
        "name": shown.name or f"{passport.primitive}, trial {passport.trial}",
        "group": shown.group,
        "direction": passport.primitive,
        "hand": numbers[0],
        "object": numbers[1],
        "rows": len(columns[rows]),
        "start": begun(trial) // step,
        "period": passport.period * step,
        "phases": phases_of(trial, step),
        "outcome": trial.outcome,
        "failed": trial.outcome not in KEPT,
        "told": shown.told,
        "packed": packed(columns[rows]),
        "contact": packed_flags(trial.touching[rows]),
    }


def _motion(shown: Shown[Trial], numbers: tuple[int, int], step: int) -> Motion:
    trial = shown.trial
    return Motion(
        **replayed(shown, numbers, step, _columns(trial)),
        angle=trial.passport.angle_deg,
        colour=colour_of(trial.passport.angle_deg),
        target=flat(_target(trial) if shown.target is None else shown.target),
    )


def _columns(trial: Trial) -> Array:
    """Return joint angles [rad], the object's pose [mm, mm, rad], each finger's nearest point [mm] and force [N]."""
    pose = planar(trial.object_pose)
    place = 1e3 * np.clip(pose[:, :2], -FAR, FAR)
    fingers = [
        np.concatenate([1e3 * np.clip(trial.finger_points[:, k, :2], -FAR, FAR), trial.forces[:, k, :2]], axis=1)
        for k in range(trial.gaps.shape[1])
    ]
    return np.concatenate([trial.joint_angles, place, np.unwrap(pose[:, 2])[:, None], *fingers], axis=1)


def begun(trial: Episode[Any]) -> int:
    """Return the row where manipulation begins, from which a trial is played: all of one whose grasp failed."""
    return int(trial.manipulation.start % len(trial.time))


def phases_of(trial: Episode[Any], step: int) -> tuple[tuple[int, str], ...]:
    """Return the first of each so many rows, and the name, of every phase."""
    starts = np.flatnonzero(np.diff(trial.phase, prepend=-1))
    return tuple((int(row) // step, trial.phases[int(trial.phase[row])]) for row in starts)


def _target(trial: Trial) -> Array:
    """Return the reference path of a trial [mm] from where manipulation began, no farther than the hand's limit."""
    path, limit = trial.reference[:, :2], trial.passport.limit
    if limit is not None and trial.passport.angle_deg is not None:
        path = path[np.linalg.norm(path, axis=-1) <= limit + 1e-6]
    return np.asarray(1e3 * (path + trial.object_pose[begun(trial), :2]))


def _corners(trial: Trial) -> Array:
    """Return what the stage must show `(N, 2)` [mm]: palm, joints, and the object until shortly after it was lost."""
    lost = np.flatnonzero(~trial.touching.all(axis=1) & (np.arange(len(trial.time)) > trial.manipulation.start))
    last = min(int(lost[0]) + AFTER if len(lost) else len(trial.time), len(trial.time))
    outline = polygon(trial.passport.object)
    size = np.linalg.norm(outline, axis=1).max()
    place = trial.object_pose[:last, :2]
    joints = hand_positions(trial.passport.hand, trial.joint_angles[:last]).reshape(-1, 2)
    half = trial.passport.hand.link_width / 2
    around = [place - size, place + size, joints - half, joints + half]
    return np.asarray(1e3 * np.clip(np.concatenate([palm_outline(trial.passport.hand), *around]), -FAR, FAR))


def _hand(hand: HandSpec) -> Hand:
    fingers = []
    for name, finger, place in zip(hand.finger_names, hand.fingers, hand.slices, strict=True):
        x, y = finger.base
        outlines = tuple(flat(1e3 * link_outline(hand, finger, link)) for link in range(len(finger.links)))
        lengths = tuple(1e3 * length for length in finger.links)
        fingers.append(Finger(name, (1e3 * x, 1e3 * y), place.start, lengths, outlines))
    return Hand(flat(1e3 * palm_outline(hand)), tuple(fingers))


def _body(spec: ObjectSpec) -> Body:
    outline = 1e3 * polygon(spec)
    return Body(flat(outline), round(0.6 * float(np.linalg.norm(outline, axis=1).min()), 2))
