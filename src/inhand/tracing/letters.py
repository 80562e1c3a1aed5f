"""The capitals A to Z, each as one stroke that never lifts; some parts are drawn there and back."""

from typing import NamedTuple


class Arc(NamedTuple):
    """A part of an upright ellipse."""

    x: float
    """Its middle's x."""
    y: float
    """Its middle's y."""
    rx: float
    """Half its width."""
    ry: float
    """Half its height."""
    start_deg: float
    """Where it starts: the circle's angle before it is stretched, counter-clockwise from +x [deg]."""
    end_deg: float
    """Where it ends [deg]; less than the start: it runs clockwise."""


Stroke = tuple[tuple[float, float] | Arc, ...]
"""What a pen does: points (x, y) and arcs, each joined to the next by a straight line; x right, y up."""

HEIGHT = 6.0
"""Height of every letter, from the line at y = 0 upwards; only the tail of Q goes below."""

LETTERS: dict[str, Stroke] = {
    "A": ((0, 0), (2, 6), (4, 0), (3.4, 1.8), (0.6, 1.8)),
    "B": ((0, 0), (0, 6), Arc(2, 4.6, 1.6, 1.4, 90, -90), (0, 3.2), Arc(2.2, 1.6, 1.8, 1.6, 90, -90), (0, 0)),
    "C": (Arc(2.5, 3, 2.5, 3, 50, 310),),
    "D": ((0, 0), (0, 6), Arc(1.5, 3, 2.7, 3, 90, -90), (0, 0)),
    "E": ((3.8, 6), (0, 6), (0, 3), (3, 3), (0, 3), (0, 0), (3.8, 0)),
    "F": ((3.8, 6), (0, 6), (0, 3), (3, 3), (0, 3), (0, 0)),
    "G": (Arc(2.5, 3, 2.5, 3, 50, 345), (4.915, 2.8), (2.9, 2.8)),
    "H": ((0, 6), (0, 0), (0, 3), (4, 3), (4, 6), (4, 0)),
    "I": ((0, 6), (2.4, 6), (1.2, 6), (1.2, 0), (0, 0), (2.4, 0)),
    "J": ((3.2, 6), Arc(1.6, 1.6, 1.6, 1.6, 0, -170)),
    "K": ((0, 6), (0, 0), (0, 2.4), (4, 6), (1.2, 3.48), (4, 0)),
    "L": ((0, 6), (0, 0), (3.6, 0)),
    "M": ((0, 0), (0, 6), (2.4, 1.6), (4.8, 6), (4.8, 0)),
    "N": ((0, 0), (0, 6), (4, 0), (4, 6)),
    "O": (Arc(2.5, 3, 2.5, 3, 90, 450),),
    "P": ((0, 0), (0, 6), Arc(2, 4.4, 1.8, 1.6, 90, -90), (0, 2.8)),
    "Q": (Arc(2.5, 3, 2.5, 3, -50, 310), (3.007, 1.902), (5.207, -0.498)),
    "R": ((0, 0), (0, 6), Arc(2, 4.4, 1.8, 1.6, 90, -90), (0, 2.8), (1.8, 2.8), (4, 0)),
    "S": (Arc(1.9, 4.55, 1.8, 1.45, 25, 270), Arc(1.9, 1.55, 1.9, 1.55, 90, -155)),
    "T": ((0, 6), (4.4, 6), (2.2, 6), (2.2, 0)),
    "U": ((0, 6), Arc(2, 2, 2, 2, 180, 360), (4, 6)),
    "V": ((0, 6), (2, 0), (4, 6)),
    "W": ((0, 6), (1.4, 0), (2.8, 4.4), (4.2, 0), (5.6, 6)),
    "X": ((0, 6), (4, 0), (2, 3), (4, 6), (0, 0)),
    "Y": ((0, 6), (2, 3), (4, 6), (2, 3), (2, 0)),
    "Z": ((0, 6), (4, 6), (0, 0), (4, 0)),
}
"""Every letter's stroke."""
