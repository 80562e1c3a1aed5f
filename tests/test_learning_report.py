"""Records of trainings, learning curves, a policy beside the expert, and trials that failed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from figure_reader import legend_texts
from inhand.asterisk_test.comparison import HEADER, ControllerTrials, lost, rows, with_more
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.failures import Failure, failure_of, failures_figure
from inhand.asterisk_test.results import Result, result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.trial import LOST_CONTACT, NO_GRASP, TIME_OUT, Trial
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.learning.commands import EvaluateConfig
from inhand.learning.figures import (
    MOST_POINTS,
    directions_figure,
    learning_figure,
    progress_figure,
    shown_range,
    smoothed,
    spread,
)
from inhand.learning.progress import Learned, evaluation_rows, read_learning
from inhand.learning.report import Compared, write_evaluation
from inhand.tasks.primitives import TRAIN, UNSEEN
from page_reader import Read


def entry(fraction: float, dropped: int = 0) -> dict[str, float]:
    return {
        "fraction": fraction, "dropped": dropped, "trials": 4, "across": 0.002, "turned": 0.1, "total": 10 * fraction,
        "expert_total": 9.5,
    }  # fmt: skip


def journal(folder: Path, episodes: int = 60, fractions: tuple[float, ...] = (0.5, 0.9, 0.8)) -> Path:
    """Write the record of a training: episodes that end in tens, a round of updates after each five."""
    rng = np.random.default_rng(4)
    lines: list[dict[str, object]] = [{"kind": "imitation", "step": 1000, "loss": 0.1}]
    for number in range(1, episodes + 1):
        lines.append({"kind": "episode", "step": number, "total": rng.normal(), "last": -10.0 if number == 7 else 0.1})
        if number % 5 == 0:
            told = {"critic loss": 10.0 ** (number / 10), "actor loss": -float(number), "expert share": 0.5}
            lines.append({"kind": "learning", "step": 10 * (number // 10), **told})
    for number, fraction in enumerate(fractions):
        ways = {f"{p.angle_deg:g}": entry(fraction, int(number == 2 and p.name == "In")) for p in (*UNSEEN, *TRAIN)}
        step = number * episodes // max(len(fractions) - 1, 1)
        lines.append({"kind": "evaluation", "step": step, "score": fraction, "directions": ways})
    text = "".join(json.dumps(line) + "\n" for line in lines)
    (folder / "metrics.jsonl").write_text(text + '{"kind": "episode", "st')
    return folder


@pytest.fixture
def record(tmp_path: Path) -> Learned:
    """Return the record of a small training."""
    return read_learning(journal(tmp_path))


def data(ax: Axes, number: int) -> Array:
    return np.asarray(ax.lines[number].get_xydata(), dtype=float)


def titles(figure: Figure) -> list[str]:
    return [ax.get_title(loc="left") for ax in figure.axes]


def test_a_record_is_read_and_a_line_that_was_cut_off_is_not(record: Learned) -> None:
    assert len(record.total) == len(record.last) == 60
    assert list(record.at[:3]) == [0, 10, 10]
    assert [each.episode for each in record.evaluations] == [0, 30, 60]
    assert record.best is record.evaluations[1]
    assert list(record.best.directions) == [p.name for p in (*TRAIN, *UNSEEN)]


def test_the_table_of_an_evaluation_has_both_groups(record: Learned) -> None:
    lines = evaluation_rows(record.evaluations[2])
    assert len(lines) == 18
    assert lines[4] == ("In", "0.80", "1 of 4", "2.0", "5.7", "8.0", "9.5")
    assert lines[8] == ("trained directions", "0.80", "1 of 32", "2.0", "5.7", "8.0", "9.5")
    assert lines[17][:3] == ("unseen directions", "0.80", "0 of 32")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (None, "has no metrics.jsonl; give a run of `inhand train`"),
        ("nothing\n", "is no record of a training"),
        ('{"kind": "episode"}\n', "is no record of a training: KeyError"),
        ('{"kind": "imitation", "step": 1000, "loss": 0.1}\n', "has not been evaluated yet: let it train on"),
    ],
)
def test_what_is_no_record_is_refused(tmp_path: Path, text: str | None, why: str) -> None:
    if text is not None:
        (tmp_path / "metrics.jsonl").write_text(text)
    with pytest.raises(InputError, match=why):
        read_learning(tmp_path)


def test_smoothing_is_tensorboards() -> None:
    np.testing.assert_allclose(smoothed(np.array([2.0, 2.0, 2.0])), 2.0)
    np.testing.assert_allclose(smoothed(np.array([1.0, 0.0]), 0.7), [1.0, 0.7 * 0.3 / (1 - 0.49)])
    assert len(smoothed(np.empty(0))) == 0


def test_rounds_between_two_ends_of_episodes_lie_between_them() -> None:
    np.testing.assert_allclose(spread(np.array([0.0, 0, 10, 20, 20]), 30.0), [0, 5, 10, 20, 25])
    np.testing.assert_allclose(spread(np.array([4.0, 4.0]), 4.0), [4, 4])
    assert len(spread(np.empty(0), 10.0)) == 0


def test_axes_leave_outliers_out_but_never_the_smoothed_line() -> None:
    values = np.r_[np.linspace(0.0, 1.0, 99), -1000.0]
    low, high = shown_range(values, smoothed(values[:99]))
    assert -0.5 < low < 0.0
    assert 1.0 < high < 1.2
    low, high = shown_range(np.full(5, 3.0), np.full(5, 3.0))
    assert low < 3.0 < high


def test_learning_curves_show_rewards_and_losses(record: Learned) -> None:
    figure = learning_figure(record, "Title", "below")
    assert titles(figure) == [
        "Sum of the rewards",
        "Last reward of an episode",
        "Loss of the critic",
        "Loss of the actor",
    ]
    total, last, critic, actor = figure.axes
    np.testing.assert_allclose(data(total, 0), np.column_stack([np.arange(1, 61), record.total]))
    np.testing.assert_allclose(data(total, 1)[:, 1], smoothed(record.total))
    assert last.texts[0].get_text() == "1 of 60 outside"
    assert (critic.get_yscale(), actor.get_yscale(), total.get_yscale()) == ("log", "linear", "linear")
    assert [ax.get_xlim() for ax in figure.axes] == [(0, 60)] * 4
    assert legend_texts(figure) == ["smoothed by 0.7", "as recorded"]


def test_a_training_too_short_for_updates_has_no_empty_panels(record: Learned) -> None:
    none = np.empty(0)
    figure = learning_figure(replace(record, at=none, critic_loss=none, actor_loss=none))
    assert titles(figure) == ["Sum of the rewards", "Last reward of an episode"]


def test_tiny_losses_leave_no_factor_above_their_axis(record: Learned) -> None:
    figure = learning_figure(replace(record, actor_loss=1e-8 * (record.actor_loss - 100.0)))
    figure.canvas.draw()
    actor = figure.axes[3]
    assert actor.get_yaxis().get_offset_text().get_text() == ""
    assert all("e\N{MINUS SIGN}0" in text.get_text() for text in actor.get_yticklabels()[:2])


def test_long_records_are_thinned_and_signed_losses_may_be_wide(tmp_path: Path) -> None:
    record = read_learning(journal(tmp_path, episodes=5 * MOST_POINTS + 1))
    wide = replace(record, actor_loss=-record.critic_loss, critic_loss=np.full(len(record.at), np.nan))
    figure = learning_figure(wide)
    total, _, critic, actor = figure.axes
    assert len(data(total, 0)) == 5 * MOST_POINTS + 1
    assert 300 < len(data(total, 1)) <= MOST_POINTS
    assert total.lines[0].get_linestyle() == "None"
    assert actor.get_yscale() == "symlog"
    assert critic.texts[0].get_text() == "nothing recorded"


def test_progress_is_set_against_the_expert_and_the_limit(record: Learned) -> None:
    figure = progress_figure(record)
    returns, limits, losses = figure.axes
    np.testing.assert_allclose(data(returns, 0), [[0, 5], [30, 9], [60, 8]])
    level = [line for line in returns.lines if line.get_linestyle() == "--"]
    assert np.asarray(level[0].get_ydata())[0] == 9.5
    np.testing.assert_allclose(data(limits, 0)[:, 1], [0.5, 0.9, 0.8])
    np.testing.assert_allclose(data(losses, 0)[:, 1], [0, 0, 100 / 32])
    assert returns.get_ylim()[0] <= 0.0
    assert legend_texts(figure) == ["8 trained directions", "8 unseen directions", "the expert", "best policy"]


def test_every_direction_has_its_plot_with_what_was_lost(record: Learned) -> None:
    figure = directions_figure(record)
    assert titles(figure) == [p.name for p in (*TRAIN, *UNSEEN)]
    assert {ax.get_title(loc="right") for ax in figure.axes} == {"0.90"}
    crosses = {ax.get_title(loc="left"): len(np.asarray(ax.lines[-1].get_xdata())) for ax in figure.axes}
    assert {name for name, count in crosses.items() if count} == {"In"}
    assert "lower still" not in legend_texts(figure)
    assert "the expert" not in legend_texts(figure)


def test_an_object_that_went_backwards_does_not_press_the_others_together(tmp_path: Path) -> None:
    record = read_learning(journal(tmp_path, fractions=(0.9, -3.0)))
    ways = {name: replace(reached, expert_fraction=0.95) for name, reached in record.best.directions.items()}
    known = replace(record, evaluations=tuple(replace(each, directions=ways) for each in record.evaluations[:1]))
    figure = directions_figure(record)
    assert figure.axes[0].get_ylim()[0] > -0.3
    assert "lower still" in legend_texts(figure)
    assert "the expert" in legend_texts(directions_figure(known))


@pytest.fixture(scope="module")
def both() -> tuple[ControllerTrials, ControllerTrials]:
    """Return 5 trials of two directions by the thesis's controller, which loses objects, and by the expert."""
    found = []
    for name in ("thesis-ik", "ik"):
        config = AsteriskConfig(directions="Right,Right'", trials=2, controller=name)
        setup = with_more(prepare(config), 5)
        trials = simulate(config, setup)
        found.append(ControllerTrials(name, trials, tuple(map(result_of_trial, trials)), 2))
    return found[0], found[1]


Both = tuple[ControllerTrials, ControllerTrials]


def test_more_episodes_leave_the_first_trials_as_they_are(both: Both) -> None:
    config = AsteriskConfig(directions="Right,Right'", trials=2, controller="thesis-ik")
    alone = simulate(config, prepare(config))
    assert [(t.passport.primitive, t.passport.trial) for t in both[0].trials] == [
        ("Right", 1), ("Right", 2), ("Right'", 1), ("Right'", 2), ("Right", 3),
    ]  # fmt: skip
    for first, other in zip(alone, both[0].trials, strict=False):
        np.testing.assert_array_equal(first.object_pose, other.object_pose)
    for ours, experts in zip(both[0].trials, both[1].trials, strict=True):
        np.testing.assert_array_equal(ours.object_pose[0], experts.object_pose[0])
    assert len(with_more(prepare(config), 2).assignments) == 4
    with pytest.raises(InputError, match="--episodes 0: give at least one episode"):
        with_more(prepare(config), 0)


def test_the_table_sets_both_side_by_side(both: Both) -> None:
    lines = rows(*both, [], [TRAIN[2]])
    assert [line[0] for line in lines] == ["Right", "all 1"]
    assert len(lines[0]) == len(HEADER)
    shown = [result for result in both[1].results if result.direction == "Right" and result.trial <= 2]
    assert lines[0][1] == f"{shown[0].limit:.1f}"
    assert lines[0][2].endswith(f" | {np.mean([result.fraction or 0 for result in shown]):.2f}")
    assert lines[0][4] == "-"
    ours = [result for result in both[0].results if result.direction == "Right"]
    assert lines[0][-1] == f"{lost(ours)} of 3 | 0 of 3"
    assert len(both[0].first[0]) == 4


def test_lost_is_what_was_not_held_to_the_end(both: Both) -> None:
    result = both[1].results[0]
    outcomes = (LOST_CONTACT, NO_GRASP, TIME_OUT, result.outcome)
    assert lost([replace(result, outcome=outcome) for outcome in outcomes]) == 2


def ended(pair: tuple[Trial, Result], outcome: str, who: str | None) -> Failure:
    return failure_of(pair[0], replace(pair[1], outcome=outcome, first_lost=who))


def test_a_failure_says_who_let_go_and_where(both: Both) -> None:
    pair = both[0].failed[0]
    failure, (trial, result) = failure_of(*pair), pair
    assert result.outcome == LOST_CONTACT
    assert failure.name == f"{result.direction}, trial {result.trial}"
    place = f"at {result.metrics.distance_mm:.0f} of {result.limit:.0f} mm ({100 * (result.fraction or 0):.0f}%)"
    assert ended(pair, LOST_CONTACT, "left").reason == f"left let go {place}"
    assert ended(pair, LOST_CONTACT, "left and right").reason == f"both let go {place}"
    assert ended(pair, TIME_OUT, None).reason == f"time out {place}"
    assert ended(pair, NO_GRASP, None).reason == "the grasp failed"
    assert not all(failure.held)
    touching = np.asarray(trial.manipulated_path()[2].all(axis=-1))
    assert touching[: failure.end].all()
    assert not touching[failure.end]


def test_failures_are_drawn_with_both_parts_of_their_path(both: Both) -> None:
    failure = failure_of(*both[0].failed[0])
    figure = failures_figure([failure] * 5, "lost")
    assert len(figure.axes) == 5
    ax = figure.axes[0]
    before, after = (next(line for line in ax.lines if line.get_linestyle() == style) for style in ("-", ":"))
    after_points = np.asarray(after.get_xydata())
    np.testing.assert_allclose(after_points, failure.path_mm[failure.end :])
    assert before.get_xydata() is not None
    texts = {text.get_text() for text in ax.texts}
    assert texts == {failure.name, failure.reason}
    assert {"finger that let go", "target to the reach limit"} <= set(legend_texts(figure))
    for count in (0, 13):
        with pytest.raises(InputError, match=f"{count} failed trials given: a figure shows 1 to 12"):
            failures_figure([failure] * count)


def test_an_evaluation_draws_failures_only_where_there_are_some(both: Both, tmp_path: Path) -> None:
    config = AsteriskConfig(directions="Right,Right'", trials=2)
    for name, (policy, other) in {"bad": both, "good": both[::-1]}.items():
        found = Compared(EvaluateConfig(), config, policy, other, {}, notes=("a note",))
        (tmp_path / name).mkdir()
        write_evaluation(found, tmp_path / name)
        views = Read(found.html()).views()
        assert [panel["title"] for panel in views["asterisks"]["panels"]] == [other.name, policy.name]
        assert any(trial["failed"] and trial["group"] == policy.name for trial in views["player"]["trials"]) == (
            name == "bad"
        )
        page = (tmp_path / name / "report.md").read_text()
        assert "* a note" in page
        assert "| Right |" in page
        assert "| Out |" not in page
        assert (tmp_path / name / "figures" / "failures_1.png").is_file() == (name == "bad")
        assert "* ik: no trial failed." in page
        assert page.count("\\|") > 10
