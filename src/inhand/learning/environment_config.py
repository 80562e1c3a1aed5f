"""What an environment is asked for by keywords, and the pool of starts that its episodes are drawn from."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inhand.control.run_config import HeldConfig
from inhand.control.user_policy import GraspKind
from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.grasp_search import GraspPlan
from inhand.learning.starts import Noise, Starts, gripped, plans_for, reach_of
from inhand.learning.worlds import Interface
from inhand.sim.disturbance import Disturbance
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.engines import check_engine
from inhand.sim.memory import START_BYTES, check_memory
from inhand.sim.names import ENGINE, Engine
from inhand.tasks.decisions import find_reward
from inhand.tasks.goals import GoalReward, goal_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.primitives import parse_directions

POOL_SEED = 0
"""Seed of the pools of starts, so that a seed of `reset` means the same episode in every process."""
RowsAlong: TypeAlias = Callable[[Any], NDArray[np.int64]]
"""Gives the rows of a direction."""
SAME_DEG = 1e-6
"""Directions closer than this are one [deg]."""


@dataclass(frozen=True)
class EnvironmentConfig(Interface, HeldConfig):
    """Keywords of `inhand/Asterisk-v0`."""

    directions: str | Sequence[str | float] = "train"
    """The words of the command line (train, unseen, all, names, letters), or degrees counter-clockwise from +x."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""
    starts: int = 64
    """Starts that episodes are drawn from, the directions in turn."""
    stop: bool = False
    """Whether the object is to stay where its grip is predicted to end, which `grip` and `progress` tell."""
    grasp: GraspKind = "planned"
    """Grip: planned for each direction (a second for each two), or rough (thesis 3.2, at once)."""
    engine: Engine = ENGINE
    """Physics engine: planar, mujoco (in three dimensions), or bullet as a witness (extra `bullet`; much slower)."""
    threads: int = 0
    """Threads of the simulation; 0 uses every core."""
    pictures: Literal["drawn", "mujoco"] = "drawn"
    """What renders: drawn (the plane from above, without GL) or mujoco (its renderer; extra `viewer`, and GL)."""
    disturb: str = "none"
    """What disturbs worlds, senses and commands: none, bench, field, hard, or a TOML file. Each of the starts is in a
    world of its own."""

    def __post_init__(self) -> None:
        """Refuse values that no environment can have."""
        super().__post_init__()
        for name, least in (("noise_mm", 0), ("noise_deg", 0), ("threads", 0), ("horizon", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is {getattr(self, name)}; it must be {least} or more")
        if self.starts < len(self.angles):
            raise InputError(f"starts={self.starts} for {len(self.angles)} directions: give at least one for each")
        check_memory(f"starts={self.starts}", self.starts, START_BYTES[self.engine])
        check_engine(self.engine)
        load_disturbance(self.disturb)
        find_layout(self.observation)
        find_reward(self.interface.reward)
        check_fit(*self.held)

    @property
    def interface(self) -> Interface:
        """What its worlds see, do and reward."""
        return Interface(self.observation, self.actions, self.reward, self.horizon)

    @property
    def stops(self) -> bool:
        """Whether starts say how far their grip is predicted to reach."""
        return self.stop

    @property
    def held(self) -> Held:
        """Hand and object."""
        return Held(load_hand(self.hand), load_object(self.object))

    @property
    def angles(self) -> tuple[float, ...]:
        """Directions, each once [deg]."""
        return angles_of(self.directions)

    def pool(self) -> Starts:
        """Return the starts of episodes; equal keywords share one pool, made once in a process."""
        noise = Noise(self.noise_mm / 1e3, math.radians(self.noise_deg))
        how = self.grasp, noise, self.engine, load_disturbance(self.disturb)
        return _pool(self.held, self.angles, how, self.starts, stop=self.stops)


@dataclass(frozen=True)
class GoalConfig(EnvironmentConfig):
    """Keywords of `inhand/AsteriskGoal-v0`."""

    reward: GoalReward = "sparse"
    """sparse (-1, and 0 at the goal) or dense (-1 for each centimetre left)."""
    nearest_mm: float = 10.0
    """Shortest way to a goal [mm]."""
    tolerance_mm: float = 2.0
    """Distance within which a goal is reached [mm]."""
    tolerance_deg: float = 5.0
    """Turn within which a goal is reached [deg]."""
    lost: Literal["terminated", "truncated"] = "terminated"
    """What a lost object does to an episode. With rewards of -1 a termination is a way out of them; a learner that
    drops objects on purpose needs `truncated`, after which it counts on as if the episode went on."""

    def __post_init__(self) -> None:
        """Refuse values that no environment can have."""
        super().__post_init__()
        for name in ("nearest_mm", "tolerance_mm", "tolerance_deg"):
            if getattr(self, name) <= 0:
                raise InputError(f"{name} is {getattr(self, name)}; it must be above 0")

    @property
    def interface(self) -> Interface:
        """What its worlds see and do; what they reward counts for nothing."""
        return Interface(self.observation, self.actions, horizon=self.horizon)

    @property
    def stops(self) -> bool:
        """Whether starts say how far their grip is predicted to reach: goals lie before that."""
        return True

    @property
    def tolerance(self) -> tuple[float, float]:
        """Distance [m] and turn [rad] within which a goal is reached."""
        return self.tolerance_mm / 1e3, math.radians(self.tolerance_deg)

    def reward_of(self, achieved: ArrayLike, desired: ArrayLike) -> Array:
        """Return the reward `(...)` of poses `(..., 3)` for goals `(..., 3)` [m, m, rad].

        Raises:
            InputError: no numbers, or not three of them to a pose.
        """
        for name, given in (("achieved_goal", achieved), ("desired_goal", desired)):
            poses = np.asarray(given)
            if poses.dtype.kind not in "fiu" or poses.shape[-1:] != (3,):
                raise InputError(f"{name} is {poses.dtype} {poses.shape}; it must be poses (..., 3) [m, m, rad]")
        return goal_reward(achieved, desired, self.tolerance, self.reward)


def angles_of(directions: str | Sequence[str | float]) -> tuple[float, ...]:
    """Return directions, each once [deg], of words of the command line or degrees.

    Raises:
        InputError: an unknown word, or one that only turns the object.
    """
    words = directions if isinstance(directions, str) else [str(each) for each in directions]
    return tuple(dict.fromkeys(round(math.degrees(each.angle), 9) for each in parse_directions(words)))


def rows_asked(
    pool: Starts, options: dict[str, Any], count: int, rng: np.random.Generator, rows_along: RowsAlong
) -> NDArray[np.int64]:
    """Return the rows of a pool `(count,)` to start from, drawn of all or of the direction that options give.

    `direction` is a word or degrees, for all worlds or one for each; `rows_along` gives the rows of one.

    Raises:
        InputError: another option, or a direction that the pool has not.
    """
    for name in options:
        if name != "direction":
            near = near_matches(str(name), ["direction"])
            raise InputError(f"unknown option {name!r} of reset{near}; use 'direction'")
    if "direction" not in options:
        return rng.integers(len(pool), size=count)
    given = options["direction"]
    each = [given] if isinstance(given, str) or np.ndim(given) == 0 else list(given)
    if len(each) not in {1, count}:
        raise InputError(f"{len(each)} directions for {count} worlds: give one for all or one for each")
    found = [rng.choice(rows_along(each[world % len(each)])) for world in range(count)]
    return np.array(found, dtype=np.int64)


def rows_along(angle_deg: Array, direction: str | float) -> NDArray[np.int64]:
    """Return the rows of a direction among those of a pool `(N,)` [deg].

    Raises:
        InputError: a direction that the pool has not.
    """
    asked = angles_of([direction])
    away = np.abs((angle_deg - asked[0] + 180.0) % 360.0 - 180.0)
    rows = np.flatnonzero(away < SAME_DEG)
    if len(asked) > 1 or len(rows) == 0:
        have = ", ".join(f"{angle:g}" for angle in np.unique(angle_deg))
        raise InputError(
            f"direction {direction!r} of reset is none of this environment's, {have} deg: use one of them, or name it"
            " in directions= when you make the environment"
        )
    return rows


@cache
def _plans(held: Held, angles: tuple[float, ...], grasp: GraspKind, engine: Engine) -> dict[float, GraspPlan]:
    return plans_for(*held, angles, grasp, engine)


@cache
def _pool(
    held: Held,
    angles: tuple[float, ...],
    gripping: tuple[GraspKind, Noise, Engine, Disturbance | None],
    count: int,
    *,
    stop: bool,
) -> Starts:
    grasp, noise, engine, disturb = gripping
    grips = _plans(held, angles, grasp, engine), np.resize(np.array(angles), count)
    starts = gripped(*held, grips, np.random.default_rng(POOL_SEED), noise, engine=engine, disturb=disturb)
    return replace(starts, distance=reach_of(held, starts)) if stop else starts
