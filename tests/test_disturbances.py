"""Disturbed worlds: every quantity acts, in the physics or in what is seen, and no world's draw touches another's."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from commands import Call
from inhand.control.between import Between
from inhand.control.seen import SENSED
from inhand.control.senses import Senses
from inhand.errors import InputError
from inhand.geometry import Array, spatial
from inhand.sim.disturbance import (
    BENCH,
    FIELD,
    HARD,
    Camera,
    Commands,
    Differences,
    Disturbance,
    Encoders,
    Pushes,
)
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.drawn import Disturbed, Drawn, draw, truth
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from test_simulator import CUBE, HAND, grip, open_hand

PERIOD = 0.02
ENGINES = ("planar", "mujoco")


def drawn_worlds(spec: Disturbance, count: int, first: int = 0) -> list[Disturbed]:
    """Return the worlds of some keys."""
    return [draw(spec, (first + number,), HAND.n_joints) for number in range(count)]


def state_at(poses: Array, joints: Array, time: float) -> State:
    """Return a state of worlds whose objects stand at poses `(B, 3)` and whose joints at angles `(B, n)`."""
    count = len(poses)
    points = np.zeros((count, 2, 3))
    return State(
        np.full(count, time),
        spatial(poses, 0.05),
        np.zeros((count, 6)),
        joints,
        np.zeros_like(joints),
        joints,
        np.zeros_like(joints),
        np.zeros((count, 2), dtype=np.int64),
        points,
        points,
        np.zeros((count, 2)),
        points,
        np.zeros(count, dtype=bool),
    )


def watched(spec: Disturbance, count: int, decisions: int, first: int = 0) -> tuple[list[Any], Array]:
    """Return what is sensed of objects and joints that move evenly, decision by decision, and how they are `(T, 3)`."""
    rates, still = np.array([0.05, -0.02, 0.3]), np.zeros((count, HAND.n_joints))
    worlds, poses = drawn_worlds(spec, count, first), []
    senses = None
    seen = []
    for number in range(decisions + 1):
        pose = number * PERIOD * rates
        state = state_at(np.tile(pose, (count, 1)), still + number * PERIOD, number * PERIOD)
        if senses is None:
            senses = Senses(spec, state, PERIOD)
            senses.begin(np.arange(count), worlds, state)
        else:
            senses.take(state)
        poses.append(pose)
        seen.append(senses.sensed(state, state.targets))
    return seen, np.array(poses)


@pytest.mark.parametrize("spec", [BENCH, FIELD, HARD], ids=lambda spec: spec.name)
def test_what_is_drawn_lies_in_its_range_and_fills_it(spec: Disturbance) -> None:
    worlds = [world.drawn for world in drawn_worlds(spec, 400)]
    for name in ("friction", "mass", "size", "floor", "stiffness", "damping", "torque"):
        values, (low, high) = np.array([getattr(world, name) for world in worlds]), getattr(spec.differs, name)
        assert values.min() >= low * (1 - 1e-12)
        assert values.max() <= high * (1 + 1e-12)
        middle = np.sqrt(low * high)
        assert abs(np.mean(values < middle) - 0.5) < 0.1 or low == high
    for name, (low, high) in (("camera_s", spec.camera.delay_ms), ("command_s", spec.commands.delay_ms)):
        late = 1e3 * np.array([getattr(world, name) for world in worlds])
        assert late.min() == pytest.approx(low, abs=0.05 * (high - low))
        assert late.max() == pytest.approx(high, abs=0.05 * (high - low))
    starts = np.array([world.start for world in worlds])
    spread = spec.differs.start_mm / 1e3, spec.differs.start_mm / 1e3, np.deg2rad(spec.differs.start_deg)
    np.testing.assert_allclose(starts.std(axis=0), spread, rtol=0.15)
    zeros = np.array([world.zero for world in worlds])
    assert zeros.std() == pytest.approx(np.deg2rad(spec.differs.zero_deg), rel=0.1)
    bias = np.array([world.bias for world in worlds])
    np.testing.assert_allclose(np.hypot(*bias[:, :2].T), spec.camera.bias_mm / 1e3)
    np.testing.assert_allclose(np.abs(bias[:, 2]), np.deg2rad(spec.camera.bias_deg))
    centre = 1e3 * np.array([world.centre for world in worlds])
    assert np.abs(centre).max() == pytest.approx(spec.differs.centre_mm, rel=0.05)


def test_a_world_keeps_its_other_numbers_where_one_quantity_is_left_alone() -> None:
    one, other = (
        draw(FIELD, (3, 1), 4).drawn,
        draw(replace(FIELD, differs=replace(FIELD.differs, mass=(2.0, 2.0))), (3, 1), 4),
    )
    assert other.drawn == replace(one, mass=2.0)
    assert draw(FIELD, (3, 2), 4).drawn.friction != one.friction


def test_the_truth_is_the_nominal_world_times_the_factors() -> None:
    drawn = Drawn((0,), 0.5, 2.0, 1.1, 3.0, 1.2, 0.7, 0.9, (0.001, -0.002))
    hand, spec, scene = truth(drawn, HAND, CUBE, SceneSpec())
    assert (hand.friction, hand.stiffness, hand.damping, hand.torque) == (
        0.5 * HAND.friction,
        1.2 * HAND.stiffness,
        0.7 * HAND.damping,
        0.9 * HAND.torque,
    )
    assert (spec.mass, spec.centre, spec.size[2]) == (2 * CUBE.mass, (0.001, -0.002), CUBE.size[2])
    assert spec.size[:2] == pytest.approx((1.1 * CUBE.size[0], 1.1 * CUBE.size[1]))
    assert scene.floor_friction == 3 * SceneSpec().floor_friction


def pair(engine: str, scene: SceneSpec | None = None, **factors: Any) -> Simulator:
    """Return two worlds: the first as drawn, the second undisturbed."""
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    scene = scene or SceneSpec()
    hand, spec, around = truth(Drawn((0,), **factors), HAND, CUBE, scene)
    # In MuJoCo a centre of mass of its own is a matter of kind, and 0.1 mm is one too.
    other = replace(CUBE, centre=(1e-4, 0.0)) if any(spec.centre) else CUBE
    return make_simulator(engine, [hand, HAND], [spec, other], [around, scene], 1)


def placed(simulator: Simulator, joints: Array | None = None) -> State:
    """Place the object at its start in both worlds, the fingers away from it or at joint angles `(n,)`."""
    angles = open_hand(HAND) if joints is None else joints
    return simulator.reset(np.tile(HAND.start_pose, (2, 1)), np.tile(angles, (2, 1)))


@pytest.mark.parametrize("engine", [*ENGINES, "bullet"])
def test_mass_size_and_floor_act(engine: str) -> None:
    simulator = pair(engine, mass=2.0)
    placed(simulator)
    simulator.push(np.arange(2), np.tile([0.006, 0.0, 0.0], (2, 1)))
    np.testing.assert_allclose(simulator.measure().object_velocity[:, 0], [0.1, 0.2], rtol=1e-6)
    fingers = grip(HAND, CUBE, -0.004)
    gaps = placed(pair(engine, size=1.1), fingers).gaps
    np.testing.assert_allclose(gaps[1] - gaps[0], 0.05 * CUBE.size[0], atol=2e-5)
    simulator = pair(engine, floor=0.5)
    start = placed(simulator)
    simulator.step(start.targets, 5)
    simulator.push(np.arange(2), np.tile([0.0, 0.006, 0.0], (2, 1)))
    before = simulator.measure().object_velocity[:, 1]
    after = simulator.step(start.targets, 5).object_velocity[:, 1]
    slowed = before - after
    np.testing.assert_allclose(slowed[1], 0.2 * 9.81 * 0.02, rtol=0.1)
    np.testing.assert_allclose(slowed[0] / slowed[1], 0.5, rtol=0.15)


@pytest.mark.parametrize("engine", [*ENGINES, "bullet"])
def test_an_object_spins_about_where_its_mass_is(engine: str) -> None:
    away = np.array([0.006, -0.004])
    simulator = pair(engine, SceneSpec(gravity=0.0), centre=tuple(away))
    start = placed(simulator)
    snapshot = simulator.snapshot()
    rate = 5.0
    qvel = snapshot.qvel.copy()
    qvel[:, -1] = rate
    qvel[0, -6:-4] = -rate * np.array([-away[1], away[0]])  # of the origin, while the centre of mass rests
    centre = snapshot.centre.copy()
    centre[:, 3:] = [0.0, 0.0, rate]
    every = np.arange(2)
    simulator.restore(every, replace(snapshot, qvel=qvel, centre=centre), every)
    state = simulator.step(start.targets, 10)
    turned = state.pose[0, 2]
    moved = state.pose[:, :2] - start.pose[:, :2]
    cos, sin = np.cos(turned), np.sin(turned)
    expected = away - np.array([[cos, -sin], [sin, cos]]) @ away
    assert turned > 0.05
    np.testing.assert_allclose(moved[0], expected, atol=6e-5)
    np.testing.assert_allclose(moved[1], 0.0, atol=1.6e-4)


@pytest.mark.parametrize("engine", [*ENGINES, "bullet"])
def test_friction_and_the_servos_act(engine: str) -> None:
    simulator = pair(engine, friction=0.3)
    held = grip(HAND, CUBE, 0.004)
    placed(simulator, held)
    for _ in range(10):
        simulator.step(np.tile(held, (2, 1)), 5)
    simulator.push(np.arange(2), np.tile([0.0, 0.01, 0.0], (2, 1)))
    before = simulator.measure().pose[:, 1]
    moved = simulator.step(np.tile(held, (2, 1)), 25).pose[:, 1] - before
    assert moved[0] > 1.5 * moved[1] > 0
    for name, factor, step, slower in (
        ("stiffness", 0.5, 0.05, True),
        ("damping", 0.5, 0.3, False),
        ("torque", 0.2, 0.3, True),
    ):
        simulator = pair(engine, None, **{name: factor})
        start = placed(simulator)
        far = start.targets + step * np.array([-1.0, 0.0, 1.0, 0.0])
        gone = np.abs(simulator.step(far, 10).joint_angles - start.joint_angles)[:, [0, 2]].sum(axis=1)
        assert (gone[0] < 0.95 * gone[1]) if slower else (gone[0] > 1.05 * gone[1]), name


@pytest.mark.parametrize("engine", [*ENGINES, "bullet"])
def test_targets_lag_by_physics_steps_world_by_world(engine: str) -> None:
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    lags = [0, 2, 3]
    simulator = make_simulator(engine, HAND, [CUBE] * 3)
    alone = make_simulator(engine, HAND, [CUBE])
    poses, joints = np.tile(HAND.start_pose, (3, 1)), np.tile(open_hand(HAND), (3, 1))
    start = simulator.reset(poses, joints)
    simulator.lag = np.array(lags)
    state = simulator.step(start.targets + 0.1, 5)
    np.testing.assert_array_equal(state.targets, start.targets + 0.1)
    for world, lag in enumerate(lags):
        alone.reset(poses[:1], joints[:1])
        if lag:
            alone.step(start.targets[:1], lag)
        expected = alone.step(start.targets[:1] + 0.1, 5 - lag)
        np.testing.assert_array_equal(state.joint_angles[world], expected.joint_angles[0])


@pytest.mark.parametrize("engine", [*ENGINES, "bullet"])
def test_a_world_becomes_another_kind_and_goes_on_as_one(engine: str) -> None:
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    objects = [CUBE, replace(CUBE, mass=4 * CUBE.mass, centre=(0.003, 0.0))]
    if engine == "mujoco":  # whose worlds are all of a kind with or without a centre of mass of their own
        objects[0] = replace(CUBE, centre=(0.001, 0.0))
    simulator = make_simulator(engine, HAND, objects, kinds=np.array([0, 0, 1]))
    own = make_simulator(engine, HAND, objects[1:])
    poses, joints = np.tile(HAND.start_pose, (3, 1)), np.tile(grip(HAND, CUBE, 0.002), (3, 1))
    simulator.reset(poses, joints)
    own.reset(poses[:1], joints[:1])
    simulator.restore(np.array([1]), own.snapshot(), np.array([0]), np.array([1]))
    targets = joints + 0.02
    states = [simulator.step(targets, 5) for _ in range(3)][-1], [own.step(targets[:1], 5) for _ in range(3)][-1]
    assert simulator.objects == (objects[0], objects[1], objects[1])
    np.testing.assert_allclose(states[0].object_pose[1], states[1].object_pose[0], atol=1e-12)
    assert np.abs(states[0].object_pose[0] - states[0].object_pose[1]).max() > 1e-7


def test_encoders_have_a_resolution_noise_a_delay_and_another_zero() -> None:
    step = np.deg2rad(0.5)
    seen, _ = watched(Disturbance(encoders=Encoders(resolution_deg=0.5)), 1, 20)
    read = np.array([each.joint_angles[0] for each in seen])
    np.testing.assert_allclose(read / step, np.round(read / step), atol=1e-9)
    true = PERIOD * np.arange(21)[:, None]
    assert 0 < np.abs(read - true).max() <= step / 2 + 1e-12
    np.testing.assert_allclose(seen[5].joint_velocities[0], (read[5] - read[4]) / PERIOD)

    seen, _ = watched(Disturbance(encoders=Encoders(noise_deg=0.3)), 20, 50)
    away = np.array([each.joint_angles for each in seen]) - PERIOD * np.arange(51)[:, None, None]
    assert np.rad2deg(away.std()) == pytest.approx(0.3, rel=0.05)
    assert np.rad2deg(np.abs(away.mean())) < 0.03

    seen, _ = watched(Disturbance(encoders=Encoders(delay_ms=(30.0, 30.0))), 1, 20)
    assert seen[10].joint_angles[0, 0] == pytest.approx(true[10, 0] - 0.03)

    spec = Disturbance(differs=Differences(zero_deg=1.0))
    zero = draw(spec, (0,), HAND.n_joints).drawn.zero
    seen, _ = watched(spec, 1, 3)
    np.testing.assert_allclose(seen[2].joint_angles[0] - true[2], zero)
    assert np.abs(zero).min() > 1e-4
    simulator = make_simulator("planar", HAND, [CUBE], threads=1)
    start = simulator.reset(HAND.start_pose[None], open_hand(HAND)[None])
    between = Between(drawn_worlds(spec, 1), start, 0.004, 5)
    np.testing.assert_allclose(between.send(simulator, start.targets), start.targets - zero)
    np.testing.assert_allclose(between.seen(SENSED).joint_angles, start.joint_angles + zero)


def test_a_camera_has_a_rate_and_a_delay() -> None:
    seen, poses = watched(Disturbance(camera=Camera(rate_hz=30.0, delay_ms=(40.0, 40.0))), 1, 30)
    times, now = np.array([each.frame_time[0] for each in seen]), PERIOD * np.arange(31)
    np.testing.assert_allclose(30 * times, np.round(30 * times), atol=1e-9)
    ages = now - times
    assert ages.min() >= 0.04 - 1e-9
    assert ages.max() < 0.04 + 1 / 30 + 1e-9
    assert len(np.unique(times)) == pytest.approx(30 * 0.6, abs=2)
    rates = poses[1] / PERIOD
    found = np.array([each.frame_pose[0] for each in seen])
    np.testing.assert_allclose(found, np.maximum(times, 0.0)[:, None] * rates, atol=1e-6)
    np.testing.assert_allclose([each.age[0] for each in seen], ages, atol=1e-12)


def test_a_camera_has_noise_in_each_frame_and_a_bias_in_all() -> None:
    seen, poses = watched(Disturbance(camera=Camera(noise_mm=1.0, noise_deg=2.0)), 20, 100)
    away = np.array([each.frame_pose for each in seen]) - poses[:, None]
    np.testing.assert_allclose(away.std(axis=(0, 1)), [1e-3, 1e-3, np.deg2rad(2.0)], rtol=0.05)
    assert abs(np.corrcoef(away[1:, 0, 0], away[:-1, 0, 0])[0, 1]) < 0.3
    seen, poses = watched(Disturbance(camera=Camera(bias_mm=2.0, bias_deg=3.0)), 3, 10)
    away = np.array([each.frame_pose for each in seen]) - poses[:, None]
    np.testing.assert_allclose(away, np.broadcast_to(away[0], away.shape), atol=1e-12)
    np.testing.assert_allclose(np.hypot(*away[0, :, :2].T), 2e-3)
    np.testing.assert_allclose(np.abs(away[0, :, 2]), np.deg2rad(3.0))


def runs_of(missing: Sequence[bool]) -> list[int]:
    """Return the lengths of the runs of missing frames that are over."""
    text = "".join("x" if each else " " for each in missing)
    return [len(run) for run in text.rpartition(" ")[0].split()]


@pytest.mark.parametrize(("run", "longest"), [((1, 1), 1), ((2, 5), 5)])
def test_frames_are_missing_alone_or_in_runs(run: tuple[int, int], longest: int) -> None:
    seen, _ = watched(Disturbance(camera=Camera(missing=0.15, missing_run=run)), 8, 600)
    times = np.array([each.frame_time for each in seen])
    missing = np.diff(times, axis=0) < 1e-9
    assert missing.mean() == pytest.approx(0.15, abs=0.02)
    lengths = [length for world in missing.T for length in runs_of(world.tolist())]
    assert min(lengths) == run[0]
    assert max(lengths) >= longest  # one run may follow another at once


def test_commands_are_late_and_pushes_come_as_drawn() -> None:
    spec = Disturbance(commands=Commands((28.0, 28.0)), pushes=Pushes(6.0, 5.0, 3))
    simulator = make_simulator("planar", HAND, [CUBE] * 40, threads=1)
    start = simulator.reset(np.tile(HAND.start_pose, (40, 1)), np.tile(open_hand(HAND), (40, 1)))
    between = Between(drawn_worlds(spec, 40), start, 0.004, 5)
    sent = [between.send(simulator, start.targets + 0.01 * number) for number in range(1, 5)]
    np.testing.assert_array_equal(simulator.lag, 2)
    for arrived, number in zip(sent, range(4), strict=True):
        np.testing.assert_allclose(arrived - start.targets, 0.01 * number, atol=1e-12)
    np.testing.assert_allclose(between.seen(SENSED).targets - start.targets, 0.04, atol=1e-12)
    speeds = [simulator.measure().object_velocity[:, :2].copy()]
    assert not speeds[0].any()  # not while nothing is held
    between.pushing = True
    for _ in range(100):
        between.send(simulator, start.targets)
        speeds.append(simulator.measure().object_velocity[:, :2].copy())
    jumps = np.linalg.norm(np.diff(speeds, axis=0), axis=-1)
    np.testing.assert_allclose(jumps[jumps > 1e-9], 0.006 / CUBE.mass)
    count = (jumps > 1e-9).sum(axis=0)
    assert count.max() == 3
    assert (jumps > 1e-9).argmax(axis=0).mean() * PERIOD == pytest.approx(1 / 5, abs=0.08)
    angles = np.arctan2(*np.diff(speeds, axis=0)[jumps > 1e-9].T)
    assert abs(np.exp(1j * angles).mean()) < 0.3


@pytest.mark.parametrize("spec", [FIELD, HARD], ids=lambda spec: spec.name)
def test_what_is_seen_of_a_world_is_the_same_alone(spec: Disturbance) -> None:
    whole, _ = watched(spec, 6, 150)
    alone, _ = watched(spec, 1, 150, first=4)
    for together, apart in zip(whole, alone, strict=True):
        for name, values in vars(apart).items():
            np.testing.assert_array_equal(getattr(together, name)[4:5], values)


def test_episodes_begin_anew_in_some_worlds_and_the_others_see_on() -> None:
    state, count = state_at(np.zeros((3, 3)), np.zeros((3, HAND.n_joints)), 0.0), np.arange(3)
    kept, begun = Senses(HARD, state, PERIOD), Senses(HARD, state, PERIOD)
    for senses in (kept, begun):
        senses.begin(count, drawn_worlds(HARD, 3), state)
        for number in range(1, 8):
            senses.take(state_at(np.full((3, 3), 0.001 * number), state.joint_angles, number * PERIOD))
    last = state_at(np.full((3, 3), 0.007), state.joint_angles, 0.14)
    begun.begin(np.array([1]), drawn_worlds(HARD, 1, first=9), last)
    one, other = (senses.sensed(last, last.targets) for senses in (kept, begun))
    for name in ("frame_pose", "joint_angles", "joint_velocities", "frame_time"):
        np.testing.assert_array_equal(getattr(one, name)[[0, 2]], getattr(other, name)[[0, 2]])
        assert (getattr(one, name)[1] != getattr(other, name)[1]).any()
    assert not other.joint_velocities[1].any()


TOML = """
level = "field"
name = "mine"
[differs]
friction = 0.7
mass = [1, 2]
[camera]
delay_ms = [40, 40]
missing_run = [2, 3]
"""


def test_a_file_changes_a_level(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(TOML, encoding="utf-8")
    spec = load_disturbance(str(file))
    differs = replace(FIELD.differs, friction=(0.7, 0.7), mass=(1.0, 2.0))
    camera = replace(FIELD.camera, delay_ms=(40.0, 40.0), missing_run=(2, 3))
    assert spec == replace(FIELD, name="mine", differs=differs, camera=camera)
    assert load_disturbance(str(file)) is spec  # read once
    file.write_text(TOML.replace("0.7", "0.75"), encoding="utf-8")
    assert load_disturbance(str(file)) == replace(spec, differs=replace(differs, friction=(0.75, 0.75)))
    assert load_disturbance("none") is None
    assert load_disturbance("hard") is HARD


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[differs]\nfricton = 0.7", "unknown quantity 'fricton' in [differs]; did you mean friction?"),
        ("[diffrs]\nfriction = 0.7", "unknown table 'diffrs'; did you mean differs?"),
        ("friction = 0.7", "unknown table 'friction'; friction belongs in the table [differs]"),
        ("[differs]\nfriction = -0.7", "friction is [-0.7, -0.7]; it must be [lowest, highest], both above 0"),
        ("[differs]\nmass = [2, 1]", "mass is [2, 1]; it must be [lowest, highest]"),
        ("[differs]\nmass = [1, inf]", "mass is [1, inf]"),
        ("[camera]\nnoise_mm = nan", "noise_mm is nan; it must be a finite number"),
        ("[camera]\nnoise_mm = -1", "noise_mm is -1; it must be 0 or more"),
        ("[camera]\ndelay_ms = 9000", "a delay is from 0 to 500 ms"),
        ("[commands]\ndelay_ms = [-5, 5]", "a delay is from 0 to 500 ms"),
        ("[camera]\nmissing = 1", "missing is 1; it must be a share below 1"),
        ("[camera]\nmissing_run = [0, 2]", "missing_run is [0, 2]"),
        ("[camera]\nrate_hz = 1e9", "rate_hz is 1e+09"),
        ("level = 'fild'", "unknown disturbance 'fild'; did you mean field?"),
        ("[camera]\nrate_hz = 'fast'", "rate_hz is 'fast'; it must be a number"),
        ("camera = 3", "camera is 3; it must be a table"),
        ("[camera", "is not a TOML file"),
    ],
)
def test_what_cannot_be_drawn_is_refused(text: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_disturbance(str(file))
    assert told in str(error.value)
    assert "own.toml" in str(error.value)


def test_a_disturbance_that_is_not_there_is_refused_before_anything_runs(inhand: Call, tmp_path: Path) -> None:
    for command in ("asterisk", "trace", "sweep", "evaluate"):
        code, _, told = inhand(command, "--disturb", "feild", "--out", tmp_path / "out")
        assert code == 2
        assert "unknown disturbance 'feild'; did you mean field?" in told
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="no disturbance file"):
        load_disturbance(str(tmp_path / "none.toml"))
