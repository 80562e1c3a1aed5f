"""How far a hand could carry an object along a path: the end of the last grip that slides connect with the start.

At every pose of a path all grips are found: pairs of touching postures, one of each finger, whose line lies inside both
friction cones and whose links keep apart. A grip counts if a chain of grips leads to it from the start, each a small
step of the object or a slide of one contact along the outline away from the one before. What is asked is geometry and
Coulomb friction alone: no controller, no torque, no speed.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, cross, interpolate, transform, way_along
from inhand.hands.hand import FINGER_NAMES, HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces, polygon
from inhand.hands.polygons import separation
from inhand.hands.reach.bundles import cells
from inhand.hands.reach.fingers import OVERLAP, Body, Postures, touching_postures
from inhand.hands.reach.pairs import Grips, clear_pairs, closures, connected, neighbours
from inhand.hands.shapes import palm_outline

BLOCK = 12
"""Poses of a path whose postures are found at a time."""
OFF_CENTRE = 2.0
"""What a metre between grip line and object's middle counts against the cosine of its tilt, where one grip is shown."""
FINE = 8
"""Parts into which the step is cut in which the last grip ends."""
FINE_CELLS = 8
"""Parts into which the cells of the outline are cut near the end: between coarse cells the last grips are missed."""
AROUND = 3
"""Near the end, cells are looked at that are at most so many coarse cells from the last grips."""
FINEST, COARSEST = 0.0005, 0.01
"""Finest and coarsest step [m]."""
FINEST_S = 40.0
"""What all directions take of one core at the finest step, measured with the default hand and object [s]."""
BACK = 3
"""Steps before the end of the coarse search from which the fine one starts."""


@dataclass(frozen=True)
class ReachConfig:
    """How finely a reach is computed, and what it may use."""

    resolution: float = 0.002
    """Step along paths and length of a cell of the outline [m]; the end of a path is found `FINE` times finer."""
    fan: float = np.deg2rad(7.5)
    """Angle of a cell on a corner of the outline [rad]."""
    friction: float | None = None
    """Coefficient of friction between finger and object; None takes the product of the specs'."""
    rotation: float = 0.0
    """Largest rotation away from the path's own [rad]."""

    def __post_init__(self) -> None:
        """Refuse numbers that no computation has."""
        if not (np.isfinite(self.resolution) and FINEST - 1e-12 <= self.resolution <= COARSEST + 1e-12):
            raise InputError(
                f"resolution {1e3 * self.resolution:g} mm: give {1e3 * FINEST:g} to {1e3 * COARSEST:g} mm; all"
                f" directions at the finest take about {FINEST_S:g} s"
            )
        if self.friction is not None and not (np.isfinite(self.friction) and self.friction >= 0):
            raise InputError(f"friction {self.friction:g}: a coefficient of friction is 0 or more")
        if not (np.isfinite(self.rotation) and 0 <= self.rotation <= np.pi / 2):
            raise InputError(f"rotation bound {np.rad2deg(self.rotation):g} deg: give 0 to 90 deg")


@dataclass(frozen=True)
class PoseGrips:
    """Grips at one pose."""

    left: Postures
    """Postures of the left finger, L of them."""
    right: Postures
    """Postures of the right finger, R of them."""
    grips: Grips
    """Which pairs are grips `(L, R)`."""


@dataclass(frozen=True)
class Farthest:
    """The end of the last connected grip along a path."""

    way: float
    """Way along the path [m], see `geometry.way_along`."""
    pose: Array
    """The object's pose there `(3,)` in the palm frame."""
    joints: Array
    """Joint angles of one grip there `(n_joints,)` [rad]."""
    contacts: Array
    """Its contacts in the object's frame, left finger first `(2, 2)` [m]."""


@dataclass(frozen=True)
class _Scene:
    """A hand and an object, prepared."""

    hand: HandSpec
    body: Body
    friction: float
    turns: Array
    hop: int = 1


_Column: TypeAlias = list[PoseGrips | None]
"""What is reached at one place of the path, for every rotation away from it."""


def body_of(spec: ObjectSpec, spacing: float, fan: float) -> Body:
    """Return an object's outline in cells of a length [m] on its faces and an angle [rad] on its corners."""
    return Body(cells(polygon(spec), spacing, fan), convex_pieces(spec))


def farthest(
    hand: HandSpec,
    spec: ObjectSpec,
    path: Array,
    config: ReachConfig | None = None,
    told: Callable[[float], None] = lambda _: None,
) -> Farthest | None:
    """Return how far an object can be carried along a path, or None where no grip holds it at the start.

    The path is object poses `(S, 3)` in the palm frame, followed on straight lines between them. `told` is told the way
    [m] up to which it has been followed.
    """
    config = config or ReachConfig()
    scene = _scene(hand, spec, config)
    way = way_along(path)
    count = int(np.ceil(way[-1] / config.resolution - 1e-9))
    steps = np.minimum(np.arange(count + 1) * config.resolution, way[-1])
    done, last = 0, deque[_Column](maxlen=BACK + 1)  # of a long way all would fill the memory
    for column in _walk(scene, interpolate(steps, way, path), None):
        told(float(steps[done]))
        done += 1
        last.append(column)
    if not last:
        return None
    end, column = float(steps[done - 1]), last[-1]
    if done <= count:
        # It ends within the path: from some steps back the grips are followed in finer cells, then in finer steps too.
        fine = body_of(spec, config.resolution / FINE_CELLS, config.fan / FINE_CELLS)
        finer = replace(scene, body=fine, hop=FINE_CELLS)
        start = max(done - 1 - BACK, 0)
        refined = _refined(scene, finer, interpolate(steps[start : start + 1], way, path), last[0])
        known = float(steps[start]), refined
        for size in (config.resolution, config.resolution / FINE):
            ways = known[0] + size * np.arange(1, round((way[-1] - known[0]) / size) + 1)
            walk = _walk(finer, interpolate(ways, way, path), known[1], around=AROUND * FINE_CELLS)
            for place, reached in zip(ways, walk, strict=False):
                known = float(place), reached
        if known[0] >= end:
            scene, (end, column) = finer, known
    return _described(scene, interpolate(np.array([end]), way, path)[0], end, column)


def reaches(hand: HandSpec, spec: ObjectSpec, path: Array, config: ReachConfig | None = None) -> bool:
    """Return whether an object can be carried along the whole of a path, to within the resolution.

    Takes what `farthest` takes, and less time where the path cannot be followed: its end is not found any finer.
    """
    config = config or ReachConfig()
    scene, way = _scene(hand, spec, config), way_along(path)
    count = int(np.ceil(way[-1] / config.resolution - 1e-9))
    steps = np.minimum(np.arange(count + 1) * config.resolution, way[-1])
    return sum(1 for _ in _walk(scene, interpolate(steps, way, path), None)) > count


def why_none(hand: HandSpec, spec: ObjectSpec, pose: Array, config: ReachConfig | None = None) -> str:
    """Return which constraint keeps every grip from holding an object at a pose `(1, 3)`."""
    scene = _scene(hand, spec, config or ReachConfig())
    fingers = [touching_postures(hand, finger, scene.body, pose) for finger in hand.fingers]
    for side, found in zip(FINGER_NAMES, fingers, strict=True):
        if len(found.pose) == 0:
            return f"the {side} finger reaches no point of it within its joint limits"
    if not closures(scene.friction, *fingers).any():
        return "no two reachable points have their line inside both friction cones"
    return "the fingers would meet, or the object meets the palm, in every grip that holds it"


def _scene(hand: HandSpec, spec: ObjectSpec, config: ReachConfig) -> _Scene:
    body = body_of(spec, config.resolution, config.fan)
    friction = hand.friction * spec.friction if config.friction is None else config.friction
    count = int(np.ceil(config.rotation * TURN_ARM / config.resolution - 1e-9))
    turns = np.linspace(-config.rotation, config.rotation, 2 * count + 1)
    return _Scene(hand, body, friction, turns)


def _walk(scene: _Scene, poses: Array, column: _Column | None, around: int | None = None) -> Iterator[_Column]:
    """Give what is reached at each pose `(P, 3)` in turn, from what was reached before the first, until nothing is.

    None before the first starts with every grip of it. Only cells `around` the last grips are looked at, or all.
    """
    block = BLOCK if around is None else FINE // 2
    bodies = (scene.body, scene.body)
    for first in range(0, len(poses), block):
        if around is not None and column is not None:
            left, right = _used(column)
            bodies = _beside(scene.body, left, around), _beside(scene.body, right, around)
        for here in _touched(scene, bodies, poses[first : first + block]):
            column = _first(scene, here) if column is None else _next(scene, here, column)
            if not any(column):
                return
            yield column


def _used(column: _Column) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the cells that the left and the right finger touch in any grip of a column."""
    held = [each for each in column if each is not None]
    left = np.concatenate([each.left.cell[each.grips.any(axis=1)] for each in held])
    right = np.concatenate([each.right.cell[each.grips.any(axis=0)] for each in held])
    return np.unique(left), np.unique(right)


def _beside(body: Body, used: NDArray[np.int64], around: int) -> Body:
    """Return a body of which only the cells are looked at that are at most `around` cells from some."""
    beside = used[:, None] + np.arange(-around, around + 1)
    return replace(body, chosen=np.unique(beside % len(body.cells)))


def _touched(scene: _Scene, bodies: tuple[Body, Body], poses: Array) -> Iterator[list[PoseGrips | None]]:
    """Give what both fingers can touch at each pose, for every rotation; None where object and palm overlap."""
    hand, turns = scene.hand, scene.turns
    flat = (poses[:, None] + np.stack([0 * turns, 0 * turns, turns], axis=-1)).reshape(-1, 3)
    free = np.ones(len(flat), dtype=bool)
    palm = palm_outline(hand)
    for piece in scene.body.pieces:
        free &= separation(palm, transform(flat[:, None], piece)) > -OVERLAP
    left, right = (
        touching_postures(hand, finger, body, flat) for finger, body in zip(hand.fingers, bodies, strict=True)
    )
    ends = [np.searchsorted(found.pose, np.arange(len(flat) + 1)) for found in (left, right)]
    for first in range(0, len(flat), len(turns)):
        yield [
            _closed(scene, left.only(slice(*ends[0][k : k + 2])), right.only(slice(*ends[1][k : k + 2])))
            if free[k]
            else None
            for k in range(first, first + len(turns))
        ]


def _closed(scene: _Scene, left: Postures, right: Postures) -> PoseGrips | None:
    """Return the pairs whose line lies inside both friction cones, without postures that have no partner."""
    grips = closures(scene.friction, left, right)
    rows, columns = np.flatnonzero(grips.any(axis=1)), np.flatnonzero(grips.any(axis=0))
    return PoseGrips(left.only(rows), right.only(columns), grips[np.ix_(rows, columns)]) if len(rows) > 0 else None


def _first(scene: _Scene, here: Sequence[PoseGrips | None]) -> _Column:
    """Return every grip at the start, without rotation."""
    middle = len(here) // 2
    column: _Column = [None] * len(here)
    pair = here[middle]
    if pair is not None:
        grips = clear_pairs(scene.hand, pair.left.joints, pair.right.joints, pair.grips)
        column[middle] = replace(pair, grips=grips) if grips.any() else None
    return column


def _refined(scene: _Scene, fine: _Scene, pose: Array, column: _Column) -> _Column:
    """Return what is reached at a pose `(1, 3)` in finer cells, from what is in coarser ones."""
    coarse = scene.body.nearest(fine.body.cells.points, fine.body.cells.normals)
    looked_at = [_beside(scene.body, cells, AROUND).numbers for cells in _used(column)]
    first, second = (replace(fine.body, chosen=np.flatnonzero(np.isin(coarse, cells))) for cells in looked_at)
    (here,) = _touched(fine, (first, second), pose)
    refined: _Column = [None] * len(column)
    for t, (pair, held) in enumerate(zip(here, column, strict=True)):
        if pair is not None and held is not None:
            left, right = (replace(found, cell=coarse[found.cell]) for found in (pair.left, pair.right))
            refined[t] = _reached(fine, pair, _seeds(scene, PoseGrips(left, right, pair.grips), held), None)
    return refined


def _next(scene: _Scene, here: Sequence[PoseGrips | None], before: _Column) -> _Column:
    """Return what is reached at a place from the one before, and from there by turning the object."""
    column: _Column = [None] * len(here)
    waiting = [(t, held) for t, held in enumerate(before) if held is not None]
    while waiting:
        t, source = waiting.pop(0)
        pair = here[t]
        if pair is None:
            continue
        found = _reached(scene, pair, _seeds(scene, pair, source), column[t])
        if found is None:
            continue
        column[t] = found
        waiting += [(beside, found) for beside in (t - 1, t + 1) if 0 <= beside < len(here)]
    return column


def _seeds(scene: _Scene, pair: PoseGrips, source: PoseGrips) -> Grips:
    """Return which grips `(L, R)` of a pose are beside a source's grips."""
    count, hop = len(scene.body.cells), scene.hop
    rows, columns = np.flatnonzero(source.grips.any(axis=1)), np.flatnonzero(source.grips.any(axis=0))
    # A grip is beside another if both its contacts are: a product of three tables, over those in use alone.
    left = neighbours(source.left.only(rows), pair.left, count, hop).astype(np.float32)
    right = neighbours(source.right.only(columns), pair.right, count, hop).astype(np.float32)
    held = source.grips[np.ix_(rows, columns)].astype(np.float32)
    return np.asarray((left.T @ held @ right > 0) & pair.grips)


def _reached(scene: _Scene, pair: PoseGrips, seeds: Grips, known: PoseGrips | None) -> PoseGrips | None:
    """Return the grips of a pose that seeds lead to, with those known; None where that adds none."""
    left, right, grips = pair.left, pair.right, pair.grips
    seeds = seeds if known is None else seeds & ~known.grips
    if not seeds.any():
        return None
    count = len(scene.body.cells)
    slides = neighbours(left, left, count), neighbours(right, right, count)
    reached = connected(grips, seeds, slides)
    clear = clear_pairs(scene.hand, left.joints, right.joints, reached)
    # Links that meet are looked for last, as it costs most; where some do, what was reached through them may not be.
    if (reached & ~clear).any():
        seeds &= clear
        reached = connected(clear, seeds, slides) if seeds.any() else seeds
    if not reached.any():
        return None
    return PoseGrips(left, right, reached if known is None else reached | known.grips)


def _described(scene: _Scene, pose: Array, way: float, column: _Column) -> Farthest:
    """Return, of the grips left at the end, one well inside the friction cones and near the object's middle."""
    held = [(abs(turn), t, each) for t, (turn, each) in enumerate(zip(scene.turns, column, strict=True)) if each]
    _, t, last = min(held, key=lambda each: each[:2])
    left, right = np.nonzero(last.grips)
    first, second = last.left.only(left), last.right.only(right)
    line = second.points - first.points
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    inside = np.minimum(-(line * first.normals).sum(-1), (line * second.normals).sum(-1))
    best = int(np.argmax(inside - OFF_CENTRE * np.abs(cross(line, first.points))))
    return Farthest(
        way,
        pose + np.array([0.0, 0.0, scene.turns[t]]),
        np.concatenate([first.joints[best], second.joints[best]]),
        np.stack([first.points[best], second.points[best]]),
    )
