"""The comparison of primitives in sequence with training end to end: a small one, its numbers and its refusals."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import compare_study as compare
from compare_config import CompareConfig
from compare_page import budgets, write_compare
from compare_stats import adaptations, bootstrap, scores
from compare_study import Contestant, check_compare, contestants, horizon_of, training_of
from inhand.control.catalogue import find_controller
from inhand.control.policy import save_policy
from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.learning.config import Training

SMALL = CompareConfig(tasks=("key",), others=(), seeds=(0,), episodes=3, budget=0.02, adaptation=(4,), jobs=1)


def quiet(text: str, done: int, total: int) -> None:
    """Tell nobody."""


def test_every_training_gets_the_same_environment_steps() -> None:
    config = CompareConfig()
    steps = budgets(config)
    for count in steps.values():
        assert sum(count.values()) == pytest.approx(1324 * 200, rel=0.01)
    on_senses = [name for name in steps if name == "structured" or name.startswith("guided-sensed")]
    assert len(on_senses) == 1 + len(config.tasks)
    for name in on_senses:
        assert all(steps.pop(name).values())
    for count in steps.values():
        assert count["demonstrated"] == pytest.approx(1024 * 200, rel=0.01)
        assert count["agent"] == pytest.approx(300 * 200, rel=0.01)
    assert training_of(config, Contestant("structured", "", 1)).interface.observation == "senses"
    who = Contestant("structured-privileged", "", 1), Contestant("guided", "key", 1), Contestant("unguided", "key", 1)
    structured, guided, unguided = (training_of(config, each) for each in who)
    assert structured.directions == "train"
    assert not structured.task
    assert guided.learning == unguided.learning == structured.learning
    assert (guided.interface.observation, unguided.interface.observation) == ("grip", "whole")
    assert guided.seed == 1
    sensed = training_of(config, Contestant("guided-sensed", "key", 1))
    assert (sensed.task, sensed.interface.observation, sensed.interface.truth) == ("key", "senses", "truth")
    assert (sensed.learning, sensed.rounds) == (training_of(config, Contestant("structured", "", 1)).learning, 4)
    assert training_of(config, Contestant("guided-sensed", "key", 1), 16).rounds == 0  # demonstrations alone


def test_contestants_are_the_expert_the_structured_one_and_three_kinds_for_each_task() -> None:
    found = contestants(CompareConfig(tasks=("key", "place"), seeds=(0, 1)))
    assert len(found) == 1 + 2 * 2 + 3 * 2 * 2
    assert len({who.folder for who in found}) == len(found)


def test_a_horizon_leaves_time_to_hold() -> None:
    seconds = (0.04 + 2 * TURN_ARM * np.deg2rad(30.0)) / 0.04 + 0.5
    assert 1.2 * seconds / 0.02 + 60 <= horizon_of(SMALL, "key") <= 1.2 * seconds / 0.02 + 70


def test_bootstrap_knows_constants_spread_and_missing_values() -> None:
    same = bootstrap([np.ones(5), np.ones(5)])
    assert (same.mean, same.low, same.high) == (1.0, 1.0, 1.0)
    wide = bootstrap([np.zeros(50), np.ones(50)])
    assert (wide.mean, wide.low, wide.high) == (0.5, 0.0, 1.0)
    narrow = bootstrap([np.tile([0.0, 1.0], 200)])
    assert narrow.low < 0.5 < narrow.high
    assert narrow.high - narrow.low == pytest.approx(2 * 1.96 * 0.5 / 20, rel=0.15)
    assert bootstrap([np.array([np.nan, 2.0]), np.array([np.nan])]).mean == 2.0
    assert np.isnan(bootstrap([np.array([np.nan])]).mean)


def entry(name: str, task: str, seed: int, outcomes: list[str]) -> dict[str, Any]:
    kind, _, trained = name.partition(", ")
    episodes = [{"outcome": o, "completion": float(o == "reached"), "rms_mm": 1.0} for o in outcomes]
    who = {"kind": kind, "task": trained, "seed": seed}
    return {"contestant": who, "task": task, "disturb": "none", "episodes": episodes}


def test_scores_count_what_was_lost_and_what_was_done() -> None:
    lost = entry("guided, key", "place", 0, ["lost contact", "reached"])
    kept = entry("guided, key", "place", 1, ["reached", "stopped"])
    first, second = scores([lost, kept, entry("structured", "key", 0, ["reached"])])
    assert (first.name, first.task, first.trained) == ("guided, key", "place", False)
    assert (first.dropped, first.episodes) == (1, 4)
    assert first.done.mean == first.completion.mean == 0.5
    assert not second.trained


def test_errors_are_those_of_the_episodes_that_kept_the_object() -> None:
    mixed = entry("guided, key", "place", 0, ["lost contact", "reached", "stopped", "no grasp"])
    for episode, rms in zip(mixed["episodes"], (90.0, 1.0, 2.0, 70.0), strict=True):
        episode["rms_mm"] = rms
    (score,) = scores([mixed])
    assert score.error.mean == 1.5
    assert score.error.high <= 2.0


def test_adaptation_is_the_fewest_steps_that_were_enough() -> None:
    who = {"kind": "unguided", "task": "key"}
    rows = [
        {"contestant": who | {"seed": 0}, "steps": 100, "completion": 0.4},
        {"contestant": who | {"seed": 0}, "steps": 400, "completion": 0.95},
        {"contestant": who | {"seed": 1}, "steps": 400, "completion": 0.5},
    ]
    (found,) = adaptations(rows, (0, 1))
    assert found.steps == (400, None)
    assert found.most == 400


@pytest.mark.parametrize(
    ("config", "text"),
    [
        (replace(SMALL, tasks=()), "at least one of --tasks"),
        (replace(SMALL, tasks=("wall",)), "needs a wall"),
        (replace(SMALL, tasks=("kee",)), "key"),
        (replace(SMALL, tasks=("square:x",)), "is no size"),
        (replace(SMALL, disturb=()), "one of --disturb"),
        (replace(SMALL, disturb=("feild",)), "field"),
        (replace(SMALL, episodes=0), "at least 1"),
        (replace(SMALL, budget=0.0), "--budget 0"),
        (replace(SMALL, address="auto"), "--address is of a cluster"),
    ],
)
def test_what_cannot_be_compared_is_refused_before_anything_is_written(
    config: CompareConfig, text: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with pytest.raises(InputError, match=text):
        check_compare(replace(config, out=out))
    assert not out.exists()


def test_a_folder_of_other_settings_or_of_something_else_is_refused(tmp_path: Path) -> None:
    check_compare(replace(SMALL, out=tmp_path / "study"))
    check_compare(replace(SMALL, out=tmp_path / "study", jobs=2))  # where it is computed is no part of a study
    with pytest.raises(InputError, match="other settings \\(episodes\\)"):
        check_compare(replace(SMALL, out=tmp_path / "study", episodes=4))
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="no study"):
        check_compare(replace(SMALL, out=tmp_path / "other"))


def canned(training: Training, out: Path, *_: object, **__: object) -> Path:
    """Leave what a training leaves: a policy that says what it was trained on, and what an evaluation found."""
    policy = find_controller("rl-privileged").policy
    assert policy is not None
    save_policy(replace(policy, trained=dict(policy.trained) | {"task": training.task}), out / "best")
    line = {"kind": "evaluation", "fraction": training.recipe.episodes / 10, "dropped": 1, "trials": 4}
    (out / "metrics.jsonl").write_text(json.dumps(line) + "\n")
    (out / "finished.json").write_text("{}")
    return out / "best"


def test_a_small_study_ends_in_a_table_and_a_figure_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = replace(SMALL, out=tmp_path / "study", adaptation=(16, 4, 9))
    monkeypatch.setattr(compare, "train", canned)
    monkeypatch.setattr("compare_stats.DRAWS", 100)
    check_compare(config)
    compare.trained(config, quiet)
    found = compare.evaluated(config, quiet)
    few = compare.adapted(config, quiet)
    assert {entry["contestant"]["kind"] for entry in found} == {
        "expert",
        "structured",
        "structured-privileged",
        "guided-sensed",
        "guided",
        "unguided",
    }
    expert = next(entry for entry in found if entry["contestant"]["kind"] == "expert")
    assert all(episode["outcome"] == "reached" for episode in expert["episodes"])
    late = next(e for e in found if e["contestant"]["kind"] == "expert" and e["disturb"] == "field")
    assert all(episode["outcome"] != "reached" for episode in late["episodes"])  # it lives on perfect knowledge
    assert [(each["demonstrations"], each["completion"], each["dropped"]) for each in few] == [
        (4, 0.4, 0.25),
        (9, 0.9, 0.25),  # enough: sixteen are not tried
    ] * 3
    write_compare(config, found, few)
    text = (config.out / "report.md").read_text()
    assert "| structured | key | none | no |" in text
    assert "| guided, key | key | field | yes |" in text
    assert (config.out / "compare_field.png").stat().st_size > 5000
    content = json.loads((config.out / "compare.json").read_text())
    assert len(content["scores"]) == len(found)

    monkeypatch.setattr(compare, "train", None)  # nothing is computed a second time
    monkeypatch.setattr(compare, "follow", None)
    compare.trained(config, quiet)
    assert compare.evaluated(config, quiet) == found
    assert compare.adapted(config, quiet) == few
