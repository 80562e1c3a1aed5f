"""Forces that hold an object in space, against SciPy's minimiser and against what cannot be held."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from inhand.geometry import Array
from inhand.hands.spatial.forces import BALANCED, GripRules, hold, weight_held

DOWN = np.array([0.0, 0.0, -9.81])
LONG = GripRules(rounds=3000, close=1e-9)


def three_contacts(count: int) -> tuple[Array, Array]:
    """Contacts round a body, and unit normals into it, a little askew."""
    rng = np.random.default_rng(0)
    angles = np.deg2rad([90.0, 210.0, 330.0]) + 0.15 * rng.standard_normal((count, 3))
    out = np.stack([np.cos(angles), np.sin(angles), 0.15 * rng.standard_normal((count, 3))], axis=-1)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    points = 0.025 * out + 0.004 * rng.standard_normal((count, 3, 3))
    return points, -out


def total(points: Array, forces: Array) -> Array:
    """The wrench of forces about the origin."""
    return np.concatenate([forces.sum(axis=-2), np.cross(points, forces).sum(axis=-2)], axis=-1)


def test_forces_are_the_nearest_to_the_grip() -> None:
    points, inward = three_contacts(6)
    wanted = np.tile(weight_held(0.5, DOWN), (6, 1))  # heavy, so that cones matter
    wanted[:, 3:] += 0.004 * np.random.default_rng(1).standard_normal((6, 3))
    found = hold((points, inward), wanted, np.zeros((6, 3)), rules=LONG)
    assert (found.misses < 1e-4).all()
    np.testing.assert_allclose(total(points, found.forces), wanted, atol=1e-9)
    for k in range(6):

        def cones(flat: Array, k: int = k) -> Array:
            forces = flat.reshape(3, 3)
            along = (forces * inward[k]).sum(axis=-1)
            aside = forces - along[:, None] * inward[k]
            return np.concatenate(
                [LONG.friction * along - np.sqrt((aside**2).sum(axis=-1) + 1e-16), along - LONG.least]
            )

        def balance(flat: Array, k: int = k) -> Array:
            error = total(points[k], flat.reshape(3, 3)) - wanted[k]
            return np.asarray(error / [1, 1, 1, 0.03, 0.03, 0.03])

        def cost(flat: Array, k: int = k) -> float:
            return float(((flat - LONG.grip * inward[k].ravel()) ** 2).sum())

        bounds: Any = [{"type": "ineq", "fun": cones}, {"type": "eq", "fun": balance}]
        begun = found.forces[k].ravel() + 0.05
        best = minimize(cost, begun, method="SLSQP", constraints=bounds, options={"maxiter": 300, "ftol": 1e-12})
        assert best.success
        np.testing.assert_allclose(found.forces[k].ravel(), best.x, atol=2e-3)


def test_a_warm_start_needs_few_rounds() -> None:
    points, inward = three_contacts(50)
    slippery = np.full(50, 0.25)
    wanted, middle = weight_held(0.05, DOWN)[None], np.zeros((1, 3))
    exact = hold((points, inward), wanted, middle, rules=LONG, friction=slippery)
    possible = exact.misses < 1e-3
    assert possible.sum() > 10
    moved, few = points + 2e-4 * inward, GripRules(rounds=5)
    warm = hold((moved, inward), wanted, middle, rules=few, before=exact, friction=slippery)
    cold = hold((moved, inward), wanted, middle, rules=few, friction=slippery)
    again = hold((moved, inward), wanted, middle, rules=LONG, friction=slippery)
    errors = [np.abs(each.forces - again.forces)[possible].max(axis=(1, 2)).mean() for each in (warm, cold)]
    assert errors[0] < 0.02
    assert errors[0] < 0.3 * errors[1]


@pytest.mark.parametrize(("friction", "holds"), [(0.72, True), (0.1, False)])
def test_what_cannot_be_held_is_told(friction: float, holds: bool) -> None:
    """Three contacts on the upper half slip off below where friction is low, whatever the grip."""
    points, inward = three_contacts(1)
    inward = inward + np.array([0.0, 0.0, -0.35])
    inward /= np.linalg.norm(inward, axis=-1, keepdims=True)
    found = hold(
        (points, inward), weight_held(0.05, DOWN)[None], np.zeros((1, 3)), rules=LONG, friction=np.array([friction])
    )
    assert (found.misses[0] < BALANCED) == holds


def test_each_world_has_its_own_grip() -> None:
    points, inward = three_contacts(2)
    grip = np.array([1.0, 4.0])
    found = hold((points, inward), weight_held(0.01, DOWN)[None], np.zeros((1, 3)), rules=LONG, grip=grip)
    along = (found.forces * inward).sum(axis=-1).mean(axis=1)
    np.testing.assert_allclose(along, grip, rtol=0.15)
    np.testing.assert_allclose(total(points, found.forces), np.tile(weight_held(0.01, DOWN), (2, 1)), atol=1e-9)
