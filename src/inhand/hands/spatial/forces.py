"""Contact forces that hold an object against gravity: near a grip, inside the friction cones, in balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inhand.geometry import Array

BALANCED = 0.05
"""Forces that miss their balance by less hold the object [N]: a tenth of the weight of 50 g."""


@dataclass(frozen=True, eq=False)
class Grip:
    """Forces of N contacts in B worlds."""

    forces: Array
    """Forces on the object `(B, N, 3)` [N]: their sum is the wanted wrench, they may pass their cones by a little."""
    inside: Array
    """The same brought inside the cones `(B, N, 3)` [N]."""
    pulls: Array
    """What the search has learned, to begin the next from `(B, N, 3)` [N]."""
    misses: Array
    """How far `inside` is from balance `(B,)` [N]; `BALANCED` or more where the contacts cannot hold the object."""


@dataclass(frozen=True)
class GripRules:
    """How contacts shall hold."""

    grip: float = 2.5
    """Normal force that each contact would rather have [N]."""
    friction: float = 0.72
    """Coefficient of friction that may be used: 0.8 of the standard hand's."""
    least: float = 0.5
    """Least normal force of a contact [N]."""
    rounds: int = 20
    """Most rounds of the search; 5 to 20 do from a warm start."""
    close: float = 1e-4
    """Forces this near to their cones are found [N]."""


def hold(
    contacts: tuple[Array, Array],
    wanted: Array,
    centres: Array,
    *,
    rules: GripRules | None = None,
    before: Grip | None = None,
    grip: Array | None = None,
    friction: Array | None = None,
) -> Grip:
    """Return forces nearest to a grip along the inward normals that give a wrench.

    Minimises sum |f_j - grip n_j|^2 over forces in their friction cones, of a least normal force, with sum f_j = F and
    sum (p_j - c) x f_j = M, by ADMM between the balanced forces and the cones (Boyd et al. 2011).

    Args:
        contacts: points `(B, N, 3)` [m] and unit normals into the object `(B, N, 3)`.
        wanted: the sum of forces [N] and of moments about the centres [N m] `(B, 6)`: to hold, minus the weight.
        centres: points that moments are about, the object's centres of mass `(B, 3)` [m].
        rules: grip, friction and how long to search.
        before: the grip of the last step, near which this one is.
        grip: the same as of the rules for each world `(B,)` [N].
        friction: the same for each world `(B,)`.
    """
    from inhand.hands.spatial.balancing import Problem, balance_worlds

    rules = rules or GripRules()
    points, inward = (np.ascontiguousarray(each, dtype=float) for each in contacts)
    worlds = len(points)
    preferred = np.full(worlds, rules.grip) if grip is None else np.ascontiguousarray(grip, dtype=float)
    allowed = np.full(worlds, rules.friction) if friction is None else np.ascontiguousarray(friction, dtype=float)
    inside = preferred[:, None, None] * inward if before is None else before.inside.copy()
    pulls = np.zeros_like(inside) if before is None else before.pulls.copy()
    found = Grip(np.empty_like(inside), inside, pulls, np.empty(worlds))
    # Of one order of rows, so that the kernel is compiled once.
    wanted, centres = (np.array(np.broadcast_to(e, (worlds, e.shape[-1])), order="C") for e in (wanted, centres))
    told = found.forces, inside, pulls, found.misses
    problem = Problem(points, inward, wanted, centres, preferred, allowed, *told)
    balance_worlds(problem, (rules.least, float(rules.rounds), rules.close))
    return found


def weight_held(mass: float, gravity: Array) -> Array:
    """Return the wrench `(..., 6)` that holds a mass [kg] against gravity `(..., 3)` [m/s^2]."""
    return np.concatenate([-mass * gravity, np.zeros_like(gravity)], axis=-1)
