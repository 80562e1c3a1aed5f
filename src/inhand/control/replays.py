"""Trials as a page replays them: hand and object once, what moves packed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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


@dataclass(frozen=True, eq=False)
class Shown:
    """A trial to replay."""

    trial: Trial
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


def replays(shown: Sequence[Shown], *, picker: Panel | None = None, walls: Sequence[Flat] = ()) -> list[View]:
    """Return the player of trials as a part of a page; nothing where none has a row."""
    there = [each for each in shown if len(each.trial.time)]
    many = f" Of {len(there)} trials {MOST_TRIALS} are here, those that failed first." * (len(there) > MOST_TRIALS)
    player = [player_of(there, picker=picker, walls=walls)] if there else []
    return [View("player", each, "Replay", EXPLAINED + many) for each in player]


def player_of(shown: Sequence[Shown], *, picker: Panel | None = None, walls: Sequence[Flat] = ()) -> Player:
    """Return a player of trials; of many those that failed, and the first of the others."""
    kept = [shown[k] for k in chosen_of([(each.trial.outcome, each.trial.passport.trial) for each in shown])]
    step = -(-sum(len(each.trial.time) for each in kept) // MOST_ROWS)
    hands = list(dict.fromkeys(each.trial.passport.hand for each in kept))
    objects = list(dict.fromkeys(each.trial.passport.object for each in kept))
    trials = tuple(
        _motion(each, hands.index(each.trial.passport.hand), objects.index(each.trial.passport.object), step)
        for each in kept
    )
    extent = joined([extent_of(_corners(each.trial), MARGIN_MM) for each in kept])
    bodies = tuple(_body(spec) for spec in objects)
    return Player(tuple(map(_hand, hands)), bodies, trials, extent, tuple(walls), picker)


def chosen_of(ends: Sequence[tuple[str, int]]) -> list[int]:
    """Return which trials of given outcomes and numbers a page holds: of many those that failed come first."""
    order = sorted(range(len(ends)), key=lambda k: (ends[k][0] in KEPT, ends[k][1]))
    return sorted(order[:MOST_TRIALS])


def _motion(shown: Shown, hand: int, thing: int, step: int) -> Motion:
    trial, rows = shown.trial, slice(None, None, step)
    passport = trial.passport
    start = min(trial.manipulation.start, len(trial.time) - 1) // step
    columns = _columns(trial)[rows]
    name = shown.name or f"{passport.primitive}, trial {passport.trial}"
    return Motion(
        name=name,
        group=shown.group,
        direction=passport.primitive,
        angle=passport.angle_deg,
        colour=colour_of(passport.angle_deg),
        hand=hand,
        object=thing,
        rows=len(columns),
        start=start,
        period=passport.period * step,
        phases=phases_of(trial, step),
        outcome=trial.outcome,
        failed=trial.outcome not in KEPT,
        told=shown.told,
        target=flat(_target(trial) if shown.target is None else shown.target),
        packed=packed(columns),
        contact=packed_flags(trial.touching[rows]),
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


def phases_of(trial: Episode[Any], step: int) -> tuple[tuple[int, str], ...]:
    """Return the first of each so many rows, and the name, of every phase."""
    starts = np.flatnonzero(np.diff(trial.phase, prepend=-1))
    return tuple((int(row) // step, trial.phases[int(trial.phase[row])]) for row in starts)


def _target(trial: Trial) -> Array:
    """Return the reference path of a trial [mm] from where manipulation began, no farther than the hand's limit."""
    start = min(trial.manipulation.start, len(trial.time) - 1)
    path, limit = trial.reference[:, :2], trial.passport.limit
    if limit is not None and trial.passport.angle_deg is not None:
        path = path[np.linalg.norm(path, axis=-1) <= limit + 1e-6]
    return np.asarray(1e3 * (path + trial.object_pose[start, :2]))


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
