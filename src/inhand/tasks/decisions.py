"""Decisions: what actions do to the joints, and what is paid for what they change.

Actions are numbers within [-1, 1] for each joint. A reward is a weighted sum of terms, each a pure function of one
decision.
"""

import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.registry import Registry, describe
from inhand.sim.state import State
from inhand.tasks.observations import AnyAim

Actions = Literal["angles", "steps", "fine"]
"""`angles`: joint targets over the joints' ranges (thesis 3.3.2). `steps`: how far the last targets move on.
`fine`: the same in small steps, with which chance holds the object for longer."""

LARGEST_STEP = 0.04
"""How far a step of 1 moves a joint target in one decision [rad]: 2 rad/s, guessed."""
FINE_STEP = 0.01
"""How far a fine step of 1 does [rad]: 0.5 rad/s, guessed; the expert's 40 mm/s take no more."""
CONTACT_CAP = -1000.0
"""Contact rewards at or below this become -100 (thesis 3.3.3); it takes a gap of 6.9 m, so it never acts."""
NEAR = 0.001
"""An object within this of its end has arrived [m]."""


def checked_actions(given: object, shape: tuple[int, ...]) -> Array:
    """Return actions as numbers `(B, n)`.

    Raises:
        InputError: no numbers, another shape, or one that is not finite.
    """
    try:
        found = np.asarray(given)
    except ValueError:
        found = np.asarray(None)
    if found.dtype.kind not in "fiu":
        raise InputError(f"actions {reprlib.repr(given)}: give numbers {shape} within [-1, 1]")
    if found.shape != shape:
        raise InputError(
            f"actions of shape {found.shape}; {shape[0]} worlds need {shape}, a number within [-1, 1] for each joint"
        )
    if not np.isfinite(found).all():
        world, joint = np.argwhere(~np.isfinite(found))[0]
        raise InputError(f"the action of joint {joint} in world {world} is {found[world, joint]}; give one in [-1, 1]")
    return found.astype(float)


def largest_step(kind: Actions) -> float:
    """Return how far an action of 1 moves a joint target in one decision, where actions are steps [rad]."""
    return FINE_STEP if kind == "fine" else LARGEST_STEP


class Commanded(Protocol):
    """What tells the last commands: a `State`, or what is sensed."""

    @property
    def targets(self) -> Array:
        """Joint angles last commanded `(B, n)` [rad]."""


class Limited(Protocol):
    """What tells joint limits: a hand, or the arrays of many."""

    @property
    def limits(self) -> Array:
        """Lowest and highest joint angles `(n, 2)`, or of each world `(B, n, 2)` [rad]."""


def targets_of(actions: Array, kind: Actions, hand: Limited, state: Commanded) -> Array:
    """Return joint targets `(B, n)` [rad] of actions `(B, n)`, which are cut to [-1, 1]."""
    cut, limits = np.clip(actions, -1.0, 1.0), hand.limits
    if kind == "angles":
        return np.asarray(limits[..., 0] + (cut + 1.0) / 2.0 * np.ptp(limits, axis=-1))
    return np.asarray(np.clip(state.targets + largest_step(kind) * cut, limits[..., 0], limits[..., 1]))


def actions_of(targets: Array, kind: Actions, hand: Limited, state: Commanded) -> Array:
    """Return the actions `(B, n)` within [-1, 1] that come nearest to commanding joint targets `(B, n)` [rad]."""
    limits = hand.limits
    if kind == "angles":
        return np.asarray(np.clip(2.0 * (targets - limits[..., 0]) / np.ptp(limits, axis=-1) - 1.0, -1.0, 1.0))
    return np.asarray(np.clip((targets - state.targets) / largest_step(kind), -1.0, 1.0))


@dataclass(frozen=True)
class Made:
    """What a decision made of the way that was asked for."""

    gained: Array
    """Way gained `(B,)` [m]; what lies beyond the end does not count."""
    left: Array
    """Way left `(B,)` [m], negative past the end."""
    across: Array
    """Distance from the line `(B,)` [m]."""
    turned: Array
    """Angle away from what is asked `(B,)` [rad]."""


@dataclass(frozen=True)
class Decision:
    """One decision of a batch of B worlds."""

    before: State
    """The state it was taken in."""
    after: State
    """The state it led to."""
    action: Array
    """The action `(B, n)`."""
    last: Array
    """The action before it `(B, n)`."""
    dropped: NDArray[np.bool_]
    """Whether the episode ended by losing the object `(B,)`."""
    aim: AnyAim
    route: Made | None = None
    """What was made of a route's way; None where a primitive was asked for."""

    @cached_property
    def made(self) -> Made:
        """What was made of the way that was asked for."""
        if self.route is not None:
            return self.route
        aim = self.aim
        after, before = self.shift, aim.shift(aim.where(self.before))
        come = aim.come(after)
        gained = np.minimum(come, aim.distance) - np.minimum(aim.come(before), aim.distance)
        return Made(gained, aim.distance - come, *aim.off(after))

    @cached_property
    def shift(self) -> Array:
        """Way along the primitive, way to its left [m] and angle turned [rad] `(B, 3)`, or as `SpatialAim.shift`."""
        return np.asarray(self.aim.shift(self.aim.where(self.after)))


@dataclass(frozen=True)
class Term:
    """One weighted part of a reward."""

    name: str
    """Its name in `info`."""
    weight: float
    """Its weight."""
    value: Callable[[Decision], Array]
    """Gives it, unweighted, `(B,)`."""


def reward(terms: tuple[Term, ...], decision: Decision) -> tuple[Array, dict[str, Array]]:
    """Return the rewards `(B,)` and every weighted term by name."""
    parts = {term.name: term.weight * term.value(decision) for term in terms}
    return np.sum(list(parts.values()), axis=0), parts


def find_reward(name: str) -> tuple[Term, ...]:
    """Return the terms of a reward by name; `progress,effort` adds a user's term to one.

    Raises:
        InputError: there is none of that name.
    """
    first, *more = name.split(",")
    if first not in REWARDS:
        raise InputError(f"unknown reward {first!r}{near_matches(first, REWARDS)}; allowed are {', '.join(REWARDS)}")
    return (*REWARDS[first], *(TERMS.known(word) for word in more))


def contact(decision: Decision) -> Array:
    """-exp of the summed gaps of the fingers [m], divided by 100, or -100 beyond the cap (thesis 3.3.3)."""
    value = -np.exp(np.maximum(decision.after.gaps, 0.0).sum(axis=-1))
    return np.where(value <= CONTACT_CAP, -100.0, value / 100.0)


def direction(decision: Decision) -> Array:
    """Distance along the primitive less half the distance across it, from its start [m] (thesis 3.3.3)."""
    shift = decision.shift
    return np.asarray(shift[:, 0] - 0.5 * np.abs(shift[:, 1]))


def progress(decision: Decision) -> Array:
    """Way gained along the primitive [m]; what lies beyond where the object is to stay does not count."""
    return decision.made.gained


def waiting(decision: Decision) -> Array:
    """1 where the object is not yet within `NEAR` of where it is to stay."""
    return np.asarray(decision.made.left > NEAR, dtype=float)


def astray(decision: Decision) -> Array:
    """How far the object is off [m]: across beyond 0.5 mm, past its end, and a tenth of its turn beyond 0.01 [rad]."""
    made = decision.made
    across, turned = np.maximum(made.across - 5e-4, 0.0), np.maximum(made.turned - 0.01, 0.0)
    return np.asarray(across + 0.1 * turned + np.maximum(-made.left - NEAR, 0.0))


def jerk(decision: Decision) -> Array:
    """Mean square of the change of action."""
    return np.asarray(((decision.action - decision.last) ** 2).mean(axis=-1))


def drop(decision: Decision) -> Array:
    """1 where the object was lost."""
    return decision.dropped.astype(float)


REWARDS = {
    "thesis": (Term("contact", 1.0, contact), Term("direction", 100.0, direction)),
    "progress": (
        Term("progress", 100.0, progress),
        Term("waiting", -0.01, waiting),
        Term("astray", -10.0, astray),
        Term("jerk", -0.002, jerk),
        Term("drop", -10.0, drop),
    ),
    "gain": (Term("progress", 100.0, progress), Term("drop", -5.0, drop)),
}
"""Rewards by name. `progress` and `gain` count a centimetre along as 1; their other weights are guessed. Where
waiting and straying cost, as in `progress`, a learner without demonstrations finds that dropping the object at once
costs least; in `gain` holding it still costs nothing."""


def _term(name: str, given: object) -> Term:
    """Return a user's term, its values looked at."""
    if not isinstance(given, Term) or not callable(given.value) or not np.isfinite(given.weight):
        raise InputError(
            f"reward term {name!r} is {describe(getattr(given, 'value', given))} with weight"
            f" {getattr(given, 'weight', None)}: it must be a function of a decision with a finite weight"
        )

    def value(decision: Decision) -> Array:
        found, count = np.asarray(given.value(decision), dtype=float), decision.after.n_worlds
        if found.shape != (count,):
            raise InputError(f"reward term {name!r} gives {found.shape}: it must give ({count},), one number a world")
        return found

    return Term(name, float(given.weight), value)


TERMS: Registry[Term] = Registry("reward term", {}, _term)
"""Terms that users add to a reward."""
