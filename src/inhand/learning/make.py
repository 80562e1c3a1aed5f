"""Environments by the words of a program: one, or many in one simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from inhand.environment_ids import IDS
from inhand.errors import InputError, near_matches, needs_extra
from inhand.hands.spatial.files import hand_name, object_name
from inhand.records import checked
from inhand.sim.disturbance import disturbance_of

if TYPE_CHECKING:
    import gymnasium

WORDS = {
    "asterisk": "inhand/Asterisk-v0",
    "easy": "inhand/AsteriskEasy-v0",
    "goal": "inhand/AsteriskGoal-v0",
    "spatial": "inhand/SpatialAsterisk-v0",
}
"""Short words for the ids."""


def make(
    name: str = "asterisk", *, num_envs: int | None = None, **keywords: Any
) -> gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any]:
    """Return an environment, as `gymnasium.make` or, with `num_envs`, `gymnasium.make_vec` does.

    Args:
        name: asterisk, easy, goal, spatial (a hand in space), or an id of Gymnasium's.
        num_envs: how many in one simulation; None for a single one.
        keywords: fields of `inhand.learning.environment_config.EnvironmentConfig`, of `GoalConfig` for goals; hand,
            object and disturb may be specs too. And `render_mode="rgb_array"` for pictures.

    Raises:
        InputError: an unknown name or keyword, or the extra `rl` is missing.
    """
    try:
        import gymnasium
    except ImportError as error:
        raise needs_extra("rl", "an environment") from error
    name = checked("name", name, str)
    if "hand" in keywords:
        keywords["hand"] = hand_name(keywords["hand"])
    if "object" in keywords:
        keywords["object"] = object_name(keywords["object"])
    keywords |= disturbance_of(keywords)
    found = WORDS.get(name, name)
    if found not in IDS:
        known = (*WORDS, *IDS)
        raise InputError(f"unknown environment {name!r}{near_matches(name, known)}; allowed are {', '.join(known)}")
    if num_envs is None:
        return gymnasium.make(found, **keywords)
    return gymnasium.make_vec(found, num_envs=num_envs, vectorization_mode="vector_entry_point", **keywords)
