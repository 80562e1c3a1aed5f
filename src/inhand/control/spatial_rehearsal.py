"""Grasps in space tried out in simulation, on the object where it stands and under the gravity that it has.

As in the plane a search on paper does not know what closing the fingers does. The best few grasps of every path are
closed in simulated worlds of their own, take the object's weight and carry it to where the grip that is measured there
is predicted to end. Of those that keep it the one is taken that goes farthest, less a cost for what it strays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import SpatialTask
from inhand.control.loop import Bench, Recording, simulate
from inhand.control.phases import Grasp
from inhand.control.spatial_follow import stops_at
from inhand.control.spatial_ik import SpatialIkConfig, SpatialIkController, grip_for
from inhand.control.trial import REACHED, TIME_OUT
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.grasp_search import SpatialGrasp, SpatialSearchConfig, search_grasps
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.kinematics import inverse
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins
from inhand.hands.spatial.shared_grasps import search_shared, worth_together
from inhand.rotations import SpatialPath, placed
from inhand.tasks.spatial.paths import SpatialReference, hold_path, stacked_paths, whole_spatial_path

LONGEST, SLOWEST = 8.0, 0.65
"""Time for which an object is carried at most [s]; more where paths are longer than the expert comes in it at this
share of its speed."""
LOSS = 1.0
"""Way that losing the object costs a grasp [m]: more than any other grasp can gain."""
AT_ONCE = 150
"""Worlds whose grasps are tried at a time: about a thousand worlds, whose states take 0.3 GB."""
GAP = 0.7
"""Way that it costs the one grasp for all to have a finger off the object for a while [m]: less than losing it, and
more than can be gained. A sequence takes the finger back, and goes farther so."""
LOST = -LOSS / 2
"""A grasp that is worth less has lost the object, or a finger has [m]."""
WIDE = ((0.006, 0.35), (0.015, 0.7))
"""Margins from the predicted end where every grasp loses the object before it, each where those before do not do [m,
rad]."""
TO_THE_END = ((0.006, 0.21), (0.004, 0.14), (0.003, 0.1), (0.0, 0.0), (-0.002, -0.07))
"""Margins that the one grasp for all is tried with in the end, in its very worlds, the last beyond the end [m, rad]."""
ASIDE = 12.0
"""Way that it costs the one grasp for each metre that the object is beside its path, held at its end too (guessed)."""
BEHIND = 0.6
"""Where grasps go less than this share of the way that the search found, they are told to go as far as that: a start
some tenths of a millimetre off can cost the room that the prediction asks for at one pose, though nothing meets."""
STRAYED = 6.0
"""Way that an object costs which strays from its path, for each metre beside it: guessed, a grasp that turns the object
by 5 deg is worth 13 mm less than one that does not."""
CLOSE = Margins(links=5e-4, fingers=0.001, joints=0.02)
"""What fingers keep in a second search, little more than the prediction of the end does: what comes too close is lost
in the rehearsal, where each grasp is tried in the very world that it is for."""
GAIN = 0.004
"""Its grasps are tried where they go this much farther than others [m]."""
OTHERS, OTHERWISE = 24, 0.015
"""Where all of a path lose their object, so many more of its grasps are tried, this far apart at a contact [m]."""
PLAIN = SpatialIkConfig()
"""Numbers by which grasps are tried that a learned policy carries."""
OPENING, SQUEEZE = 0.008, 0.002
"""How far fingers stand off their contacts before they close, and how far inside the object they aim [m]."""


def planned_in_space(
    hand: SpatialHand,
    spec: SolidSpec,
    paths: Sequence[SpatialReference],
    gravity: Array,
    starts: Array,
    *,
    bench: Bench,
    fixed: bool = False,
    shared: bool = False,
    told: Callable[[SpatialPath, Array], Array] | None = None,
    config: SpatialIkConfig = PLAIN,
) -> Grasp:
    """Return for every path the grasp of the contact search that goes farthest in simulation, closed at its start.

    Paths count from where their objects stand, or, if they are `fixed`, from where the hand starts them. One grasp may
    be `shared` by all. `told` is what makes of paths and the ways `(B,)` [m] that are found those to go, `config` the
    numbers of the expert that tries them.

    Raises:
        InputError: no contacts hold the object at its start.
    """
    gravities, held = np.unique(gravity, axis=0), (hand, spec)
    worlds = Worlds(gravity, starts, np.broadcast_to(hand.start_pose, starts.shape) if fixed else None)
    if shared:
        tried = tried_together(held, _searched_together(held, paths, gravities), paths, worlds, (bench, config))
    else:
        groups, tried = searched(held, paths, gravities, bench, config.closer), []
        for part in _parts(len(paths)):
            some = [paths[k] for k in part]
            tried += tried_out(held, [groups[path.name] for path in some], some, worlds.some(part), (bench, config))
    way = np.array([each.way for each in tried])
    if told is not None:
        way = told(stacked_paths(paths), way)
    return replace(closed_at(hand, [each.grasp for each in tried], starts), way=way)


def searched(
    held: tuple[SpatialHand, SolidSpec],
    paths: Sequence[SpatialReference],
    gravities: Array,
    bench: Bench,
    closer: int = SpatialIkConfig.closer,
) -> dict[str, list[SpatialGrasp]]:
    """Return the grasps of the contact search for paths, by their names, some of them `closer` to what they avoid."""
    hand, spec = held
    firsts = {path.name: path for path in reversed(paths)}
    whole = [whole_spatial_path(path) for path in firsts.values()]
    names = iter(firsts)

    def told() -> None:
        if bench.progress is not None:
            bench.progress(f"grasps {next(names)}", len(paths), 0)

    config = search_of(spec, gravities)
    found = search_grasps(held, hand.start_pose, whole, gravities, config=config, progress=told)
    close = search_grasps(held, hand.start_pose, whole, gravities, config=replace(config, margins=CLOSE, keep=closer))
    groups = {
        name: [*usual, *(each for each in more if not usual or each.way > usual[0].way + GAIN)]
        for name, usual, more in zip(firsts, found, close, strict=True)
    }
    none = [name for name, group in groups.items() if not group]
    if none:
        raise _without_grasp(held, ", ".join(none))
    return groups


def _searched_together(
    held: tuple[SpatialHand, SolidSpec], paths: Sequence[SpatialReference], gravities: Array
) -> list[SpatialGrasp]:
    """Return the grasps that are worth most along all paths together."""
    whole = [whole_spatial_path(path) for path in {path.name: path for path in reversed(paths)}.values()]
    found = search_shared(held, held[0].start_pose, whole, gravities, search_of(held[1], gravities))
    if not found:
        raise _without_grasp(held, "all directions together")
    return found


def _without_grasp(held: tuple[SpatialHand, SolidSpec], what: str) -> InputError:
    hand, spec = held
    return InputError(
        f"no grasp of {hand.name} holds {spec.name} against its weight for {what}: use a lighter or smaller object,"
        " more friction, or another hand or gravity"
    )


def _parts(count: int) -> list[list[int]]:
    """Return the numbers of worlds in parts that are tried at once."""
    return [list(range(first, min(first + AT_ONCE, count))) for first in range(0, count, AT_ONCE)]


class Worlds(NamedTuple):
    """In which worlds grasps are tried."""

    gravity: Array
    """Gravity in each `(B, 3)` [m/s^2]."""
    starts: Array
    """Where each object starts `(B, 7)`."""
    origin: Array | None = None
    """Where each path counts from `(B, 7)`; None for where the object is."""

    def some(self, which: Sequence[int] | NDArray[np.int64]) -> "Worlds":
        """Return some of the worlds, in an order."""
        origin = None if self.origin is None else self.origin[which]
        return Worlds(self.gravity[which], self.starts[which], origin)


@dataclass(frozen=True, eq=False)
class Tried:
    """A grasp, as it did in a world."""

    grasp: SpatialGrasp
    way: float
    """Where its set point stops [m]."""
    worth: float
    """How far it goes less what it strays, and less `LOSS` where the object is lost [m]."""


def tried_out(
    held: tuple[SpatialHand, SolidSpec],
    groups: Sequence[Sequence[SpatialGrasp]],
    paths: Sequence[SpatialReference],
    worlds: Worlds,
    how: tuple[Bench, SpatialIkConfig],
) -> list[Tried]:
    """Return the best grasp of every world; where all lose the object they stop farther before, or others are tried."""
    found = [_best(group) for group in rehearsed(held, groups, paths, worlds, how)]
    again = _Again(held, found, groups, paths, worlds, how)
    again.stop_before()
    again.take_others()
    ways = [max(_planned_way(grasp, path) for grasp in group) for group, path in zip(groups, paths, strict=True)]
    short = [k for k, each in enumerate(found) if each.way < BEHIND * ways[k]]
    again.try_out(short, planned=True)
    return found


def _planned_way(grasp: SpatialGrasp, path: SpatialReference) -> float:
    """Return how far along a path a grasp was planned to go [m], after the turn that the path holds."""
    return grasp.way - TURN_ARM * float(np.linalg.norm(path.hold))


@dataclass(frozen=True, eq=False)
class _Again:
    """Grasps of worlds that are tried again in another way; what is worth more takes the place of what was found."""

    held: tuple[SpatialHand, SolidSpec]
    found: list[Tried]
    groups: Sequence[Sequence[SpatialGrasp]] | dict[int, list[SpatialGrasp]]
    paths: Sequence[SpatialReference]
    worlds: Worlds
    how: tuple[Bench, SpatialIkConfig]
    strict: bool = False
    """Whether a finger may not be off the object for a while."""

    def stop_before(self) -> None:
        """Try those that lose the object once more, to stop farther before its end."""
        for margin in WIDE:
            self.try_out(self.lost, margin)

    def take_others(self) -> None:
        """Try other grasps where all lose the object: those that are alike may all fail to close."""
        lost, gravities = self.lost, np.unique(self.worlds.gravity, axis=0)
        config = replace(search_of(self.held[1], gravities), keep=OTHERS, apart=OTHERWISE)
        whole = [whole_spatial_path(self.paths[k]) for k in lost]
        others = search_grasps(self.held, self.held[0].start_pose, whole, gravities, config=config)
        replace(self, groups=dict(zip(lost, others, strict=True))).try_out(lost)

    @property
    def lost(self) -> list[int]:
        """Which worlds have lost their object."""
        return [k for k, each in enumerate(self.found) if each.worth < LOST]

    def try_out(self, rows: Sequence[int], margin: tuple[float, float] | None = None, *, planned: bool = False) -> None:
        """Try the grasps of some worlds, perhaps with another margin."""
        if not rows:
            return
        groups, paths = [self.groups[k] for k in rows], [self.paths[k] for k in rows]
        (bench, config), worlds = self.how, self.worlds.some(rows)
        how = bench, config if margin is None else replace(config, margin=margin)
        again = rehearsed(self.held, groups, paths, worlds, how, planned=planned, strict=self.strict)
        for k, group in zip(rows, again, strict=True):
            self.found[k] = _best([self.found[k], *group])


def _best(group: Sequence[Tried]) -> Tried:
    """Return the first of those that are worth most."""
    return max(group, key=lambda one: one.worth)


def tried_together(
    held: tuple[SpatialHand, SolidSpec],
    grasps: Sequence[SpatialGrasp],
    paths: Sequence[SpatialReference],
    worlds: Worlds,
    how: tuple[Bench, SpatialIkConfig],
) -> list[Tried]:
    """Return for every world the one grasp that is worth most in all of them, and loses the object in fewest."""
    found = list[list[Tried]]()
    for part in _parts(len(paths)):
        some = [paths[k] for k in part]
        found += rehearsed(held, [grasps] * len(part), some, worlds.some(part), how, strict=True)
    worth = np.array([[each.worth for each in group] for group in found]).T
    best = int((worth_together(np.maximum(worth, 0.0), paths) - (worth < LOST).sum(axis=1)).argmax())
    tried = [group[best] for group in found]
    again = _Again(held, tried, [[grasps[best]]] * len(tried), paths, worlds, how, strict=True)
    again.stop_before()
    for margin in TO_THE_END:
        again.try_out(range(len(tried)), margin)
    return tried


def search_of(spec: SolidSpec, gravities: Array) -> SpatialSearchConfig:
    """Return how the search looks: with the grip that the expert has of an object of such a weight."""
    config = SpatialSearchConfig()
    weight = np.array([spec.mass * np.linalg.norm(gravities, axis=-1).max()])
    return replace(config, rules=replace(config.rules, grip=float(grip_for(weight, SpatialIkConfig())[0])))


def closed_at(hand: SpatialHand, grasps: Sequence[SpatialGrasp], starts: Array, squeeze: float = SQUEEZE) -> Grasp:
    """Return joint angles that stand off the contacts of a grasp for each start `(B, 7)`, and that press on them.

    Fingers that press aim inside the object by `squeeze` [m].
    """
    opened, closed = np.empty((2, len(starts), hand.n_joints))
    for f, (finger, own) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        points, normals = (np.stack([getattr(grasp, name)[f] for grasp in grasps]) for name in ("points", "normals"))
        planned = np.stack([grasp.joints[own] for grasp in grasps])[:, None]
        for found, off in ((opened, OPENING), (closed, -squeeze)):
            goals = placed(starts, points + (finger.tip_radius + off) * normals)
            found[:, own] = inverse(finger, goals, planned)[0][:, 0]
    return Grasp(opened, closed)


def rehearsed(
    held: tuple[SpatialHand, SolidSpec],
    groups: Sequence[Sequence[SpatialGrasp]],
    paths: Sequence[SpatialReference],
    worlds: Worlds,
    how: tuple[Bench, SpatialIkConfig],
    *,
    planned: bool = False,
    strict: bool = False,
) -> list[list[Tried]]:
    """Return what each world's grasps are worth in it: how far they go, less what the object strays.

    They go as far as the grip that is measured is predicted to hold, or as they were `planned` to. Where it is `strict`
    a finger that is off the object for a while costs `GAP`.
    """
    (hand, spec), (bench, config) = held, how
    owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    grasps, mine = [grasp for group in groups for grasp in group], [paths[k] for k in owner.tolist()]
    there, path = worlds.some(owner), stacked_paths(mine)
    way = np.minimum(list(map(_planned_way, grasps, mine)), path.length)
    told = stops_at(path, way, config.margin) if planned else None
    task = SpatialTask(hand, (spec,) * len(owner), path, gravity=there.gravity, start=there.origin, distance=told)
    made = [SpatialIkController(task, config)]  # which stays the last where no world holds its object

    def carry(task: SpatialTask) -> SpatialIkController:
        made.append(SpatialIkController(task, config))
        return made[-1]

    twists = stacked_paths([hold_path(path) for path in mine])
    closed, silent = closed_at(hand, grasps, there.starts), replace(bench, progress=None)
    _, found = simulate(task, closed, there.starts, carry, silent, twists=twists, longest=longest_of(path, config))
    kept, last = np.isin(np.array(found.outcomes), (REACHED, TIME_OUT)), made[-1]
    cost = np.where(kept, np.where(always_held(found), 0.0, GAP) if strict else 0.0, LOSS)
    worth = last.progress - (ASIDE * last.aside if strict else STRAYED * last.strayed) - cost
    tried = [Tried(grasps[k], float(last.limit[k]), float(worth[k])) for k in range(len(grasps))]
    return [[tried[k] for k in np.flatnonzero(owner == w)] for w in range(len(groups))]


def always_held(found: Recording) -> NDArray[np.bool_]:
    """Return in which worlds all fingers touch for the whole of the last phase `(B,)`."""
    rows = np.flatnonzero(found.phase == len(found.phases) - 1)
    touching: NDArray[np.bool_] = np.array([found.states[row].touching for row in rows])
    return np.asarray(touching.all(axis=(0, 2)))


def longest_of(path: SpatialPath, config: SpatialIkConfig) -> float:
    """Return for how long objects are carried along paths at most [s]."""
    return max(LONGEST, float(path.length.max()) / (SLOWEST * config.speed))
