"""Disturbed runs: trials that can be run again alone, controllers that read what is sensed, environments, reports."""

import json
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

import inhand
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.run import Setup, prepare, simulate
from inhand.control.catalogue import CONTROLLERS
from inhand.control.controller import Task
from inhand.control.episode import SHAPES
from inhand.control.seen import NotSensedError, Seen
from inhand.control.trial import Trial, load_trial, save_trial
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.learning.batch import Batch
from inhand.learning.environment_config import EnvironmentConfig
from inhand.learning.presets import smoke
from inhand.learning.replay_buffer import Columns
from inhand.sim.disturbance import DISTURBANCES, FIELD, Camera, Differences, Disturbance, Pushes, disturbance_of
from inhand.sim.drawn import truth
from inhand.sim.scene import SceneSpec
from test_simulator import CUBE, HAND

LEVEL = Disturbance("between", replace(FIELD.differs, mass=(0.8, 1.25)), FIELD.encoders, FIELD.camera, FIELD.commands)


class Holder:
    """Holds what it holds by what is sensed, and keeps what it saw."""

    reads = "sensed"
    grasp = "rough"
    saw: ClassVar[list[object]] = []

    def __init__(self, task: Task) -> None:
        """See nothing yet."""
        self._decisions = 0
        del task

    def begin(self, seen: Seen) -> None:
        """Begin with the commands as they are."""
        Holder.saw = [seen]
        self._targets = seen.targets

    def act(self, seen: Seen) -> Array:
        """Hold on."""
        Holder.saw.append(seen)
        self._decisions += 1
        return self._targets

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """End after five decisions."""
        return np.full(seen.n_worlds, self._decisions >= 5)


class Peeker(Holder):
    """Says that it reads what is sensed, and asks for gaps."""

    def act(self, seen: Seen) -> Array:
        """Ask for what no hand can know."""
        return super().act(seen) + 0.0 * seen.gaps.sum()


def same(one: Trial, other: Trial) -> None:
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert (one.outcome, one.passport) == (other.outcome, other.passport)


@pytest.fixture(scope="module")
def run() -> Run:
    """Two directions and trials, disturbed."""
    made = inhand.asterisk(directions="Out,Left", trials=2, disturb=LEVEL, engine="planar")
    assert isinstance(made, Run)
    return made


def test_a_disturbed_trial_can_be_run_again_alone(run: Run) -> None:
    setup = prepare(run.config)
    worlds = [trial.passport.disturbed for trial in run.trials]
    assert len({None if world is None else world.drawn.mass for world in worlds}) == 4
    part: Setup = replace(setup, assignments=setup.assignments[3:])
    same(simulate(run.config, part)[0], run.trials[3])


def test_a_trial_says_how_it_was_disturbed_and_what_its_controller_read(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Run, "write_report", lambda *_: None)
    trial, file = run.trials[1], tmp_path / "trial.npz"
    save_trial(trial, file)
    again = load_trial(file).passport
    assert again == trial.passport
    assert again.disturbed is not None
    assert (again.disturbed.spec, again.reads, again.disturb) == (LEVEL, "privileged", "between")
    assert again.object == CUBE  # what the controller was told
    table = run.table()
    assert set(table["disturb"]) == {"between"}
    assert set(table["reads"]) == {"privileged"}
    (note,) = [note for note in run.notes if note.startswith("Disturbed")]
    assert "differs.friction 0.6 to 1.6" in note
    assert "reads what is privileged" in note
    assert note in run.page()
    run.save(tmp_path / "run")
    told = json.loads((tmp_path / "run" / "metrics.json").read_text(encoding="utf-8"))
    assert told["reads"] == "privileged"
    assert told["disturbed"][1]["drawn"]["friction"] == pytest.approx(again.disturbed.drawn.friction)
    assert told["config"]["disturb"] == "between"


def test_phases_before_the_last_take_their_whole_time_and_pushes_come_in_the_last() -> None:
    calm, pushed = (
        inhand.asterisk(directions="Out", trials=1, disturb=Disturbance(name, pushes=Pushes(push, 20.0))).trials[0]
        for name, push in (("calm", 0.0), ("shoved", 3.0))
    )
    assert [int((calm.phase == number).sum()) for number in (0, 1)] == [26, 60]  # 0.5 s and the start; 1.2 s
    begin = calm.manipulation.start
    np.testing.assert_array_equal(calm.object_pose[:begin], pushed.object_pose[:begin])
    assert np.abs(calm.object_pose[begin : begin + 10] - pushed.object_pose[begin : begin + 10]).max() > 1e-5


def test_objects_start_beside_where_the_grasp_is_planned_for(run: Run) -> None:
    nominal = simulate(replace(run.config, disturb="none"), prepare(replace(run.config, disturb="none")))
    for disturbed, plain in zip(run.trials, nominal, strict=True):
        assert disturbed.passport.disturbed is not None
        away = disturbed.object_pose[0, :2] - plain.object_pose[0, :2]
        np.testing.assert_allclose(away, disturbed.passport.disturbed.drawn.start[:2], atol=1e-12)


@pytest.mark.parametrize("disturb", ["none", LEVEL], ids=["exact", "disturbed"])
def test_a_controller_that_reads_what_is_sensed_gets_no_more(disturb: str | Disturbance) -> None:
    done = inhand.asterisk(controller=Holder, directions="Out", trials=1, disturb=disturb, engine="planar")
    assert {type(seen) for seen in Holder.saw} == {Seen}
    assert set(done.table()["reads"]) == {"sensed"}
    with pytest.raises(NotSensedError, match="gaps is not sensed") as error:
        inhand.asterisk(controller=Peeker, directions="Out", trials=1, disturb=disturb, engine="planar")
    assert isinstance(error.value, InputError)
    assert isinstance(error.value, AttributeError)


def test_another_word_for_what_a_controller_reads_is_refused() -> None:
    class Odd(Holder):
        reads = "everything"

    with pytest.raises(InputError, match="reads = 'everything'"):
        CONTROLLERS.name_of(Odd)


def disturbed_batch(spec: Disturbance, starts: int = 8) -> Batch[EnvironmentConfig]:
    """Return six environments whose starts are disturbed."""
    config = EnvironmentConfig(
        observation="grip",
        actions="steps",
        reward="progress",
        horizon=12,
        directions=[0, 90],
        starts=starts,
        grasp="rough",
        engine="planar",
        threads=1,
        disturb=disturbance_of({"disturb": spec})["disturb"],
    )
    return Batch(config, 6, None)


def played(batch: Batch[EnvironmentConfig], seed: int, decisions: int = 30) -> list[Array]:
    """Return what is seen of some decisions."""
    seen, _ = batch.reset(np.random.default_rng(seed), None)
    found, actions = [seen], np.random.default_rng(1).uniform(-0.2, 0.2, (decisions, 6, 4))
    for action in actions:
        step = batch.step(action)
        found += [step.successor, step.seen, step.reward]
    return found


def test_environments_are_disturbed_and_a_seed_gives_the_same_bytes() -> None:
    batch = disturbed_batch(LEVEL)
    first, again, other = (played(batch, seed) for seed in (0, 0, 1))
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, two)
    assert any((one != two).any() for one, two in zip(first, other, strict=True))


def test_an_episode_runs_in_the_world_that_its_start_was_gripped_in() -> None:
    batch = disturbed_batch(Disturbance("masses", Differences(mass=(0.3, 3.0))))
    batch.reset(np.random.default_rng(3), None)
    pool = batch.config.pool()
    assert pool.disturbed is not None
    masses = [truth(each.drawn, HAND, CUBE, SceneSpec())[1].mass for each in pool.disturbed]
    assert len(set(masses)) == len(pool)
    for _ in range(15):
        batch.step(np.zeros((6, 4)))
        now = [spec.mass for spec in batch.worlds.simulator.objects]
        assert set(now) <= set(masses)
        begun = batch.worlds.aim.start  # tells the row of the pool that the episode began from
        rows = np.abs(pool.state.pose[:, None] - begun).sum(axis=-1).argmin(axis=0)
        assert now == [masses[row] for row in rows]


def test_an_environment_shows_what_is_seen_and_pays_for_what_is() -> None:
    exact_worlds, biased = (
        disturbed_batch(Disturbance("camera", camera=camera)) for camera in (Camera(), Camera(bias_mm=4.0))
    )
    for batch in (exact_worlds, biased):
        batch.reset(np.random.default_rng(0), None)
    for _ in range(3):
        one, two = (batch.step(np.full((6, 4), 0.05)) for batch in (exact_worlds, biased))
        np.testing.assert_array_equal(one.reward, two.reward)
        np.testing.assert_array_equal(one.after.object_pose, two.after.object_pose)
        away = biased.worlds.seen.pose[:, :2] - biased.worlds.state.pose[:, :2]
        np.testing.assert_allclose(np.linalg.norm(away, axis=-1), 4e-3, atol=1e-9)
        # The way is counted from where the object was seen, so that a bias is not a way.
        np.testing.assert_allclose(one.successor[:, 2:7], two.successor[:, 2:7], atol=1e-5)
        assert np.abs(one.successor - two.successor).max() > 0.01


def test_pushes_reach_the_objects_of_environments() -> None:
    calm, pushed = (disturbed_batch(Disturbance("pushed", pushes=Pushes(push, 20.0))) for push in (0.0, 3.0))
    for batch in (calm, pushed):
        batch.reset(np.random.default_rng(0), None)
    speeds = []
    for _ in range(10):
        one, two = (batch.step(np.zeros((6, 4))) for batch in (calm, pushed))
        speeds.append(np.linalg.norm(two.after.object_velocity - one.after.object_velocity, axis=-1))
    assert (np.max(speeds, axis=0) > 1e-3).sum() >= 3
    assert not speeds[0][np.max(speeds, axis=0) < 1e-3].any()


def test_disturbed_worlds_go_on_from_what_was_kept_byte_for_byte() -> None:
    batch, again = disturbed_batch(FIELD), disturbed_batch(FIELD)
    played(batch, 2, decisions=17)
    kept = batch.worlds.state_dict()
    again.worlds.load_state_dict(dict(kept))
    actions = np.random.default_rng(5).uniform(-0.2, 0.2, (20, 6, 4))
    for action in actions:
        one, two = batch.step(action), again.step(action)
        for name in ("seen", "successor", "reward", "terminated"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert batch.worlds.simulator.objects == again.worlds.simulator.objects


def test_demonstrations_are_recorded_in_disturbed_worlds_and_the_dataset_says_so(tmp_path: Path) -> None:
    pytest.importorskip("minari", reason="datasets need the extra `rl`")
    made = [
        inhand.record(directions=[0], episodes=4, expert="thesis-ik", horizon=30, out=tmp_path / name, disturb=disturb)
        for name, disturb in (("own", LEVEL), ("plain", "none"))
    ]
    found, plain = made
    assert (found.config.disturb, plain.config.disturb) == (LEVEL, None)
    seen, exact = (next(iter(each.episodes)).observations for each in made)
    assert np.abs(seen[0] - exact[0]).max() > 1e-3
    assert inhand.load(tmp_path / "own").config == found.config


def test_starts_of_a_training_are_kept_with_their_worlds(tmp_path: Path) -> None:
    from inhand.learning.setup import Ready, load_ready, save_ready

    config = replace(smoke(), engine="planar", disturb=DISTURBANCES.name_of(LEVEL))
    pool = disturbed_batch(LEVEL, starts=3).config.pool()
    held, numbers = config.recording.held, np.zeros(3)
    save_ready(Ready(held, Columns(31, 4), (pool,), (pool,), numbers, numbers, numbers, 7), tmp_path / "ready.npz")
    assert load_ready(config, tmp_path / "ready.npz").starts[0].disturbed == pool.disturbed
