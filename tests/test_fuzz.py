"""Bad input of every kind: told in a text, in time, and nothing left behind.

`make test` takes 20 tries of each kind, always the same; `make fuzz` takes 2,000 in all, other ones each time.
"""

from __future__ import annotations

import importlib.util
import io
import json
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save

import damage
from commands import Call
from inhand import folders
from inhand.asterisk_test import spread
from inhand.asterisk_test.config import AsteriskConfig, ReachCommand
from inhand.asterisk_test.people.human import read_human_file
from inhand.asterisk_test.results import result_of_human, result_of_trial
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.control.contract import contract_of
from inhand.control.policy import CARD, Policy, load_policy, save_policy
from inhand.control.policy_arrays import ACTOR
from inhand.control.trial import load_trial, save_trial
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.learning.commands import EvaluateConfig, RecordConfig, TrainConfig
from inhand.records import configured
from inhand.sim.disturbance import FIELD
from inhand.tasks.layouts import find_layout
from inhand.tracing.config import TraceConfig
from inhand.tracing.drawings import find_drawing
from test_robot_hands import EXAMPLES, gripper_mjcf
from test_spec_files import BLOCK, HAND
from test_trial import made_trial

RL = all(importlib.util.find_spec(name) is not None for name in ("jax", "minari", "gymnasium"))
LONGEST_S = 10
"""Nothing may be busy for longer without a word [s]."""
DEEP = settings.get_current_profile_name() == "fuzz"
"""Whether `make fuzz` asked."""
CUBE = {"name": "a", "shape": "polygon", "height_mm": 60, "corners_mm": [[0, 0], [40, 0], [40, 40], [20, 25], [0, 40]]}
PEOPLE = ("josh_2v2_a_n_1.csv", "filt_josh_2v2_a_n_1.csv", "2v2_a_n_josh_1.csv", "controllerhuman_2v2_a_n_1.csv")
"""Names of recordings, each of which means another unit."""
EPISODES = "main_data.hdf5"
"""Minari's file of a dataset's episodes."""
PATH = "x,y,rmag\n" + "".join(f"0.{k},{k}.5,0.{k}\n" for k in range(9)) + ",,\n1,9,1\n"
CAMERA = ",x,y,z,rmag,pitch,roll,yaw,tmag\n" + "".join(f"{k},0.00{k},0.0{k},0,{k},0,0,0,1\n" for k in range(9))
POINTS = "x_mm,y_mm,theta_deg\n0,0,0\n10,5,20\n-12.5,30,0\n"
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">
<g transform="translate(3 4) rotate(30)" style="fill: none; stroke: black">
<path d="M 0 0 L 10 0 C 12 3 14 5 20 5 A 5 3 20 0 1 30 8 q 1 2 3 4 h 3 v -2 z" class="a"/>
</g><g display="none"><rect x="1" y="2" width="10" height="5" rx="1"/></g>
</svg>"""
SHAPES = (
    """<svg><polyline points="0,0 10,5 20,0" style="transform: scale(2)"/><line x1="40" y1="0" x2="60" y2="9"/></svg>"""
)


@contextmanager
def in_time() -> Iterator[None]:
    """Stop what takes longer than `LONGEST_S`, where a signal can."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGALRM"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        pytest.fail(f"busy for {LONGEST_S} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(LONGEST_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


Try = Callable[[Callable[[st.SearchStrategy[Any]], Any], Path], Callable[[], object]]
"""Draws an input, puts it into a folder, and returns what reads it."""


def hands(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    (folder / "hand.toml").write_bytes(draw(damage.texts((HAND,))))
    return partial(load_hand, folder / "hand.toml")


def robots(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    toml, urdf = (EXAMPLES / f"gripper.{end}" for end in ("toml", "urdf"))
    table, robot = toml.read_text(), urdf.read_text()
    mjcf = draw(st.booleans())
    if mjcf:
        table, robot = table.replace("gripper.urdf", "gripper.xml"), gripper_mjcf(load_hand(toml))
    name = folder / f"gripper.{'xml' if mjcf else 'urdf'}"
    name.write_bytes(draw(damage.texts((robot,))))
    (folder / "hand.toml").write_bytes(table.encode() if draw(st.integers(0, 3)) else draw(damage.texts((table,))))
    return partial(load_hand, folder / "hand.toml")


def objects(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    polygon = "\n".join(f"{key} = {json.dumps(value)}" for key, value in CUBE.items())
    (folder / "object.toml").write_bytes(draw(damage.texts((BLOCK, polygon))))
    return partial(load_object, folder / "object.toml")


def drawings(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    csv = draw(st.booleans())
    path = folder / f"drawing.{'csv' if csv else 'svg'}"
    path.write_bytes(draw(damage.texts((POINTS,) if csv else (SVG, SHAPES))))
    return partial(find_drawing, str(path))


def recordings(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    path = folder / draw(st.sampled_from(PEOPLE))
    path.write_bytes(draw(damage.texts((PATH, CAMERA))))
    gaps = draw(st.sampled_from(("refuse", "drop", "fill")))
    return lambda: result_of_human(read_human_file(path, gaps), compatible=True)


def trials(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    arrays = dict(_trial())
    if draw(st.booleans()):
        head = draw(damage.tables(json.loads(str(arrays["head"]))))
        arrays["head"] = np.array(json.dumps(head))
    else:
        arrays = draw(damage.arrays(arrays))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    (folder / "trial.npz").write_bytes(draw(damage.files(buffer.getvalue())))
    return lambda: result_of_trial(load_trial(folder / "trial.npz"), compatible=True)


def policies(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    card, arrays = _policy()
    if draw(st.booleans()):
        card = draw(damage.tables(card))
    else:
        arrays = draw(damage.arrays(arrays))
    text = json.dumps(card).encode() if draw(st.integers(0, 3)) else draw(damage.texts((json.dumps(card),)))
    plain = {name: array for name, array in arrays.items() if array.dtype.kind in "fi?"}
    (folder / CARD).write_bytes(text)
    (folder / ACTOR).write_bytes(draw(damage.files(save(plain))))
    return partial(load_policy, folder)


@cache
def _trial() -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        save_trial(made_trial(), Path(folder, "trial.npz"))
        with np.load(Path(folder, "trial.npz")) as found:
            return dict(found)


@cache
def _policy() -> tuple[dict[str, Any], dict[str, Any]]:
    hand = load_hand("2v2_50.50_50.50_1.1_53")
    weights, contract = np.ones((find_layout("grip").size(hand), 4)), contract_of(hand, FIELD)
    policy = Policy((weights,), (np.zeros(4),), "grip", "steps", "planned", {"hand": "x"}, contract)
    with TemporaryDirectory() as folder:
        save_policy(policy, Path(folder))
        return json.loads(Path(folder, CARD).read_text()), load_file(Path(folder, ACTOR))


def datasets(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    import h5py

    from inhand.learning.datasets import read_dataset

    metadata, episodes = _dataset()
    place = folder / "data"
    place.mkdir()
    text = json.dumps(draw(damage.tables(metadata))) if draw(st.booleans()) else json.dumps(metadata)
    (place / "metadata.json").write_text(text)
    (place / EPISODES).write_bytes(draw(damage.files(episodes)))
    with suppress(OSError, RuntimeError, KeyError), h5py.File(place / EPISODES, "a") as file:
        group = file["episode_1"]
        names = ("observations", "actions", "rewards", "infos/wanted", "terminations")
        before = {name: group[name][()] for name in names}
        for name, array in draw(damage.arrays(before) if draw(st.booleans()) else st.just({})).items():
            del group[name]
            if array.dtype.kind != "U":  # which HDF5 has not
                group[name] = array
    return lambda: list(read_dataset(folder)[1])


@cache
def _dataset() -> tuple[dict[str, Any], bytes]:
    from inhand.learning.datasets import write_dataset
    from test_datasets import HEAD, made_up

    with TemporaryDirectory() as folder:
        write_dataset(Path(folder), made_up(2), HEAD)
        data = Path(folder, "data")
        return json.loads((data / "metadata.json").read_text()), (data / EPISODES).read_bytes()


def runs(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    from inhand.learning.presets import preset
    from inhand.learning.run_cards import MARK, card_of, read_config
    from inhand.records import table_of

    card = draw(damage.tables(table_of(card_of(preset("smoke")))))
    (folder / MARK).write_text(json.dumps(card))
    return partial(read_config, folder)


def keywords(draw: Callable[..., Any], folder: Path) -> Callable[[], object]:
    from inhand.learning.environment_config import EnvironmentConfig, GoalConfig

    del folder
    kind = draw(
        st.sampled_from((EnvironmentConfig, GoalConfig, AsteriskConfig, TraceConfig, ReachCommand, SweepConfig))
    )
    names = st.sampled_from([each.name for each in fields(kind)] + ["x"])
    odd = st.sampled_from((*damage.ODD, "train", "Out", "rough", np.nan, np.zeros(2), object()))
    return partial(configured, kind, draw(st.dictionaries(names, odd, min_size=1, max_size=3)))


KINDS: dict[str, Try] = {
    "hands": hands,
    "robots": robots,
    "objects": objects,
    "drawings": drawings,
    "recordings": recordings,
    "trials": trials,
    "policies": policies,
    **({"datasets": datasets, "runs": runs, "keywords": keywords} if RL else {}),
}
"""What is read, by the word for it."""
TRIES = settings().max_examples // len(KINDS) + 1 if DEEP else 20
SETTINGS = settings(
    max_examples=TRIES,
    derandomize=not DEEP,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@pytest.mark.parametrize("kind", KINDS)
def test_what_cannot_be_read_is_told(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    count = iter(range(10**6))

    @SETTINGS
    @given(st.data())
    def attempt(data: st.DataObject) -> None:
        folder = tmp_path / str(next(count))
        folder.mkdir()
        read = KINDS[kind](data.draw, folder)
        before = sorted(tmp_path.rglob("*"))
        with in_time(), suppress(InputError):
            read()
        assert sorted(tmp_path.rglob("*")) == before

    attempt()


class Begun(BaseException):
    """Everything was looked at, and the run would begin."""


CONFIGS = {
    "asterisk": AsteriskConfig,
    "trace": TraceConfig,
    "reach": ReachCommand,
    "sweep": SweepConfig,
    "robustness": RobustnessConfig,
    "record": RecordConfig,
    "train": TrainConfig,
    "evaluate": EvaluateConfig,
    "metrics": None,
    "view": None,
    "hands": None,
}
COMMON = ("cube_39", "2v2_50.50_50.50_1.1_53", "Out", "ik", "bullet", "square", "file.toml", "file.csv", "full", "12")
"""Words that some option takes."""


@st.composite
def lines(draw: Callable[..., Any]) -> list[str]:
    """Give the words of a command line."""
    command = draw(st.sampled_from(sorted(CONFIGS)))
    config = CONFIGS[command]
    names = ["--json", "--gaps", "--speed", "--x"] if config is None else [f"--{each.name}" for each in fields(config)]
    words = st.sampled_from(COMMON) | st.sampled_from(tuple(word for word in damage.WORDS if word != "1000000"))
    options = draw(st.lists(st.tuples(st.sampled_from(names), words), max_size=4))
    line = [command, *draw(st.lists(words, max_size=1 if config is None else 0))]
    for name, word in options:
        line += [name.replace("_", "-"), word] if draw(st.integers(0, 5)) else [name]
    return line


def test_a_command_says_what_it_cannot_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, inhand: Call) -> None:
    def begin(*_: object) -> None:
        raise Begun

    monkeypatch.chdir(tmp_path)
    for place in (folders, spread):
        monkeypatch.setattr(place, "alone", begin)
    if RL:
        from inhand.learning import runs as training

        monkeypatch.setattr(training, "alone", begin)
    (tmp_path / "file.toml").write_text(BLOCK)
    (tmp_path / "file.csv").write_text(POINTS)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    before = sorted(tmp_path.rglob("*"))

    @SETTINGS
    @given(lines())
    def attempt(line: list[str]) -> None:
        try:
            with in_time():
                code, _, err = inhand(*line)
            assert code == 0 or (code == 2 and err)
            assert sorted(tmp_path.rglob("*")) == before
        except Begun:
            for each in sorted(set(tmp_path.rglob("*")) - set(before), reverse=True):
                each.rmdir()

    attempt()
