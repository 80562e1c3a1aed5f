"""A primitive of your own: `inhand asterisk --directions own_primitive.py:weave` goes along it, as this file does."""

import numpy as np

import inhand


@inhand.register.primitive("weave")
def weave():
    """Return poses (N, 3) from the object's start: to the right, with a wave of 5 mm across [m, m, rad]."""
    along = np.linspace(0.0, 0.08, 81)
    return np.column_stack([along, 0.005 * np.sin(2 * np.pi * along / 0.04), np.zeros(81)])


if __name__ == "__main__":
    run = inhand.asterisk(directions="weave", trials=1)
    print(run.table()[["direction", "outcome", "distance_mm", "lateral_max_mm"]])
