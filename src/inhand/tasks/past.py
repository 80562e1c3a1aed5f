"""What a hand knows at a decision, and what it knew a little before: the view of layouts of what is sensed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.once import once
from inhand.sim.scene import DECISION_S
from inhand.sim.state import State
from inhand.tasks.observations import Aim, AnyAim, Layout, Part, Scene, by_rank
from inhand.tasks.spatial.aims import SpatialAim

SPAN = 2
"""Which of the `LAGS` a joint's velocity is measured over: two decisions."""
LAGS = (0, 1, 2, 4, 8)
"""Decisions back that are remembered, the present one first: 160 ms, in which a camera of 30 Hz takes five frames."""

A = TypeVar("A", Aim, SpatialAim)
LAGGED = ("joints", "commands", "frames", "ages")
"""What a `Past` has of each of them."""


@dataclass(frozen=True)
class Past:
    """What is known of B worlds with n joints and F fingers; of L decisions, which lie `LAGS` back."""

    joints: Array
    """What the encoders read `(L, B, n)` [rad]."""
    commands: Array
    """The commands that were last given then `(L, B, n)` [rad]."""
    frames: Array
    """The object's pose in the last frame that had come in `(L, B, 3)` [m, m, rad]; in space `(..., 7)`."""
    ages: Array
    """How old that frame was `(L, B)` [s]."""
    first: Array
    """What the encoders read when the primitive began `(B, n)` [rad]."""
    start: Array
    """Where the primitive starts: the mean of the frames while the hand waited `(B, 3)` [m, m, rad]."""
    waiting: NDArray[np.bool_]
    """Whether the hand still waits for frames `(B,)`."""
    pose: Array
    """Where an estimator believes the object now `(B, 3)` [m, m, rad]."""
    believed: Array
    """Where it believed it when the wait ended `(B, 3)` [m, m, rad]."""
    velocity: Array
    """How it believes the object to move now `(B, 3)` [m/s, m/s, rad/s], in space `(B, 6)`."""
    points: Array
    """Where it believes the fingers to touch, in the object's frame `(B, F, 2)` [m], in space `(B, F, 3)`."""
    askew: Array
    """Angles from the outline's normals there to the line between them `(B, F)` [rad]; in space the normals themselves,
    unit vectors out of the object in the palm frame `(B, F, 3)`."""

    @property
    def joint_angles(self) -> Array:
        """What the encoders read now `(B, n)` [rad]."""
        return np.asarray(self.joints[0])

    @property
    def targets(self) -> Array:
        """The commands that were last given `(B, n)` [rad]."""
        return np.asarray(self.commands[0])

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return len(self.start)

    def select(self, worlds: NDArray[np.int64]) -> "Past":
        """Return what is known of some worlds alone."""
        return Past(**{name: each[:, worlds] if name in LAGGED else each[worlds] for name, each in vars(self).items()})

    def shift(self, aim: Aim | SpatialAim) -> Array:
        """Return the shift `(B, 3)` of what is asked, as believed, since the wait."""
        if isinstance(aim, SpatialAim):
            return replace(aim, start=self.believed).shift(self.pose)
        return aim.shift(aim.start + self.pose - self.believed)

    def aimed(self, aim: A) -> A:
        """Return what is asked as the hand knows it: from where it saw the primitive start; while it waits, to stay."""
        return replace(aim, start=self.start, distance=np.where(self.waiting, 0.0, aim.distance))

    def planned(self, aim: Aim) -> "tuple[Past, Aim]":
        """Return the same and what is asked, of what is planned to start at a place, once first frames are in."""
        waiting = self.waiting[:, None]
        start, believed = (np.where(waiting, seen, aim.start) for seen in (self.start, self.believed))
        mine = replace(self, start=start, believed=believed)
        return mine, mine.aimed(aim)


def of_believed(
    values: Callable[[State, AnyAim, Scene], Array], believed: Callable[[Past, Scene], State]
) -> Callable[[Past, AnyAim, Scene], Array]:
    """Return what gives numbers of a state for the state that is believed, with what is asked from where that began."""
    return lambda past, aim, scene: values(believed(past, scene), _from_believed(past, aim), scene)


@once
def _from_believed(past: Past, aim: AnyAim) -> AnyAim:
    return replace(aim, start=past.believed)


def speeds_of(past: Past) -> Array:
    """Return how fast joints have moved of late `(B, n)` [rad/s]: a difference of readings."""
    return np.asarray((past.joint_angles - past.joints[SPAN]) / (LAGS[SPAN] * DECISION_S))


def _ranked(lags: Array, scene: Scene) -> Array:
    """Return numbers of all joints at each lag `(L, B, n)`, in the order of `by_rank`, side by side `(B, L n)`."""
    return np.concatenate(list(lags[..., by_rank(scene.hand)]), axis=-1)


def _each(given: Array | float, past: Past) -> Array:
    """Return a number of each world `(B, 1)`."""
    return np.broadcast_to(given, past.n_worlds)[:, None]


def _frames(past: Past, aim: Aim, _scene: Scene) -> Array:
    return np.concatenate([aim.shift(frames) for frames in past.frames], axis=-1)


def _left(past: Past, aim: Aim, _scene: Scene) -> Array:
    return np.asarray(aim.distance - aim.come(past.shift(aim)))[:, None]


SENSES = Layout(
    "senses-1",
    (
        Part("direction, unit vector; 0 of a turn", lambda _past, aim, _scene: aim.heading, 1.0, fixed=2),
        Part("side of a turn", lambda past, aim, _scene: _each(aim.turn, past), 1.0, fixed=1),
        Part("way to go in all [m]", lambda past, aim, _scene: _each(aim.distance, past), 0.1, fixed=1),
        Part(
            "object at the start, from where hands hold it [m, m, rad]",
            lambda past, _aim, scene: past.start - scene.hand.start_pose,
            (0.15, 0.15, 1.0),
            fixed=3,
        ),
        Part(
            "encoders at the start [rad]",
            lambda past, _aim, scene: past.first[:, by_rank(scene.hand)],
            np.pi,
            for_joint=1,
        ),
        Part("encoders [rad]", lambda past, _aim, scene: _ranked(past.joints, scene), np.pi, for_joint=len(LAGS)),
        Part(
            "encoders since then [rad]",
            lambda past, _aim, scene: _ranked(past.joints[0] - past.joints[1:], scene),
            1 / 30,
            for_joint=len(LAGS) - 1,
        ),
        Part(
            "commands ahead of the encoders [rad]",
            lambda past, _aim, scene: _ranked(past.commands - past.joints, scene),
            0.2,
            for_joint=len(LAGS),
        ),
        Part(
            "frames: way along and to the left [m], angle turned [rad]",
            _frames,
            (0.1, 0.01, 0.2) * len(LAGS),
            fixed=3 * len(LAGS),
        ),
        Part("age of the frames [s]", lambda past, _aim, _scene: past.ages.T, 0.1, fixed=len(LAGS)),
        Part(
            "believed: way along and to the left [m], angle turned [rad]",
            lambda past, aim, _scene: past.shift(aim),
            (0.1, 0.01, 0.2),
            fixed=3,
        ),
        Part("the same of a turn [rad]", lambda past, aim, _scene: past.shift(aim)[:, 2:], 1.5, fixed=1),
        Part("believed: way left to go [m]", _left, 0.1, fixed=1),
        Part("the same, near the end [m]", _left, 0.01, fixed=1),
        Part(
            "believed: contacts in the object frame [m]",
            lambda past, _aim, _scene: past.points.reshape(past.n_worlds, -1),
            0.04,
            for_finger=2,
        ),
        Part("believed: how askew contacts are [rad]", lambda past, _aim, _scene: past.askew, 0.5, for_finger=1),
    ),
    sensed=True,
)
"""99 numbers with two links a finger; scales are guessed from what the expert's episodes hold."""
