"""What is drawn for each world of a disturbance, in the plane or in space, and the true hand, object and scene of it.

A world's numbers follow from its own key alone, a tuple of whole numbers such as seed, trial and direction. So they do
not depend on what runs beside it, and a world of which a disturbance leaves one quantity alone has the other numbers
that it has with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec, resized
from inhand.rotations import pose_from
from inhand.sim.disturbance import FACTORS, Disturbance, Range
from inhand.sim.scene import SceneSpec, scene_of_each

H = TypeVar("H", HandSpec, SpatialHand)
S = TypeVar("S", ObjectSpec, SolidSpec)
Key = tuple[int, ...]
TRUTH = 1
"""What tells the generator of a world's truth from that of its start."""


@dataclass(frozen=True)
class Drawn:
    """What was drawn for one world."""

    key: Key
    """What it was drawn with, and what noise, missing frames and pushes are drawn with."""
    friction: float = 1.0
    mass: float = 1.0
    size: float = 1.0
    floor: float = 1.0
    stiffness: float = 1.0
    damping: float = 1.0
    torque: float = 1.0
    """Factors of the fingers' friction, of the object's mass and width, of the floor's friction and of the servos."""
    centre: tuple[float, ...] = (0.0, 0.0)
    """Centre of mass from where the even object has it: x, y, and in space z [m]."""
    zero: tuple[float, ...] = ()
    """What each joint's encoder reads at zero [rad]."""
    start: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Start of the object from where the grasp is planned for [m, m, rad]; in space a place and a rotation vector."""
    bias: tuple[float, ...] = (0.0, 0.0, 0.0)
    """What every frame of the camera adds to the pose, in the same numbers."""
    encoder_s: float = 0.0
    camera_s: float = 0.0
    command_s: float = 0.0
    """How late joint angles, frames and commands are [s]."""


@dataclass(frozen=True)
class Disturbed:
    """How one world is disturbed."""

    spec: Disturbance
    drawn: Drawn

    def again(self, key: Key) -> Disturbed:
        """Return the same world with other noise, missing frames and pushes: those of a key."""
        return replace(self, drawn=replace(self.drawn, key=key))


def draw(spec: Disturbance, key: Key, n_joints: int, *, space: bool = False) -> Disturbed:
    """Return what a disturbance draws for the world of a key, with a hand of some joints, in the plane or in space."""
    rng, differs = np.random.default_rng((*key, TRUTH)), spec.differs
    # Every number is drawn, also where it is not used, so that each has its place whatever the disturbance is.
    shares, side = rng.random(len(FACTORS) + 6), rng.random()
    normal = rng.standard_normal(3 + n_joints)
    factors = {name: _between(getattr(differs, name), shares[k]) for k, name in enumerate(FACTORS)}
    rest = shares[len(FACTORS) :].tolist()
    around = 2 * np.pi * rest[5]
    turn = np.deg2rad(spec.camera.bias_deg) * (1.0 if side < 0.5 else -1.0)
    start = normal[:3] * (differs.start_mm / 1e3, differs.start_mm / 1e3, np.deg2rad(differs.start_deg))
    delays = (spec.encoders.delay_ms, spec.camera.delay_ms, spec.commands.delay_ms)
    late = [(low + share * (high - low)) / 1e3 for (low, high), share in zip(delays, rest[2:5], strict=True)]
    drawn = Drawn(
        key,
        **factors,
        centre=(differs.centre_mm / 1e3 * (2 * rest[0] - 1), differs.centre_mm / 1e3 * (2 * rest[1] - 1)),
        zero=tuple((np.deg2rad(differs.zero_deg) * normal[3:]).tolist()),
        start=(float(start[0]), float(start[1]), float(start[2])),
        bias=(
            float(spec.camera.bias_mm / 1e3 * np.cos(around)),
            float(spec.camera.bias_mm / 1e3 * np.sin(around)),
            float(turn),
        ),
        encoder_s=late[0],
        camera_s=late[1],
        command_s=late[2],
    )
    return Disturbed(spec, _in_space(spec, drawn, rng) if space else drawn)


def _in_space(spec: Disturbance, drawn: Drawn, rng: np.random.Generator) -> Drawn:
    """Return what was drawn with what has more numbers in space; how far is as in the plane, directions are any."""
    up, normal = rng.random(), rng.standard_normal((4, 3))
    differs, camera, sizes = spec.differs, spec.camera, np.linalg.norm(normal[2:], axis=-1, keepdims=True)
    off = normal[:2] * [[differs.start_mm / 1e3], [np.deg2rad(differs.start_deg)]]
    bias = normal[2:] / sizes * [[camera.bias_mm / 1e3], [np.deg2rad(camera.bias_deg)]]
    centre = (*drawn.centre, differs.centre_mm / 1e3 * (2 * up - 1))
    return replace(drawn, centre=centre, start=tuple(off.ravel().tolist()), bias=tuple(bias.ravel().tolist()))


def _between(limits: Range, share: float) -> float:
    """Return a factor at a share of the way between two, evenly in its logarithm."""
    low, high = limits
    return float(low * (high / low) ** share)


def truth(drawn: Drawn, hand: H, spec: S, scene: SceneSpec) -> tuple[H, S, SceneSpec]:
    """Return hand, object and surroundings as they are in a world, of those that controllers are told."""
    servos = {
        name: getattr(hand, name) * getattr(drawn, name) for name in ("friction", "stiffness", "damping", "torque")
    }
    return (
        replace(hand, **servos),
        _body(drawn, spec),
        replace(scene, floor_friction=scene.floor_friction * drawn.floor),
    )


def _body(drawn: Drawn, spec: S) -> S:
    """Return the true object; its height stays in the plane, and follows its size in space."""
    mass, (right, out, *up) = spec.mass * drawn.mass, drawn.centre
    if isinstance(spec, SolidSpec):
        x, y, z = spec.centre
        return replace(resized(spec, drawn.size), mass=mass, centre=(x + right, y + out, z + sum(up)))
    width, depth, height = spec.size
    size, centre = (width * drawn.size, depth * drawn.size, height), (spec.centre[0] + right, spec.centre[1] + out)
    return replace(spec, mass=mass, size=size, centre=centre)


def check_drawn(spec: Disturbance, hand: H, thing: S) -> None:
    """Refuse a disturbance at whose ends a hand or an object is not one that can be.

    Raises:
        InputError: the text names the disturbance and what cannot be.
    """
    for end in (0, 1):
        ends = {name: getattr(spec.differs, name)[end] for name in FACTORS}
        try:
            truth(Drawn((), **ends), hand, thing, SceneSpec())
        except InputError as error:
            raise InputError(f"disturbance {spec.name!r} cannot be drawn: {error}") from error


def truths(
    disturbed: Sequence[Disturbed],
    hand: H | Sequence[H],
    objects: Sequence[S],
    scenes: SceneSpec | Sequence[SceneSpec] | None,
) -> tuple[list[H], list[S], list[SceneSpec]]:
    """Return the true hand, object and surroundings of each world; the hand is one for all or one for each."""
    around = scene_of_each(objects, scenes)
    hands_told = [hand] * len(objects) if isinstance(hand, HandSpec | SpatialHand) else hand
    told = zip(disturbed, hands_told, objects, around, strict=True)
    each = [truth(world.drawn, own, spec, scene) for world, own, spec, scene in told]
    hands, things, true = (list(part) for part in zip(*each, strict=True))
    return hands, things, true


def true_starts(disturbed: Sequence[Disturbed], starts: Array) -> Array:
    """Return where objects stand of which grasps are planned for starts `(B, 3)`, in space `(B, 7)`."""
    off = np.array([each.drawn.start for each in disturbed])
    return starts + off if off.shape[1] == 3 else pose_from(starts, off[:, :3], off[:, 3:])
