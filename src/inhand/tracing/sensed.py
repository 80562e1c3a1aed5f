"""High-level control on what a hand can know: the sequencer decides on where an estimator believes the objects to be.

One memory goes through a whole plan, so nothing is forgotten and nothing waited for between two primitives. Plans
count from the palm, so what one primitive is off is not carried into the next.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.memory import Memory
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array, Path
from inhand.hands.fit import Held
from inhand.sim.state import State
from inhand.tracing.plan import Plan
from inhand.tracing.sequencer import Repertoire, Sequencer
from inhand.tracing.walk import SequenceConfig


class SensedSequencer:
    """Takes every world through its plan, once its first frames have come in."""

    reads = SENSED

    def __init__(
        self,
        task: Task,
        plans: Sequence[Plan],
        repertoire: Repertoire,
        config: SequenceConfig | None = None,
        *,
        remembers: bool = False,
    ) -> None:
        """Take worlds through plans, one each, given in the palm frame, as far as the task says.

        Primitives of a policy that `remembers` see what is remembered.
        """
        self._held, self._remembers = Held(task.hand, task.objects[0]), remembers
        here = Path(np.zeros((task.n_worlds, 2, 3)))
        self._waiting = repertoire["hold"](replace(task, path=here, start=None, distance=np.zeros(task.n_worlds)))
        self.sequence = Sequencer(task, plans, repertoire, config)
        """What decides."""

    def begin(self, seen: Seen) -> None:
        """Start from the grip that holds the object now."""
        self._memory, self._going = Memory(self._held, seen), False
        state = self._believed(seen)
        self._waiting.begin(self.sequence.view(self._waiting, state, np.arange(seen.n_worlds)))

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._memory.take(seen)
        state = self._believed(seen)
        # Time stands still in a world whose episode has ended: it holds up no other.
        if not self._going and not bool(self._memory.waiting.all()):
            self._going = True
            self.sequence.begin(state)
        if self._going:
            return self.sequence.act(state)
        self.sequence.legs.append(np.zeros(seen.n_worlds, dtype=np.int64))
        return self._waiting.act(self.sequence.view(self._waiting, state, np.arange(seen.n_worlds)))

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have come to the end of their plan or have stopped for good `(B,)`."""
        del seen
        return np.array([walk.ended for walk in self.sequence.walks])

    def _believed(self, seen: Seen) -> State:
        """Return what is believed of the worlds, and tell the sequence what is sensed and remembered."""
        self.sequence.seen = seen
        self.sequence.past = self._memory.past if self._remembers else None
        return self._memory.state(seen)
