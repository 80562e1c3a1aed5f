"""Trials in space as a page replays them: links, palm and object once, what moves packed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inhand.control.replays import FAR, Shown, begun, chosen, replayed, views_of
from inhand.control.spatial_scenes import box_faces, faces_of, rods_at
from inhand.control.spatial_trial import SpatialTrial
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialFinger, SpatialHand
from inhand.plots.page.solids import Extent3, Solid, SolidFinger, SolidHand, SolidLink, SolidMotion, Solids
from inhand.plots.page.views import Flat, View

MARGIN_MM = 10.0
EXPLAINED = (
    "Drag it, or turn it by arrow keys while it is marked. Green tips touch; where manipulation begins the time is 0."
    " Space or k plays, comma and full stop go a step."
)


def solid_replays(shown: Sequence[Shown[SpatialTrial]]) -> list[View]:
    """Return the player of trials in space as a part of a page; nothing where none has a row."""
    return views_of(shown, EXPLAINED, _player)


def _player(shown: Sequence[Shown[SpatialTrial]]) -> Solids:
    kept, hands, objects, trials = chosen(shown, _motion)
    bodies = tuple(Solid(tuple(_flat(face) for face in faces_of(spec))) for spec in objects)
    return Solids(tuple(map(_hand, hands)), bodies, trials, _extent([each.trial for each in kept]))


def _motion(shown: Shown[SpatialTrial], numbers: tuple[int, int], step: int) -> SolidMotion:
    trial, passport = shown.trial, shown.trial.passport
    place = 1e3 * np.clip(trial.object_pose[:, :3], -FAR, FAR)
    forces = np.linalg.norm(trial.forces, axis=-1)
    columns = np.concatenate([trial.joint_angles, place, trial.object_pose[:, 3:], forces], axis=1)
    line = trial.reference[:, :3]
    if passport.limit is not None and passport.along is not None:
        line = line[np.linalg.norm(line, axis=-1) <= passport.limit + 1e-6]
    target = _flat(line + trial.object_pose[begun(trial), :3])
    return SolidMotion(**replayed(shown, numbers, step, columns), along=passport.along, target=target)


def _hand(hand: SpatialHand) -> SolidHand:
    fingers = tuple(_finger(finger, place.start) for finger, place in zip(hand.fingers, hand.slices, strict=True))
    return SolidHand(tuple(_flat(face) for face in box_faces(hand.palm)), fingers)


def _finger(finger: SpatialFinger, first: int) -> SolidFinger:
    links = tuple(
        SolidLink(
            _mm(link.origin),
            link.turn,
            link.axis,
            tuple((*_mm(each.start), *_mm(each.end), 1e3 * each.radius) for each in link.capsules),
        )
        for link in finger.links
    )
    return SolidFinger(finger.name, first, links, _mm(finger.tip), 1e3 * finger.tip_radius)


def _mm(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = vector
    return 1e3 * x, 1e3 * y, 1e3 * z


def _flat(points: Array) -> Flat:
    """Return points `(N, 3)` [m] as x, y, z, x, ... [mm]."""
    return tuple((np.round(1e3 * points, 2) + 0.0).ravel().tolist())


def _extent(trials: Sequence[SpatialTrial]) -> Extent3:
    """Return the ball that holds hands and objects until they are lost, or far away."""
    corners = []
    for trial in trials:
        rods, _ = rods_at(trial.passport.hand, trial.joint_angles[::10])
        held = trial.object_pose[trial.touching.any(axis=1) | (trial.phase == 0), :3]
        half = np.array(trial.passport.object.half)
        corners += [rods[..., :3].reshape(-1, 3), held[::5] - half, held[::5] + half]
    every = 1e3 * np.clip(np.concatenate(corners), -FAR, FAR)
    low, high = every.min(axis=0), every.max(axis=0)
    x, y, z = ((low + high) / 2).tolist()
    return Extent3((x, y, z), float(np.linalg.norm(high - low)) / 2 + MARGIN_MM)
