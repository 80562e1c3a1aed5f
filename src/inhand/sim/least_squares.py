"""Damped least squares: joint steps for wanted steps of a point, batched."""

from __future__ import annotations

import numpy as np

from inhand.geometry import Array


def damped_least_squares(jacobian: Array, step: Array, damping: float, posture: Array | None = None) -> Array:
    """Return joint steps `(..., n)` [rad] that move a point by `step` `(..., 2)` [m].

    Minimises |J dq - dx|^2 + damping^2 |dq|^2, so dq = J' (J J' + damping^2 I)^-1 dx. A posture step
    `(..., n)` [rad] is added where it does not move the point (only fingers of three links have room for it).
    The weights are mink's with unit cost on position (Wampler 1986; thesis 3.2).

    Args:
        jacobian: `(..., 2, n)` [m/rad].
        step: wanted step of the point [m].
        damping: damping factor [m/rad].
        posture: joint steps wanted for themselves [rad].
    """
    a = (jacobian[..., 0, :] ** 2).sum(-1) + damping**2
    b = (jacobian[..., 0, :] * jacobian[..., 1, :]).sum(-1)
    c = (jacobian[..., 1, :] ** 2).sum(-1) + damping**2
    wanted = step
    if posture is not None:
        wanted = step - (jacobian * posture[..., None, :]).sum(-1)
    determinant = a * c - b * b
    first = (c * wanted[..., 0] - b * wanted[..., 1]) / determinant
    second = (a * wanted[..., 1] - b * wanted[..., 0]) / determinant
    joint_step = jacobian[..., 0, :] * first[..., None] + jacobian[..., 1, :] * second[..., None]
    return np.asarray(joint_step if posture is None else joint_step + posture)
