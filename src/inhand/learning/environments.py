"""The manipulation phase as Gymnasium environments, one at a time or a batch in one simulation.

`inhand/Asterisk-v0` moves the object along a direction as the thesis has it, `inhand/AsteriskEasy-v0` in a setting to
learn in from nothing, `inhand/AsteriskGoal-v0` to a goal that hindsight may replace, `inhand/SpatialAsterisk-v0` is of
a hand in space. `import inhand` makes them known
to Gymnasium, whichever of the two is imported first.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inhand.errors import InputError, needs_extra
from inhand.geometry import Array
from inhand.learning.batch import RENDER_MODES, Batch, GoalBatch, Info, Seen
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig
from inhand.learning.spatial_environment import SpatialBatch, SpatialEnvironmentConfig
from inhand.records import checked, configured

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise needs_extra("rl", "an environment") from error

Kinds: TypeAlias = tuple[type[EnvironmentConfig | SpatialEnvironmentConfig], type[Batch[Any]]]
"""What reads an environment's keywords, and the worlds that they ask for."""
METADATA: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 50}
"""What Gymnasium asks about one environment: it gives pictures, and a second has 50 decisions."""
VECTOR_METADATA: dict[str, Any] = {**METADATA, "autoreset_mode": AutoresetMode.SAME_STEP}
"""The same about a batch."""
IN_SPACE: dict[str, Any] = {**METADATA, "render_modes": []}
VECTOR_IN_SPACE: dict[str, Any] = {**VECTOR_METADATA, "render_modes": []}
"""The same of hands in space, of which no pictures are given."""


class _WithGoals:
    _kinds: Kinds = (GoalConfig, GoalBatch)
    _batch: Batch[GoalConfig]

    def compute_reward(self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: object) -> Array:
        """Return the reward `(...)` of poses `(..., 3)` for goals `(..., 3)`; what else is known changes nothing."""
        del info
        return self._batch.config.reward_of(achieved_goal, desired_goal)


class AsteriskEnv(gymnasium.Env[Any, Any]):
    """Move a held object along a direction (`inhand/Asterisk-v0`).

    Observations, actions and rewards are the thesis's by default. An episode ends where the object was lost for more
    than 20 physics steps, and is cut off at the horizon. `info` tells `direction` [deg], the way `along` it and to its
    `left` [m], the angle `turned` [rad], whether the object was `lost`, and the reward's `terms`.
    """

    metadata = METADATA
    _kinds: Kinds = (EnvironmentConfig, Batch)

    def __init__(self, *, render_mode: str | None = None, **keywords: object) -> None:
        """Make the environment; grasps and starts are made once in a process for equal keywords.

        Args:
            render_mode: rgb_array, or None for no pictures.
            keywords: the fields of `EnvironmentConfig`, for goals of `GoalConfig`.

        Raises:
            InputError: an unknown keyword or a value that cannot be.
        """
        self._batch, self.render_mode = _batch(self._kinds, keywords, 1, render_mode), render_mode
        self.observation_space, self.action_space = self._batch.observation_space, self._batch.action_space
        self._running, self._shown = False, (self._batch.worlds.state, self._batch.ways())

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, Info]:
        """Start an episode; equal seeds give equal bytes. `options={"direction": ...}` picks one of the directions.

        Raises:
            InputError: an unknown option or direction.
        """
        super().reset(seed=_seed(seed))
        seen, info = self._batch.reset(self.np_random, options)
        self._running, self._shown = True, (self._batch.worlds.state, self._batch.ways())
        return _one(seen), _one_info(info)

    def step(self, action: ArrayLike) -> tuple[Seen, float, bool, bool, Info]:
        """Take a decision `(n,)`.

        Raises:
            ResetNeeded: no episode runs.
            InputError: an action of the wrong shape or that is no number.
        """
        if not self._running:
            raise gymnasium.error.ResetNeeded("no episode runs: call reset() first, and again after each episode's end")
        ways = self._batch.ways()
        found = self._batch.step([action])
        terminated, truncated = bool(found.terminated[0]), bool(found.truncated[0])
        self._running, self._shown = not (terminated or truncated), (found.after, ways)
        return _one(found.successor), float(found.reward[0]), terminated, truncated, _one_info(found.info)

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture `(400, 400, 3)` of what the last step led to; None where none were asked for."""
        return None if self.render_mode is None else self._batch.pictures(*self._shown)[0]


class AsteriskGoalEnv(_WithGoals, AsteriskEnv):
    """Move a held object to a goal on a direction (`inhand/AsteriskGoal-v0`).

    Observations are a dict of `observation`, `achieved_goal` and `desired_goal`; goals are poses of the object x [m],
    y [m], theta [rad] seen from where the hand places it. The reward is always
    `compute_reward(achieved_goal, desired_goal, info)`, and `info` tells `is_success` instead of `terms`. The direction
    stays a part of `observation`.
    """


class SpatialAsteriskEnv(AsteriskEnv):
    """Move an object held in space along a direction, or turn it about an axis (`inhand/SpatialAsterisk-v0`).

    `info` tells the unit vectors of `direction` and `axis`, one of which is 0, and `gravity` [m/s^2], each of three
    numbers in the palm frame; the way `along`, the distance `across` from it [m] and the angle `turned` away [rad].
    """

    metadata = IN_SPACE
    _kinds = (SpatialEnvironmentConfig, SpatialBatch)


class AsteriskVectorEnv(VectorEnv[Any, Any, Any]):
    """Many of `AsteriskEnv` in one simulation on all cores, restarted in the step in which they end."""

    metadata = VECTOR_METADATA
    _kinds: Kinds = (EnvironmentConfig, Batch)

    def __init__(self, num_envs: int = 1, *, render_mode: str | None = None, **keywords: object) -> None:
        """Make the environments.

        Args:
            num_envs: how many.
            render_mode: rgb_array, or None for no pictures.
            keywords: the fields of `EnvironmentConfig`, for goals of `GoalConfig`.

        Raises:
            InputError: an unknown keyword or a value that cannot be, or more than the machine has memory for.
        """
        self.num_envs, self.render_mode = checked("num_envs", num_envs, int), render_mode
        if self.num_envs < 1:
            raise InputError(f"num_envs is {num_envs}; it must be 1 or more")
        self._batch = _batch(self._kinds, keywords, self.num_envs, render_mode)
        self.single_observation_space = self._batch.observation_space
        self.single_action_space = self._batch.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, Info]:
        """Start every episode anew; `options={"direction": ...}` takes one direction for all or one for each.

        Raises:
            InputError: an unknown option or direction.
        """
        super().reset(seed=_seed(seed))
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

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture `(400, 400, 3)` of each environment as it is now; None where none were asked for."""
        batch = self._batch
        return None if self.render_mode is None else batch.pictures(batch.worlds.state, batch.ways())


class AsteriskGoalVectorEnv(_WithGoals, AsteriskVectorEnv):
    """Many of `AsteriskGoalEnv` in one simulation on all cores, restarted in the step in which they end."""


class SpatialAsteriskVectorEnv(AsteriskVectorEnv):
    """Many of `SpatialAsteriskEnv` in one simulation on all cores, restarted in the step in which they end."""

    metadata = VECTOR_IN_SPACE
    _kinds = (SpatialEnvironmentConfig, SpatialBatch)


def _batch(kinds: Kinds, keywords: dict[str, Any], count: int, render_mode: str | None) -> Batch[Any]:
    return kinds[1](configured(kinds[0], keywords), count, render_mode)


def _seed(given: object) -> int | None:
    """Return a seed of `reset`, looked at."""
    seed = checked("seed", given, int | None)
    if seed is not None and seed < 0:
        raise InputError(f"seed is {seed}; it must be 0 or more, or None for one that is drawn")
    return None if seed is None else int(seed)


def _one(seen: Seen, world: int = 0) -> Seen:
    return {name: part[world].copy() for name, part in seen.items()} if isinstance(seen, dict) else seen[world].copy()


def _one_info(info: Info) -> Info:
    return {name: _one_info(told) if isinstance(told, dict) else _first(told) for name, told in info.items()}


def _first(told: NDArray[Any]) -> object:
    return told[0].item() if told.ndim == 1 else told[0].copy()


def _masked(info: Info, mask: NDArray[np.bool_]) -> Info:
    """Return infos as Gymnasium tells those of some of the worlds: each beside a mask of who has it, 0 elsewhere."""
    told: Info = {}
    for name, value in info.items():
        told[name] = _masked(value, mask) if isinstance(value, dict) else np.where(mask, value.T, value.dtype.type(0)).T
        told[f"_{name}"] = mask.copy()
    return told
