"""How far a hand could carry an object along a path: the end of the last grip that slides connect with the start.

At every pose of a path all grips are found: pairs of touching postures, one of each finger, whose line lies inside both
friction cones and whose links keep apart. A grip counts if a chain of grips leads to it from the start, each a small
step of the object or a slide of one contact along the outline away from the one before. What is asked is geometry and
Coulomb friction alone: no controller, no torque, no speed.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, cross, interpolate, transform, way_along
from inhand.hands.force_closure import force_closure
from inhand.hands.hand import FINGER_NAMES, HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces, polygon
from inhand.hands.polygons import separation
from inhand.hands.reach.bundles import cells
from inhand.hands.reach.fingers import Body, touched
from inhand.hands.reach.pairs import grips_of, merged
from inhand.hands.reach.parts import OVERLAP, Chain, Flags, Grips, Indices, Sides, Step, Toucher, toucher
from inhand.hands.reach.rooms import Rooms
from inhand.hands.shapes import palm_outline

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
FINEST_S = 8.0
"""What all directions take of one core at the finest step, measured with the default hand and object [s]."""
AHEAD = 3
"""Cells beyond those that a step leads to, at which grips are looked for first: slides hardly ever lead farther."""
NO_CELLS: Indices = np.empty(0, dtype=np.int64)
"""Cells that none is near."""
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


@dataclass(frozen=True, eq=False)
class Scene:
    """A hand and an object, prepared."""

    hand: HandSpec
    body: Body
    touchers: tuple[Toucher, Toucher]
    friction: float
    turns: Array
    hop: int
    """By how many cells contacts of neighbouring grips at neighbouring poses may differ."""
    coarse: Indices
    """For each cell the nearest of those that are coarse `(U,)`."""
    starts: dict[bytes, Grips | None] = field(default_factory=dict)
    """Every grip at the pose at which paths started last."""

    @property
    def chains(self) -> tuple[Chain, Chain]:
        """Both fingers."""
        return self.touchers[0].finger, self.touchers[1].finger

    @property
    def cone(self) -> float:
        """Cosine of the friction cone's half angle; none is as narrow as that of no friction."""
        return float(np.cos(np.arctan(self.friction))) if self.friction > 0 else np.inf


_Column: TypeAlias = list[Grips | None]
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
    scene = scene_of(hand, spec, config)
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
        finer = scene_of(hand, spec, config, finer=True)
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
    scene, way = scene_of(hand, spec, config), way_along(path)
    count = int(np.ceil(way[-1] / config.resolution - 1e-9))
    steps = np.minimum(np.arange(count + 1) * config.resolution, way[-1])
    return sum(1 for _ in _walk(scene, interpolate(steps, way, path), None)) > count


def why_none(hand: HandSpec, spec: ObjectSpec, pose: Array, config: ReachConfig | None = None) -> str:
    """Return which constraint keeps every grip from holding an object at a pose `(1, 3)`."""
    scene = scene_of(hand, spec, config or ReachConfig())
    left, right = (touched(each, len(scene.body.cells), pose) for each in scene.touchers)
    for side, found in zip(FINGER_NAMES, (left, right), strict=True):
        if len(found.pose) == 0:
            return f"the {side} finger reaches no point of it within its joint limits"
    first = left.points[:, None], left.normals[:, None]
    if not force_closure(scene.friction, first, (right.points, right.normals)).any():
        return "no two reachable points have their line inside both friction cones"
    return "the fingers would meet, or the object meets the palm, in every grip that holds it"


@lru_cache(maxsize=8)
def scene_of(hand: HandSpec, spec: ObjectSpec, config: ReachConfig, *, finer: bool = False) -> Scene:
    """Return a hand and an object as all paths have them in common, with the outline in coarse or finer cells."""
    parts = FINE_CELLS if finer else 1
    body = body_of(spec, config.resolution / parts, config.fan / parts)
    friction = hand.friction * spec.friction if config.friction is None else config.friction
    count = int(np.ceil(config.rotation * TURN_ARM / config.resolution - 1e-9))
    turns = np.linspace(-config.rotation, config.rotation, 2 * count + 1)
    coarser = scene_of(hand, spec, config).body if finer else body
    coarse = coarser.nearest(body.cells.points, body.cells.normals)
    left, right = (toucher(hand, finger, body.cells, body.pieces) for finger in hand.fingers)
    return Scene(hand, body, (left, right), friction, turns, parts, coarse)


def _walk(scene: Scene, poses: Array, column: _Column | None, around: int | None = None) -> Iterator[_Column]:
    """Give what is reached at each pose `(P, 3)` in turn, from what was reached before the first, until nothing is.

    None before the first starts with every grip of it. Only cells `around` the last grips are looked at, or all.
    """
    turned = poses[:, None] + scene.turns[:, None] * np.array([0.0, 0.0, 1.0])
    free, palm = np.ones(turned.shape[:-1], dtype=bool), palm_outline(scene.hand)
    for piece in scene.body.pieces:
        free &= separation(palm, transform(turned[..., None, :], piece)) > -OVERLAP
    rooms = Rooms(scene.touchers, len(scene.body.cells))
    for k, here in enumerate(turned):
        if around is not None and column is not None and k % (FINE // 2) == 0:
            rooms.choose(_around(scene.body, column, around))
        place = Place(scene, rooms, here, free[k])
        column = _first(place) if column is None else _next(place, column)
        if not any(column):
            return
        yield column


@dataclass(frozen=True, eq=False)
class Place:
    """A place on the path, at every rotation away from it."""

    scene: Scene
    rooms: Rooms
    poses: Array
    """The object's poses `(T, 3)`."""
    free: Flags
    """Where object and palm keep apart `(T,)`."""

    def grips(self, turn: int, before: Grips | None, coarser: Scene | None = None) -> Grips | None:
        """Return the grips at one rotation that others lead to, all of them if None; looked for near the others.

        Nothing is missed: as long as a grip lies beside chosen cells that were not looked at, these are looked at, too.
        The others may be of a scene of coarser cells.
        """
        if not self.free[turn]:
            return None
        scene, rooms, around = self.scene, self.rooms, self.scene.hop + AHEAD
        used = (before.sides[0].cell, before.sides[1].cell) if before and not coarser else (NO_CELLS, NO_CELLS)
        for k, near in enumerate(rooms.near):
            near.near[:] = before is None
            if before and coarser:
                near.near[:] = _near(coarser.body, before.sides[k].cell, coarser.hop)[scene.coarse]
        step = Step(scene.cone, (coarser or scene).hop, rooms.n_cells, len((coarser or scene).body.cells))
        while True:
            sides = rooms.sides(self.poses[turn : turn + 1], used, around)
            seen = _in_coarse(scene, sides) if coarser else None
            found = grips_of(rooms.pairs(sides, before), sides, scene.chains, step, before, seen=seen)
            if found is None or rooms.holds(found):
                return found
            used, around = (found.sides[0].cell, found.sides[1].cell), 1 + AHEAD


def _in_coarse(scene: Scene, sides: Sides) -> Sides:
    """Return postures with the coarse cells that they touch."""
    left, right = (side._replace(cell=scene.coarse[side.cell]) for side in sides)
    return left, right


def _near(body: Body, used: Indices, around: int) -> Flags:
    """Return which cells are at most `around` cells from some `(U,)`."""
    near = np.zeros(len(body.cells), dtype=bool)
    near[(used[:, None] + np.arange(-around, around + 1)) % len(near)] = True
    return near


def _around(body: Body, column: _Column, around: int) -> tuple[Flags, Flags]:
    """Return which cells are at most `around` cells from those of each finger in any grip of a column `(U,)`."""
    left, right = (np.concatenate([each.sides[k].cell for each in column if each is not None]) for k in range(2))
    return _near(body, left, around), _near(body, right, around)


def _first(place: Place) -> _Column:
    """Return every grip at the start, without rotation, found once for all paths that start there."""
    middle, starts = len(place.poses) // 2, place.scene.starts
    key = place.poses[middle].tobytes()
    found = starts.get(key)
    if found is None:
        found = place.grips(middle, None)
        starts.clear()  # paths of one scene mostly start at one pose
        starts[key] = found
    return [found if t == middle else None for t in range(len(place.poses))]


def _refined(scene: Scene, fine: Scene, pose: Array, column: _Column) -> _Column:
    """Return what is reached at a pose `(1, 3)` in finer cells, from what is in coarser ones."""
    left, right = (looked_at[fine.coarse] for looked_at in _around(scene.body, column, AROUND))
    poses = pose + fine.turns[:, None] * np.array([0.0, 0.0, 1.0])
    rooms = Rooms(fine.touchers, len(fine.body.cells))
    rooms.choose((left, right))
    place = Place(fine, rooms, poses, np.array([held is not None for held in column]))
    return [place.grips(t, held, scene) for t, held in enumerate(column)]


def _next(place: Place, before: _Column) -> _Column:
    """Return what is reached at a place from the one before, and from there by turning the object."""
    column: _Column = [None] * len(place.poses)
    waiting = [t for t, held in enumerate(before) if held is not None]
    while waiting:
        t = waiting.pop(0)
        sides = [s for s in (t - 1, t + 1) if 0 <= s < len(column)]
        found = place.grips(t, merged([each for each in (before[t], *(column[s] for s in sides)) if each is not None]))
        known = column[t]
        if found is not None and (known is None or found.held.sum() > known.held.sum()):
            column[t] = found
            waiting += [s for s in sides if s not in waiting]
    return column


def _described(scene: Scene, pose: Array, way: float, column: _Column) -> Farthest:
    """Return, of the grips left at the end, one well inside the friction cones and near the object's middle."""
    held = [(abs(turn), t, each) for t, (turn, each) in enumerate(zip(scene.turns, column, strict=True)) if each]
    _, t, last = min(held, key=lambda each: each[:2])
    first, second = (side.only(rows) for side, rows in zip(last.sides, np.nonzero(last.held), strict=True))
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
