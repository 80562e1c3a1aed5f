"""High-level control on what a hand can know: the sequencer decides on where an estimator believes the objects to be.

One estimator goes through a whole plan, so nothing is forgotten and nothing waited for between two primitives. Plans
count from the palm, so what one primitive is off is not carried into the next.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.estimator import Estimator, waited
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array
from inhand.tracing.plan import Plan
from inhand.tracing.sequencer import Repertoire, Sequencer
from inhand.tracing.walk import SequenceConfig


class SensedSequencer:
    """Takes every world through its plan, once its first frames have come in."""

    reads = SENSED

    def __init__(
        self, task: Task, plans: Sequence[Plan], repertoire: Repertoire, config: SequenceConfig | None = None
    ) -> None:
        """Take worlds through plans, one each, given in the palm frame, as far as the task says."""
        self._estimator = Estimator(task.hand, task.objects[0])
        self._waiting = repertoire["hold"](replace(task, start=None, distance=np.zeros(task.n_worlds)))
        self.sequence = Sequencer(task, plans, repertoire, config)
        """What decides."""

    def begin(self, seen: Seen) -> None:
        """Start from the grip that holds the object now."""
        self._estimator.begin(seen)
        self._began, self._going, self._taken = seen.time, False, True
        self._waiting.begin(self._estimator.state(seen))

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        if not self._taken:
            self._estimator.take(seen)
        self._taken, state = False, self._estimator.state(seen)
        self.sequence.seen = seen
        # Time stands still in a world whose episode has ended: it holds up no other.
        if not self._going and bool(waited(self._began, seen).any()):
            self._going = True
            self.sequence.begin(state)
        if self._going:
            return self.sequence.act(state)
        self.sequence.legs.append(np.zeros(seen.n_worlds, dtype=np.int64))
        return self._waiting.act(state)

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have come to the end of their plan or have stopped for good `(B,)`."""
        del seen
        return np.array([walk.ended for walk in self.sequence.walks])
