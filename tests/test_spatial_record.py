"""Demonstrations with a hand in space: recorded, stopped and gone on with, read back, learned from, refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("minari", reason="the extra `rl` is not installed")

import inhand
from commands import Call
from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.learning import demonstrations, record, setup, space_pools
from inhand.learning.commands import RecordConfig
from inhand.learning.config import Training
from inhand.learning.dataset import Dataset, load_dataset
from inhand.learning.dataset_cards import CONTINUOUS
from inhand.learning.datasets import (
    DatasetEpisode,
    add_to,
    begin_dataset,
    end_dataset,
    go_on_with,
    read_dataset,
    write_dataset,
)
from inhand.learning.half_recorded import STOPPED, go_on
from inhand.learning.presets import privileged_spatial, spatial
from inhand.learning.progress import EXPERT
from inhand.learning.recipe import SEEN, SpatialRecording
from inhand.learning.record import environment_spec, head_of, recording_of, run_record
from inhand.learning.run_cards import check
from inhand.learning.setup import make_ready
from inhand.learning.space_pools import Planned, pool_of
from inhand.learning.starts import Starts
from inhand.learning.travel import export_run, import_demonstrations
from test_spatial_learning import ASKED, PLAIN, PULLS, in_space

PAIR = ("3f_60.60_40_10", "cube_50")
FEW = RecordConfig(hand=PAIR[0], object=PAIR[1], episodes=9, horizon=12, expert="teacher", midway=0.5, seed=3)
"""A quarter of a second each, of plain grips that need no search."""
PLANS = Planned(ASKED, ((PLAIN,),) * len(ASKED), PULLS)


@pytest.fixture(scope="module", autouse=True)
def small() -> Iterator[None]:
    """Plan nothing, and record a few episodes side by side."""
    with pytest.MonkeyPatch.context() as patch:
        for room in (record, space_pools):
            patch.setattr(room, "planned", lambda *_: PLANS)
        for room in (demonstrations, setup):
            patch.setattr(room, "BATCH", 4)
        patch.setattr(demonstrations, "EARLIEST", 4)
        yield


@pytest.fixture(scope="module")
def found(small: None, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Return a small dataset."""
    del small
    return run_record(replace(FEW, out=tmp_path_factory.mktemp("space") / "set"))


def stopped(what: str, done: int, _total: int) -> None:
    """Stop a recording once some of it is there."""
    if what.startswith("recording") and done:
        raise KeyboardInterrupt


def assert_same(one: Path, other: Path) -> None:
    both = [list(read_dataset(folder)[1]) for folder in (one, other)]
    for left, right in zip(*both, strict=True):
        for name in DatasetEpisode.__dataclass_fields__:
            a, b = (np.asarray(getattr(each, name)) for each in (left, right))
            assert (a.dtype, a.tobytes()) == (b.dtype, b.tobytes()), name


def test_what_was_recorded_is_read_back(found: Dataset) -> None:
    head, episodes = read_dataset(found.folder)
    assert (head.kind.hand.name, head.object.name, head.expert) == (*PAIR, "teacher")
    assert (head.engine, head.directions, head.kind.horizon) == ("mujoco", "all,turns", 12)
    read, again = list(episodes), load_dataset(found.folder)
    assert len(read) == len(again.lost) == 9
    assert found.space is not None
    for k, each in enumerate(read):
        assert each.observations.shape == (len(each.rewards) + 1, 171)
        assert each.start.shape == (7,)
        assert np.linalg.norm(each.gravity if each.gravity is not None else 0) == pytest.approx(9.81)
        for name in ("along", "about", "gravity"):
            np.testing.assert_array_equal(getattr(each, name), getattr(found.space, name)[k])
    table = again.table()
    turns = table["direction"].str.startswith("turn").to_numpy()
    np.testing.assert_allclose(table["distance_mm"][~turns], 1e3 * again.distance[~turns])
    np.testing.assert_allclose(table["planned_deg"][turns], np.rad2deg(again.planned[turns] / TURN_ARM))
    assert again.summary()["episodes"]["all"] == 9
    assert len(again.figure().axes) == 4


def test_one_that_was_stopped_goes_on_as_if_it_had_not_been(found: Dataset, tmp_path: Path) -> None:
    config, part = replace(FEW, out=tmp_path / "set"), tmp_path / "set.part"
    with pytest.raises(KeyboardInterrupt):
        run_record(config, stopped)
    assert (part / STOPPED).is_file()
    with pytest.raises(InputError, match="not finished"):
        inhand.load(tmp_path / "set")
    told: list[int] = []
    again = run_record(config, lambda what, now, _total: told.append(now) if "recording" in what else None)
    assert told[0] > 0
    assert [each.name for each in tmp_path.iterdir()] == ["set"]
    assert not (again.folder / STOPPED).exists()
    assert_same(found.folder, again.folder)
    np.testing.assert_array_equal(again.planned, found.planned)


def test_a_recording_of_other_settings_or_one_that_cannot_be_read_begins_anew(tmp_path: Path) -> None:
    config, part = replace(FEW, out=tmp_path / "set"), tmp_path / "set.part"
    with pytest.raises(KeyboardInterrupt):
        run_record(config, stopped)
    head, whole = head_of(recording_of(config), "all,turns"), (part / STOPPED).read_bytes()
    for content in (whole, whole[:100], b""):
        (part / STOPPED).write_bytes(content)
        begun, storage = go_on(part, head, "other words", None)
        assert (len(begun.ends), begun.kept, storage.total_episodes) == (0, None, 0)
        assert not (part / STOPPED).exists()


def test_episodes_behind_those_that_count_are_cut_off(found: Dataset, tmp_path: Path) -> None:
    """A process that is killed while it writes leaves some of a batch."""
    episodes = list(found.episodes)
    add_to(begin_dataset(tmp_path, found.config), episodes[:5], found.config.kind)
    storage = go_on_with(tmp_path, found.config, 3)
    add_to(storage, episodes[3:], found.config.kind)
    end_dataset(tmp_path)
    assert_same(found.folder, tmp_path)
    (tmp_path / "data").rename(tmp_path / "data.part")
    with pytest.raises(InputError, match="cannot be read"):
        go_on_with(tmp_path, found.config, 10)


def test_demonstrations_in_space_travel(found: Dataset, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="the extra `lerobot` is not installed")
    assert export_run(found.folder, tmp_path / "there", "lerobot").count == 9
    assert import_demonstrations(tmp_path / "there", tmp_path / "back") == 9
    assert read_dataset(tmp_path / "back")[0] == found.config
    assert_same(found.folder, tmp_path / "back")


def small_training(folder: Path) -> Training:
    base = privileged_spatial()
    recipe = replace(base.recipe, episodes=8, midway=0.0)
    return replace(base, interface=replace(base.interface, horizon=12), recipe=recipe, demonstrations=str(folder))


def test_a_training_in_space_learns_from_a_dataset(
    found: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tests(recording: SpatialRecording, trials: int, _told: object) -> Starts:
        return pool_of(recording, PLANS, 4 * trials, np.random.default_rng(1))

    monkeypatch.setattr(space_pools, "tests_of", tests)
    config = small_training(found.folder)
    check(config)
    ready = make_ready(config, tmp_path, lambda *_: None)
    assert ready.expert_rows == sum(len(each.rewards) for each in found.episodes)
    rows = np.fromfile(tmp_path / EXPERT, np.float32).reshape(-1, ready.columns.width)
    seen = np.concatenate([each.observations[:-1] for each in found.episodes])
    np.testing.assert_array_equal(rows[: len(seen), : ready.columns.d], seen)
    assert len(ready.starts[0]) <= 4


def test_datasets_that_cannot_be_learned_from_are_refused(found: Dataset, tmp_path: Path) -> None:
    config = small_training(found.folder)
    with pytest.raises(InputError, match=r"horizon: 12 there, 180 here"):
        check(replace(config, interface=privileged_spatial().interface))
    with pytest.raises(InputError, match=r"critics that see the truth, which no dataset holds: .* spatial-privileged"):
        check(replace(spatial(), demonstrations=str(found.folder)))
    with pytest.raises(InputError, match=r"hand: 3f_60.60_40_10 there, 2v2"):
        check(Training("mine", demonstrations=str(found.folder)))
    recording = recording_of(FEW)
    for name, directions, gravity, told in (
        ("one", "Out,0:1:2", "sphere", "shows 0:1:2, which evaluations count as unseen"),
        ("two", CONTINUOUS, "1,1,0.9", "shows gravity 1,1,0.9, which evaluations count"),
    ):
        write_dataset(tmp_path / name, (), head_of(recording, directions, gravity))
        with pytest.raises(InputError, match=told):
            check(replace(config, demonstrations=str(tmp_path / name)))


def test_the_expert_demonstrates_too_under_the_gravity_that_is_asked_for() -> None:
    config = replace(FEW, expert="ik", gravity="down", push=0.0, whole=0.5, directions="Out,turn+z", horizon=40)
    recording = recording_of(config)
    assert isinstance(recording, SpatialRecording)
    assert [each.name for each in recording.primitives] == ["Out", "turn+z"]
    plans = replace(PLANS, gravity=np.tile(recording.gravity or (), (len(ASKED), 1)))
    pool = pool_of(recording, plans, 5, np.random.default_rng(11))
    np.testing.assert_allclose(pool.asked_in_space.gravity, np.tile([0.0, 0.0, 9.81], (len(pool), 1)))
    pool = replace(pool, distance=np.full(len(pool), 0.006))
    shown = demonstrations.recorded(recording, pool, np.random.default_rng(12))
    assert not shown.terminated.any()
    np.testing.assert_allclose(shown.distance, 0.006, atol=2e-3)
    np.testing.assert_array_equal(shown.actions, shown.wanted)


def test_what_is_asked_for_by_words() -> None:
    recording = recording_of(replace(FEW, directions=CONTINUOUS))
    assert isinstance(recording, SpatialRecording)
    assert (recording.primitives, recording.drawn, recording.gravity) == (SEEN, 96, None)
    trained = in_space(privileged_spatial())
    assert (trained.primitives, trained.drawn, trained.gravity) == (SEEN, 96, None)
    spec = environment_spec(recording, replace(FEW, directions=CONTINUOUS)) or ""
    for text in ('"id": "inhand/SpatialAsterisk-v0"', '"directions": "all,turns"', '"gravity": "sphere"'):
        assert text in spec
    assert environment_spec(recording_of(replace(FEW, disturb="field")), FEW) is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--expert", "thesis-ik"), "--expert thesis-ik with 3f_60.60_40_10, a hand in space: take ik or teacher"),
        (("--observation", "grip"), "--observation grip with 3f_60.60_40_10, a hand in space: take space, space-sens"),
        (("--gravity", "0,0,0"), "gravity '0,0,0' has no length"),
        (("--gravity", "sidewards"), "gravity 'sidewards'; did you mean sideways"),
        (("--directions", "Up@+x@15"), "Up@+x@15 hold a rotation: an episode moves an object or turns it"),
        (("--directions", "Outt"), "unknown direction 'Outt'"),
        (("--engine", "bullet"), "engine 'bullet' with a hand in space"),
        (("--horizon", 0), "--horizon 0: give at least 1"),
        (("--hand", "2v2_50.50_50.50_1.1_53", "--object", "cube_39", "--gravity", "up"), "--gravity up with 2v2"),
        (("--hand", "2v2_50.50_50.50_1.1_53", "--object", "cube_39", "--observation", "space"), "a hand in the plane"),
    ],
)
def test_what_cannot_be_recorded_in_space_is_refused(
    tmp_path: Path, inhand: Call, words: tuple[object, ...], told: str
) -> None:
    pair = ("--hand", PAIR[0], "--object", PAIR[1])
    code, _, err = inhand("record", *pair, *words, "--out", tmp_path / "deep" / "set")
    assert (code, told in err) == (2, True), err
    assert list(tmp_path.iterdir()) == []
