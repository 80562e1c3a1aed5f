"""The witness engine: PyBullet, the thesis's, behind the same interface as MuJoCo.

Solver, contact model and servos differ from MuJoCo's, so that what a controller does in both engines is no artefact
of one. PyBullet's servo is a velocity constraint, not a spring: in each physics step it asks a joint for the speed

    w* = POSITION_GAIN (target - q) / timestep + (1 - VELOCITY_GAIN) w

with at most the hand's torque. A blocked joint therefore pushes with up to the whole torque however small its error
is, where MuJoCo's pushes with stiffness (target - q).
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, spatial, turn
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.bullet_model import Part, World, build_world, load_pybullet, object_parts
from inhand.sim.engine import check_start, check_substeps, check_targets
from inhand.sim.model import FAR, SceneSpec, scene_of_each
from inhand.sim.state import State, ran_away

POSITION_GAIN = 0.1
"""Share of its error that a servo closes in one physics step (PyBullet's default)."""
VELOCITY_GAIN = 1.0
"""Share of its speed that a servo takes away in one physics step (PyBullet's default)."""

Reading = tuple[list[float], list[float], list[float], list[float], list[tuple[float, ...]]]
"""Of one world: joint angles and velocities, object pose and velocity; of each link its distance to the object and
the nearest points of both."""


class BulletSimulator:
    """B worlds of one hand, each with its own object and surroundings, stepped one after another on one thread.

    Distances are queries made after the last physics step, so that everything in `State` belongs to one instant. A
    world that diverges is put back and told in `State.diverged`.
    """

    def __init__(
        self,
        hand: HandSpec,
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
    ) -> None:
        """Open a connection for each object; it closes with the simulator.

        Args:
            hand: the hand of every world.
            objects: the object of each world; shapes, sizes and masses may differ.
            scenes: what surrounds them, one for all or one for each world.

        Raises:
            InputError: PyBullet is not installed, no objects are given, not as many scenes as objects, or walls.
        """
        self._scenes = scene_of_each(objects, scenes)
        if any(scene.walls for scene in self._scenes):
            raise InputError("walls with the engine 'bullet', which has none here: use the engine 'mujoco'")
        self.hand = hand
        self.objects = tuple(objects)
        self.timestep = self._scenes[0].timestep
        self._engine = load_pybullet()
        self._clients = [self._engine.connect(self._engine.DIRECT) for _ in objects]
        weakref.finalize(self, _disconnect, self._engine, self._clients)
        self._worlds: list[World] = []
        self._starts: tuple[Array, Array] = np.zeros((0, 3)), np.zeros((0, hand.n_joints))
        self._diverged = np.zeros(len(self.objects), dtype=bool)
        self._steps = 0

    def reset(self, object_pose: Array, joint_angles: Array) -> State:
        """Place the objects `(B, 3)` upright on the plane and the joints `(B, n)`, all at rest; return the state.

        The worlds are built anew: contacts that PyBullet remembers would change the next episode.
        """
        check_targets(joint_angles, len(self.objects), self.hand.n_joints)
        check_start(object_pose, len(self.objects))
        self._starts = object_pose.copy(), joint_angles.copy()
        self._worlds = [self._begin(index) for index in range(len(self.objects))]
        self._diverged[:] = False
        self._steps = 0
        return self._measure(joint_angles)

    def step(self, targets: Array, substeps: int) -> State:
        """Hold joint targets `(B, n)` [rad] for `substeps` physics steps; return the state after the last.

        Raises:
            InputError: a target is not finite (the text names world and joint), or nothing was reset yet.
        """
        check_substeps(substeps)
        check_targets(targets, len(self.objects), self.hand.n_joints)
        if not self._worlds:
            raise InputError("step() before reset(): place objects and joints with reset() first")
        for world, wanted in zip(self._worlds, targets, strict=True):
            _command(self._engine, world, self.hand, wanted)
            for _ in range(substeps):
                self._engine.stepSimulation(world.client)
        self._steps += substeps
        return self._measure(targets)

    def _begin(self, index: int) -> World:
        """Build one world anew, at rest where it was last reset to."""
        spec, (poses, angles) = self.objects[index], self._starts
        world = build_world(self._engine, self._clients[index], self.hand, spec, self._scenes[index])
        _place(self._engine, world, spatial(poses[index], spec.height / 2), angles[index])
        return world

    def _measure(self, targets: Array) -> State:
        rows = [_read(self._engine, world, self.hand) for world in self._worlds]
        wild = ran_away(*(np.array(part) for part in list(zip(*rows, strict=True))[:4]))
        for index in np.flatnonzero(wild).tolist():
            self._worlds[index] = self._begin(index)
            rows[index] = _read(self._engine, self._worlds[index], self.hand)
        self._diverged |= wild
        return _state_from(rows, self.hand, self._steps * self.timestep, targets, self._diverged.copy())


def _disconnect(engine: ModuleType, clients: list[int]) -> None:
    for client in clients:
        engine.disconnect(client)


def _place(engine: ModuleType, world: World, pose: Array, joint_angles: Array) -> None:
    """Put the object at a full pose `(7,)` and the joints at angles `(n,)` [rad], all at rest."""
    position, quaternion = pose[:3] + _arm(world, pose[3:]), [*pose[4:], pose[3]]  # PyBullet's end with w
    engine.resetBasePositionAndOrientation(world.object, position, quaternion, physicsClientId=world.client)
    for joint, angle in enumerate(joint_angles):
        engine.resetJointState(world.hand, joint, angle, 0.0, physicsClientId=world.client)


def _command(engine: ModuleType, world: World, hand: HandSpec, targets: Array) -> None:
    n = hand.n_joints
    engine.setJointMotorControlArray(
        world.hand,
        range(n),
        engine.POSITION_CONTROL,
        targetPositions=targets,
        forces=[hand.torque] * n,
        positionGains=[POSITION_GAIN] * n,
        velocityGains=[VELOCITY_GAIN] * n,
        physicsClientId=world.client,
    )


def _read(engine: ModuleType, world: World, hand: HandSpec) -> Reading:
    client, n = world.client, hand.n_joints
    joints = engine.getJointStates(world.hand, range(n), physicsClientId=client)
    position, (x, y, z, w) = engine.getBasePositionAndOrientation(world.object, physicsClientId=client)
    linear, angular = engine.getBaseVelocity(world.object, physicsClientId=client)
    links = [_distance(engine, world, link) for link in range(n)]
    arm = _arm(world, np.array([w, x, y, z]))
    pose, velocity = [*(position - arm), w, x, y, z], [*(linear - np.cross(angular, arm)), *angular]
    return [j[0] for j in joints], [j[1] for j in joints], pose, velocity, links


def _arm(world: World, quaternion: Array) -> Array:
    """Return the way `(3,)` [m] from the object's origin to the centre of mass that PyBullet places and reports."""
    return turn(quaternion, np.array([*world.middle, 0.0]))


def _distance(engine: ModuleType, world: World, link: int) -> tuple[float, ...]:
    """Return a link's distance to the object [m] and the nearest points x, y of link and object [m]."""
    found = [point for part in object_parts(world) for point in _closest(engine, world, link, part)]
    if not found:
        return FAR, 0.0, 0.0, 0.0, 0.0
    nearest = min(found, key=lambda point: point[8])
    return nearest[8], *nearest[5][:2], *nearest[6][:2]


def _closest(engine: ModuleType, world: World, link: int, part: Part) -> list[tuple[Any, ...]]:
    body, piece = part
    found = engine.getClosestPoints(world.hand, body, FAR, link, piece, physicsClientId=world.client)
    return list(found or ())


def _state_from(rows: list[Reading], hand: HandSpec, time: float, targets: Array, diverged: NDArray[np.bool_]) -> State:
    joints, velocities, poses, object_velocities, links = (np.array(part) for part in zip(*rows, strict=True))
    n_left = len(hand.left.links)
    gaps = links[..., 0]
    left, right = gaps[:, :n_left].argmin(axis=1), gaps[:, n_left:].argmin(axis=1)
    chosen = links[np.arange(len(rows))[:, None], np.stack([left, right + n_left], axis=1)]
    return State(
        time=np.full(len(rows), time),
        object_pose=poses,
        object_velocity=object_velocities,
        joint_angles=joints,
        joint_velocities=velocities,
        targets=np.array(targets, dtype=float),
        link_gaps=gaps,
        contact_links=np.stack([left, right], axis=1),
        finger_points=chosen[..., 1:3],
        object_points=chosen[..., 3:5],
        gaps=chosen[..., 0],
        diverged=diverged,
    )
