"""The manipulation phase as Gymnasium environments, one at a time or a batch in one simulation.

`inhand/Asterisk-v0` moves the object along a direction, `inhand/AsteriskGoal-v0` to a goal that hindsight may replace.
`import inhand` makes both known to Gymnasium, whichever of the two is imported first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inhand.errors import InputError, needs_extra
from inhand.geometry import Array, wrap_angle
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig, config_of, rows_asked
from inhand.learning.worlds import Interface, ManipulationWorlds, Step
from inhand.tasks.goals import goal_reached

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise needs_extra("rl", "an environment") from error

Seen: TypeAlias = Any
"""Observations: an array `(B, d)`, or a dict of arrays `(B, ...)` where there are goals; of one world without `B`."""
Info: TypeAlias = dict[str, Any]
"""Numbers `(B,)` by name, some in dicts of their own; of one world without `B`."""

GOAL_ROOM = np.array([0.5, 0.5, np.pi], dtype=np.float32)
"""Goals and what is achieved are cut to this on either side [m, m, rad]; no finger reaches as far."""
METADATA: dict[str, Any] = {"render_modes": [], "render_fps": 50}
"""What Gymnasium asks about one environment: there is nothing to render, and a second has 50 decisions."""
VECTOR_METADATA: dict[str, Any] = {**METADATA, "autoreset_mode": AutoresetMode.SAME_STEP}
"""The same about a batch."""


C = TypeVar("C", bound=EnvironmentConfig)


@dataclass(frozen=True)
class _Outcome:
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


class _Batch(Generic[C]):
    """B worlds with the spaces of one."""

    def __init__(self, config: C, count: int) -> None:
        self.config = config
        held = config.held
        self._pool = config.pool(stop=self._stops())
        self._origin = held[0].start_pose
        interface = Interface(config.observation, config.actions, self._terms(), config.horizon)
        self.worlds = ManipulationWorlds(held, self._pool, count, interface, threads=config.threads)
        size = self.worlds.layout.size(held[0])
        self.observation_space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (held[0].n_joints,), np.float32)

    def _stops(self) -> bool:
        return self.config.stop

    def _terms(self) -> str:
        return self.config.reward

    def reset(self, rng: np.random.Generator, options: dict[str, Any] | None) -> tuple[Seen, Info]:
        """Start every episode anew with draws of a generator; return observations and infos."""
        self.worlds.rng = rng
        observation = self.worlds.reset(rows_asked(self._pool, options or {}, self.worlds.count, rng))
        return self._begun(observation), self.begun_info()

    def begun_info(self) -> Info:
        """Return what is told when episodes begin."""
        return {"direction": np.rad2deg(self.worlds.aim.angle)}

    def step(self, actions: ArrayLike) -> _Outcome:
        """Take a decision `(B, n)`; worlds whose episode ends start the next one."""
        told = self.begun_info()
        step = self.worlds.step(np.asarray(actions, dtype=float))
        along, left, turned = step.shift.T
        told |= {"along": along, "left": left, "turned": turned, "lost": step.terminated}
        return self._outcome(step, told)

    def _begun(self, observation: Array) -> Seen:
        return observation.astype(np.float32)

    def _outcome(self, step: Step, told: Info) -> _Outcome:
        seen, successor = step.observation.astype(np.float32), step.successor.astype(np.float32)
        told |= {"terms": step.terms}
        return _Outcome(seen, successor, step.reward, step.terminated, step.truncated, told)


class _GoalBatch(_Batch[GoalConfig]):
    """The same with goals.

    A goal lies on the primitive, between `nearest_mm` and where the start's own grip is predicted to end, which the
    expert reaches; the hand's limit in that direction would ask most grips for more than they can.
    """

    def __init__(self, config: GoalConfig, count: int) -> None:
        super().__init__(config, count)
        goal = spaces.Box(-GOAL_ROOM, GOAL_ROOM, dtype=np.float32)
        names = ("observation", "achieved_goal", "desired_goal")
        self.observation_space = spaces.Dict(dict(zip(names, (self.observation_space, goal, goal), strict=True)))
        self._desired = np.zeros((count, 3), dtype=np.float32)

    def _stops(self) -> bool:
        return True

    def _terms(self) -> str:
        return "thesis"

    def _begun(self, observation: Array) -> Seen:
        self._desired = self._goals()
        return self._with_goals(observation, self.worlds.state.pose, self._desired)

    def _outcome(self, step: Step, told: Info) -> _Outcome:
        successor = self._with_goals(step.successor, step.goal, self._desired)
        achieved, desired = successor["achieved_goal"], successor["desired_goal"]
        told |= {"is_success": goal_reached(achieved, desired, self.config.tolerance)}
        reward = self.config.reward_of(achieved, desired)
        ended = step.terminated | step.truncated
        if ended.any():
            self._desired = np.where(ended[:, None], self._goals(), self._desired)
        seen = self._with_goals(step.observation, self.worlds.state.pose, self._desired)
        terminated = step.terminated if self.config.lost == "terminated" else np.zeros_like(ended)
        return _Outcome(seen, successor, reward, terminated, ended & ~terminated, told)

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


class AsteriskEnv(gymnasium.Env[Any, Any]):
    """Move a held object along a direction (`inhand/Asterisk-v0`).

    Observations, actions and rewards are the thesis's by default. An episode ends where the object was lost for more
    than 20 physics steps, and is cut off at the horizon. `info` tells `direction` [deg], the way `along` it and to its
    `left` [m], the angle `turned` [rad], whether the object was `lost`, and the reward's `terms`. It is not rendered:
    `inhand asterisk` draws and animates trials.
    """

    metadata = METADATA
    _kinds: tuple[type[EnvironmentConfig], type[_Batch[Any]]] = (EnvironmentConfig, _Batch)

    def __init__(self, *, render_mode: None = None, **keywords: object) -> None:
        """Make the environment; grasps and starts are made once in a process for equal keywords.

        Args:
            render_mode: None, the only one.
            keywords: the fields of `EnvironmentConfig`, for goals of `GoalConfig`.

        Raises:
            InputError: an unknown keyword or a value that cannot be.
        """
        self._batch = _batch(self._kinds, keywords, 1, render_mode)
        self.observation_space, self.action_space = self._batch.observation_space, self._batch.action_space
        self._running = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, Info]:
        """Start an episode; equal seeds give equal bytes. `options={"direction": ...}` picks one of the directions.

        Raises:
            InputError: an unknown option or direction.
        """
        super().reset(seed=seed)
        seen, info = self._batch.reset(self.np_random, options)
        self._running = True
        return _one(seen), _one_info(info)

    def step(self, action: ArrayLike) -> tuple[Seen, float, bool, bool, Info]:
        """Take a decision `(n,)`.

        Raises:
            ResetNeeded: no episode runs.
            InputError: an action of the wrong shape or that is no number.
        """
        if not self._running:
            raise gymnasium.error.ResetNeeded("no episode runs: call reset() first, and again after each episode's end")
        found = self._batch.step(np.asarray(action)[None])
        terminated, truncated = bool(found.terminated[0]), bool(found.truncated[0])
        self._running = not (terminated or truncated)
        return _one(found.successor), float(found.reward[0]), terminated, truncated, _one_info(found.info)


class AsteriskGoalEnv(AsteriskEnv):
    """Move a held object to a goal on a direction (`inhand/AsteriskGoal-v0`).

    Observations are a dict of `observation`, `achieved_goal` and `desired_goal`; goals are poses of the object x [m],
    y [m], theta [rad] seen from where the hand places it. The reward is always
    `compute_reward(achieved_goal, desired_goal, info)`, and `info` tells `is_success` instead of `terms`. The direction
    stays a part of `observation`.
    """

    _kinds = (GoalConfig, _GoalBatch)

    def compute_reward(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: object) -> Array:
        """Return the reward `(...)` of poses `(..., 3)` for goals `(..., 3)`; what else is known changes nothing."""
        del info
        return _reward(self._batch, achieved_goal, desired_goal)


class AsteriskVectorEnv(VectorEnv[Any, Any, Any]):
    """Many of `AsteriskEnv` in one simulation on all cores, restarted in the step in which they end."""

    metadata = VECTOR_METADATA
    _kinds: tuple[type[EnvironmentConfig], type[_Batch[Any]]] = (EnvironmentConfig, _Batch)

    def __init__(self, num_envs: int = 1, *, render_mode: None = None, **keywords: object) -> None:
        """Make the environments.

        Args:
            num_envs: how many.
            render_mode: None, the only one.
            keywords: the fields of `EnvironmentConfig`, for goals of `GoalConfig`.

        Raises:
            InputError: an unknown keyword or a value that cannot be.
        """
        self._batch, self.num_envs = _batch(self._kinds, keywords, num_envs, render_mode), num_envs
        self.single_observation_space = self._batch.observation_space
        self.single_action_space = self._batch.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, Info]:
        """Start every episode anew; `options={"direction": ...}` takes one direction for all or one for each.

        Raises:
            InputError: an unknown option or direction.
        """
        super().reset(seed=seed)
        seen, info = self._batch.reset(self.np_random, options)
        return seen, _masked(info, np.ones(self.num_envs, dtype=bool))

    def step(self, actions: ArrayLike) -> tuple[Seen, Array, NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Take a decision `(B, n)` in every environment.

        Where an episode ends the observation is the next one's first; `final_obs` and `final_info` tell of its last.

        Raises:
            InputError: actions of the wrong shape or that are no numbers.
        """
        found = self._batch.step(actions)
        ended = found.terminated | found.truncated
        info = _masked(found.info, ~ended)
        if ended.any():
            info |= _masked(self._batch.begun_info(), np.ones(self.num_envs, dtype=bool))
            last = np.full(self.num_envs, None, dtype=object)
            for world in np.flatnonzero(ended).tolist():
                last[world] = _one(found.successor, world)
            info |= {"final_obs": last, "_final_obs": ended.copy()}
            info |= {"final_info": _masked(found.info, ended), "_final_info": ended.copy()}
        return found.seen, found.reward, found.terminated, found.truncated, info


class AsteriskGoalVectorEnv(AsteriskVectorEnv):
    """Many of `AsteriskGoalEnv` in one simulation on all cores, restarted in the step in which they end."""

    _kinds = (GoalConfig, _GoalBatch)

    def compute_reward(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: object) -> Array:
        """Return the reward `(...)` of poses `(..., 3)` for goals `(..., 3)`; what else is known changes nothing."""
        del info
        return _reward(self._batch, achieved_goal, desired_goal)


def _batch(
    kinds: tuple[type[EnvironmentConfig], type[_Batch[Any]]], keywords: dict[str, Any], count: int, render_mode: None
) -> _Batch[Any]:
    if render_mode is not None:
        raise InputError(f"render_mode={render_mode!r}: there is none; `inhand asterisk` draws and animates trials")
    return kinds[1](config_of(kinds[0], keywords), count)


def _reward(batch: _Batch[GoalConfig], achieved: ArrayLike, desired: ArrayLike) -> Array:
    return batch.config.reward_of(achieved, desired)


def _one(seen: Seen, world: int = 0) -> Seen:
    """Return the observation of one world."""
    return {name: part[world].copy() for name, part in seen.items()} if isinstance(seen, dict) else seen[world].copy()


def _one_info(info: Info) -> Info:
    """Return the info of the first world."""
    return {name: _one_info(told) if isinstance(told, dict) else told[0].item() for name, told in info.items()}


def _masked(info: Info, mask: NDArray[np.bool_]) -> Info:
    """Return infos as Gymnasium tells those of some of the worlds: each beside a mask of who has it, 0 elsewhere."""
    told: Info = {}
    for name, value in info.items():
        told[name] = _masked(value, mask) if isinstance(value, dict) else np.where(mask, value, value.dtype.type(0))
        told[f"_{name}"] = mask.copy()
    return told
