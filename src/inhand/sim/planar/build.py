"""The numbers of a planar model, from the specs of hands, objects and what surrounds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.caches import cached
from inhand.geometry import Array, perpendicular
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, centre_of_mass, convex_pieces, polygon
from inhand.hands.outlines import centroid, second_moments
from inhand.hands.polygons import edge_normals, is_box
from inhand.hands.shapes import link_outline, palm_outline
from inhand.sim.planar.parts import Model
from inhand.sim.scene import SceneSpec

World: TypeAlias = tuple[HandSpec, ObjectSpec, SceneSpec]

LEAST_FRICTION = 1e-5
"""MuJoCo's smallest friction."""
TWO = 2.0
"""Contacts of the three-dimensional scene that one here can stand for: a fingertip's two rims, or the two ends of an
upright edge that lies on a face."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A convex outline of a body."""

    corners: Array
    """Corners in the body's frame `(C, 2)` [m], counter-clockwise; the middle of a circle `(1, 2)`; none `(0, 2)`."""
    radius: float = 0.0
    """Radius of a circle [m]."""


NOTHING = Outline(np.zeros((0, 2)))


def planar_inertia(spec: ObjectSpec) -> float:
    """Return an object's moment of inertia about the vertical through its centre of mass [kg m^2]."""
    if spec.shape == "cylinder":
        return spec.mass * spec.size[0] ** 2 / 8
    return float(spec.mass * np.trace(second_moments(polygon(spec))))


def friction_arm(spec: ObjectSpec) -> float:
    """Return the arm [m] at which the floor's friction on a turning object acts.

    The object stands on the corners of its outline's hull, a cylinder on its rim, as MuJoCo lets it. The corners carry
    loads that balance about the centre of mass and are as even as can be; the arm is their mean distance from it.
    """
    if spec.shape == "cylinder" and not any(spec.centre):
        return spec.size[0] / 2
    from scipy.optimize import nnls  # whose import takes a warm run 0.2 s more than reading the arm does
    from scipy.spatial import ConvexHull

    corners = polygon(spec)
    away = corners[ConvexHull(corners).vertices] - centre_of_mass(spec)
    even = 1e-3 * np.abs(away).max()
    rows = np.vstack([np.ones(len(away)), away.T / np.abs(away).max(), even * np.eye(len(away))])
    loads, _ = nnls(rows, np.concatenate([[1.0, 0.0, 0.0], np.full(len(away), even / len(away))]))
    return float(loads @ np.linalg.norm(away, axis=-1) / loads.sum())


def _friction_arms(specs: Sequence[ObjectSpec]) -> dict[ObjectSpec, float]:
    """Return the friction arms of objects; that of one object alone is kept on disk, for those that differ are drawn.

    What is drawn for a run is asked for once, and would leave a file for each of its worlds.
    """
    distinct = list(dict.fromkeys(specs))
    if len(distinct) > 1:
        return {spec: friction_arm(spec) for spec in distinct}
    (spec,) = distinct
    found = cached("arm", spec, __name__, lambda: {"arm": np.array(friction_arm(spec))})
    return {spec: float(found["arm"])}


def build(worlds: Sequence[World]) -> Model:
    """Return the models of K different worlds whose hands have the same joints."""
    hand = worlds[0][0]
    n_pieces = max(len(_pieces(spec)) for _, spec, _ in worlds)
    n_walls = max(len(scene.walls) for _, _, scene in worlds)
    outlines = [_outlines(world, n_pieces, n_walls) for world in worlds]
    n, most = hand.n_joints, max(len(o.corners) for row in outlines for o in row)
    corners, normals = np.zeros((2, len(worlds), len(outlines[0]), most, 2))
    middle, bound = np.zeros((*corners.shape[:2], 2)), np.zeros(corners.shape[:2])
    for place in np.ndindex(corners.shape[:2]):
        points = outlines[place[0]][place[1]].corners
        corners[place][: len(points)] = points
        if len(points) > 1:
            normals[place][: len(points)] = edge_normals(points)
        if len(points):
            middle[place] = points.mean(axis=0)
            bound[place] = np.linalg.norm(points - middle[place], axis=-1).max() + outlines[place[0]][place[1]].radius
    pairs = _pairs(hand, n_pieces, n_walls)
    flat = np.array([[_lies_flat(row, pair, (n, n + n_pieces)) for pair in pairs] for row in outlines])
    first = np.repeat([place.start for place in hand.slices], [len(f.links) for f in hand.fingers])
    owners = np.repeat(np.arange(len(hand.fingers)), [len(f.links) for f in hand.fingers])
    arms = _friction_arms([spec for _, spec, _ in worlds])
    numbers = [_numbers(world, arms[world[1]]) for world in worlds]
    return Model(
        timestep=worlds[0][2].timestep,
        first=np.array([*first, n, n + 1, n + 2], dtype=np.int64),
        finger=owners.astype(np.int64),
        **{name: np.stack([each[name] for each in numbers]) for name in numbers[0]},
        body=np.array([*range(n), *[n] * n_pieces, *[n + 1] * (1 + n_walls)], dtype=np.int64),
        outline=corners,
        normal=normals,
        corners=np.array([[len(o.corners) for o in row] for row in outlines], dtype=np.int64),
        radius=np.array([[o.radius for o in row] for row in outlines]),
        middle=middle,
        bound=bound,
        pairs=np.array(pairs, dtype=np.int64),
        friction=np.array([_frictions(world, pairs, n_pieces) for world in worlds]),
        share=np.where(flat | _tip_on_object(hand, pairs, n_pieces), TWO, 1.0),
        flat=flat,
    )


def _pieces(spec: ObjectSpec) -> list[Outline]:
    """Return an object's convex pieces, seen from its centre of mass."""
    if spec.shape == "cylinder":
        return [Outline(np.zeros((1, 2)) - centre_of_mass(spec), spec.size[0] / 2)]
    return [Outline(piece - centre_of_mass(spec)) for piece in convex_pieces(spec)]


def _outlines(world: World, n_pieces: int, n_walls: int) -> list[Outline]:
    """Return a world's outlines: links, pieces of the object, palm, walls; what it has fewer of is nothing."""
    hand, spec, scene = world
    links = [Outline(link_outline(hand, finger, i)) for finger in hand.fingers for i in range(len(finger.links))]
    pieces, walls = _pieces(spec), [Outline(wall.outline) for wall in scene.walls]
    pieces += [NOTHING] * (n_pieces - len(pieces))
    return [*links, *pieces, Outline(palm_outline(hand)), *walls, *[NOTHING] * (n_walls - len(walls))]


def _pairs(hand: HandSpec, n_pieces: int, n_walls: int) -> list[tuple[int, int]]:
    """Return pairs of outlines that can touch; a piece of the object comes second."""
    n = hand.n_joints
    pieces, fixed = range(n, n + n_pieces), range(n + n_pieces, n + n_pieces + 1 + n_walls)
    fingers = [range(place.start, place.stop) for place in hand.slices]
    pairs = [*product(range(n), pieces), *product(fixed, pieces), *product(range(n), fixed[1:])]
    pairs += [(link, fixed[0]) for finger in fingers for link in finger[1:]]
    return pairs + [pair for one, other in combinations(fingers, 2) for pair in product(one, other)]


def _lies_flat(outlines: Sequence[Outline], pair: tuple[int, int], pieces: tuple[int, int]) -> bool:
    """Return whether a pair can touch at two points: two boxes, as in MuJoCo, and the object on what stands still.

    There MuJoCo gives an outline that is no box one point, on which it would rock.
    """
    one, other = (outlines[k].corners for k in pair)
    if min(len(one), len(other)) < 2:
        return False
    still = pair[0] >= pieces[1] and pieces[0] <= pair[1] < pieces[1]
    return still or (is_box(one) and is_box(other))


def _tip_on_object(hand: HandSpec, pairs: Sequence[tuple[int, int]], n_pieces: int) -> NDArray[np.bool_]:
    """Return whether each pair is a fingertip and the object `(P,)`."""
    n, tips = hand.n_joints, {place.stop - 1 for place in hand.slices}
    return np.array([one in tips and n <= other < n + n_pieces for one, other in pairs])


def _frictions(world: World, pairs: Sequence[tuple[int, int]], n_pieces: int) -> list[float]:
    """Return the friction coefficient of each pair."""
    hand, spec, scene = world
    n = hand.n_joints

    def of(outline: int) -> float:
        if outline < n or outline == n + n_pieces:
            return hand.friction
        if outline < n + n_pieces:
            return spec.friction
        wall = outline - n - n_pieces - 1
        return scene.walls[wall].friction if wall < len(scene.walls) else 0.0

    return [max(of(one) * of(other), LEAST_FRICTION) for one, other in pairs]


def _numbers(world: World, arm: float) -> dict[str, Array]:
    """Return masses, inertias, servos and inverse weights of a world, whose floor acts on its object at an arm [m]."""
    hand, spec, scene = world
    links = [(finger, i) for finger in hand.fingers for i in range(len(finger.links))]
    outlines = [link_outline(hand, finger, i) for finger, i in links]
    mass = np.array([*(hand.mass(finger, i) for finger, i in links), spec.mass])
    moments = [float(np.trace(second_moments(corners))) for corners in outlines]
    inertia = np.array([*(mass[:-1] * moments), planar_inertia(spec)])
    centre = np.stack([centroid(corners) for corners in outlines])
    hold = max(scene.floor_friction * spec.friction, LEAST_FRICTION) * spec.mass * max(scene.gravity, 0.0)
    straight, weight, joint_weight = _straight(hand, mass[:-1], inertia[:-1], centre)
    diagonal = [*straight, spec.mass, spec.mass, inertia[-1]]
    return {
        "base": np.array([finger.base for finger, _ in links]),
        "length": np.array([finger.links[i] for finger, i in links]),
        "mass": mass,
        "inertia": inertia,
        "centre": centre,
        "servo": np.tile([hand.armature, hand.damping, hand.stiffness, hand.torque], (len(links), 1)),
        "limits": hand.limits,
        "loss": hold * np.array([1.0, 1.0, arm]),
        "weight": np.array([*weight, 1 / spec.mass]),
        "joint_weight": np.array([*joint_weight, 1 / spec.mass, 1 / spec.mass, 1 / inertia[-1]]),
        "scale": np.array(1 / sum(diagonal)),
    }


def _straight(hand: HandSpec, mass: Array, inertia: Array, centre: Array) -> tuple[Array, Array, Array]:
    """Return of straight fingers the mass matrix's diagonal and the inverse weights of links and joints, each `(n,)`.

    MuJoCo takes inverse weights in this pose; a link's is the mean over three axes, along one of which it cannot move.
    """
    diagonal, weight, joint_weight = np.zeros((3, hand.n_joints))
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        joints = np.stack([np.zeros(len(finger.links)), np.cumsum([0.0, *finger.links[:-1]])], axis=-1)
        arms = perpendicular((joints + centre[place])[:, None] - joints)
        moves = np.tril(np.ones(arms.shape[:2]))[..., None] * arms  # of link i by joint j
        turns = np.tril(np.ones(arms.shape[:2]))
        matrix = np.einsum("i,ija,ika->jk", mass[place], moves, moves)
        matrix += np.einsum("i,ij,ik->jk", inertia[place], turns, turns) + hand.armature * np.eye(len(joints))
        inverse = np.linalg.inv(matrix)
        diagonal[place], joint_weight[place] = np.diag(matrix), np.diag(inverse)
        weight[place] = np.einsum("ija,jk,ika->i", moves, inverse, moves) / 3
    return diagonal, weight, joint_weight
