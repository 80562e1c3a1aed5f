"""Manipulation phases as Gymnasium's spaces, observations and infos: what one environment and a batch of them share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeAlias, TypeVar, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, wrap_angle
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig, rows_along, rows_asked
from inhand.learning.step import Step
from inhand.learning.worlds import ManipulationWorlds
from inhand.records import checked
from inhand.sim.memory import WORLD_BYTES, check_memory
from inhand.sim.state import State
from inhand.tasks.goals import goal_reached

if TYPE_CHECKING:
    from inhand.plots.live import Live
    from inhand.sim.rendered import Rendered

Seen: TypeAlias = Any
"""Observations: an array `(B, d)`, or a dict of arrays `(B, ...)` where there are goals; of one world without `B`."""
Info: TypeAlias = dict[str, Any]
"""Numbers `(B,)` by name, some in dicts of their own; of one world without `B`."""

GOAL_ROOM = np.array([0.5, 0.5, np.pi], dtype=np.float32)
"""Goals and what is achieved are cut to this on either side [m, m, rad]; no finger reaches as far."""
RENDER_MODES = ("rgb_array",)
"""How environments can be looked at: as pictures."""
SHOWN_WAY = 0.08
"""Length of the line that pictures draw where no end was asked for [m]."""

C = TypeVar("C", bound=Any)


@dataclass(frozen=True)
class Outcome:
    """What a decision of B worlds led to."""

    seen: Seen
    """What to decide on next, of the new episode where one has ended."""
    successor: Seen
    """What the decision led to."""
    reward: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    info: Info
    """About the decision."""
    after: State
    """What it led to."""


class Batch(Generic[C]):
    """B worlds with the spaces of one."""

    MODES: ClassVar[tuple[str, ...]] = RENDER_MODES
    """How they can be looked at."""
    SHIFT: ClassVar[tuple[str, ...]] = ("along", "left", "turned")
    """What a shift is called in `info`."""

    def __init__(self, config: C, count: int, render_mode: str | None) -> None:
        """Make the worlds, and before them their starts, once for equal configurations.

        Raises:
            InputError: no such way to be looked at, or more worlds than the machine has memory for.
        """
        self.config = config
        if render_mode not in {None, *self.MODES}:
            words = "".join(f"{mode!r}, or " for mode in self.MODES)
            raise InputError(f"render_mode={render_mode!r}: use {words}None for no pictures")
        held = config.held
        check_memory(f"num_envs={count}", count, WORLD_BYTES[config.engine])
        self.pool = config.pool()
        self._origin = held.hand.start_pose
        self.worlds = ManipulationWorlds(held, self.pool, count, config.interface, threads=config.threads)
        self._draws: Live | Rendered | None = None
        size = self.worlds.layout.size(held.hand)
        self.observation_space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (self.worlds.layout.actions(held.hand),), np.float32)

    def reset(self, rng: np.random.Generator, options: dict[str, Any] | None) -> tuple[Seen, Info]:
        """Start every episode anew with draws of a generator; return observations and infos."""
        asked = checked("options", options, dict[str, Any] | None) or {}
        rows = rows_asked(self.pool, asked, self.worlds.count, rng, self.rows_along)
        self.worlds.rng = rng
        observation = self.worlds.reset(rows)
        return self._begun(observation), self.begun_info()

    def begun_info(self) -> Info:
        """Return what is told when episodes begin."""
        return {"direction": np.rad2deg(self.worlds.aim.angle)}

    def step(self, actions: object) -> Outcome:
        """Take a decision `(B, n)`; worlds whose episode ends start the next one."""
        told = self.begun_info()
        step = self.worlds.step(actions)
        told |= {**dict(zip(self.SHIFT, step.shift.T, strict=True)), "lost": step.terminated}
        return self._outcome(step, told)

    def rows_along(self, direction: object) -> NDArray[np.int64]:
        """Return the starts of a direction, a word or degrees.

        Raises:
            InputError: there are none.
        """
        return rows_along(self.pool.angle_deg, cast("str | float", direction))

    def _begun(self, observation: Array) -> Seen:
        return observation.astype(np.float32)

    def _outcome(self, step: Step, told: Info) -> Outcome:
        seen, successor = step.observation.astype(np.float32), step.successor.astype(np.float32)
        told |= {"terms": step.terms}
        return Outcome(seen, successor, step.reward, step.terminated, step.truncated, told, step.after)

    def ways(self) -> Array:
        """Return where the objects began and where they are asked to go `(B, 2, 2)` [m]."""
        aim = self.worlds.aim
        ends = aim.goal(np.where(np.isfinite(aim.distance), aim.distance, SHOWN_WAY))
        return np.stack([aim.start[:, :2], ends[:, :2]], axis=1)

    def pictures(self, state: State, ways: Array) -> tuple[NDArray[np.uint8], ...]:
        """Return a picture of every world in a state; nothing is drawn, and no library for it loaded, before.

        Raises:
            InputError: MuJoCo's renderer was asked for and is missing, or has no GL.
        """
        if self._draws is None:
            self._draws = _draws(self.config)
        return tuple(map(self._draws.picture, state.joint_angles, state.pose, ways))


def _draws(config: EnvironmentConfig) -> Live | Rendered:
    """Return what draws the worlds of a configuration."""
    if config.pictures == "mujoco":
        from inhand.sim.rendered import Rendered

        return Rendered(*config.held)
    from inhand.plots.live import Live

    return Live(*config.held)


class GoalBatch(Batch[GoalConfig]):
    """The same with goals.

    A goal lies on the primitive, between `nearest_mm` and where the start's own grip is predicted to end, which the
    expert reaches; the hand's limit in that direction would ask most grips for more than they can.
    """

    def __init__(self, config: GoalConfig, count: int, render_mode: str | None) -> None:
        """Make the same with goals."""
        super().__init__(config, count, render_mode)
        goal = spaces.Box(-GOAL_ROOM, GOAL_ROOM, dtype=np.float32)
        names = ("observation", "achieved_goal", "desired_goal")
        self.observation_space = spaces.Dict(dict(zip(names, (self.observation_space, goal, goal), strict=True)))
        self._desired = np.zeros((count, 3), dtype=np.float32)

    def _begun(self, observation: Array) -> Seen:
        self._desired = self._goals()
        return self._with_goals(observation, self.worlds.state.pose, self._desired)

    def _outcome(self, step: Step, told: Info) -> Outcome:
        successor = self._with_goals(step.successor, step.after.pose, self._desired)
        achieved, desired = successor["achieved_goal"], successor["desired_goal"]
        told |= {"is_success": goal_reached(achieved, desired, self.config.tolerance)}
        reward = self.config.reward_of(achieved, desired)
        ended = step.terminated | step.truncated
        if ended.any():
            self._desired = np.where(ended[:, None], self._goals(), self._desired)
        seen = self._with_goals(step.observation, self.worlds.state.pose, self._desired)
        terminated = step.terminated if self.config.lost == "terminated" else np.zeros_like(ended)
        return Outcome(seen, successor, reward, terminated, ended & ~terminated, told, step.after)

    def ways(self) -> Array:
        """Return where the objects began and their goals `(B, 2, 2)` [m]."""
        return np.stack([self.worlds.aim.start[:, :2], (self._desired + self._origin)[:, :2]], axis=1)

    def _goals(self) -> NDArray[np.float32]:
        """Return a goal for every world `(B, 3)`."""
        aim = self.worlds.aim
        nearest = np.minimum(self.config.nearest_mm / 1e3, aim.distance)
        return self._relative(aim.goal(self.worlds.rng.uniform(nearest, aim.distance)))

    def _relative(self, pose: Array) -> NDArray[np.float32]:
        """Return poses `(B, 3)` seen from where the hand places the object."""
        away = pose - self._origin
        away[:, 2] = wrap_angle(away[:, 2])
        return np.asarray(np.clip(away, -GOAL_ROOM, GOAL_ROOM), dtype=np.float32)

    def _with_goals(self, observation: Array, pose: Array, desired: NDArray[np.float32]) -> Seen:
        parts = observation.astype(np.float32), self._relative(pose), desired.copy()
        return dict(zip(("observation", "achieved_goal", "desired_goal"), parts, strict=True))
