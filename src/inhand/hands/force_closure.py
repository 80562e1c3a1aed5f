"""Planar two-finger force closure: whether two point contacts with friction can hold an object."""

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array


def force_closure(friction: float | Array, left: tuple[Array, Array], right: tuple[Array, Array]) -> NDArray[np.bool_]:
    """Return whether the line between two contacts lies inside both friction cones; never without friction.

    Each contact is points `(..., 2)` [m] and outward normals `(..., 2)` in the object frame; all leading axes and the
    coefficient of friction that may be used broadcast.
    """
    line = right[0] - left[0]
    line = line / np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    least = np.cos(np.arctan(friction))
    inside = (-(line * left[1]).sum(-1) >= least) & ((line * right[1]).sum(-1) >= least)
    return np.asarray(inside & (np.asarray(friction) > 0))
