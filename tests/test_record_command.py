"""`inhand record`, end to end and where it refuses."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import inhand as front
from commands import Call
from inhand.cli.record import rows_of
from inhand.errors import InputError
from inhand.learning.commands import RecordConfig
from inhand.learning.dataset import Dataset
from inhand.learning.dataset_cards import CONTINUOUS
from inhand.learning.datasets import MARK, read_dataset, read_head
from inhand.learning.recipe import Recording
from inhand.learning.record import head_of, recording_of

FEW = ("--episodes", 5, "--horizon", 25, "--midway", 0, "--seed", 2)


@pytest.fixture
def inhand_record(inhand: Call) -> Call:
    """Return the command, skipped where it cannot record."""
    pytest.importorskip("minari", reason="the extra `rl` is not installed")
    return lambda *words: inhand("record", *words)


def test_a_few_episodes_become_a_dataset(tmp_path: Path, inhand_record: Call) -> None:
    words = (
        *FEW,
        "--directions",
        "Right,Out",
        "--expert",
        "thesis-ik",
        "--observation",
        "thesis",
        "--actions",
        "angles",
    )
    code, out, err = inhand_record(*words, "--reward", "thesis", "--push", 0, "--out", tmp_path / "set")
    assert (code, err) == (0, "")
    for text in ("thesis-ik on cube_39", "Distance [mm]", "Of the plan", "Right", "Out", "all"):
        assert text in out
    assert ": 5 of 5" in out
    assert f"Dataset inhand/cube_39/thesis-ik-v0: {tmp_path / 'set'}" in out
    head, episodes = read_dataset(tmp_path / "set")
    assert (head.kind.interface.layout, head.kind.actions, head.kind.horizon) == ("thesis-1", "angles", 25)
    assert (head.grasp, head.directions, head.push, head.seed) == ("rough", "Right,Out", 0.0, 2)
    read = list(episodes)
    assert len(read) == 5
    found = front.load(tmp_path / "set")
    assert isinstance(found, Dataset)
    assert list(found.table()["distance_mm"]) == pytest.approx([1e3 * each.distance for each in read])
    assert [each.angle_deg for each in found.episodes] == list(found.angle_deg)
    assert found._repr_png_().startswith(b"\x89PNG")
    assert {each.angle_deg for each in read} <= {0.0, 90.0}
    for each in read:
        np.testing.assert_array_equal(each.actions, each.wanted)
    assert [each.name for each in tmp_path.iterdir()] == ["set"]


def test_the_witness_demonstrates(tmp_path: Path, inhand_record: Call) -> None:
    pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    words = ("--engine", "bullet", "--expert", "thesis-ik", "--directions", "Right", "--midway", 0)
    code, _, err = inhand_record(*words, "--episodes", 2, "--horizon", 3, "--out", tmp_path / "set")
    assert (code, err) == (0, "")
    head, episodes = read_dataset(tmp_path / "set")
    assert head.engine == "bullet"
    assert [len(each.rewards) for each in episodes] == [3, 3]


def test_equal_seeds_give_equal_bytes_and_a_dataset_is_kept(tmp_path: Path, inhand_record: Call) -> None:
    words = (*FEW, "--directions", "continuous", "--expert", "thesis-ik")
    for name in ("one", "two"):
        code, out, _ = inhand_record(*words, "--out", tmp_path / name)
        assert code == 0
        assert "+-22.5" in out
    first, second = (list(read_dataset(tmp_path / name)[1]) for name in ("one", "two"))
    for one, other in zip(first, second, strict=True):
        assert one.observations.tobytes() == other.observations.tobytes()
        assert one.actions.tobytes() == other.actions.tobytes()
    before = (tmp_path / "one" / MARK).read_bytes()
    code, _, err = inhand_record(*words, "--out", tmp_path / "one")
    assert (code, "give another folder, or --overwrite" in err) == (2, True)
    assert (tmp_path / "one" / MARK).read_bytes() == before
    assert inhand_record(*words, "--seed", 5, "--out", tmp_path / "one", "--overwrite")[0] == 0
    assert read_head(tmp_path / "one").seed == 5


def test_a_hand_from_a_file_is_told_by_its_name(
    tmp_path: Path, inhand_record: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(
        "name = 'wide'\npalm_width_mm = 60\nleft.links_mm = [72, 72]\nright.links_mm = [72, 72]\n"
    )
    words = ("--hand", "mine.toml", "--episodes", 1, "--horizon", 2, "--directions", "Right", "--midway", 0)
    code, out, err = inhand_record(*words, "--expert", "thesis-ik", "--out", "set")
    assert (code, err) == (0, "")
    assert "thesis-ik on cube_39, wide: 1 episode" in out
    assert "1 episodes" not in out


def test_ctrl_c_keeps_nothing_and_says_so(tmp_path: Path, inhand_record: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("inhand.learning.record.demonstrations", stopped)
    code, out, err = inhand_record(*FEW, "--out", tmp_path / "set")
    assert code == 130
    assert "Stopped after 0 episodes; nothing is kept" in out
    assert "nothing was overwritten" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--episodes", 0), "--episodes 0: give at least 1"),
        (("--episodes", 2000000), "they would take about 180 GB of disk and 3 hours of two cores; at most 100000"),
        (("--push", -1), "--push -1: give 0 or more"),
        (("--noise-mm", "nan"), "--noise-mm is nan; it must be a finite number"),
        (("--midway", 1.5), "--midway 1.5: a share is from 0 to 1"),
        (("--observation", "gripp"), "unknown observation 'gripp'; did you mean grip"),
        (("--observation", "joints"), "--observation joints has slots for joints that a hand has not"),
        (("--reward", "progres"), "unknown reward 'progres'; did you mean progress?"),
        (("--directions", "Outt"), "unknown direction 'Outt'"),
        (("--directions", "cw"), "cw only rotates and has no direction"),
        (("--object", "cube_300"), "object 'cube_300' is 300.0 mm wide"),
    ],
)
def test_what_cannot_be_recorded_is_refused_before_anything_is_written(
    tmp_path: Path, inhand_record: Call, words: tuple[object, ...], told: str
) -> None:
    code, _, err = inhand_record(*words, "--out", tmp_path / "deep" / "set")
    assert code == 2
    assert told in err
    assert list(tmp_path.iterdir()) == []


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from inhand.cli.record import run_record

    monkeypatch.setitem(sys.modules, "minari", None)
    with pytest.raises(InputError, match=r"`inhand record` needs the extra `rl`: pip install 'inhand\[rl\]'"):
        run_record(RecordConfig())


def test_a_named_or_continuous_recording_plans_the_grid_it_needs() -> None:
    asked = RecordConfig(), RecordConfig(directions="continuous"), RecordConfig(grip_spread=10.0)
    grids = [found.grid for each in asked if isinstance(found := recording_of(each), Recording)]
    assert grids[0] == tuple(45.0 * k for k in range(8))
    assert [len(grid) for grid in grids[1:]] == [48, 48]


def test_the_table_counts_by_direction_or_sector() -> None:
    found = Dataset(
        head_of(recording_of(RecordConfig()), CONTINUOUS),
        Path("nowhere"),
        np.array([90.0, 90.0, 70.0, -160.0]),
        np.array([False, True, False, False]),
        np.array([0.06, 0.02, 0.05, 0.04]),
        np.array([0.06, 0.04, 0.1, 0.0]),
    )
    assert rows_of(found) == [
        ("Out +-22.5", "3", "1", "43.3", "0.667"),
        ("Left +-22.5", "1", "0", "40.0", "-"),
        ("all", "4", "1", "42.5", "0.667"),
    ]
    named = rows_of(replace(found, config=replace(found.config, directions="90 70 -160")))
    assert [row[0] for row in named] == ["Out", "-160 deg", "70 deg", "all"]
    assert named[0][1:] == ("2", "1", "40.0", "0.750")
    assert list(found.table()["direction"]) == ["Out", "Out", "70 deg", "-160 deg"]
