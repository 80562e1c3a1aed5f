"""The planar engine behind the interface of every simulator."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, perpendicular, rotate, spatial
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, centre_of_mass
from inhand.sim.engine import check_impulse, check_start, check_substeps, check_targets, hand_of_each
from inhand.sim.model import SceneSpec, scene_of_each
from inhand.sim.names import Engine
from inhand.sim.planar.build import build
from inhand.sim.planar.kernels import measure_worlds, step_worlds
from inhand.sim.planar.parts import Readings, Work, Worlds, room
from inhand.sim.snapshot import Snapshot, check_restore
from inhand.sim.state import State, ran_away


@dataclass(frozen=True, eq=False)
class Part:
    """The worlds that one thread steps: views of all of them, and room of its own."""

    worlds: Worlds
    readings: Readings
    work: Work


class PlanarSimulator:
    """B worlds in the plane, each with a hand, an object and surroundings of its own."""

    engine: Engine = "planar"

    def __init__(
        self,
        hand: HandSpec | Sequence[HandSpec],
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        threads: int = 0,
    ) -> None:
        """Build a world for each object.

        Args:
            hand: the hand of every world, or one for each; their numbers and outlines may differ, not their joints.
            objects: the object of each world, of any outlines.
            scenes: what surrounds them, one for all or one for each world.
            threads: threads to step on; 0 uses every core.

        Raises:
            InputError: no objects, hands of other joints, scenes of different timesteps, or another number of hands
                or scenes than of objects.
        """
        surroundings = scene_of_each(objects, scenes)
        hands = hand_of_each(hand, len(objects))
        self.hand, self.objects, self.timestep = hands[0], tuple(objects), surroundings[0].timestep
        each = list(zip(hands, objects, surroundings, strict=True))
        kinds = {world: number for number, world in enumerate(dict.fromkeys(each))}
        self._model = build(list(kinds))
        count, n, fingers = len(objects), self.hand.n_joints, len(self.hand.fingers)
        self._worlds = Worlds(
            np.array([kinds[world] for world in each]),
            *np.zeros((2, count, n + 3)),
            np.zeros((count, n)),
            np.zeros((count, n + 3)),
            np.zeros((count, fingers, 2)),
        )
        nearest = np.zeros((count, fingers), dtype=np.int64)
        self._readings = Readings(np.zeros((count, n)), nearest, np.zeros((count, fingers, 2, 2)))
        self._time, self._diverged = np.zeros(count), np.zeros(count, dtype=bool)
        self._start = self._worlds.position.copy()
        self._first = [place.start for place in self.hand.slices]
        self._mass, self._height = np.array([(spec.mass, spec.height / 2) for spec in objects]).T
        self._centre = np.stack([centre_of_mass(spec) for spec in objects])
        threads = min(threads or os.cpu_count() or 1, count)
        self._parts = [self._part(rows) for rows in np.array_split(np.arange(count), threads)]
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def reset(self, object_pose: Array, joint_angles: Array) -> State:
        """Place the objects `(B, 3)` and the joints `(B, n)`, all at rest; return the state."""
        n, worlds = self.hand.n_joints, self._worlds
        check_targets(joint_angles, len(self.objects), n)
        check_start(object_pose, len(self.objects))
        for array in (worlds.velocity, worlds.acceleration, worlds.force, self._time, self._diverged):
            array[:] = 0
        worlds.position[:, :n] = worlds.target[:] = joint_angles
        worlds.position[:, n:] = object_pose
        worlds.position[:, n : n + 2] += rotate(object_pose[:, 2], self._centre)
        self._start[:] = worlds.position
        return self.measure()

    def step(self, targets: Array, substeps: int) -> State:
        """Hold joint targets `(B, n)` [rad] for `substeps` physics steps; return the state after the last.

        Raises:
            InputError: a target is not finite; the text names world and joint. Or no physics step was asked for.
        """
        check_substeps(substeps)
        check_targets(targets, len(self.objects), self.hand.n_joints)
        self._worlds.target[:] = targets
        self._run(lambda part: step_worlds(self._model, part.worlds, part.work, substeps))
        self._time += substeps * self.timestep
        return self.measure()

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on, to put worlds back to it with `restore`."""
        n, worlds = self.hand.n_joints, self._worlds
        return Snapshot(
            time=self._time.copy(),
            qpos=np.concatenate([worlds.position[:, :n], self._object_pose()], axis=-1),
            qvel=np.concatenate([worlds.velocity[:, :n], self._object_velocity()], axis=-1),
            ctrl=worlds.target.copy(),
            qacc_warmstart=np.concatenate([worlds.acceleration[:, :n], planar_rates(worlds.acceleration[:, n:])], axis=-1),
            forces=self._forces(),
            centre=np.concatenate([worlds.position[:, n:], worlds.velocity[:, n:]], axis=-1),
        )

    def restore(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        """Put worlds `(K,)` back to rows `(K,)` of a snapshot; the other worlds are not touched.

        The snapshot may be another simulator's, of another engine too: what is upright and in the plane is taken over.
        Nothing is measured: `measure` does that, once for all that was put back.

        Raises:
            InputError: worlds or rows that are not there, a world named twice, or a hand of another number of joints.
        """
        n, mine = self.hand.n_joints, self._worlds
        check_restore(worlds, len(self.objects), snapshot, rows, n)
        centre = snapshot.centre[rows]
        mine.position[worlds] = np.concatenate([snapshot.qpos[rows, :n], centre[:, :3]], axis=-1)
        mine.velocity[worlds] = np.concatenate([snapshot.qvel[rows, :n], centre[:, 3:]], axis=-1)
        mine.acceleration[worlds] = snapshot.qacc_warmstart[rows][:, [*range(n + 2), n + 5]]
        mine.target[worlds] = snapshot.ctrl[rows]
        mine.force[worlds] = snapshot.forces[rows, :, :2]
        self._time[worlds] = snapshot.time[rows]
        self._diverged[worlds] = False

    def push(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        """Push the objects of worlds `(K,)` at their centres of mass with impulses `(K, 3)` [N s], at this instant.

        What would lift or sink the object is lost: it stays in the plane.

        Raises:
            InputError: worlds that are not there, or impulses of another shape or not finite.
        """
        check_impulse(worlds, len(self.objects), impulse)
        n = self.hand.n_joints
        self._worlds.velocity[worlds, n : n + 2] += impulse[:, :2] / self._mass[worlds, None]

    def measure(self) -> State:
        """Return the state of the present instant, worlds that diverged put back first."""
        self._put_back()
        self._run(lambda part: measure_worlds(self._model, part.worlds, part.work, part.readings))
        n, worlds, readings = self.hand.n_joints, self._worlds, self._readings
        rows = np.arange(len(self.objects))[:, None]
        points = np.empty((*readings.points.shape[:3], 3))
        points[..., :2], points[..., 2] = readings.points, self._height[:, None, None]
        return State(
            time=self._time.copy(),
            object_pose=self._object_pose(),
            object_velocity=self._object_velocity(),
            joint_angles=worlds.position[:, :n].copy(),
            joint_velocities=worlds.velocity[:, :n].copy(),
            targets=worlds.target.copy(),
            link_gaps=readings.gaps.copy(),
            contact_links=readings.nearest.copy(),
            finger_points=points[:, :, 0],
            object_points=points[:, :, 1],
            gaps=readings.gaps[rows, readings.nearest + self._first],
            forces=self._forces(),
            diverged=self._diverged.copy(),
        )

    def _part(self, rows: NDArray[np.int64]) -> Part:
        """Return views of some worlds that lie side by side, and room to step them in."""
        here = slice(int(rows[0]), int(rows[-1]) + 1)
        views = (kind(*(array[here] for array in whole)) for kind, whole in ((Worlds, self._worlds), (Readings, self._readings)))
        return Part(*views, room(self._model))

    def _run(self, work: Callable[[Part], None]) -> None:
        """Do something with every part, each on a thread of its own."""
        if self._pool is None:
            work(self._parts[0])
        else:
            list(self._pool.map(work, self._parts))

    def _put_back(self) -> None:
        """Find worlds that diverged and put them at rest where they were last reset to; their time goes on."""
        now = self._worlds
        wild = ran_away(now.position, now.velocity)
        if wild.any():
            self._diverged |= wild
            now.position[wild] = self._start[wild]
            for array in (now.velocity, now.acceleration, now.force):
                array[wild] = 0.0

    def _object_pose(self) -> Array:
        """Return the full pose of each object's frame `(B, 7)`."""
        pose = self._worlds.position[:, self.hand.n_joints :].copy()
        pose[:, :2] -= rotate(pose[:, 2], self._centre)
        full = spatial(pose, 0.0)
        full[:, 2] = self._height
        return full

    def _object_velocity(self) -> Array:
        """Return the velocity of each object's frame `(B, 6)`: linear [m/s], angular [rad/s]."""
        n = self.hand.n_joints
        rates = self._worlds.velocity[:, n:].copy()
        arm = perpendicular(rotate(self._worlds.position[:, n + 2], self._centre))
        rates[:, :2] -= rates[:, 2:] * arm
        return planar_rates(rates)

    def _forces(self) -> Array:
        """Return the force of each finger on the object `(B, F, 3)` [N]."""
        return np.concatenate([self._worlds.force, np.zeros((*self._worlds.force.shape[:2], 1))], axis=-1)


def planar_rates(rates: Array) -> Array:
    """Return rates along x, y and about z `(B, 3)` as linear and angular `(B, 6)`."""
    zero = np.zeros(len(rates))
    return np.stack([rates[:, 0], rates[:, 1], zero, zero, zero, rates[:, 2]], axis=-1)
