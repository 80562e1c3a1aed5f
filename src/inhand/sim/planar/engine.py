"""The planar engine behind the interface of every simulator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.cores import usable
from inhand.geometry import Array, perpendicular, rotate, spatial
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.engine import LINK_SENSOR_SIZE, Simulator
from inhand.sim.planar.build import build
from inhand.sim.planar.kernels import measure_worlds, step_worlds
from inhand.sim.planar.parts import Work, Worlds, room
from inhand.sim.scene import SceneSpec
from inhand.sim.snapshot import Snapshot, nowhere
from inhand.sim.state import State, ran_away

WORTH = 24
"""Active worlds for each thread from which several are worth it: handing work over and waiting for it takes 90 us of
processor time a decision, as much as stepping 16 worlds (measured with 4 to 128 worlds, two cores)."""


@dataclass(frozen=True, eq=False)
class Part:
    """What one thread works on: views of some worlds that lie side by side, and room of its own."""

    worlds: Worlds
    links: Array
    work: Work


class PlanarSimulator(Simulator):
    """Worlds in the plane; hands, objects and walls may differ in everything but the hands' numbers of joints."""

    engine = "planar"

    def __init__(
        self,
        hand: HandSpec | Sequence[HandSpec],
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        threads: int = 0,
        *,
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Build a world for each object, to step on some threads; 0 uses every core.

        Raises:
            InputError: what no simulator takes.
        """
        super().__init__(hand, objects, scenes, kinds)
        distinct = {kind: number for number, kind in enumerate(dict.fromkeys(self._kinds))}
        self._number = np.array([distinct[kind] for kind in self._kinds])
        count, n = self.n_worlds, self.hand.n_joints
        self._model = build(list(distinct))
        self._worlds = Worlds(
            kind=self._number[self._kind],
            active=np.ones(count, dtype=bool),
            position=np.zeros((count, n + 3)),
            velocity=np.zeros((count, n + 3)),
            target=np.zeros((count, n)),
            coming=np.zeros((count, n)),
            lag=np.zeros(count, dtype=np.int64),
            acceleration=np.zeros((count, n + 3)),
            force=self._forces,
        )
        self._time, self._start = np.zeros(count), self._worlds.position.copy()
        self._links = np.zeros((count, n, LINK_SENSOR_SIZE))
        self._links[:, :, 3::3] = self._height[:, None, None]
        threads = min(threads or usable(), count)
        self._parts = [self._part(rows) for rows in np.array_split(np.arange(count), threads)]
        self._others = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def _measure(self, active: NDArray[np.bool_]) -> State:
        self._worlds.active[:] = active
        self._put_back()
        self._run(lambda part: measure_worlds(self._model, part.worlds, part.work, part.links))
        n, now = self.hand.n_joints, self._worlds
        joints = now.position[:, :n].copy(), now.velocity[:, :n].copy()
        body = self._object_pose(), self._object_velocity()
        return self._state(self._time.copy(), body, joints, now.target, self._links)

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on: one of like hand, object and scene goes on alike."""
        n, now = self.hand.n_joints, self._worlds
        return Snapshot(
            time=self._time.copy(),
            qpos=np.concatenate([now.position[:, :n], self._object_pose()], axis=-1),
            qvel=np.concatenate([now.velocity[:, :n], self._object_velocity()], axis=-1),
            ctrl=now.target.copy(),
            qacc_warmstart=np.concatenate([now.acceleration[:, :n], _upright(now.acceleration[:, n:])], axis=-1),
            forces=self._forces.copy(),
            centre=np.concatenate([now.position[:, n:], now.velocity[:, n:]], axis=-1),
            held=nowhere(self.n_worlds),
        )

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        n, now = self.hand.n_joints, self._worlds
        now.position[:, :n] = now.target[:] = joint_angles
        now.position[:, n:] = object_pose
        now.position[:, n : n + 2] += rotate(object_pose[:, 2], self._centre)
        for array in (now.velocity, now.acceleration, self._time):
            array[:] = 0.0
        self._start[:] = now.position

    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        self._worlds.active[:], self._worlds.coming[:], self._worlds.lag[:] = active, targets, self.lag
        self._run(lambda part: step_worlds(self._model, part.worlds, part.work, substeps))
        self._time[active] += substeps * self.timestep

    def _hold(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        """Advance at once; the kernel lets targets lag."""
        self._advance(targets, substeps, active)

    def _become(self, worlds: NDArray[np.int64]) -> None:
        self._worlds.kind[worlds] = self._number[self._kind[worlds]]
        self._links[worlds, :, 3::3] = self._height[worlds, None, None]

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        n, now = self.hand.n_joints, self._worlds
        centre = snapshot.centre[rows]
        now.position[worlds] = np.concatenate([snapshot.qpos[rows, :n], centre[:, :3]], axis=-1)
        now.velocity[worlds] = np.concatenate([snapshot.qvel[rows, :n], centre[:, 3:]], axis=-1)
        now.acceleration[worlds] = snapshot.qacc_warmstart[rows][:, [*range(n + 2), n + 5]]
        now.target[worlds] = snapshot.ctrl[rows]
        self._time[worlds] = snapshot.time[rows]

    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        n = self.hand.n_joints
        self._worlds.velocity[worlds, n : n + 2] += impulse[:, :2] / self._mass[worlds, None]

    def _put_back(self) -> None:
        """Find worlds that diverged and put them at rest where they were last reset to; their time goes on."""
        now = self._worlds
        wild = ran_away(now.position, now.velocity)
        if wild.any():
            self._diverged |= wild
            now.position[wild] = self._start[wild]
            for array in (now.velocity, now.acceleration, self._forces):
                array[wild] = 0.0

    def _part(self, rows: NDArray[np.int64]) -> Part:
        here = slice(int(rows[0]), int(rows[-1]) + 1)
        now = self._worlds
        views: list[Any] = [array[here] for array in now]
        return Part(Worlds(*views), self._links[here], room(self._model))

    def _run(self, work: Callable[[Part], None]) -> None:
        """Do something with every part, the first on this thread, the others on their own where that is worth it."""
        parts = self._parts
        if self._others is None or np.count_nonzero(self._worlds.active) < WORTH * len(parts):
            for part in parts:
                work(part)
            return
        begun = [self._others.submit(work, part) for part in parts[1:]]
        work(parts[0])
        for each in begun:
            each.result()

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
        rates[:, :2] -= rates[:, 2:] * perpendicular(rotate(self._worlds.position[:, n + 2], self._centre))
        return _upright(rates)


def _upright(rates: Array) -> Array:
    """Return rates along x, y and about z `(B, 3)` as linear and angular ones `(B, 6)`."""
    full = np.zeros((len(rates), 6))
    full[:, :2], full[:, 5] = rates[:, :2], rates[:, 2]
    return full
