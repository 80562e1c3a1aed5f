"""What stands between controllers and disturbed worlds: senses one way, commands and pushes the other.

The loop asks it at every decision: what arrives at the servos, which objects are pushed, and what is seen of the state
that this led to. One object serves the B worlds of a batch; every episode of a world begins with `begin`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.control.noise import Noise
from inhand.control.seen import SENSED, Reads, View
from inhand.control.senses import SOON, Senses, decisions_of
from inhand.geometry import Array
from inhand.sim.drawn import Disturbed
from inhand.sim.engine import Simulator
from inhand.sim.state import State

PUSHES = 4
"""What tells the generator of a world's pushes from others of it."""


class Between:
    """Senses, delayed commands and pushes of B worlds of one disturbance."""

    def __init__(self, disturbed: Sequence[Disturbed], state: State, timestep: float, substeps: int) -> None:
        """Begin an episode in every world, from the state that it is in.

        Args:
            disturbed: how each world is disturbed, all by the same.
            state: of all worlds.
            timestep: of the physics [s].
            substeps: physics steps for one decision.
        """
        self.spec, self._period, self._substeps = disturbed[0].spec, substeps * timestep, substeps
        n_worlds, n_joints = state.targets.shape
        self._senses = Senses(self.spec, state, self._period)
        latest = decisions_of(self.spec.commands.delay_ms[1] / 1e3, self._period)
        self._line = np.zeros((latest + 2, n_worlds, n_joints))
        self._head = 0
        self._worlds = np.arange(n_worlds)
        self._whole, self._zero = np.zeros(n_worlds, dtype=np.int64), np.zeros((n_worlds, n_joints))
        self._noise = Noise(n_worlds, PUSHES, 0, 2)
        self._next, self._pushed = np.zeros(n_worlds), np.zeros(n_worlds, dtype=np.int64)
        self._held, self._lag = np.zeros(n_worlds), np.zeros(n_worlds, dtype=np.int64)
        self._state, self._commands = state, state.targets
        self._shown: dict[Reads, View] = {}
        self.pushing = False
        """Whether objects are pushed now: only where they are held and carried, by the loop's word."""
        self.begin(self._worlds, disturbed, state)

    def begin(self, worlds: NDArray[np.int64], disturbed: Sequence[Disturbed], state: State) -> None:
        """Begin episodes in some worlds `(K,)`, from a state of all; nothing is on its way to them."""
        drawn = [each.drawn for each in disturbed]
        self._zero[worlds] = [each.zero for each in drawn]
        steps = np.rint([each.command_s / self._period * self._substeps for each in drawn]).astype(np.int64)
        self._whole[worlds], self._lag[worlds] = np.divmod(steps, self._substeps)
        self._line[:, worlds] = state.targets[worlds]
        commands = self._commands.copy()
        commands[worlds] = state.targets[worlds] + self._zero[worlds]
        self._noise.begin(worlds, [each.key for each in drawn])
        self._held[worlds], self._pushed[worlds] = 0.0, 0
        self._next[worlds] = self._pauses()[worlds]
        self._senses.begin(worlds, disturbed, state)
        self._state, self._commands, self._shown = state, commands, {}

    def send(self, simulator: Simulator, commands: Array) -> Array:
        """Take commands `(B, n)` [rad] and return those that arrive in this decision; push what is to be pushed.

        A command is told to the servo, whose zero may be another than the joint's.
        """
        self._commands = commands
        self._head = (self._head + 1) % len(self._line)
        self._line[self._head] = commands - self._zero
        simulator.lag = self._lag
        if self.pushing and self.spec.pushes.push_mns and self.spec.pushes.per_s:
            self._push(simulator)
        return np.asarray(self._line[(self._head - self._whole) % len(self._line), self._worlds])

    def take(self, state: State) -> None:
        """Take in the state that a decision led to."""
        self._senses.take(state)
        self._state, self._shown = state, {}

    def seen(self, reads: Reads) -> View:
        """Return what a controller that reads so sees of the state that was taken in last: a `State` or a `Seen`."""
        if reads not in self._shown:
            show = self._senses.sensed if reads == SENSED else self._senses.privileged
            self._shown[reads] = show(self._state, self._commands)
        return self._shown[reads]

    def _push(self, simulator: Simulator) -> None:
        most = self.spec.pushes.most
        due = (self._next <= self._held + SOON) & ((self._pushed < most) if most else True)
        self._held += self._period
        if due.any():
            angle = 2 * np.pi * self._noise.rows(self._pushed)[due, 1]
            away = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=-1)
            simulator.push(np.flatnonzero(due), self.spec.pushes.push_mns / 1e3 * away)
            self._pushed = self._pushed + due
            self._next = np.where(due, self._next + self._pauses(), self._next)

    def _pauses(self) -> Array:
        """Return the time before each world's next push `(B,)` [s]."""
        rate = self.spec.pushes.per_s
        return np.asarray(
            -np.log1p(-self._noise.rows(self._pushed)[:, 0]) / rate if rate else np.zeros(len(self._held))
        )
