"""Whole routes in worlds of learning: what a decision made of their ways."""

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.tasks.decisions import Made
from inhand.tasks.routes import Routes

Places = NDArray[np.int64]
"""Numbers of poses on routes."""


def made_along(routes: Routes, rows: Places, places: tuple[Places, Places], pose: Array) -> Made:
    """Return what was made of routes `rows` `(B,)` from places then to those now, of objects at poses `(B, 3)`."""
    then, now = (routes.way[rows, place] for place in places)
    return Made(now - then, routes.way[rows, -1] - now, *routes.off(rows, places[1], pose))


def shift_along(routes: Routes, rows: Places, come: Places, made: Made) -> Array:
    """Return the way along routes, the way beside them [m] and the angle turned from them [rad] `(B, 3)`."""
    return np.stack([routes.way[rows, come], made.across, made.turned], axis=-1)
