"""What a learned controller sees in space: for each joint what the primitive and the grip ask of it, then the whole.

Layout `space` is the counterpart of `joints` in the plane (`tasks/joint_rows.py`): its rows hold the joint steps, by
damped least squares at the measured contact, that would carry the object on, take back what it is off, or bring a tip
onto it, and the angle by which a servo gives way under the forces that hold the weight. So directions, turns and
gravities that were never shown ask for steps of the same kind.
"""

import numpy as np

from inhand.geometry import Array
from inhand.hands.spatial.forces import GripRules, hold, weight_held
from inhand.hands.spatial.kinematics import damped_least_squares, place, point_jacobian
from inhand.rotations import carried, matrix_of, seen_from
from inhand.sim.state import State
from inhand.tasks.observations import Layout, Part, Scene
from inhand.tasks.spatial.aims import SpatialAim

DAMPING = 0.005
"""Damping of the least squares, the expert's [m/rad]."""
NEAR = 0.01
"""Way left beyond which a row's step to the end grows no more [m]."""
PERIOD = 0.02
"""Time for which rows count speeds: a decision [s]."""
GRIP = GripRules(grip=2.5, rounds=40)
"""Grip that rows tell the joints' angles for: the expert's, with"""
SHARE = 0.8
"""this share of the friction."""

COLUMNS = (
    ("command ahead of the joint [rad]", 0.2),
    ("step onto the object [rad]", 0.1),
    ("step back [rad]", 0.1),
    ("step against motion off it [rad]", 0.03),
    ("step for 1 mm on [rad]", 0.03),
    ("step of its motion on [rad]", 0.03),
    ("step to the end, at most 10 mm [rad]", 0.3),
    ("how far the servo lags there [rad]", 0.3),
    ("angle of the grip that carries the weight [rad]", 0.2),
    ("joint velocity [rad/s]", 4.0),
    ("angle [rad]", np.pi),
    ("room to the upper limit [rad]", 0.5),
    ("room to the lower limit [rad]", 0.5),
)
"""What is told of each joint, and what becomes 1 of it."""


def joint_rows_in_space(state: State, aim: SpatialAim, scene: Scene) -> Array:
    """Return what is told of the joints, column by column `(B, len(COLUMNS) * n_joints)`."""
    hand, pose, now = scene.hand, state.object_pose, aim.speed(state)[:, None]
    aside = state.object_velocity - now * aim.motion
    end = np.clip(aim.left(pose), -NEAR, NEAR)[:, None] * aim.motion
    motions = [-aim.off_by(pose), -PERIOD * aside, 1e-3 * aim.motion, PERIOD * now * aim.motion, end]
    forces = grip_forces(state, scene)
    told = place(hand, state.joint_angles)
    steps, grips = np.empty((len(motions) + 1, *state.joint_angles.shape)), np.empty(state.joint_angles.shape)
    for i, own in enumerate(hand.slices):
        point = state.object_points[:, i]
        jacobian, arm = point_jacobian(told.places[:, own], told.axes[:, own], point), point - pose[:, :3]
        onto = np.maximum(state.gaps[:, i], 0.0)[:, None] * state.normals[:, i]
        moved = np.stack([onto, *(carried(motion, arm) for motion in motions)])
        steps[..., own] = damped_least_squares(jacobian, moved, DAMPING)
        grips[:, own] = (jacobian * forces[:, i, :, None]).sum(axis=-2) / hand.stiffness
    high, low = hand.limits[:, 1], hand.limits[:, 0]
    columns = (
        state.targets - state.joint_angles,
        *steps,
        hand.damping / hand.stiffness / PERIOD * steps[-1],
        grips,
        state.joint_velocities,
        state.joint_angles,
        np.clip(high - state.joint_angles, 0.0, 1.0),
        np.clip(state.joint_angles - low, 0.0, 1.0),
    )
    return np.concatenate([column / half for column, (_, half) in zip(columns, COLUMNS, strict=True)], axis=-1)


def grip_forces(state: State, scene: Scene) -> Array:
    """Return the forces of a plain grip that carry the objects' weight `(B, F, 3)` [N]."""
    mass, friction = (np.array([getattr(spec, name) for spec in scene.objects]) for name in ("mass", "friction"))
    return hold(
        (state.object_points, state.normals),
        weight_held(1.0, mass[:, None] * gravity_in(scene)),
        state.object_pose[:, :3],
        rules=GRIP,
        friction=SHARE * scene.hand.friction * friction,
    ).forces


def gravity_in(scene: Scene) -> Array:
    """Return the gravity of each world in the palm frame `(B, 3)` [m/s^2].

    Raises:
        ValueError: a scene of the plane, which has none of its own.
    """
    if scene.gravity is None:
        raise ValueError("a scene of a hand in the plane does not tell gravity")
    return scene.gravity


def _contacts(state: State, _aim: SpatialAim, _scene: Scene) -> Array:
    """Where each finger touches the object, in the object's frame."""
    return seen_from(state.object_pose[:, None], state.object_points).reshape(state.n_worlds, -1)


def object_axes(state: State, _aim: SpatialAim, _scene: Scene) -> Array:
    """Return the object's x and y axes in the palm frame `(B, 6)`."""
    return matrix_of(state.object_pose[:, 3:])[..., :2].reshape(state.n_worlds, -1)


def _weight(_state: State, _aim: SpatialAim, scene: Scene) -> Array:
    return np.array([spec.mass for spec in scene.objects])[:, None] * gravity_in(scene)


def _friction(_state: State, _aim: SpatialAim, scene: Scene) -> Array:
    return np.array([[scene.hand.friction * spec.friction] for spec in scene.objects])


ASKED = (
    Part("direction, unit vector; 0 of a turn", lambda _state, aim, _scene: aim.along, 1.0, fixed=3),
    Part("axis of a turn, unit vector; 0 of a direction", lambda _state, aim, _scene: aim.about, 1.0, fixed=3),
    Part("way left to go [m]", lambda state, aim, _scene: aim.left(state.object_pose)[:, None], 0.1, fixed=1),
    Part("the same, near the end [m]", lambda state, aim, _scene: aim.left(state.object_pose)[:, None], 0.01, fixed=1),
)
HELD = (
    Part(
        "way off and angle off what is asked [m, rad]",
        lambda state, aim, _scene: aim.off_by(state.object_pose),
        (0.01, 0.01, 0.01, 0.2, 0.2, 0.2),
        fixed=6,
    ),
    Part(
        "velocity and spin [m/s, rad/s]",
        lambda state, _aim, _scene: state.object_velocity,
        (0.2, 0.2, 0.2, 2.0, 2.0, 2.0),
        fixed=6,
    ),
    Part(
        "object position from where hands hold it [m]",
        lambda state, _aim, scene: state.object_pose[:, :3] - np.array(scene.hand.start_position),
        0.1,
        fixed=3,
    ),
    Part("the object's x and y axes", object_axes, 1.0, fixed=6),
    Part("contacts in the object frame [m]", _contacts, 0.04, for_finger=3),
    Part(
        "normals into the object",
        lambda state, _aim, _scene: state.normals.reshape(state.n_worlds, -1),
        1.0,
        for_finger=3,
    ),
    Part("gaps of the fingers [m]", lambda state, _aim, _scene: state.gaps, 0.005, for_finger=1),
    Part("weight [N]", _weight, 1.0, fixed=3),
    Part("friction of a contact", _friction, 1.0, fixed=1),
)

SPACE = Layout(
    "space-1",
    (
        Part("for each joint: " + ", ".join(name for name, _ in COLUMNS), joint_rows_in_space, 1.0, for_joint=13),
        *ASKED,
        *HELD,
    ),
    space=True,
)
"""171 numbers with three fingers of three joints; scales are guessed from what the expert's episodes hold."""
