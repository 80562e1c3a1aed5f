"""Metrics in space: the plane's where all lies in the plane, the same however the palm is turned, turns past half."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inhand.asterisk_test.metrics import Metrics, measure
from inhand.asterisk_test.spatial.metrics import angles_of, measure_in_space, twist_and_swing
from inhand.geometry import Array, turn
from inhand.rotations import multiply, quaternion_of

STILL = np.tile([1.0, 0.0, 0.0, 0.0], (40, 1))
HELD = np.ones((40, 3), dtype=bool)


def wandering(seed: int) -> Array:
    """A path in the plane that leaves its line `(40, 2)` [mm]."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal([0.6, 0.4], 0.3, (40, 2)), axis=0)


@pytest.mark.parametrize("angle", [0.0, 33.7, -120.0])
def test_in_the_plane_they_are_those_of_the_plane(angle: float) -> None:
    path, turned = wandering(1), np.linspace(0.0, 12.0, 40)
    contact = HELD.copy()
    contact[35] = False
    flat = measure(path, turned, angle, contact=contact, row_s=0.02, reference_mm=np.array([[0.0, 0.0], [9.0, 9.0]]))
    way = np.deg2rad(angle)
    found = measure_in_space(
        np.column_stack([path, np.full(40, 3.0)]),
        quaternion_of(np.deg2rad(turned)[:, None] * [0.0, 0.0, 1.0]),
        ((float(np.cos(way)), float(np.sin(way)), 0.0), None),
        contact=contact,
        row_s=0.02,
        reference_mm=np.array([[0.0, 0.0, 0.0], [9.0, 9.0, 0.0]]),
    )
    assert found.swing_max_deg is None
    for name in Metrics.__dataclass_fields__:
        assert getattr(found, name) == pytest.approx(getattr(flat, name), rel=1e-9, abs=1e-9), name


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.integers(0, 5))
def test_they_do_not_depend_on_how_the_palm_is_turned(vector: tuple[float, float, float], seed: int) -> None:
    rng, whole = np.random.default_rng(seed), quaternion_of(np.array(vector))
    path = np.column_stack([wandering(seed), rng.normal(0.0, 0.3, 40)])
    own = quaternion_of(0.05 * np.cumsum(rng.standard_normal((40, 3)), axis=0))
    goals: list[tuple[Array | None, Array]] = [
        (np.array([0.6, 0.0, 0.8]), np.zeros(3)),
        (None, np.array([0, 0.8, 0.6])),
    ]
    for ahead, axis in goals:
        both = []
        for quaternion in (np.array([1.0, 0.0, 0.0, 0.0]), whole):
            back = quaternion * [1, -1, -1, -1]
            x, y, z = turn(quaternion, axis)
            direction = None if ahead is None else tuple(turn(quaternion, ahead))
            both.append(
                measure_in_space(
                    turn(quaternion, path),
                    multiply(multiply(quaternion, own), back),
                    (direction, (x, y, z) if axis.any() else None),
                    contact=HELD,
                    row_s=0.02,
                )
            )
        for name, value in vars(both[0]).items():
            other = getattr(both[1], name)
            assert other == (None if value is None else pytest.approx(value, rel=1e-6, abs=1e-6)), name


def test_a_turn_is_counted_past_half_a_turn_and_apart_from_its_swing() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    angles = np.deg2rad(np.linspace(0.0, 400.0, 101))
    aside = np.deg2rad(np.linspace(0.0, 5.0, 101))[:, None] * [0.0, 1.0, 0.0]  # across the axis
    rotation = multiply(quaternion_of(aside), quaternion_of(angles[:, None] * axis))
    twist, swing = twist_and_swing(rotation, axis)
    np.testing.assert_allclose(twist, angles, atol=1e-9)
    np.testing.assert_allclose(swing, np.linalg.norm(aside, axis=-1), atol=1e-9)
    x, y, z = axis
    found = measure_in_space(
        np.zeros((101, 3)), rotation, (None, (x, y, z)), contact=np.ones((101, 2), dtype=bool), row_s=0.02
    )
    assert found.rotation_final_deg == pytest.approx(400.0)
    assert found.efficiency == pytest.approx(1.0)
    assert found.swing_max_deg == pytest.approx(5.0)
    assert found.distance_mm == 0.0


def test_a_turn_the_wrong_way_counts_below_zero() -> None:
    rotation = quaternion_of(np.linspace(0.0, -0.3, 40)[:, None] * [0.0, 0.0, 1.0])
    found = measure_in_space(np.zeros((40, 3)), rotation, (None, (0.0, 0.0, 1.0)), contact=HELD, row_s=0.02)
    assert found.rotation_final_deg == pytest.approx(-np.rad2deg(0.3))


def test_angles_are_at_most_half_a_turn_whichever_sign_a_quaternion_has() -> None:
    quaternion = quaternion_of(np.array([[0.0, 0.0, 0.4], [3.0, 0.0, 0.0]]))
    np.testing.assert_allclose(angles_of(quaternion), [0.4, 3.0])
    np.testing.assert_allclose(angles_of(-quaternion), [0.4, 3.0])


def test_rows_after_a_lost_contact_do_not_count() -> None:
    contact = HELD.copy()
    contact[10:, 1] = False
    path = np.linspace(0.0, 39.0, 40)[:, None] * [0.0, 0.0, 1.0]
    found = measure_in_space(path, STILL, ((0.0, 0.0, 1.0), None), contact=contact, row_s=0.02)
    assert found.distance_mm == 9.0
    assert found.longest_gap_s == pytest.approx(30 * 0.02)
