"""Damped least squares, against mink, NumPy's least squares and its own promises."""

import mink
import mujoco
import numpy as np
import pytest

from inhand.geometry import Array
from inhand.hands.hand import FingerSpec
from inhand.hands.kinematics import damped_least_squares, joint_positions, point_jacobian
from inhand.hands.names import CATALOGUE, parse_hand_name

FINGERS = {f"{name} {i}": finger for name in CATALOGUE for i, finger in enumerate(parse_hand_name(name).fingers)}
every_finger = pytest.mark.parametrize("finger", FINGERS.values(), ids=FINGERS.keys())


def tip_jacobian(finger: FingerSpec, angles: Array) -> Array:
    joints = joint_positions(finger, angles)
    return point_jacobian(joints[..., :-1, :], joints[..., -1, :])


def bent_angles(finger: FingerSpec, count: int, seed: int) -> Array:
    """Postures away from the straight finger, where no small step is out of reach."""
    rng = np.random.default_rng(seed)
    bends = finger.bend * rng.uniform(0.4, 2.4, (count, len(finger.links)))
    bends[:, 0] = rng.uniform(-1.5, 1.5, count)
    return bends


def mink_finger(finger: FingerSpec) -> mujoco.MjModel:
    """A chain of massless-looking links with a site at the tip, written for this test alone."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    body, position = spec.worldbody, [*finger.base, 0.0]
    for length in finger.links:
        body = body.add_body(pos=position, mass=0.01, inertia=[1e-5] * 3, explicitinertial=True)
        body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        position = [0, length, 0]
    body.add_site(name="tip", pos=position)
    return spec.compile()


def mink_step(configuration: mink.Configuration, step: Array, damping: float) -> Array:
    """The joint step by which mink moves the tip, position only, unit cost."""
    here = configuration.get_transform_frame_to_world("tip", "site")
    task = mink.FrameTask("tip", "site", position_cost=1.0, orientation_cost=0.0)
    goal = here.translation() + np.array([*step, 0.0])
    task.set_target(mink.SE3.from_rotation_and_translation(here.rotation(), goal))
    # Over a time step of 1 s the velocity is the joint step; mink's damping multiplies |dq|^2 as it stands.
    return np.asarray(mink.solve_ik(configuration, [task], 1.0, "daqp", damping=damping**2, limits=[]))


@every_finger
@pytest.mark.parametrize("damping", [1e-3, 1e-2, 0.1])
def test_joint_steps_are_those_of_mink(finger: FingerSpec, damping: float) -> None:
    configuration = mink.Configuration(mink_finger(finger))
    rng = np.random.default_rng(4)
    for angles in bent_angles(finger, 5, 5):
        configuration.update(angles)
        step = rng.normal(size=2) * 1e-3
        ours = damped_least_squares(tip_jacobian(finger, angles), step, damping)
        np.testing.assert_allclose(ours, mink_step(configuration, step, damping), rtol=1e-7, atol=1e-10)


@every_finger
@pytest.mark.parametrize("damping", [1e-4, 1e-2, 1.0])
def test_the_step_minimises_the_damped_squares(finger: FingerSpec, damping: float) -> None:
    rng = np.random.default_rng(6)
    for angles in bent_angles(finger, 10, 7):
        jacobian, step = tip_jacobian(finger, angles), rng.normal(size=2) * 0.01
        rows = np.concatenate([jacobian, damping * np.eye(len(angles))])
        expected = np.linalg.lstsq(rows, np.concatenate([step, np.zeros(len(angles))]), rcond=None)[0]
        np.testing.assert_allclose(damped_least_squares(jacobian, step, damping), expected, rtol=1e-6, atol=1e-10)


@every_finger
def test_the_error_strictly_falls_for_small_steps(finger: FingerSpec) -> None:
    angles = bent_angles(finger, 50, 8)
    start = joint_positions(finger, angles)[:, -1]
    way = np.random.default_rng(9).uniform(-np.pi, np.pi, 50)
    goal = start + 2e-3 * np.stack([np.cos(way), np.sin(way)], axis=-1)
    error = np.linalg.norm(goal - start, axis=-1)
    for _ in range(5):
        tip = joint_positions(finger, angles)[:, -1]
        angles = angles + damped_least_squares(tip_jacobian(finger, angles), goal - tip, 0.02)
        smaller = np.linalg.norm(goal - joint_positions(finger, angles)[:, -1], axis=-1)
        assert (smaller < error).all()
        error = smaller


@every_finger
def test_without_damping_to_speak_of_the_step_arrives(finger: FingerSpec) -> None:
    angles = bent_angles(finger, 20, 10)
    jacobian = tip_jacobian(finger, angles)
    step = np.random.default_rng(11).normal(size=(20, 2)) * 1e-3
    joint_step = damped_least_squares(jacobian, step, 1e-7)
    np.testing.assert_allclose((jacobian * joint_step[:, None]).sum(-1), step, rtol=1e-6, atol=1e-12)


def test_more_damping_gives_shorter_joint_steps() -> None:
    finger = FINGERS[f"{CATALOGUE[0]} 0"]
    jacobian = tip_jacobian(finger, bent_angles(finger, 20, 12))
    step = np.random.default_rng(13).normal(size=(20, 2)) * 1e-2
    sizes = [np.linalg.norm(damped_least_squares(jacobian, step, d), axis=-1) for d in (1e-3, 1e-2, 1e-1, 1.0)]
    assert (np.diff(sizes, axis=0) < 0).all()


def test_a_straight_finger_takes_a_bounded_step_where_it_cannot_go() -> None:
    finger = FINGERS[f"{CATALOGUE[0]} 0"]
    step = damped_least_squares(tip_jacobian(finger, np.zeros(2)), np.array([0.0, 0.01]), 1e-3)
    np.testing.assert_allclose(step, 0.0, atol=1e-12)


def test_a_posture_step_does_not_move_the_point() -> None:
    finger = parse_hand_name("3v3_25.40.35_40.35.25_1.1_63").left
    angles = bent_angles(finger, 20, 14)
    jacobian = tip_jacobian(finger, angles)
    posture = np.random.default_rng(15).normal(size=(20, 3)) * 0.1
    alone = damped_least_squares(jacobian, np.zeros((20, 2)), 1e-6, posture)
    np.testing.assert_allclose((jacobian * alone[:, None]).sum(-1), 0.0, atol=1e-9)
    # What is left of the posture is its share along the one direction that keeps the point.
    free = np.cross(jacobian[:, 0], jacobian[:, 1])
    free /= np.linalg.norm(free, axis=-1, keepdims=True)
    np.testing.assert_allclose(alone, (posture * free).sum(-1, keepdims=True) * free, atol=1e-6)


def test_two_links_have_no_room_for_a_posture() -> None:
    finger = FINGERS[f"{CATALOGUE[0]} 1"]
    jacobian = tip_jacobian(finger, bent_angles(finger, 20, 16))
    step = np.full((20, 2), 1e-3)
    posture = np.full((20, 2), 0.1)
    with_posture = damped_least_squares(jacobian, step, 1e-7, posture)
    np.testing.assert_allclose(with_posture, damped_least_squares(jacobian, step, 1e-7), atol=1e-8)


def test_a_batch_is_its_members() -> None:
    rng = np.random.default_rng(17)
    jacobian, step, posture = rng.normal(size=(2, 3, 2, 3)), rng.normal(size=(2, 3, 2)), rng.normal(size=(2, 3, 3))
    batch = damped_least_squares(jacobian, step, 0.1, posture)
    assert batch.shape == (2, 3, 3)
    np.testing.assert_allclose(batch[1, 2], damped_least_squares(jacobian[1, 2], step[1, 2], 0.1, posture[1, 2]))
