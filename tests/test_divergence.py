"""A simulation that breaks down in one world is told there, and the other worlds do not notice."""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from inhand import geometry
from inhand.control.catalogue import planned_grasp, rough_grasp
from inhand.control.controller import Task
from inhand.control.ik import IkController
from inhand.control.loop import Recording, run_episodes
from inhand.control.phases import standard_phases
from inhand.control.recording import cut_trials
from inhand.control.trial import DIVERGED, REACHED, Trial
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.bullet_engine import BulletSimulator
from inhand.sim.bullet_model import load_pybullet
from inhand.sim.bullet_servo import FINER
from inhand.sim.model import build_measuring_model, build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import LARGEST, State, ran_away, select
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN
from made import passport
from test_simulator import BOXES, CUBE, HAND, assert_same, run, shaken, start_pose

WORLDS = BOXES[:4]
REST = np.array([0, 1, 3])
"""Worlds in which nothing is wrong; world 2 is the one that breaks down."""
WILD = [np.nan, np.inf, -np.inf, 1e300, 1e30, 1e12, 1e9]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file in the working directory


def at(*indices: int) -> NDArray[np.int64]:
    return np.array(indices, dtype=np.int64)


def spoilt(snapshot: Snapshot, name: str, column: int, value: float) -> Snapshot:
    """Return a snapshot with one value of every world replaced."""
    array = getattr(snapshot, name).copy()
    array[:, column] = value
    return replace(snapshot, **{name: array})


def break_down(simulator: MujocoSimulator, world: int, value: float = 1e30) -> None:
    """Give the joints of one world a speed that no simulation survives."""
    simulator.restore(at(world), spoilt(simulator.snapshot(), "qvel", 0, value), at(world))


def assert_finite(state: State) -> None:
    for field in fields(State):
        assert np.isfinite(getattr(state, field.name)).all(), field.name
    assert np.abs(state.object_velocity).max() < LARGEST


@cache
def untouched(threads: int) -> tuple[Array, list[State]]:
    """Return targets `(20, B, n)` and the states of worlds that nothing befalls from the eighth row on."""
    targets = np.stack([shaken(HAND, spec, 20, k) for k, spec in enumerate(WORLDS)], axis=1)
    simulator = MujocoSimulator(HAND, WORLDS, threads=threads)
    run(simulator, targets[:8])
    return targets, [simulator.step(row, 6) for row in targets[8:]]


def test_no_number_and_absurd_numbers_are_told() -> None:
    rows = np.array([[0.0, 1.0], [np.nan, 0.0], [0.0, -np.inf], [LARGEST, -LARGEST], [0.0, -1.1 * LARGEST]])
    np.testing.assert_array_equal(ran_away(rows, np.zeros((5, 3))), [False, True, True, False, True])
    np.testing.assert_array_equal(ran_away(np.zeros((5, 3)), rows), [False, True, True, False, True])


@pytest.mark.parametrize("build", [build_model, build_measuring_model])
def test_mujoco_does_not_reset_a_world_on_its_own(build: Callable[..., mujoco.MjModel]) -> None:
    """It would go on from the model's defaults with the clock at 0, and look like a measurement."""
    model = build(HAND, CUBE, SceneSpec())
    assert model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


@pytest.mark.parametrize("value", WILD)
@pytest.mark.parametrize(
    ("name", "column", "threads"),
    [("qvel", 0, 1), ("qvel", 5, 2), ("qpos", 1, 2), ("qpos", 4, 1), ("qacc_warmstart", 4, 2)],
)
def test_the_others_go_on_to_the_same_bytes(name: str, column: int, value: float, threads: int) -> None:
    targets, expected = untouched(threads)
    other = MujocoSimulator(HAND, WORLDS, threads=threads)
    run(other, targets[:8])
    other.restore(at(2), spoilt(other.snapshot(), name, column, value), at(2))
    states = [other.step(row, 6) for row in targets[8:]]
    assert_same([select(state, REST) for state in expected], [select(state, REST) for state in states])
    for state in states:
        assert_finite(state)
        np.testing.assert_array_equal(state.time, state.time[0])
    if name != "qacc_warmstart":
        assert states[0].diverged[2]
    assert not any(state.diverged[REST].any() for state in states)


def test_a_world_that_diverged_rests_where_it_was_reset_to_and_says_so_until_it_is_started_again() -> None:
    simulator = MujocoSimulator(HAND, WORLDS, threads=1)
    begun = run(simulator, shaken(HAND, CUBE, 6, seed=3))[0]
    kept = simulator.snapshot()
    break_down(simulator, 2)
    targets = simulator.snapshot().ctrl + 0.01
    found = simulator.step(targets, 5)
    np.testing.assert_array_equal(found.diverged, [False, False, True, False])
    for name in ("object_pose", "joint_angles", "gaps", "finger_points"):
        np.testing.assert_array_equal(getattr(found, name)[2], getattr(begun, name)[2])
    assert not found.joint_velocities[2].any()
    assert not found.object_velocity[2].any()
    np.testing.assert_array_equal(found.targets, targets)
    assert simulator.step(targets, 5).diverged[2]
    assert simulator.measure().diverged[2]
    simulator.restore(at(0), kept, at(0))
    assert simulator.measure().diverged[2]
    simulator.restore(at(2), kept, at(2))
    assert not simulator.step(targets, 5).diverged.any()
    break_down(simulator, 1)
    assert simulator.measure().diverged[1]
    assert found.diverged[2]
    simulator.reset(begun.pose, begun.joint_angles)
    assert not simulator.step(begun.joint_angles, 5).diverged.any()


def test_a_world_restored_after_it_diverged_goes_on_as_if_it_had_not() -> None:
    targets = shaken(HAND, CUBE, 12, seed=5)[:, None].repeat(4, axis=1)
    simulator = MujocoSimulator(HAND, WORLDS, threads=1)
    run(simulator, targets[:6])
    kept = simulator.snapshot()
    first = [simulator.step(row, 6) for row in targets[6:]]
    break_down(simulator, 2)
    simulator.step(targets[0], 6)
    simulator.restore(np.arange(4), kept, np.arange(4))
    assert_same(first, [simulator.step(row, 6) for row in targets[6:]])


def test_servos_that_no_physics_step_can_hold_diverge_where_they_move() -> None:
    wild = replace(HAND, stiffness=1e9, torque=1e9, damping=0.0)
    simulator = MujocoSimulator(wild, [CUBE] * 2, threads=1)
    simulator.reset(np.tile([0.0, 0.3, 0.0], (2, 1)), np.zeros((2, 4)))
    for _ in range(3):
        state = simulator.step(np.array([[0.0] * 4, [1.0] * 4]), 500)
        np.testing.assert_array_equal(state.diverged, [False, True])
        assert_finite(state)


# The same in an episode.


class Breaking(MujocoSimulator):
    """Worlds of which one breaks down at a step."""

    world: int = 1
    at: int = 0
    taken: int = 0

    def step(self, targets: Array, substeps: int, active: NDArray[np.bool_] | None = None) -> State:
        """Break down when it is time, then step."""
        assert np.isfinite(targets).all()
        self.taken += 1
        if self.taken == self.at:
            break_down(self, self.world)
        return super().step(targets, substeps, active)


def expert(simulator: MujocoSimulator) -> tuple[Recording, tuple[Trial, ...]]:
    """Return the recording of the expert's episodes straight out, and their trials."""
    path, count = straight_path(TRAIN[0]), len(simulator.objects)
    paths = np.tile(path.poses, (count, 1, 1))
    task = Task(HAND, simulator.objects, geometry.Path(paths), simulator.timestep)
    origin = np.tile(start_pose(HAND), (count, 1))
    grasp = planned_grasp(HAND, CUBE, origin[:, None] + task.path.poses)
    phases = standard_phases(grasp, IkController)
    recording = run_episodes(simulator, task, phases, simulator.reset(origin, grasp.opened))
    passports = [passport(trial=k + 1) for k in range(count)]
    return recording, cut_trials(Trial, recording, passports, task.path.poses)


@pytest.mark.parametrize("step", [1, 20, 100])
def test_a_trial_ends_in_the_row_before_its_world_diverged(step: int) -> None:
    expected, theirs = expert(MujocoSimulator(HAND, [CUBE] * 3, threads=1))
    simulator = Breaking(HAND, [CUBE] * 3, threads=1)
    simulator.at = step
    recording, ours = expert(simulator)
    assert expected.outcomes == (REACHED,) * 3
    assert recording.outcomes == tuple(trial.outcome for trial in ours) == (REACHED, DIVERGED, REACHED)
    assert len(ours[1].time) == step
    for trial, other in zip(ours, theirs, strict=True):
        rows = step if trial is ours[1] else len(other.time)
        for name in ("time", "object_pose", "joint_angles", "targets", "gaps"):
            np.testing.assert_array_equal(getattr(trial, name), getattr(other, name)[:rows])


def test_a_grasp_whose_rehearsal_diverges_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = (start_pose(HAND) + straight_path(TRAIN[0]).poses)[None]
    best = planned_grasp(HAND, CUBE, poses, engine="mujoco")
    others = 0
    for number in range(5):

        def breaking(
            engine: str, hand: HandSpec, objects: Sequence[ObjectSpec], *_: object, world: int = number
        ) -> MujocoSimulator:
            assert engine == "mujoco"
            simulator = Breaking(hand, objects)
            simulator.world, simulator.at = world, 3
            return simulator

        monkeypatch.setattr("inhand.control.loop.make_simulator", breaking)
        others += not np.array_equal(planned_grasp(HAND, CUBE, poses, engine="mujoco").opened, best.opened)
    assert others == 1


# The same in the witness.


def closed_on(simulator: BulletSimulator) -> list[State]:
    """Close the fingers of every world on its object and return the states, the start first."""
    grasp = rough_grasp(HAND, CUBE, start_pose(HAND)[None, None])
    count = len(simulator.objects)
    opened, closed = (angles.repeat(count, axis=0) for angles in (grasp.opened, grasp.closed))
    start = simulator.reset(np.tile(start_pose(HAND), (count, 1)), opened)
    return [start, *(simulator.step(opened + share * (closed - opened), 5) for share in np.linspace(0.1, 1.0, 10))]


def spoil_second(monkeypatch: pytest.MonkeyPatch, engine: ModuleType, value: float) -> None:
    """Give the object of the second world a speed during its 12th physics step."""
    plain, taken = engine.stepSimulation, dict[int, int]()

    def step(client: int) -> None:
        plain(client)
        taken[client] = taken.get(client, 0) + 1
        if taken[client] == 12 * FINER and list(taken).index(client) == 1:
            bodies = range(engine.getNumBodies(physicsClientId=client))
            masses = [engine.getDynamicsInfo(body, -1, physicsClientId=client)[0] for body in bodies]
            thing = masses.index(pytest.approx(CUBE.mass))
            engine.resetBaseVelocity(thing, [value, 0, 0], [0, 0, value], physicsClientId=client)

    monkeypatch.setattr(engine, "stepSimulation", step)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_the_witness_tells_a_world_that_diverged_and_puts_it_back(
    value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    expected = closed_on(BulletSimulator(HAND, [CUBE] * 3))
    simulator = BulletSimulator(HAND, [CUBE] * 3)
    spoil_second(monkeypatch, load_pybullet(), value)
    states = closed_on(simulator)
    others = at(0, 2)
    assert_same([select(state, others) for state in expected], [select(state, others) for state in states])
    assert [bool(state.diverged[1]) for state in states] == [False] * 3 + [True] * 8
    for state in states:
        assert_finite(state)
    for name in ("object_pose", "joint_angles", "gaps"):
        np.testing.assert_array_equal(getattr(states[3], name)[1], getattr(states[0], name)[1])
    assert not closed_on(simulator)[-1].diverged.any()
