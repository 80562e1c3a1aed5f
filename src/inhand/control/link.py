"""The line to a hand outside the simulator: when it is asked, what it is told, and when it is held.

Every period the hand is asked once. Where it has no new joint angles, or the newest frame is too old, it is told its
last targets again. Targets keep within the joint limits and a speed.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inhand.control.readings import Looks, Reading
from inhand.control.seen import Seen
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.records import Config

Read = Callable[[], Reading | None]
"""Asks a hand what it has; None where it has nothing."""
Command = Callable[[Array], None]
"""Tells a hand its joint targets `(n,)` [rad]."""
FRAMES, ENCODERS, NO_NUMBER = "frames stopped", "encoders stopped", "no number"
"""How driving ends where a hand or its controller falls silent."""


@dataclass(frozen=True)
class DriveConfig(Config):
    """How a hand is driven."""

    rate_hz: float = 50.0
    """Decisions a second."""
    fastest: float = 4.0
    """Speed of a target at most [rad/s]: guessed, twice a learned policy's and 1.5 times what `ik-sensed` needs."""
    oldest: float = 0.4
    """A frame older than this is too old to go on by [s]: guessed, what `hard` leaves between two frames."""
    patience: float = 1.0
    """Time for which the hand is held and waited for, before driving ends [s]."""
    longest: float = 8.0
    """Time after which the object is carried no farther [s]."""

    def __post_init__(self) -> None:
        """Refuse what is no time and no speed."""
        super().__post_init__()
        for name, value in vars(self).items():
            if value <= 0:
                raise InputError(f"{name} is {value:g}; it must be above 0")


@dataclass(frozen=True)
class Clock:
    """A clock of the program's own and how to wait by it; a test may have one that runs faster."""

    now: Callable[[], float] = time.monotonic
    """Gives the time [s]."""
    wait: Callable[[float], None] = time.sleep
    """Lets time pass [s]."""


@dataclass(frozen=True)
class Row:
    """One command, and what was known when it was given."""

    phase: str
    time: float
    """Of the joint angles, by the hand's clock [s]."""
    joints: Array
    """Joint angles `(n,)` [rad]."""
    targets: Array
    """What was commanded `(n,)` [rad]."""
    pose: Array
    """The object's pose in the newest frame `(3,)` [m, m, rad]."""
    frame_time: float
    """When that was taken, by the hand's clock [s]."""
    held: bool
    """Whether nothing was decided, and the last targets were told again."""


class StoppedError(Exception):
    """Driving cannot go on; the hand holds its last targets."""

    def __init__(self, outcome: str, message: str) -> None:
        """Say how it ended, and what a person should know."""
        super().__init__(message)
        self.outcome = outcome


class Link:
    """A hand that is read and commanded."""

    def __init__(self, hand: HandSpec, ends: tuple[Read, Command], config: DriveConfig, clock: Clock) -> None:
        """Have a hand by its two functions."""
        self._read, self._command = ends
        self._limits, self._config, self._clock = hand.limits, config, clock
        self._period = 1.0 / config.rate_hz
        self._looks = Looks(hand.n_joints)
        self.targets = np.zeros(hand.n_joints)
        """What was commanded last `(n,)` [rad]; at first where the joints are."""
        self.phase = ""
        """What the rows are to say of the phase."""
        self.rows: list[Row] = []
        """Every command."""
        self.late = 0
        """Periods that had passed before their turn came."""

    @property
    def seen(self) -> Seen:
        """What a controller sees now, a world of its own."""
        return self._looks.seen(self.targets)

    def begin(self) -> None:
        """Wait for the first joint angles and the first frame; nothing is commanded.

        Raises:
            StoppedError: they do not come.
        """
        self._next = self._clock.now()
        self.look()
        self.targets = self._looks.joints

    def send(self, targets: Array) -> None:
        """Command targets `(n,)` [rad], cut to the joint limits and to the speed.

        Raises:
            StoppedError: they are no numbers; the last targets are commanded instead.
        """
        if not np.isfinite(targets).all():
            self._tell(held=True)
            raise StoppedError(
                NO_NUMBER, f"the controller gave the targets {targets.tolist()}; the hand holds its last"
            )
        step = self._config.fastest * self._period
        near = np.clip(targets, self.targets - step, self.targets + step)
        self.targets = np.clip(near, *self._limits.T)
        self._tell(held=False)

    def look(self) -> None:
        """Wait for the next period and for something new to decide on; until it is there, hold what was commanded.

        Raises:
            StoppedError: it does not come.
        """
        began = self._clock.now()
        while True:
            self._pace()
            fault = self._fault(told=self._looks.take(self._read()), since=began)
            if fault is None:
                return
            if self.rows:
                self._tell(held=True)
            self._give_up(began, *fault)

    def hold(self) -> None:
        """Command the last targets once more, if there were any."""
        if self.rows:
            self._command(self.targets)

    def _fault(self, *, told: bool, since: float) -> tuple[str, str] | None:
        """Return what keeps the next decision from being made, and its words; None where nothing does."""
        if not told:
            return ENCODERS, f"no new joint angles for {self._clock.now() - since:.1f} s"
        if self._looks.age > self._config.oldest:
            age = self._looks.age
            return FRAMES, f"the newest frame is {age:.1f} s old" if np.isfinite(age) else "no frame has come yet"
        return None

    def _give_up(self, since: float, outcome: str, words: str) -> None:
        if self._clock.now() - since > self._config.patience:
            does = "holds its last targets" if self.rows else "was told nothing"
            raise StoppedError(outcome, f"{outcome}: {words}; the hand {does}. Mend that, then begin anew")

    def _tell(self, *, held: bool) -> None:
        looks = self._looks
        self._command(self.targets)
        self.rows.append(Row(self.phase, looks.time, looks.joints, self.targets, looks.pose, looks.frame_time, held))

    def _pace(self) -> None:
        """Wait for the end of the period; what was missed is not made up for."""
        self._next += self._period
        now = self._clock.now()
        if now < self._next:
            self._clock.wait(self._next - now)
        else:
            missed = int((now - self._next) / self._period)
            self.late += missed + (now > self._next)
            self._next = now
