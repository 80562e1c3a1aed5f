"""States in which episodes of learning start: the object held, a direction given, nothing moved yet.

Placing and grasping take as long as carrying, so a trial's phases are run once for a whole pool of starts, each with
noise of its own; an episode starts from a row of the pool. Rows may also be taken in the middle of other episodes, so
that a primitive can begin anywhere in the workspace.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control import loop
from inhand.control.catalogue import direction_plans
from inhand.control.controller import Task
from inhand.control.loop import Bench, simulate
from inhand.control.policy import carried_by
from inhand.control.rehearsal import closing_joints
from inhand.control.sensed_plan import SQUEEZE, candidates
from inhand.control.user_policy import GraspKind
from inhand.errors import InputError
from inhand.geometry import Array, Path
from inhand.hands.fit import Held
from inhand.hands.grasp_search import GraspPlan, SearchConfig
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.sides import rough_plan
from inhand.hands.spatial.hand import SpatialHand
from inhand.learning.pairs import Pairs, all_pairs
from inhand.learning.space import Space, joined_spaces
from inhand.records import Config
from inhand.sim.disturbance import Disturbance
from inhand.sim.drawn import Disturbed, draw
from inhand.sim.engine import Simulator
from inhand.sim.names import ENGINE, Engine
from inhand.sim.snapshot import Snapshot, join
from inhand.sim.state import State, select
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TURNS, primitive_at
from inhand.tasks.routes import Routes

Grips = GraspPlan | list[GraspPlan]
"""A grasp, or several of which one is drawn."""
Plans = Mapping[Any, Grips]
"""Grasps by direction [deg], or by the word of what has none."""
FAR = 0.75
"""Of several grasps those are taken that reach at least this share of the farthest."""
GRID_DEG = 7.5
"""Spacing of the directions that grasps are planned for; one between them takes the nearest's [deg]."""


@dataclass(frozen=True)
class Noise(Config):
    """Standard deviations of the object's start."""

    position: float = 0.001
    """In x and y [m]."""
    rotation: float = float(np.deg2rad(1.0))
    """In theta [rad]."""

    @property
    def spread(self) -> Array:
        """Of x, y and theta `(3,)` [m, m, rad]."""
        return np.array([self.position, self.position, self.rotation])


@dataclass(frozen=True, eq=False)
class Starts:
    """N states to start from."""

    snapshot: Snapshot
    """The worlds `(N, ...)`."""
    state: State
    """What is measured in them `(N, ...)`."""
    angle_deg: Array
    """The direction to move in `(N,)` [deg]."""
    distance: Array
    """The way to go `(N,)` [m], infinite where none is given."""
    routes: Routes | None = None
    """Whole routes to follow instead; a start of a route has no direction of its own, 0 stands for it."""
    engine: Engine = ENGINE
    """The engine in which the object is held; episodes from here run in it."""
    disturbed: tuple[Disturbed, ...] | None = None
    """How the world of each start is disturbed, which episodes from it are too; None where nothing is."""
    turn: Array | None = None
    """Side to which each is to turn on the spot instead `(N,)`, as `Aim.turn`; None where all move."""
    legs: Array | None = None
    """What is asked after that `(N, L, 3)`, as in `inhand.learning.legs`; None where nothing is."""
    pairs: Pairs | None = None
    """The hand and the object of each start, where they differ."""
    space: Space | None = None
    """What is asked of a hand in space instead, whose starts have no direction in the plane: 0 stands for it."""

    def __len__(self) -> int:
        """Return the number of starts."""
        return len(self.angle_deg)

    @property
    def asked_in_space(self) -> Space:
        """What is asked of a hand in space.

        Raises:
            ValueError: starts of a hand in the plane.
        """
        if self.space is None:
            raise ValueError("starts of a hand in the plane are asked nothing in space")
        return self.space

    def take(self, rows: NDArray[np.int64], angle_deg: Array) -> Starts:
        """Return some starts with other directions [deg] and no way to go yet; routes stay."""
        routes = None if self.routes is None else Routes(self.routes.poses[rows])
        disturbed = None if self.disturbed is None else tuple(self.disturbed[row] for row in rows.tolist())
        snapshot, state, distance = self.snapshot.take(rows), select(self.state, rows), np.full(len(rows), np.inf)
        pairs = None if self.pairs is None else self.pairs.take(rows)
        space = None if self.space is None else self.space.take(rows)
        return Starts(snapshot, state, angle_deg, distance, routes, self.engine, disturbed, pairs=pairs, space=space)

    def rows(self, rows: NDArray[np.int64]) -> Starts:
        """Return some starts, of which the same is asked."""
        turn, legs = (None if each is None else each[rows] for each in (self.turn, self.legs))
        taken = self.take(rows, self.angle_deg[rows])
        return replace(taken, distance=self.distance[rows], turn=turn, legs=legs)


def joined(parts: Sequence[Starts]) -> Starts:
    """Return several pools of one engine as one."""
    states = {field.name: np.concatenate([getattr(p.state, field.name) for p in parts]) for field in fields(State)}
    angle_deg, distance = (np.concatenate([getattr(part, n) for part in parts]) for n in ("angle_deg", "distance"))
    found = [part.routes.poses for part in parts if part.routes is not None]
    routes = Routes(np.concatenate(found)) if found else None
    snapshot = join([part.snapshot for part in parts])
    worlds = tuple(world for part in parts for world in part.disturbed or ()) or None
    turn = _together([part.turn for part in parts], parts, 0.0)
    legs = _together([part.legs for part in parts], parts, np.nan)
    pairs = all_pairs([part.pairs for part in parts if part.pairs is not None])
    asked = angle_deg, distance, routes, parts[0].engine, worlds, turn, legs, pairs
    return Starts(
        snapshot,
        replace(parts[0].state, **states),
        *asked,
        joined_spaces([p.space for p in parts if p.space is not None]),
    )


def _together(given: Sequence[Array | None], parts: Sequence[Starts], nothing: float) -> Array | None:
    """Return an array of several pools as one, filled where a pool has none; None where none has it."""
    known = next((each for each in given if each is not None), None)
    if known is None:
        return None
    return np.concatenate(
        [
            np.full((len(part), *known.shape[1:]), nothing) if each is None else each
            for each, part in zip(given, parts, strict=True)
        ]
    )


def straight_task(held: Held, angle_deg: Array, distance: Array | None = None) -> Task:
    """Return the task of moving along directions `(B,)` [deg], at most some distance `(B,)` [m]."""
    paths = np.stack([straight_path(primitive_at(angle)).poses for angle in angle_deg])
    hand, spec = held
    return Task(hand, (spec,) * len(paths), Path(paths), distance=distance)


def expert_task(held: Held, starts: Starts) -> Task:
    """Return what an expert has to do from some starts: their directions or their routes."""
    if starts.routes is None:
        return straight_task(held, starts.angle_deg, starts.distance)
    poses, paths = starts.routes.poses, starts.routes.poses - starts.routes.poses[:, :1]
    objects, distance = (held.object,) * len(poses), starts.routes.length
    return Task(held.hand, objects, Path(paths), distance=distance, start=poses[:, 0])


def turn_task(held: Held, sides: Array) -> Task:
    """Return the task of turning on the spot to sides `(B,)`, 1 counter-clockwise and -1 clockwise."""
    paths = {float(np.sign(each.rotation_deg)): straight_path(each).poses for each in TURNS}
    return Task(held.hand, (held.object,) * len(sides), Path(np.stack([paths[side] for side in sides.tolist()])))


def reach_of(held: Held, starts: Starts) -> Array:
    """Return how far the grip of each start is predicted to carry the object along its direction `(N,)` [m].

    Of pairs each start's own hand and object counts, of one that is to turn the arc that it turns by.
    """
    found = np.zeros(len(starts))
    of = np.zeros(len(starts)) if starts.pairs is None else starts.pairs.of
    turning = np.zeros(len(starts)) if starts.turn is None else np.abs(starts.turn)
    for number, turns in dict.fromkeys(zip(of.tolist(), turning.tolist(), strict=True)):
        rows = np.flatnonzero((of == number) & (turning == turns))
        own = held if starts.pairs is None else starts.pairs.held[number]
        found[rows] = _reach_of_one(own, starts.rows(rows))
    return found


def _reach_of_one(held: Held, starts: Starts) -> Array:
    """Return the same of starts of one pair, which are all to move or all to turn."""
    if starts.turn is not None and starts.turn.any():
        return carried_by(turn_task(held, starts.turn), starts.state)
    task, between = straight_task(held, starts.angle_deg), None
    if starts.disturbed is not None and len(starts):
        between = loop.stand_between(starts.disturbed, starts.state, task.timestep, task.substeps)
    return carried_by(task, loop.sense(starts.state, between))


def grid_of(angles_deg: Array) -> tuple[float, ...]:
    """Return the directions of the grid nearest to some directions [deg], each once, from 0 up to 360."""
    return tuple(float(a) for a in np.unique(np.round(np.asarray(angles_deg) / GRID_DEG) * GRID_DEG % 360.0))


def plans_for(
    hand: HandSpec, spec: ObjectSpec, angles_deg: Sequence[float], grasp: GraspKind = "planned", engine: Engine = ENGINE
) -> dict[float, GraspPlan]:
    """Return the grasp of each direction [deg]; a rough one is the same for all."""
    if grasp == "rough":
        return dict.fromkeys(angles_deg, rough_plan(hand, spec))
    return dict(zip(angles_deg, direction_plans(hand, spec, straight_poses(hand, angles_deg), engine), strict=True))


def straight_poses(hand: HandSpec, angles_deg: Sequence[float]) -> Array:
    """Return the poses `(P, S, 3)` from where a hand holds objects straight along directions [deg]."""
    return np.stack([hand.start_pose + straight_path(primitive_at(angle)).poses for angle in angles_deg])


def varied_plans(held: Held, poses: Array, far: float = FAR) -> list[list[GraspPlan]]:
    """Return grasps of each path `(P, S, 3)` that are searched for several shares of the friction, all that go far.

    That is to this share of the farthest.
    """
    found, reach = candidates(held, poses)
    plans: list[list[GraspPlan]] = [[] for _ in poses]
    for each in found:
        if each.reach >= far * reach[each.path]:
            plans[each.path].append(each.plan)
    return plans


def grips_along(held: Held, poses: Array, grasp: str, engine: Engine) -> Sequence[Grips]:
    """Return what starts of each path of poses `(P, S, 3)` are gripped by, planned as `Recipe.grasp` says."""
    if grasp == "sensed":
        return varied_plans(held, poses)
    return [rough_plan(*held)] * len(poses) if grasp == "rough" else direction_plans(*held, poses, engine)


def gripped(
    hand: HandSpec,
    spec: ObjectSpec,
    grips: tuple[Plans | Sequence[Grips], Array],
    rng: np.random.Generator,
    noise: Noise | None = None,
    *,
    engine: Engine = ENGINE,
    threads: int = 0,
    disturb: Disturbance | None = None,
) -> Starts:
    """Return starts with all fingers of a hand on an object; one whose grasp fails is drawn again.

    `grips` are plans by direction [deg] or one for each start, and the direction of each start `(N,)` [deg]. Of several
    plans one is drawn, and then fingers close where objects were planned to stand, not where they do. Each is held in a
    world of its own that `disturb` draws.

    Raises:
        InputError: in ten draws a start could not be held.
    """
    given, angles = grips
    blind = any(isinstance(each, list) for each in (given.values() if isinstance(given, Mapping) else given))
    noise, bench = noise or Noise(), Bench(engine, threads=threads)
    plans = [_one_of(each, rng) for each in _offered(given, angles)]
    waiting, found, places = np.arange(len(angles)), list[Starts](), list[NDArray[np.int64]]()
    for _ in range(10):
        poses = hand.start_pose + noise.spread * rng.standard_normal((len(waiting), 3))
        worlds = drawn_worlds(hand, disturb, rng, len(waiting))
        starts = _close(Held(hand, spec), [plans[k] for k in waiting.tolist()], (poses, not blind), bench, worlds)
        held = starts.state.touching.all(axis=-1) & ~starts.state.diverged
        found.append(starts.take(np.flatnonzero(held), angles[waiting[held]]))
        places.append(waiting[held])
        waiting = waiting[~held]
        if len(waiting) == 0:
            whole, order = joined(found), np.argsort(np.concatenate(places), kind="stable")
            return whole.take(order, whole.angle_deg[order])
    raise InputError(
        f"the grasp of {spec.name!r} with {hand.name!r} for direction {angles[waiting[0]]:g} deg failed ten times in a"
        " row; use less start noise, another object or another hand"
    )


def taken(
    simulator: Simulator,
    state: State,
    worlds: NDArray[np.int64],
    angle_deg: Array,
    of: Starts | None = None,
) -> Starts:
    """Return what some worlds of a running batch look like now, as starts with directions `(N,)` [deg].

    They are disturbed, and of hands and objects, as the starts `of` the whole batch.
    """
    snapshot, distance = simulator.snapshot().take(worlds), np.full(len(worlds), np.inf)
    found = Starts(snapshot, select(state, worlds), angle_deg, distance, engine=simulator.engine)
    if of is None:
        return found
    own = of.take(worlds, angle_deg)
    return replace(found, disturbed=own.disturbed, pairs=own.pairs, space=own.space)


def drawn_worlds(
    hand: HandSpec | SpatialHand, disturb: Disturbance | None, rng: np.random.Generator, count: int
) -> tuple[Disturbed, ...] | None:
    """Return how drawn worlds are disturbed; None where nothing is."""
    if disturb is None or count == 0:
        return None
    keys, space = rng.integers(2**62, size=count).tolist(), isinstance(hand, SpatialHand)
    return tuple(draw(disturb, (key,), hand.n_joints, space=space) for key in keys)


def _one_of(plans: Grips, rng: np.random.Generator) -> GraspPlan:
    return plans[rng.integers(len(plans))] if isinstance(plans, list) else plans


def _offered(grips: Plans | Sequence[Grips], angles: Array) -> Sequence[Grips]:
    """Return what each start is offered to be held by."""
    return [grips[a] for a in _nearest(grips, angles)] if isinstance(grips, Mapping) else grips


def _nearest(plans: Plans, angles: Array) -> list[float]:
    """Return of each direction the nearest that has a plan [deg]."""
    have = np.array([angle for angle in plans if not isinstance(angle, str)])
    away = np.abs((angles[:, None] - have + 180.0) % 360.0 - 180.0)
    return [float(a) for a in have[away.argmin(axis=1)]]


def _close(
    held: Held,
    plans: list[GraspPlan],
    stand: tuple[Array, bool],
    bench: Bench,
    disturbed: tuple[Disturbed, ...] | None,
) -> Starts:
    """Close the fingers on objects that stand at poses `(N, 3)`, which are known or not."""
    (poses, known), count = stand, len(plans)
    planned = np.tile(held.hand.start_pose, (count, 1))
    squeeze = SearchConfig.squeeze if known else SQUEEZE
    grasp = closing_joints(*held, plans, planned, poses if known else planned, squeeze=squeeze)
    task = Task(held.hand, (held.object,) * count, Path(np.zeros((count, 1, 3))))
    simulator, recording = simulate(task, grasp, poses, None, bench, disturbed=disturbed)
    found = taken(simulator, recording.states[-1], np.arange(count), np.zeros(count))
    return replace(found, disturbed=disturbed)
