"""A phase of your own: `inhand asterisk --phases own_phase.py:hold` has it before manipulation, as this file has."""

import numpy as np

import inhand


@inhand.register.phase("hold", longest=0.5, must_hold=True)
class Hold:
    """Holds the grip for half a second before the object is carried."""

    def __init__(self, task):
        self.task = task

    def begin(self, state):
        self.targets = state.targets

    def act(self, state):
        return self.targets

    def finished(self, state):
        return np.zeros(state.n_worlds, dtype=bool)  # until the phase's time is up


if __name__ == "__main__":
    run = inhand.asterisk(directions="Out", trials=1, phases=["hold"])
    trial = run.trials[0]
    for number, name in enumerate(trial.phases):
        print(name, int((trial.phase == number).sum()), "rows")
