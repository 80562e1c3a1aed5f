"""A hand and an object of your own, from any spec: `--hand own_hand.py:soft --object own_hand.py:heavy`."""

from dataclasses import replace

import inhand


@inhand.register.hand("soft")
def soft():
    """Return the default hand with softer servos."""
    return replace(inhand.hand("2v2_50.50_50.50_1.1_53"), name="soft", stiffness=3.0)


@inhand.register.object("heavy")
def heavy():
    """Return the default cube, twice as heavy."""
    return replace(inhand.object("cube_39"), name="heavy", mass=0.06)


if __name__ == "__main__":
    print(inhand.asterisk("soft", "heavy", directions="Out", trials=1).table()[["direction", "distance_mm"]])
