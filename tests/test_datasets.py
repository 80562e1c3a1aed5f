"""Demonstrations as Minari datasets: written, read back by us and by Minari, refused where they do not fit."""

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.learning import datasets
from inhand.learning.commands import RecordConfig
from inhand.learning.dataset_cards import check_fits, kind_of
from inhand.learning.datasets import DATA, METADATA, DatasetEpisode, read_dataset, read_head, write_dataset
from inhand.learning.demonstrations import demonstrations, plans_of
from inhand.learning.minari_files import new_storage
from inhand.learning.recipe import Recipe, Recording
from inhand.learning.record import environment_spec, head_of
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
GRIP, THESIS = Interface("grip", "steps", "progress", 30), Interface("thesis", "angles", "thesis", 25)
RECORDING = Recording(
    HAND,
    parse_object_name("cube_39"),
    (0.0, 90.0),
    Recipe(episodes=6, push=0.05, midway=0.0, grasp="rough"),
    GRIP,
    Noise(),
    seed=3,
)
HEAD = head_of(RECORDING, "Right,Out")
WORLD = RECORDING.object, RECORDING.engine, GRIP.reward


MISSING = "the extra `rl` is not installed"


@pytest.fixture
def minari() -> None:
    """Skip where nothing can be written."""
    pytest.importorskip("minari", reason=MISSING)


def made_up(count: int) -> list[DatasetEpisode]:
    """Episodes of different lengths, every other one lost."""
    rng = np.random.default_rng(7)
    every = []
    for number in range(count):
        steps = int(rng.integers(1, 9))
        observations = rng.uniform(-1, 1, (steps + 1, HEAD.kind.size)).astype(np.float32)
        actions, wanted = rng.uniform(-1, 1, (2, steps, HAND.n_joints)).astype(np.float32)
        ends = (number % 2 == 1, number % 2 == 0, 45.0 * number, 0.01 * number, 0.1)
        every.append(DatasetEpisode(observations, actions, wanted, rng.normal(size=steps), *ends, rng.normal(size=3)))
    return every


def assert_same(found: DatasetEpisode, expected: DatasetEpisode) -> None:
    for name in DatasetEpisode.__dataclass_fields__:
        one, other = getattr(found, name), getattr(expected, name)
        np.testing.assert_array_equal(one, other, err_msg=name)
        assert np.asarray(one).dtype == np.asarray(other).dtype, name


@pytest.mark.usefixtures("minari")
def test_what_is_written_is_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(datasets, "BLOCK", 3)
    written = made_up(8)
    write_dataset(tmp_path / "set", iter(written), HEAD)
    head, episodes = read_dataset(tmp_path / "set")
    assert head == HEAD == read_head(tmp_path / "set")
    read = list(episodes)
    assert len(read) == 8
    for found, expected in zip(read, written, strict=True):
        assert_same(found, expected)
    assert [each.name for each in (tmp_path / "set").iterdir()] == [DATA]


def test_the_file_is_as_minari_writes_it(tmp_path: Path) -> None:
    """Group by group, in their order, with their attributes, types, pieces and room to grow."""
    pytest.importorskip("minari", reason=MISSING)
    import h5py
    from minari.data_collector.episode_buffer import EpisodeBuffer

    written = made_up(3)
    write_dataset(tmp_path / "ours", written, HEAD)
    (tmp_path / "theirs").mkdir()
    storage = new_storage(tmp_path / "theirs", (HEAD.kind.size, HAND.n_joints))
    for each in written:
        last = np.arange(len(each.rewards)) == len(each.rewards) - 1
        arrays = {name: getattr(each, name) for name in ("observations", "actions", "rewards")}
        ends = {"terminations": last & each.terminated, "truncations": last & each.truncated}
        storage.update_episodes([EpisodeBuffer(**arrays, **ends, infos={"wanted": each.wanted})])
    storage.update_episode_metadata([{name: getattr(each, name) for name in datasets.ABOUT} for each in written])
    found = []
    for folder in (tmp_path / "ours" / DATA, tmp_path / "theirs"):
        told: list[Any] = []

        def tell(name: str, each: h5py.Group | h5py.Dataset, told: list[Any] = told) -> None:
            told.append(
                (name, {key: (np.asarray(value).dtype, list(np.ravel(value))) for key, value in each.attrs.items()})
            )
            if isinstance(each, h5py.Dataset):
                told.append((each.dtype, each.maxshape, each[()].tolist()))

        with h5py.File(folder / "main_data.hdf5") as file:
            told.append(list(file))
            file.visititems(tell)
        found.append(told)
        assert json.loads((folder / METADATA).read_text())["total_steps"] == sum(len(each.rewards) for each in written)
    assert found[0] == found[1]


def test_minari_loads_it_by_id_and_by_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari", reason=MISSING)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert HEAD.dataset_id == "inhand/cube_39/ik-v0"
    written = made_up(3)
    folder = tmp_path / HEAD.dataset_id
    write_dataset(folder, written, HEAD, environment_spec(RECORDING, RecordConfig(directions="Right,Out")))
    assert list(minari.list_local_datasets()) == [HEAD.dataset_id]
    for dataset in (minari.load_dataset(HEAD.dataset_id), minari.MinariDataset(folder / DATA)):
        assert (dataset.id, len(dataset)) == (HEAD.dataset_id, 3)
        assert dataset.total_steps == sum(len(each.rewards) for each in written)
        assert dataset.observation_space.shape == (31,)
        assert dataset.action_space.shape == (4,)
        for found, expected in zip(dataset, written, strict=True):
            np.testing.assert_array_equal(found.observations, expected.observations)
            np.testing.assert_array_equal(found.actions, expected.actions)
            np.testing.assert_array_equal(found.infos["wanted"], expected.wanted)
            assert dataset.observation_space.contains(found.observations[0])
            assert dataset.action_space.contains(found.actions[0])
            assert found.terminations[-1] == expected.terminated
            assert found.truncations[-1] == expected.truncated
            assert not found.terminations[:-1].any()
    spec = dataset.env_spec
    assert (spec.id, spec.kwargs["observation"], spec.kwargs["directions"]) == (
        "inhand/Asterisk-v0",
        "grip",
        "Right,Out",
    )
    metadata = dataset.storage.metadata
    assert (metadata["algorithm_name"], metadata["inhand"]["head"]["kind"]["actions"]) == ("ik", "steps")


@pytest.mark.usefixtures("minari")
def test_recorded_episodes_keep_their_valid_decisions_alone(tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []

    def note(what: str, done: int, total: int) -> None:
        told.append((what, done, total))

    (batch,) = demonstrations(RECORDING, plans_of(RECORDING, told=note), np.random.default_rng(3), note)
    lost = f", {batch.terminated.sum()} lost" if batch.terminated.any() else ""
    assert told == [
        ("planning grasps", 0, 2), ("recording demonstrations", 0, 6), (f"recording demonstrations{lost}", 6, 6),
    ]  # fmt: skip
    write_dataset(tmp_path, batch.apart(), HEAD)
    episodes = list(read_dataset(tmp_path)[1])
    for world, episode in enumerate(episodes):
        steps = int(batch.valid[:, world].sum())
        assert len(episode.rewards) == steps <= GRIP.horizon
        assert episode.terminated == batch.terminated[world] != episode.truncated
        assert episode.truncated == (steps == GRIP.horizon)
        np.testing.assert_array_equal(episode.rewards, batch.rewards[:steps, world])
        np.testing.assert_allclose(episode.observations, batch.observations[: steps + 1, world], atol=1e-7)
        np.testing.assert_allclose(episode.actions, batch.actions[:steps, world], atol=1e-7)
        np.testing.assert_allclose(episode.wanted, batch.wanted[:steps, world], atol=1e-7)
        assert (episode.distance, episode.angle_deg) == (batch.distance[world], batch.angle_deg[world])
        np.testing.assert_array_equal(episode.start, batch.starts.state.pose[world])
    assert sum(len(each.rewards) for each in episodes) == batch.valid.sum()


@pytest.mark.usefixtures("minari")
def test_a_recording_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def stopped() -> Iterator[DatasetEpisode]:
        yield from made_up(2)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_dataset(tmp_path / "set", stopped(), HEAD)
    assert list((tmp_path / "set").iterdir()) == []
    write_dataset(tmp_path / "set", made_up(1), HEAD)
    with pytest.raises(InputError, match="holds a dataset; give another folder, or remove it first"):
        write_dataset(tmp_path / "set", made_up(1), HEAD)


@pytest.mark.usefixtures("minari")
def test_what_is_no_dataset_of_ours_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no dataset in .*: give the folder that `inhand record` wrote"):
        read_dataset(tmp_path)
    write_dataset(tmp_path, made_up(2), HEAD)
    path = tmp_path / DATA / datasets.METADATA
    good = json.loads(path.read_text())
    path.write_text(json.dumps(good | {"inhand": good["inhand"] | {"format": 9}}))
    with pytest.raises(
        InputError, match=r"it has format 9; this version reads 2, which has the scales of .*; record it again"
    ):
        read_dataset(tmp_path)
    path.write_text(json.dumps({key: value for key, value in good.items() if key != "inhand"}))
    with pytest.raises(InputError, match="is no dataset of `inhand record`: it is None; it must be a table"):
        read_dataset(tmp_path)
    for name, held, text in (
        ("total_episodes", None, "total_episodes is None; it must be a whole number"),
        ("total_episodes", -1, "total_episodes is -1; it must be a whole number up to"),
        ("observation_space", None, r"observation_space is None; it must be \{"),
        ("data_format", "arrow", "data_format is 'arrow'; it must be hdf5"),
    ):
        path.write_text(json.dumps(good | {name: held}))
        with pytest.raises(InputError, match=rf"the episodes in .* cannot be read: {text}.*; record them again"):
            read_dataset(tmp_path)
    path.write_text(json.dumps(good | {"author": None}))
    with pytest.raises(InputError, match=r"the episodes in .* cannot be read: .*; record them again"):
        list(read_dataset(tmp_path)[1])
    path.write_text(json.dumps(good))
    (tmp_path / DATA / "main_data.hdf5").write_bytes(b"not HDF5")
    with pytest.raises(InputError, match=r"the episodes in .* cannot be read: .*; record them again"):
        list(read_dataset(tmp_path)[1])


@pytest.mark.usefixtures("minari")
@pytest.mark.parametrize(
    ("name", "array", "text"),
    [
        ("rewards", np.zeros(99), "observations has the shape"),
        ("actions", np.full((1, 4), np.nan), "actions holds float64, not finite throughout"),
        ("infos/wanted", np.zeros(3, dtype=int), "wanted holds int64"),
    ],
)
def test_episodes_that_cannot_be_are_refused(name: str, array: NDArray[Any], text: str, tmp_path: Path) -> None:
    import h5py

    write_dataset(tmp_path, made_up(2), HEAD)
    with h5py.File(tmp_path / DATA / "main_data.hdf5", "a") as file:
        del file["episode_1"][name]
        file["episode_1"][name] = array
    with pytest.raises(InputError, match=f"cannot be read: {text}"):
        list(read_dataset(tmp_path)[1])


@pytest.mark.usefixtures("minari")
def test_a_folder_may_be_seen_from_where_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_dataset(Path("set"), made_up(1), HEAD)
    assert len(list(read_dataset(Path("set"))[1])) == 1


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    for call in (lambda: read_dataset(tmp_path), lambda: write_dataset(tmp_path, [], HEAD)):
        with pytest.raises(InputError, match=r"a dataset needs the extra `rl`: pip install 'inhand\[rl\]'"):
            call()


def test_a_dataset_of_another_kind_is_refused_part_by_part() -> None:
    check_fits(HEAD, kind_of(HAND, GRIP), WORLD)
    with pytest.raises(InputError) as error:
        check_fits(HEAD, kind_of(parse_hand_name("2v2_65.35_65.35_1.1_53"), THESIS), WORLD)
    lines = str(error.value).splitlines()
    assert lines[0] == (
        "dataset inhand/cube_39/ik-v0 is of another kind than what is to learn from it: record one with the settings"
        " here, or learn with those there"
    )
    assert [line.strip() for line in lines[1:4]] == [
        "hand: 2v2_50.50_50.50_1.1_53 there, 2v2_65.35_65.35_1.1_53 here",
        "actions: steps there, angles here",
        "horizon: 30 there, 25 here",
    ]
    assert [line.strip() for line in (lines[4], lines[5], lines[-1])] == [
        "layout: grip-1 there, thesis-1 here",
        "direction, unit vector: there alone",
        "end of each link x, y [m]: here alone",
    ]


def test_one_changed_part_alone_is_named() -> None:
    kind = kind_of(HAND, GRIP)
    *parts, last = kind.interface.parts
    with pytest.raises(InputError) as error:
        check_fits(
            HEAD, replace(kind, interface=replace(kind.interface, parts=(*parts, replace(last, scale=(0.006,))))), WORLD
        )
    assert [line.strip() for line in str(error.value).splitlines()[1:]] == [
        "gaps of the fingers [m]: scale 0.005 there, 0.006 here"
    ]
    with pytest.raises(InputError, match=f"hand: {HAND.name} there, {HAND.name} of other measures here$"):
        check_fits(HEAD, replace(kind, hand=replace(HAND, friction=0.4)), WORLD)
    other = replace(WORLD[0], friction=0.1)
    with pytest.raises(InputError) as error:
        check_fits(HEAD, kind, (other, "bullet", "thesis"))
    assert [line.strip() for line in str(error.value).splitlines()[1:]] == [
        "object: cube_39 there, cube_39 of other measures here",
        "engine: planar there, bullet here",
        "reward: progress there, thesis here",
    ]


def test_an_id_has_only_what_minari_takes() -> None:
    strange = replace(HEAD, object=replace(HEAD.object, name="my cube.v2"), expert="ik-cautious")
    assert strange.dataset_id == "inhand/my_cube_v2/ik-cautious-v0"
