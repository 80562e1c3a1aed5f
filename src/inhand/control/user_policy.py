"""A user's policy, from observations to actions, as what a controller can be made of."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.registry import describe
from inhand.tasks.decisions import Actions
from inhand.tasks.layouts import find_layout

GraspKind = Literal["planned", "rough"]
"""How an object is held: as the contact search plans it, or on the middle of its sides."""


@dataclass(frozen=True)
class UserPolicy:
    """A user's function from observations to actions, such as a policy that another library trained."""

    name: str
    """What it is called."""
    function: Callable[[Array], Any]
    """Gives actions `(B, n)` within [-1, 1] for observations `(B, d)`, numbers of 32 bits as environments give them."""
    observation: str = "grip"
    """Layout of its observations."""
    actions: Actions = "steps"
    """What its actions mean."""
    grasp: GraspKind = "planned"
    """How it is given the object."""
    stop: bool = False
    """Whether it is told how far the grip is predicted to reach, as environments with `stop` tell."""

    def __call__(self, observation: Array) -> Array:
        """Return actions `(B, n)` for observations `(B, d)`.

        Raises:
            InputError: not a row of finite numbers for each world.
        """
        actions = np.asarray(self.function(observation.astype(np.float32)), dtype=float)
        if actions.ndim != 2 or len(actions) != len(observation) or not np.isfinite(actions).all():
            raise InputError(
                f"policy {self.name!r} returned {actions.shape} for observations {observation.shape}: it must return"
                " finite actions (B, n), a row for each world and a number within [-1, 1] for each joint"
            )
        return actions


def user_policy(
    function: object,
    observation: str = "grip",
    actions: Actions = "steps",
    *,
    name: str = "",
    grasp: GraspKind = "planned",
    stop: bool = False,
) -> UserPolicy:
    """Return a user's policy as a controller that tests can run.

    Args:
        function: gives actions `(B, n)` for observations `(B, d)`; or a model with `predict`, such as
            Stable-Baselines3's, which is asked for its deterministic actions.
        observation: layout of the observations it was trained with: grip, grip-open, thesis, with your parts.
        actions: steps or angles, as in the environment.
        name: what tables call it; without it the function's or the model's own name.
        grasp: planned or rough, as in the environment.
        stop: the environment's `stop`.

    Raises:
        InputError: nothing that can be called, or an unknown word.
    """
    predict = getattr(function, "predict", None)
    if callable(predict):
        acts: Callable[[Array], Any] = partial(_predicted, predict)
    elif callable(function):
        acts = function
    else:
        raise InputError(f"policy {describe(function)}: give a function of observations, or a model with `predict`")
    if find_layout(observation).sensed:
        raise InputError(f"layout {observation!r} has a memory: make a controller with reads = 'sensed' instead")
    for word, given, allowed in (("actions", actions, get_args(Actions)), ("grasp", grasp, get_args(GraspKind))):
        if given not in allowed:
            raise InputError(f"unknown {word} {given!r}{near_matches(str(given), allowed)}; use {' or '.join(allowed)}")
    called = name or str(getattr(function, "__name__", type(function).__name__)).strip("<>")

    return UserPolicy(called, acts, observation, actions, grasp, stop)


def _predicted(predict: Callable[..., Any], observation: Array) -> Array:
    """Return a model's deterministic actions, without the state that recurrent ones give too."""
    return np.asarray(predict(observation, deterministic=True)[0])
