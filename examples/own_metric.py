"""A metric of your own: `inhand asterisk --metrics own_metric.py:speed_mm_s` measures it, and so does this file."""

import numpy as np

import inhand


@inhand.register.metric("speed_mm_s")
def speed(trial):
    """Return the object's mean speed during manipulation [mm/s]."""
    path, _, _ = trial.manipulated_path()
    time = trial.time[trial.manipulation]
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum() / (time[-1] - time[0])


if __name__ == "__main__":
    run = inhand.asterisk(directions="Right", trials=2, metrics=["speed_mm_s"])
    print(run.table()[["direction", "trial", "more.speed_mm_s"]])
