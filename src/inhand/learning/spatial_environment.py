"""What the environment of a hand in space is asked for by keywords, and its batch of worlds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.files import load_solid, load_spatial_hand
from inhand.hands.spatial.fit import check_solid_fit
from inhand.hands.spatial.grasp_search import search_grasps
from inhand.hands.spatial.gravity import GRAVITY, PALMS, gravity_of
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.batch import Batch, Info
from inhand.learning.dataset_cards import SPHERE
from inhand.learning.environment_config import POOL_SEED
from inhand.learning.space import space_of
from inhand.learning.space_pools import gripped, reach_in_space
from inhand.learning.starts import Noise, Starts
from inhand.learning.worlds import Interface
from inhand.sim.memory import START_BYTES, check_memory
from inhand.sim.names import SPATIAL, Engine
from inhand.tasks.decisions import Actions, find_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import SpatialPrimitive, parse_spatial_directions

SAME = 1e-6
"""Directions and axes closer than this are one."""


@dataclass(frozen=True)
class SpatialEnvironmentConfig(Interface):
    """Keywords of `inhand/SpatialAsterisk-v0`."""

    observation: str = "space"
    """Layout of observations: space or space-thesis."""
    actions: Actions = "steps"
    """Steps (how far joint targets move on), fine steps, or angles (joint targets over their ranges)."""
    reward: str = "progress"
    """Reward: progress, gain or thesis."""
    horizon: int = 160
    """Decisions after which an episode is cut off; one takes 20 ms."""
    hand: str = "3f_60.60_40_10"
    """Hand in space: a name (`inhand hands`) or a TOML file of a robot."""
    object: str = "cube_50"
    """Object: a name (`inhand objects`), or a TOML, STL or OBJ file."""
    directions: str | Sequence[str] = "axes,turns"
    """The words of the command line (docs/spatial.md); a primitive that holds a rotation is none of them."""
    gravity: str = SPHERE
    """How the palm is held: up, down, sideways, or a vector along which gravity pulls, as 0,-1,-1; or sphere, drawn
    anywhere for each start."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start along each axis [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation about each axis [deg]."""
    starts: int = 64
    """Starts that episodes are drawn from, the directions in turn; those in which the grip fails are left out."""
    stop: bool = True
    """Whether the object is to stay where its grip is predicted to end."""
    threads: int = 0
    """Threads of the simulation; 0 uses every core."""

    def __post_init__(self) -> None:
        """Refuse values that no environment can have."""
        super().__post_init__()
        for name, least in (("noise_mm", 0), ("noise_deg", 0), ("threads", 0), ("horizon", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is {getattr(self, name)}; it must be {least} or more")
        if self.starts < len(self.primitives):
            raise InputError(f"starts={self.starts} for {len(self.primitives)} directions: give at least one for each")
        holding = [each.name for each in self.primitives if each.direction is not None and any(each.rotation)]
        if holding:
            raise InputError(f"directions {', '.join(holding)} hold a rotation: an episode moves an object or turns it")
        if not find_layout(self.observation).space:
            raise InputError(f"observation {self.observation!r} is of the plane: use 'space' or 'space-thesis'")
        if self.gravity != SPHERE:
            gravity_of(self.gravity)
        check_memory(f"starts={self.starts}", self.starts, START_BYTES[self.engine])
        find_reward(self.reward)
        check_solid_fit(*self.held)

    @property
    def engine(self) -> Engine:
        """The engine of hands in space."""
        return SPATIAL

    @property
    def interface(self) -> Interface:
        """What its worlds see, do and reward."""
        return Interface(self.observation, self.actions, self.reward, self.horizon)

    @property
    def held(self) -> SpatialPair:
        """Hand and object."""
        return SpatialPair(load_spatial_hand(self.hand), load_solid(self.object))

    @property
    def primitives(self) -> tuple[SpatialPrimitive, ...]:
        """Directions and turns, each once."""
        return parse_spatial_directions(self.directions)

    def pool(self) -> Starts:
        """Return the starts of episodes; equal keywords share one pool, made once in a process."""
        noise = Noise(self.noise_mm / 1e3, math.radians(self.noise_deg))
        return _pool(self.held, self.primitives, self.gravity, noise, self.starts, stop=self.stop)


@cache
def _pool(
    held: SpatialPair, primitives: tuple[SpatialPrimitive, ...], gravity: str, noise: Noise, count: int, *, stop: bool
) -> Starts:
    """Return starts of grasps that are planned for the gravity, or for all three palms where it is drawn."""
    rng = np.random.default_rng(POOL_SEED)
    palms = GRAVITY * np.array(list(PALMS.values())) if gravity == SPHERE else np.array([gravity_of(gravity)])
    found = search_grasps(held, held.start, [spatial_path_of(each) for each in primitives], palms)
    known = [(each, group[0]) for each, group in zip(primitives, found, strict=True) if group]
    if not known:
        raise InputError(f"no grasp of {held.hand.name!r} holds {held.object.name!r}: use another object, or gravity")
    asked = [known[k % len(known)] for k in range(count)]
    pulls = rng.standard_normal((count, 3)) if gravity == SPHERE else np.resize(palms, (count, 3))
    pulls *= GRAVITY / np.linalg.norm(pulls, axis=-1, keepdims=True)
    space = space_of([each for each, _ in asked], pulls)
    starts = gripped(held, [grasp for _, grasp in asked], space, rng, noise)
    return replace(starts, distance=reach_in_space(held, starts)) if stop else starts


class SpatialBatch(Batch["SpatialEnvironmentConfig"]):
    """B worlds of a hand in space with the spaces of one; none is drawn."""

    MODES = ()
    SHIFT = ("along", "across", "turned")

    def begun_info(self) -> Info:
        """Return what is told when episodes begin: unit vectors of direction and axis, and gravity `(B, 3)`."""
        worlds = self.worlds
        return {"direction": worlds.aim.along, "axis": worlds.aim.about, "gravity": np.asarray(worlds.scene.gravity)}

    def ways(self) -> Array:
        """Return where the objects began and where they are asked to go `(B, 2, 3)` [m]."""
        aim = self.worlds.aim
        way = np.where(np.isfinite(aim.distance), aim.distance, 0.0)[:, None] * aim.along
        return np.stack([aim.start[:, :3], aim.start[:, :3] + way], axis=1)

    def rows_along(self, direction: object) -> NDArray[np.int64]:
        """Return the starts of a direction by its word."""
        space, asked = self.pool.asked_in_space, parse_spatial_directions(str(direction))
        wanted = space_of(asked[:1], np.zeros((1, 3)))
        away = np.abs(space.along - wanted.along).max(axis=-1) + np.abs(space.about - wanted.about).max(axis=-1)
        rows = np.flatnonzero(away < SAME)
        if len(asked) > 1 or len(rows) == 0:
            have = ", ".join(each.name for each in self.config.primitives)
            raise InputError(
                f"direction {direction!r} of reset is none of this environment's, {have}: use one of them, or name it"
                " in directions= when you make the environment"
            )
        return rows
