"""What stands between controllers and disturbed worlds: senses one way, commands and pushes the other.

The loop asks it at every decision: what arrives at the servos, which objects are pushed, and what is seen of the state
that this led to. One object serves the B worlds of a batch; every episode of a world begins with `begin`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.kept import Remembered, remember, remembered
from inhand.control.noise import Noise
from inhand.control.seen import SENSED, Reads, View
from inhand.control.senses import PARTS, Senses, decisions_of
from inhand.control.way_kernels import Line, Pushes, plan, push, send
from inhand.geometry import Array
from inhand.sim.drawn import Disturbed
from inhand.sim.engine import Simulator
from inhand.sim.state import State

MEMORIES = (Senses, Line, Pushes, *PARTS)
"""What holds a part of the memory."""
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
        ring, zero = np.zeros((latest + 2, n_worlds, n_joints)), np.zeros((n_worlds, n_joints))
        whole, self._lag, come = np.zeros((3, n_worlds), dtype=np.int64)
        self._line, self._head = Line(ring, zero, whole), 0
        self._noise = Noise(n_worlds, PUSHES, 0, 2 if state.pose.shape[1] == 3 else 3)
        pushes = self.spec.pushes
        law = pushes.push_mns / 1e3, float(pushes.per_s), pushes.most
        held, following = np.zeros((2, n_worlds))
        self._pushes = Pushes(self._noise.drawn, come, held, following, np.zeros((n_worlds, 3)), law)
        self._state, self._commands = state, state.targets
        self._shown: dict[Reads, View] = {}
        self.pushing = False
        """Whether objects are pushed now: only where they are held and carried, by the loop's word."""
        self.begin(np.arange(n_worlds), disturbed, state)

    def begin(self, worlds: NDArray[np.int64], disturbed: Sequence[Disturbed], state: State) -> None:
        """Begin episodes in some worlds `(K,)`, from a state of all; nothing is on its way to them."""
        drawn, line = [each.drawn for each in disturbed], self._line
        line.zero[worlds] = [each.zero for each in drawn]
        steps = np.rint([each.command_s / self._period * self._substeps for each in drawn]).astype(np.int64)
        line.whole[worlds], self._lag[worlds] = np.divmod(steps, self._substeps)
        line.ring[:, worlds] = state.targets[worlds]
        commands = self._commands.copy()
        commands[worlds] = state.targets[worlds] + line.zero[worlds]
        self._noise.begin(worlds, [each.key for each in drawn])
        while not plan(self._pushes, worlds):
            self._noise.draw(np.zeros(len(line.whole), dtype=np.int64))
        self._senses.begin(worlds, disturbed, state)
        self._state, self._commands, self._shown = state, commands, {}

    def send(self, simulator: Simulator, commands: Array) -> Array:
        """Take commands `(B, n)` [rad] and return those that arrive in this decision; push what is to be pushed.

        A command is told to the servo, whose zero may be another than the joint's.
        """
        self._commands = commands
        self._head = (self._head + 1) % len(self._line.ring)
        simulator.lag = self._lag
        if self.pushing and self.spec.pushes.push_mns:
            self._push(simulator)
        arriving = np.empty(commands.shape)
        send(self._line, self._head, commands, arriving)
        return arriving

    def state_dict(self) -> Remembered:
        """Return everything that `load_state_dict` needs beside the worlds' draws and their keys, arrays by name."""
        return {f"between.{name}": array for name, array in remembered(self, MEMORIES).items()}

    def load_state_dict(self, kept: dict[str, Any], state: State) -> None:
        """Go on in a state from what `state_dict` returned, among others, of worlds disturbed alike, byte for byte."""
        mine = "between."
        remember(self, MEMORIES, {name.removeprefix(mine): kept[name] for name in kept if name.startswith(mine)})
        self._state, self._shown = state, {}

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
        impulse, due = np.zeros((len(self._lag), 3)), np.zeros(len(self._lag), dtype=bool)
        while not push(self._pushes, self._period, impulse, due):
            self._noise.draw(self._pushes.come + 1)
        if due.any():
            simulator.push(np.flatnonzero(due), impulse[due])
