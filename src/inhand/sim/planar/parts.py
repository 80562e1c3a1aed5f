"""What the compiled functions work on: the numbers of the worlds' models, their states, and room to compute in.

Every tuple is a bundle of arrays. K models are shared by B worlds; a model has n joints in F fingers, then the object's
two slides and its hinge, together `n + 3` degrees of freedom, and S outlines of bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array

Indices = NDArray[np.int64]


class Model(NamedTuple):
    """The numbers of K models; what is the same in all of them has no axis K."""

    timestep: float
    """Length of a physics step [s]."""
    first: Indices
    """For each joint the first joint of its finger, for each of the object's freedoms itself `(n + 3,)`: a row of the
    mass matrix has nothing before it."""
    finger: Indices
    """For each joint `(n,)` the number of its finger."""
    base: Array
    """The first joint of each joint's finger in the palm frame `(K, n, 2)` [m]."""
    length: Array
    """Lengths of the links `(K, n)` [m]."""
    mass: Array
    """Masses of the links and the object `(K, n + 1)` [kg]."""
    inertia: Array
    """Their moments of inertia about z at their centres of mass `(K, n + 1)` [kg m^2]."""
    centre: Array
    """Centres of mass of the links in their own frames `(K, n, 2)` [m]."""
    servo: Array
    """Of each joint armature, damping, stiffness and torque `(K, n, 4)` [kg m^2, N m s, N m, N m]."""
    limits: Array
    """Lowest and highest angle of each joint `(K, n, 2)` [rad]."""
    loss: Array
    """The floor's friction on the object along x, y [N] and about z [N m] `(K, 3)`."""
    weight: Array
    """Inverse weights of links and object in contacts `(K, n + 1)` [1/kg]: how easily a force moves them."""
    joint_weight: Array
    """Inverse inertias of the joints, and of the object along x, y and about z `(K, n + 3)`."""
    scale: Array
    """What the solver's gradients and gains are multiplied with to compare them with its tolerance `(K,)`."""
    body: Indices
    """The body of each outline `(S,)`: 0 to n - 1 a link, n the object, n + 1 what stands still."""
    outline: Array
    """Corners in the body's frame `(K, S, C, 2)` [m], counter-clockwise; the object's frame is its centre of mass."""
    normal: Array
    """Outward normals of the edges that start at the corners `(K, S, C, 2)`."""
    corners: Indices
    """How many corners an outline has `(K, S)`: 1 for a circle, 0 where a model lacks it."""
    radius: Array
    """Radius of a circle `(K, S)` [m]; 0 for a polygon."""
    middle: Array
    """Middle of a circle around the outline, in the body's frame `(K, S, 2)` [m]."""
    bound: Array
    """Radius of that circle `(K, S)` [m]."""
    pairs: Indices
    """Outlines that can touch `(P, 2)`."""
    friction: Array
    """Friction coefficient of each pair `(K, P)`."""
    share: Array
    """How many contacts of the upright bodies one contact in the plane stands for `(K, P)`."""
    flat: NDArray[np.bool_]
    """Whether the outlines of a pair can lie on each other with an edge, at two points `(K, P)`."""


class Worlds(NamedTuple):
    """The state of B worlds; a step changes it in place."""

    kind: Indices
    """The model of each world `(B,)`."""
    active: NDArray[np.bool_]
    """Which are stepped and measured `(B,)`; the others stand still."""
    position: Array
    """Joint angles [rad], then the object's centre of mass x, y [m] and its angle [rad] `(B, n + 3)`."""
    velocity: Array
    """Their rates `(B, n + 3)`."""
    target: Array
    """Joint angles commanded `(B, n)` [rad]."""
    coming: Array
    """Those that are commanded `(B, n)` [rad] from a physics step on,"""
    lag: Indices
    """whose number this is `(B,)`."""
    acceleration: Array
    """What the solver found last, where it starts its next search `(B, n + 3)`."""
    force: Array
    """Force of each finger on the object during the last step `(B, F, 3)` [N], in the plane."""


class Shapes(NamedTuple):
    """Outlines in the palm frame."""

    corners: Array
    """Their corners `(S, C, 2)` [m]."""
    outward: Array
    """Outward normals of the edges that start there `(S, C, 2)`."""


class Work(NamedTuple):
    """Room for one thread to compute in; nothing in it outlives a step."""

    frame: Array
    """Cosine, sine and origin of each body's frame `(n + 2, 4)`; the last stands still."""
    shapes: Shapes
    """Outlines where they are."""
    placed: NDArray[np.bool_]
    """Whether outline and normals of this instant have been computed `(S,)`."""
    inertia: Array
    """Mass matrix `(n + 3, n + 3)`."""
    hessian: Array
    """Curvature of the cost `(n + 3, n + 3)`."""
    factor: Array
    """A Cholesky factor `(n + 3, n + 3)`."""
    skyline: Indices
    """For each row of the Hessian where its first number stands `(n + 3,)`."""
    force: Array
    """Forces without constraints `(n + 3,)`."""
    free: Array
    """Acceleration without constraints `(n + 3,)`."""
    gradient: Array
    """Slope of the cost `(n + 3,)`."""
    direction: Array
    """Where the search goes `(n + 3,)`."""
    jacobian: Array
    """Rows of each contact, along its normal and its tangent `(2 R, n + 3)`."""
    residual: Array
    """Acceleration of a contact less the one it asks for `(2 R,)`."""
    change: Array
    """Change of the residual along the direction `(2 R,)`."""
    contact: Array
    """Of each contact regularised friction, friction, both stiffnesses, both accelerations asked for `(R, 6)`."""
    where: Array
    """Normal of each contact `(R, 2)`."""
    finger: Indices
    """The finger that presses on the object in each contact `(R,)`, -1 where none does."""
    limit: Array
    """Of each joint the side of a limit that is reached (0: none), stiffness, acceleration asked for `(n, 3)`."""
    floor: Array
    """Of each of the object's freedoms stiffness, acceleration asked for and largest force of friction `(3, 3)`."""
    law: Array
    """What a constraint's law last gave: cost, two slopes, three curvatures `(6,)`."""
    hit: Array
    """Where two outlines meet: separation, normal and point `(5,)` [m]."""


def room(model: Model) -> Work:
    """Return room for one thread to compute steps of a model in."""
    n = len(model.finger)
    size, outlines, contacts = n + 3, model.outline.shape[1:], 2 * len(model.pairs)
    row, square, rows = (size,), (size, size), (2 * contacts,)
    return Work(
        frame=np.zeros((n + 2, 4)),
        shapes=Shapes(np.zeros(outlines), np.zeros(outlines)),
        placed=np.zeros(outlines[0], dtype=bool),
        inertia=np.zeros(square),
        hessian=np.zeros(square),
        factor=np.zeros(square),
        skyline=np.zeros(row, dtype=np.int64),
        force=np.zeros(row),
        free=np.zeros(row),
        gradient=np.zeros(row),
        direction=np.zeros(row),
        jacobian=np.zeros((2 * contacts, size)),
        residual=np.zeros(rows),
        change=np.zeros(rows),
        contact=np.zeros((contacts, 6)),
        where=np.zeros((contacts, 2)),
        finger=np.zeros(contacts, dtype=np.int64),
        limit=np.zeros((n, 3)),
        floor=np.zeros((3, 3)),
        law=np.zeros(6),
        hit=np.zeros(5),
    )
