"""A task of your own: `inhand trace --path own_task.py:zigzag` does it, and so does this file."""

import numpy as np

import inhand


@inhand.register.task("zigzag", stay=0.5)
def zigzag(hand, object, rng):
    """Return way-points (N, 3) from the object's start [m, m, rad], each trial's with a draw of its own."""
    across = rng.uniform(0.010, 0.015)
    return np.array([[-0.02, 0.0, 0.0], [-0.01, across, 0.1], [0.01, -across, -0.1], [0.02, 0.0, 0.0]])


if __name__ == "__main__":
    run = inhand.trace("zigzag", trials=1)
    print(run.table()[["trial", "outcome", "completion", "rms_mm"]])
