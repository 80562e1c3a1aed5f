"""A controller of your own: `inhand asterisk --controller own_controller.py:follow` runs it, and so does this file."""

import numpy as np

import inhand


@inhand.register.controller("follow")
class Follow:
    """Closes the fingers a little and moves both towards the right at a fixed speed."""

    grasp = "rough"  # both fingers on the middle of the object's sides; "planned" searches better contacts

    def __init__(self, task):
        self.step = 0.004 * np.ones(task.hand.n_joints)  # [rad] for each decision

    def begin(self, state):
        self.count, self.first = 0, state.targets

    def act(self, state):
        self.count += 1
        return self.first - self.count * self.step

    def finished(self, state):
        return np.full(state.n_worlds, self.count >= 50)


if __name__ == "__main__":
    run = inhand.asterisk(controller="follow", directions="Right", trials=1)
    print(run.table()[["direction", "outcome", "distance_mm"]])
