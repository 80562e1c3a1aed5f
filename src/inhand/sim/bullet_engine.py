"""The witness engine: PyBullet, the thesis's, behind the same interface as MuJoCo.

Solver and contacts differ from MuJoCo's, so that what a controller does in both engines is no artefact of one; servos
are MuJoCo's (`bullet_servo`).
"""

import weakref
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, inverse_quaternion, spatial, turn
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.bullet_model import Part, World, build_world, load_pybullet
from inhand.sim.bullet_servo import FINER, Servos, servos_of
from inhand.sim.engine import Simulator
from inhand.sim.scene import FAR, SceneSpec
from inhand.sim.snapshot import Snapshot, centre_of, nowhere
from inhand.sim.state import State, ran_away

MOST_WORLDS = 1000
"""Worlds in one process; PyBullet has 1,024 connections."""
Reading = tuple[list[float], list[float], list[float], list[float], list[tuple[float, ...]]]
"""Of one world: joint angles and velocities, object pose and velocity; of each link its distance to the object and
the nearest points of both."""


class BulletSimulator(Simulator):
    """Worlds in PyBullet, stepped one after another on one thread; distances are queries made after the last step."""

    engine = "bullet"

    def __init__(
        self,
        hand: HandSpec | Sequence[HandSpec],
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        *,
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Open a connection for each object, whose shapes may differ; it closes with the simulator.

        Raises:
            InputError: PyBullet is not installed, walls, too many worlds, or what no simulator takes.
        """
        super().__init__(hand, objects, scenes, kinds)
        if any(scene.walls for _, _, scene in self._kinds):
            raise InputError("walls with the engine 'bullet', which has none here: use the engine 'planar' or 'mujoco'")
        if self.n_worlds > MOST_WORLDS:
            raise InputError(f"{self.n_worlds} worlds in PyBullet, which takes at most {MOST_WORLDS}: ask for fewer")
        self._engine = load_pybullet()
        self._clients = [self._engine.connect(self._engine.DIRECT) for _ in self._kind]
        weakref.finalize(self, _disconnect, self._engine, self._clients)
        self._worlds: list[World] = []
        self._rows: list[Reading] = [([], [], [], [], [])] * self.n_worlds
        self._starts: tuple[Array, Array] = np.zeros((0, 3)), np.zeros((0, self.hand.n_joints))
        self._targets = np.zeros((self.n_worlds, self.hand.n_joints))
        self._servos = self._servos_now()
        self._others = np.zeros((self.n_worlds, self.hand.n_joints))
        self._steps = np.zeros(self.n_worlds, dtype=np.int64)

    def _measure(self, active: NDArray[np.bool_]) -> State:
        self._check_begun()
        for index in np.flatnonzero(active).tolist():
            self._rows[index] = _read(self._engine, self._worlds[index], self.hand)
        rows = self._rows
        wild = ran_away(*(np.array(part) for part in list(zip(*rows, strict=True))[:4]))
        for index in np.flatnonzero(wild).tolist():
            self._worlds[index] = self._begin(index)
            rows[index] = _read(self._engine, self._worlds[index], self.hand)
            self._forces[index] = 0.0
        self._diverged |= wild
        angles, speeds, poses, velocities, links = (np.array(part, dtype=float) for part in zip(*rows, strict=True))
        return self._state(self._time(), (poses, velocities), (angles, speeds), self._targets, links)

    def snapshot(self) -> Snapshot:
        """Return positions, velocities and targets of all worlds.

        The contacts that PyBullet remembers are not part of it, so a world that goes back goes on alike, and not byte
        for byte as it does in MuJoCo.
        """
        self._check_begun()
        rows = [_read(self._engine, world, self.hand) for world in self._worlds]
        joints, speeds, poses, velocities = (np.array(part) for part in list(zip(*rows, strict=True))[:4])
        own = turn(inverse_quaternion(poses[:, 3:]), velocities[:, 3:])
        qvel = np.concatenate([speeds, velocities[:, :3], own], axis=1)
        qpos = np.concatenate([joints, poses], axis=1)
        centre = centre_of(qpos, qvel, self._centre)
        zero = np.zeros_like(qvel)
        forces, held = self._forces.copy(), nowhere(self.n_worlds)
        return Snapshot(self._time(), qpos, qvel, self._targets.copy(), zero, forces, centre, held)

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        """Build the worlds anew: contacts that PyBullet remembers would change the next episode."""
        self._starts = object_pose.copy(), joint_angles.copy()
        self._worlds = [self._begin(index) for index in range(self.n_worlds)]
        self._steps[:] = 0
        self._targets[:] = joint_angles

    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        self._check_begun()
        where = np.flatnonzero(active)
        worlds = [self._worlds[index] for index in where.tolist()]
        for _ in range(substeps):
            self._turn(where, worlds, targets[where])
        for index, world in zip(where.tolist(), worlds, strict=True):
            self._forces[index] = [_force(self._engine, world, place) for place in self.hand.slices]
        self._steps[active] += substeps
        self._targets[active] = targets[active]

    def _turn(self, where: NDArray[np.int64], worlds: list[World], targets: Array) -> None:
        """Advance some worlds by one physics step, a torque on each joint in each of PyBullet's (`bullet_servo`)."""
        engine, step = self._engine, self.timestep / FINER
        angles, speeds = _joints(engine, worlds, self.hand.n_joints)
        mass = np.array(
            [
                engine.calculateMassMatrix(world.hand, row, physicsClientId=world.client)
                for world, row in zip(worlds, angles.tolist(), strict=True)
            ]
        )
        gain = mass @ np.linalg.inv(mass + self._servos.missing[where])
        others = self._others[where]
        for _ in range(FINER):
            wanted = self._servos.wanted(where, targets, angles, speeds)
            torque, before = np.einsum("kij,kj->ki", gain, wanted + others) - others, speeds
            for world, row in zip(worlds, torque.tolist(), strict=True):
                engine.setJointMotorControlArray(
                    world.hand, range(len(row)), engine.TORQUE_CONTROL, forces=row, physicsClientId=world.client
                )
                engine.stepSimulation(world.client)
            angles, speeds = _joints(engine, worlds, self.hand.n_joints)
            others = np.einsum("kij,kj->ki", mass, (speeds - before) / step) - torque
        self._others[where] = others

    def _servos_now(self) -> Servos:
        return servos_of([self._kinds[kind][0] for kind in self._kind.tolist()], self.timestep)

    def _become(self, worlds: NDArray[np.int64]) -> None:
        del worlds
        self._servos = self._servos_now()

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        n = self.hand.n_joints
        if not self._worlds:
            self.reset(np.zeros((self.n_worlds, 3)), np.zeros((self.n_worlds, n)))
        for world, row in zip(worlds.tolist(), rows.tolist(), strict=True):
            self._worlds[world] = self._built(world)
            pose, speed = snapshot.qpos[row, n:], snapshot.qvel[row]
            velocity = np.concatenate([speed[n : n + 3], turn(pose[3:], speed[n + 3 :])])
            _set(self._engine, self._worlds[world], pose, snapshot.qpos[row, :n], (velocity, speed[:n]))
        self._steps[worlds] = np.rint(snapshot.time[rows] / self.timestep)
        self._targets[worlds] = snapshot.ctrl[rows]
        here = self._targets[worlds], snapshot.qpos[rows, :n], snapshot.qvel[rows, :n]
        self._others[worlds] = -self._servos.wanted(worlds, *here)  # as if nothing accelerated

    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        self._check_begun()
        for index, each in zip(worlds.tolist(), impulse, strict=True):
            world = self._worlds[index]
            linear, angular = self._engine.getBaseVelocity(world.object, physicsClientId=world.client)
            faster = (np.array(linear) + each / self._mass[index]).tolist()
            self._engine.resetBaseVelocity(world.object, faster, angular, physicsClientId=world.client)

    def _time(self) -> Array:
        return np.asarray(self._steps * self.timestep, dtype=float)

    def _check_begun(self) -> None:
        if not self._worlds:
            raise InputError("step() before reset(): place objects and joints with reset() first")

    def _built(self, index: int) -> World:
        return build_world(self._engine, self._clients[index], *self._kinds[self._kind[index]])

    def _begin(self, index: int) -> World:
        """Build one world anew, at rest where it was last reset to."""
        poses, angles = self._starts
        world = self._built(index)
        self._others[index] = 0.0
        _set(self._engine, world, spatial(poses[index], self._height[index]), angles[index])
        return world


def _disconnect(engine: ModuleType, clients: list[int]) -> None:
    for client in clients:
        engine.disconnect(client)


def _set(
    engine: ModuleType, world: World, pose: Array, joint_angles: Array, speeds: tuple[Array, Array] | None = None
) -> None:
    """Put the object at a full pose `(7,)` and the joints at angles `(n,)` [rad].

    `speeds` are the object's velocity `(6,)` and the joints' `(n,)`; without them all are at rest.
    """
    arm = _arm(world, pose[3:])
    position, quaternion = pose[:3] + arm, [*pose[4:], pose[3]]  # PyBullet's end with w
    engine.resetBasePositionAndOrientation(world.object, position, quaternion, physicsClientId=world.client)
    velocity, turning = (np.zeros(6), np.zeros(len(joint_angles))) if speeds is None else speeds
    linear = velocity[:3] + np.cross(velocity[3:], arm)
    engine.resetBaseVelocity(world.object, linear.tolist(), velocity[3:].tolist(), physicsClientId=world.client)
    for joint, (angle, speed) in enumerate(zip(joint_angles, turning, strict=True)):
        engine.resetJointState(world.hand, joint, angle, speed, physicsClientId=world.client)


def _joints(engine: ModuleType, worlds: list[World], n_joints: int) -> tuple[Array, Array]:
    """Return the joints' angles and speeds `(K, n)` in some worlds."""
    rows = [engine.getJointStates(world.hand, range(n_joints), physicsClientId=world.client) for world in worlds]
    found = np.array([[joint[:2] for joint in row] for row in rows])
    return found[..., 0], found[..., 1]


def _read(engine: ModuleType, world: World, hand: HandSpec) -> Reading:
    client, n = world.client, hand.n_joints
    joints = engine.getJointStates(world.hand, range(n), physicsClientId=client)
    position, (x, y, z, w) = engine.getBasePositionAndOrientation(world.object, physicsClientId=client)
    linear, angular = engine.getBaseVelocity(world.object, physicsClientId=client)
    links = [_distance(engine, world, link) for link in range(n)]
    arm = _arm(world, np.array([w, x, y, z]))
    pose, velocity = [*(position - arm), w, x, y, z], [*(linear - np.cross(angular, arm)), *angular]
    return [j[0] for j in joints], [j[1] for j in joints], pose, velocity, links


def _force(engine: ModuleType, world: World, place: slice) -> Array:
    """Return the force `(3,)` [N] of the links of a finger on the object during the last physics step."""
    total = np.zeros(3)
    for point in engine.getContactPoints(world.hand, world.object, physicsClientId=world.client) or ():
        if place.start <= point[3] < place.stop:  # all parts act on the hand, bodyA
            total -= point[9] * np.array(point[7]) + point[10] * np.array(point[11]) + point[12] * np.array(point[13])
    return total


def _arm(world: World, quaternion: Array) -> Array:
    """Return the way `(3,)` [m] from the object's origin to the centre of mass that PyBullet places and reports."""
    return turn(quaternion, np.array([*world.middle, 0.0]))


def _distance(engine: ModuleType, world: World, link: int) -> tuple[float, ...]:
    """Return a link's distance to the object [m] and the nearest points of link and object [m]."""
    found = [point for part in world.parts for point in _closest(engine, world, link, part)]
    if not found:
        return FAR, *[0.0] * 6
    nearest = min(found, key=lambda point: point[8])
    return nearest[8], *nearest[5], *nearest[6]


def _closest(engine: ModuleType, world: World, link: int, part: Part) -> list[tuple[Any, ...]]:
    body, piece = part
    found = engine.getClosestPoints(world.hand, body, FAR, link, piece, physicsClientId=world.client)
    return list(found or ())
