"""Settings of every kind hold what their fields say, however they are made; a wrong one is refused by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

import inhand
from inhand.asterisk_test.config import AsteriskConfig, ReachCommand
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.errors import InputError
from inhand.learning.commands import EvaluateConfig, RecordConfig, TrainConfig
from inhand.learning.config import Learning, Training
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig
from inhand.learning.presets import default, privileged
from inhand.learning.recipe import Recipe
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.records import Config, configured, read_json, read_record, text_of
from inhand.sim import memory
from inhand.sim.names import Engine
from inhand.tracing.config import TraceConfig

HAND = inhand.hand("2v2_50.50_50.50_1.1_53")
KINDS: dict[type[Config], dict[str, Any]] = {
    AsteriskConfig: {},
    ReachCommand: {},
    TraceConfig: {},
    SweepConfig: {},
    RobustnessConfig: {},
    RecordConfig: {},
    TrainConfig: {},
    EvaluateConfig: {},
    EnvironmentConfig: {},
    GoalConfig: {},
    Training: {"preset": "mine"},
    Learning: {},
    Interface: {},
    Recipe: {},
    Noise: {},
}
"""Every kind, with what it cannot be made without."""
FIELDS = [(kind, name) for kind in KINDS for name in get_type_hints(kind)]


@pytest.mark.parametrize(("kind", "name"), FIELDS, ids=lambda each: getattr(each, "__name__", each))
def test_a_field_holds_nothing_else_than_it_says(kind: type[Config], name: str) -> None:
    for wrong in (object(), {"of": "any"}, b"bytes", 1j):
        with pytest.raises(InputError, match=rf"^{name}(\.of)? is .*"):
            kind(**KINDS[kind] | {name: wrong})


WRONG: list[tuple[Callable[..., object], dict[str, Any], str]] = [
    (AsteriskConfig, {"hand": HAND}, r"hand is HandSpec\(name.*; it must be a text"),
    (AsteriskConfig, {"trials": "3"}, "trials is '3'; it must be a whole number"),
    (AsteriskConfig, {"trials": 2.5}, "trials is 2.5; it must be a whole number"),
    (AsteriskConfig, {"trials": True}, "trials is True; it must be a whole number"),
    (
        AsteriskConfig,
        {"engine": "mujco"},
        r"engine is 'mujco'; it must be planar or mujoco or bullet; did you mean mujoco",
    ),
    (AsteriskConfig, {"paths": "bent"}, "paths is 'bent'.*; it must be straight or human"),
    (AsteriskConfig, {"beside": "results"}, "beside is 'results'; it must be a list"),
    (AsteriskConfig, {"metrics": (3,)}, r"metrics\[0\] is 3; it must be a text"),
    (AsteriskConfig, {"twist": np.inf}, "twist is inf; it must be a finite number"),
    (partial(replace, AsteriskConfig()), {"seed": None}, "seed is None; it must be a whole number"),
    (ReachCommand, {"friction": "low"}, "friction is 'low'; it must be a number or null"),
    (TraceConfig, {"size": "60"}, "size is '60'; it must be a number or null"),
    (SweepConfig, {"hands": "2v2"}, "hands is '2v2'; it must be a list"),
    (partial(replace, default()), {"directions": "all"}, "directions is 'all'; it must be train or continuous"),
    (partial(replace, default()), {"interface": 3}, "interface is 3; it must be a table"),
    (partial(replace, default()), {"noise": {"position": "a"}}, "noise.position is 'a'; it must be a number"),
    (partial(replace, default()), {"noise": {"place": 1.0}}, "noise.place is no setting: leave it out"),
    (inhand.asterisk, {"noise_mm": "a"}, "noise_mm is 'a'; it must be a number"),
    (inhand.asterisk, {"human": 3}, "human is 3; it must be a text"),
    (inhand.asterisk, {"beside": 3}, r"beside\[0\] is 3; it must be a text"),
    (inhand.asterisk, {"metrics": 3}, "metric 'int' is int 3"),
    (inhand.asterisk, {"directions": None}, "unknown direction 'None'"),
    (inhand.sweep, {"hands": 3}, "hand is int 3"),
    (inhand.trace, {"trials": "a"}, "trials is 'a'; it must be a whole number"),
    (inhand.trace, {"scal": True}, r"unknown keyword 'scal'; did you mean scale"),
]
"""What is made of which settings, and what it must say."""


@pytest.mark.parametrize(("make", "settings", "text"), WRONG)
def test_what_a_setting_cannot_hold_is_refused_by_name(
    make: Callable[..., object], settings: dict[str, Any], text: str
) -> None:
    with pytest.raises(InputError, match=text):
        make(**settings)


def test_what_means_the_same_is_taken() -> None:
    made = configured(
        AsteriskConfig,
        {"trials": np.int64(3), "noise_mm": 1, "out": "here", "beside": ["there"], "metrics": np.array(["one"])},
    )
    assert made == AsteriskConfig(trials=3, noise_mm=1.0, out=Path("here"), beside=(Path("there"),), metrics=("one",))
    assert type(made.trials) is int
    assert type(made.noise_mm) is float
    assert configured(EnvironmentConfig, {"directions": np.array([0, 90])}).angles == (0.0, 90.0)
    assert configured(Training, {"preset": "mine", "noise": {"position": 0.0}}).noise == Noise(position=0.0)


def test_settings_come_back_from_their_json() -> None:
    made = privileged()
    assert read_record(read_json(text_of(made)), Training) == made
    assert asdict(made)["interface"]["observation"] == "grip"


@pytest.mark.parametrize("engine", get_args(Engine))
def test_every_engine_has_its_estimate_of_memory(engine: Engine) -> None:
    assert memory.WORLD_BYTES[engine] > 0
    assert memory.START_BYTES[engine] > 0


def test_memory_is_estimated_and_refused_with_the_limit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    room = memory.available()
    assert room is None or 1e8 < room < 1e14
    (tmp_path / "meminfo").write_text("MemTotal:  9000000 kB\nMemAvailable:    1000000 kB\n")
    monkeypatch.setattr(memory, "TABLE", tmp_path / "meminfo")
    memory.check_memory("num_envs=100000", 100_000, 1e4)
    with pytest.raises(InputError, match="num_envs=200000 would take about 2 GB of memory, 10 kB each, and this"):
        memory.check_memory("num_envs=200000", 200_000, 1e4)
    with pytest.raises(InputError, match=r"has 1\.02 GB left: give at most 102400"):
        memory.check_memory("num_envs=200000", 200_000, 1e4)
    monkeypatch.setattr(memory, "TABLE", tmp_path / "none")
    memory.check_memory("num_envs=2", 2, 1e4)
