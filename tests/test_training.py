"""Training runs: the same bytes again, going on after a kill, stopping at a NaN, and folders that are refused."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("jax", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")

import jax

from inhand.control.contract import contract_of
from inhand.control.policy import load_policy
from inhand.control.policy_arrays import ACTOR
from inhand.errors import InputError
from inhand.hands.files import load_hand
from inhand.hands.fit import Held
from inhand.hands.sides import rough_plan
from inhand.learning import kinds
from inhand.learning.ahead import compile_ahead
from inhand.learning.collect import Collector
from inhand.learning.config import Training
from inhand.learning.datasets import write_dataset
from inhand.learning.ddpgfd import Learner, Report, update_many
from inhand.learning.demonstrations import demonstrations, plans_of
from inhand.learning.journal import Evaluation
from inhand.learning.presets import default, preset, thesis
from inhand.learning.record import head_of
from inhand.learning.replay_buffer import ReplayBuffer
from inhand.learning.run_cards import card_of, check, read_config
from inhand.learning.runs import resume, train
from inhand.learning.setup import Ready, load_ready, make_ready, save_ready
from inhand.learning.starts import gripped
from inhand.learning.training import Trainer
from inhand.records import table_of
from inhand.sim.disturbance import FIELD
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.tasks.layouts import find_layout
from inhand.tasks.primitives import UNSEEN

SMALL = thesis()
SMALL = replace(
    SMALL,
    interface=replace(SMALL.interface, observation="grip", actions="steps", reward="progress", horizon=25),
    recipe=replace(SMALL.recipe, episodes=24, push=0.01, midway=0.5),
    learning=replace(SMALL.learning, hidden=(16, 16), batch=16, imitation=1.0),
    imitate=500,
    warm_up=500,
    episodes=60,
    worlds=10,
    decisions=8,
    updates=20,
    evaluate_every=20,
    trials=1,
)
"""A run of seconds: rough grips need no search, and an episode is half a second long."""


SENSED = replace(
    SMALL,
    disturb="field",
    interface=replace(SMALL.interface, observation="senses", truth="truth"),
    recipe=replace(SMALL.recipe, expert="teacher", episodes=16, turns=0.25, legs=0.25),
    learning=replace(SMALL.learning, prioritised=True),
    rounds=2,
    relabelled=8,
    refit=300,
    episodes=40,
)
"""The same on real senses: the teacher labels the actor's own episodes, critics see the truth, rows have priorities."""


@pytest.fixture(scope="module")
def sensed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with everything that such a run starts with."""
    folder = tmp_path_factory.mktemp("sensed")
    save_ready(make_ready(SENSED, folder, lambda *_: None), folder / "ready.npz")
    return folder


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with everything a small run starts with."""
    folder = tmp_path_factory.mktemp("prepared")
    save_ready(make_ready(SMALL, folder, lambda *_: None), folder / "ready.npz")
    return folder


Actor = Callable[[np.ndarray], np.ndarray]
Whole = tuple[Path, Trainer, list[Evaluation]]
"""The folder of a run that nothing cut short, who trained in it, and what was told on the way."""


def _trainer(
    prepared: Path, folder: Path, config: Training = SMALL, told: Callable[[Evaluation], None] = lambda _: None
) -> Trainer:
    if not folder.exists():
        shutil.copytree(prepared, folder)
    return Trainer(config, load_ready(config, folder / "ready.npz"), folder, told)


@pytest.fixture(scope="module")
def whole(prepared: Path) -> Whole:
    """Return a small run."""
    return _whole(prepared, SMALL)


@pytest.fixture(scope="module")
def whole_sensed(sensed: Path) -> Whole:
    """Return such a run on real senses."""
    return _whole(sensed, SENSED)


def _whole(prepared: Path, config: Training) -> Whole:
    folder, found = prepared.with_name(f"{prepared.name}-whole"), list[Evaluation]()
    trainer = _trainer(prepared, folder, config, found.append)
    trainer.run()
    return folder, trainer, found


def test_another_seed_gives_other_bytes(prepared: Path, whole: Whole, tmp_path: Path) -> None:
    _trainer(prepared, tmp_path / "run", replace(SMALL, seed=1)).run()
    assert (tmp_path / "run" / "last" / ACTOR).read_bytes() != (whole[0] / "last" / ACTOR).read_bytes()


def test_a_run_without_episodes_of_its_own_imitates_alone(prepared: Path, tmp_path: Path) -> None:
    best = _trainer(prepared, tmp_path / "run", replace(SMALL, episodes=0, warm_up=0)).run()
    arrays = {(tmp_path / "run" / place / ACTOR).read_bytes() for place in ("best", "last", "imitated")}
    assert (len(arrays), best.name) == (1, "best")
    assert (tmp_path / "run" / "metrics.jsonl").read_text().count('"kind": "evaluation"') == 1


@pytest.mark.parametrize(("config", "done"), [(SMALL, 0), (SENSED, 8)])
def test_a_killed_run_goes_on_from_its_checkpoint_with_the_same_bytes(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, config: Training, done: int
) -> None:
    """Killed while the agent acts: before its first decision, and beside updates and an evaluation later."""
    prepared: Path = request.getfixturevalue("sensed" if config is SENSED else "prepared")
    whole, *_ = request.getfixturevalue("whole_sensed" if config is SENSED else "whole")
    rounds = 0
    collect = Collector.collect

    def killed(self: Collector, actor: Actor, decisions: int, spread: float, rng: np.random.Generator) -> object:
        nonlocal rounds
        rounds += 1
        if rounds > done:
            raise KeyboardInterrupt
        return collect(self, actor, decisions, spread, rng)

    monkeypatch.setattr(Collector, "collect", killed)
    with pytest.raises(KeyboardInterrupt):
        _trainer(prepared, tmp_path / "cut", config).run()
    assert (tmp_path / "cut" / "checkpoint.npz").is_file()
    assert (tmp_path / "cut" / "last" / ACTOR).read_bytes() != (whole / "last" / ACTOR).read_bytes()
    monkeypatch.setattr(Collector, "collect", collect)
    again = _trainer(prepared, tmp_path / "cut", config)
    assert (again.counters.episodes > 0) == (done > 0)
    assert again.counters.episodes < SMALL.episodes
    again.run()
    for kind in ("last", "best"):
        assert (tmp_path / "cut" / kind / ACTOR).read_bytes() == (whole / kind / ACTOR).read_bytes()
    told = [_timeless((folder / "metrics.jsonl").read_text()) for folder in (tmp_path / "cut", whole)]
    assert told[0] == told[1]


def test_the_teacher_labels_the_actors_own_episodes_with_the_truth_beside(whole_sensed: Whole) -> None:
    run, trainer, _ = whole_sensed
    ready = load_ready(SENSED, run / "ready.npz")
    cost, counters = load_policy(run / "best").cost, trainer.counters
    assert cost is not None
    assert cost == load_policy(run / "last").cost
    assert cost.episodes == 16 + 2 * 8 + counters.episodes
    assert cost.decisions > ready.expert_rows + counters.decisions  # what was relabelled too
    assert cost.updates == 2 * SENSED.imitate + SENSED.refit + SENSED.warm_up + counters.updates
    assert 0 < cost.cpu_s < 600
    imitated = load_policy(run / "imitated")
    assert imitated.cost is not None
    assert (imitated.cost.updates, imitated.cost.episodes) == (2 * SENSED.imitate + SENSED.refit, 16 + 2 * 8)
    assert not np.array_equal(imitated.weights[0], load_policy(run / "last").weights[0])
    rows = ReplayBuffer(run / "expert.rows", ready.columns, ready.expert_rows + 400, 0)
    parts = ready.columns.parts()
    assert parts["truth"].stop - parts["truth"].start == find_layout("truth").size(ready.held.hand)
    shown, own = (
        rows.at(np.arange(*each)) for each in ((0, ready.expert_rows), (ready.expert_rows, ready.expert_rows + 200))
    )
    for block in (shown, own):
        assert (block[:, parts["is_demo"]] == 1.0).all()
        assert np.ptp(block[:, parts["truth"]], axis=0).max() > 0.1
    # The teacher is pushed by little; the actor does something of its own.
    away = [np.abs(block[:, parts["action"]] - block[:, parts["expert_action"]]).mean() for block in (shown, own)]
    assert away[1] > 1.5 * away[0] > 0.0


def test_a_seed_gives_the_same_bytes_whether_updates_or_what_runs_beside_them_is_faster(
    prepared: Path, whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []

    def waited(*given: Any, **more: Any) -> tuple[Learner, Report]:
        order.append("updates")
        learner, report = update_many(*given, **more)
        report.critic_loss.block_until_ready()
        return learner, report

    def told(_: Evaluation) -> None:
        order.append("evaluation")

    monkeypatch.setattr("inhand.learning.training.update_many", waited)
    _trainer(prepared, tmp_path / "after", told=told).run()
    beside, after = whole[0], tmp_path / "after"
    assert _timeless((beside / "metrics.jsonl").read_text()) == _timeless((after / "metrics.jsonl").read_text())
    for kind in ("last", "best"):
        assert (beside / kind / ACTOR).read_bytes() == (after / kind / ACTOR).read_bytes()
    # Told when the next is due, and the first when the critic is fitted: updates go on meanwhile.
    assert order.index("evaluation") == SMALL.warm_up // SMALL.updates
    assert order.count("evaluation") >= 3


def test_what_is_compiled_ahead_is_what_training_calls(
    prepared: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Sizes of its own keep what other tests compiled out of it."""
    config = replace(SMALL, updates=11, imitate=1001, warm_up=11, episodes=5, worlds=5, evaluate_every=5)
    config = replace(config, learning=replace(SMALL.learning, hidden=(5,)))
    with jax.log_compiles():
        compile_ahead(config, load_ready(config, prepared / "ready.npz").columns)
        assert all(f"Compiling jit({name})" in caplog.text for name in ("update_many", "imitate_many"))
        caplog.clear()
        _trainer(prepared, tmp_path / "run", config).run()
    assert "_many" not in caplog.text


def _timeless(lines: str) -> list[dict[str, object]]:
    return [{k: v for k, v in json.loads(line).items() if k not in {"seconds", "cpu_s"}} for line in lines.splitlines()]


def test_a_value_that_is_not_a_number_stops_training_with_its_state_kept(
    prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = ReplayBuffer.add
    monkeypatch.setattr(ReplayBuffer, "add", lambda self, rows: add(self, rows * np.nan))
    with pytest.raises(InputError, match=r"stopped at update \d+: the critic's loss is nan.*lower the learning rate"):
        _trainer(prepared, tmp_path / "run", replace(SMALL, expert_share=0.2)).run()
    assert (tmp_path / "run" / "stopped.npz").is_file()
    policy = load_policy(tmp_path / "run" / "last")
    assert all(np.isfinite(weight).all() for weight in policy.weights)


def test_what_a_run_leaves(prepared: Path, whole: Whole, tmp_path: Path) -> None:
    run, _, found = whole
    policy = load_policy(run / "best")
    assert policy.observation == "grip"
    assert policy.contract == contract_of(load_hand(SMALL.hand), None)
    other = _trainer(prepared, tmp_path / "other", replace(SMALL, disturb="field")).actor().contract
    assert other == contract_of(load_hand(SMALL.hand), FIELD)
    assert found[0].counters.episodes == 0
    assert found[-1].counters.episodes >= SMALL.episodes
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert sum(line["kind"] == "episode" for line in lines) == found[-1].counters.episodes
    evaluations = [line for line in lines if line["kind"] == "evaluation"]
    assert len(evaluations) == len(found)
    assert len(evaluations[0]["directions"]) == 16
    assert any((run / "events").iterdir())


def test_imitation_of_24_episodes_already_carries_the_object_most_of_the_time(prepared: Path, tmp_path: Path) -> None:
    lines: list[Evaluation] = []
    config = replace(SMALL, imitate=5000, warm_up=0, episodes=1, learning=replace(SMALL.learning, hidden=(64, 64)))
    trainer = _trainer(prepared, tmp_path / "run", config, lines.append)
    trainer.run()
    ready: Ready = load_ready(config, prepared / "ready.npz")
    assert np.median(lines[0].tried.total) > 0.5 * np.median(ready.expert_total)


def test_continuous_directions_leave_the_held_out_sectors_alone() -> None:
    drawn = default().recording.draw(np.random.default_rng(0), 4000)
    unseen = np.array([primitive.angle_deg for primitive in UNSEEN])
    away = np.abs((drawn[:, None] - unseen + 180) % 360 - 180).min(axis=1)
    assert away.min() >= default().held_out
    assert 0.4 < (drawn % 45 == 0).mean() < 0.6
    assert len(np.unique(np.floor(drawn / 10))) >= 28


def test_a_dataset_gives_the_rows_that_recording_gives(prepared: Path, tmp_path: Path) -> None:
    pytest.importorskip("minari", reason="datasets need the extra `rl`")
    recording = SMALL.recording
    batches = demonstrations(recording, plans_of(recording), np.random.default_rng(SMALL.seed))
    shown = (episode for batch in batches for episode in batch.apart())
    write_dataset(tmp_path / "set", shown, head_of(recording, "train"))
    config = replace(SMALL, demonstrations=str(tmp_path / "set"))
    check(config)
    (tmp_path / "run").mkdir()
    ready = make_ready(config, tmp_path / "run", lambda *_: None)
    with (tmp_path / "run" / "expert.rows").open("rb") as ours, (prepared / "expert.rows").open("rb") as theirs:
        size = 4 * ready.expert_rows * ready.columns.width
        assert ours.read(size) == theirs.read(size)
    assert ready.starts[0].state.touching.all()
    refused = [
        (replace(config, object="cube_45"), "object: cube_39 there, cube_45 here"),
        (replace(config, interface=replace(SMALL.interface, reward="thesis")), "reward: progress there, thesis here"),
        (replace(config, task="key"), "shows directions: leave demonstrations out to train on a whole task"),
        (replace(config, demonstrations=str(tmp_path)), "no dataset in"),
    ]
    for other, text in refused:
        with pytest.raises(InputError, match=text):
            check(other)
    write_dataset(tmp_path / "all", (), head_of(recording, "Out,Out'"))
    with pytest.raises(InputError, match="shows Out', which evaluations count as unseen"):
        check(replace(config, demonstrations=str(tmp_path / "all")))


def test_the_share_of_the_expert_decays_by_a_fifth(prepared: Path, tmp_path: Path) -> None:
    trainer = _trainer(prepared, tmp_path / "run", replace(SMALL, expert_share=1.0, share_every=100))
    shares = []
    for episodes in (0, 99, 100, 250):
        trainer.counters.episodes = episodes
        shares.append(trainer.share)
    np.testing.assert_allclose(shares, [1.0, 1.0, 0.8, 0.64])


def _card(folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    folder.mkdir()
    with pytest.raises(InputError, match="no training run"):
        read_config(folder)
    card = table_of(card_of(SMALL))
    change(card)
    (folder / "config.json").write_text(json.dumps(card))
    return folder


def test_a_configuration_comes_back_as_it_was(tmp_path: Path) -> None:
    assert read_config(_card(tmp_path / "run", lambda _: None)) == SMALL


def test_a_run_of_another_version_is_refused(tmp_path: Path) -> None:
    folder = _card(tmp_path / "run", lambda card: card.update(version="0.0.1"))
    with pytest.raises(InputError, match=r"it is of version 0\.0\.1, this is .*Train anew"):
        resume(folder, (lambda *_: None, lambda _: None))


CARDS: list[tuple[Callable[[dict[str, Any]], object], str]] = [
    (lambda card: card.update(format=1), "it has format 1; this version reads 2, which has the scales of observations"),
    (lambda card: card["interface"].update(layout="grip-0"), "layout: grip-0 there, grip-1 here"),
    (lambda card: card["interface"]["parts"][6].update(scale=[0.3]), "velocity along and to the left [m/s]: scale 0.3"),
    (lambda card: card["interface"].update(largest_step=0.05), "largest step: 0.05 there, 0.04 here"),
    (lambda card: card["config"].update(seed="1"), "config.seed is '1'; it must be a whole number"),
    (lambda card: card["config"].update(colour=1), "config.colour is a field that this version does not know"),
    (
        lambda card: card["config"]["interface"].update(actions="leaps"),
        "actions is 'leaps'; it must be angles or steps or fine",
    ),
    (
        lambda card: card["config"]["learning"].update(hidden=[64, -0.5]),
        "learning.hidden[1] is -0.5; it must be a whole",
    ),
]
"""Changes of a run's card, and what the text says of them."""


@pytest.mark.parametrize(("change", "text"), CARDS)
def test_a_run_that_cannot_be_gone_on_with_is_refused(
    change: Callable[[dict[str, Any]], object], text: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=rf"cannot be gone on with: .*{re.escape(text)}.*Train anew"):
        read_config(_card(tmp_path / "run", change))


def test_a_finished_run_is_not_gone_on_with(tmp_path: Path) -> None:
    folder = _card(tmp_path / "run", lambda _: None)
    (folder / "finished.json").write_text("{}")
    (folder / "report.md").write_text("its page")
    with pytest.raises(InputError, match="is finished; its policy is in"):
        resume(folder, (lambda *_: None, lambda _: None))


@pytest.mark.parametrize(
    ("config", "text"),
    [
        (replace(SMALL, hand="nonsense"), "nonsense"),
        (replace(SMALL, episodes=0, imitate=0), "episodes 0: give at least 1"),
        (replace(SMALL, episodes=-1), "episodes -1: give at least 0"),
        (replace(SMALL, seed=-1), "--seed -1"),
        (replace(SMALL, learning=replace(SMALL.learning, discount=1.5)), "discount 1.5"),
        (replace(SMALL, interface=replace(SMALL.interface, observation="grap")), "unknown observation 'grap'"),
    ],
)
def test_what_cannot_be_trained_is_refused_before_anything_is_written(
    config: Training, text: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=text):
        train(config, tmp_path / "run", (lambda *_: None, lambda _: None))
    assert not (tmp_path / "run").exists()


def test_presets_have_names_and_the_thesis_has_its_own_numbers() -> None:
    given = preset("thesis")
    counts = given.episodes, given.recipe.episodes, given.agent_episodes, given.evaluate_every
    assert counts == (20000, 5000, 10000, 200)
    numbers = given.learning
    assert numbers.actor_rate == numbers.critic_rate == numbers.weight_decay == 1e-4
    assert numbers.discount == 0.995
    assert (numbers.look_ahead, numbers.batch, numbers.critics, numbers.imitation, given.imitate) == (5, 10, 1, 0.0, 0)
    assert preset("privileged").learning.critics == 2
    with pytest.raises(
        InputError,
        match="unknown preset 'best'; allowed are default, privileged, family, family-privileged, from-family, spatial",
    ):
        preset("best")


def test_an_agent_learns_in_the_engine_of_its_starts(
    prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the witness's starts worlds, tests and evaluations run in the witness, a few decisions of each."""
    pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    shutil.copytree(prepared, tmp_path / "run")
    ready = load_ready(SMALL, prepared / "ready.npz")
    few = np.array([0, 8])
    held = Held(*ready.held)
    grips = [rough_plan(*held)] * len(few), ready.angle_deg[few]
    starts = gripped(*held, grips, np.random.default_rng(0), engine="bullet")
    starts = replace(starts, distance=ready.tests[0].distance[few])
    expert = {name: getattr(ready, name)[few] for name in ("limit", "expert_total", "expert_fraction")}
    engines = []

    def told(engine: str, *given: Any, **more: Any) -> Simulator:
        engines.append(engine)
        return make_simulator(engine, *given, **more)

    monkeypatch.setattr(kinds, "make_simulator", told)
    config = replace(SMALL, engine="bullet", interface=replace(SMALL.interface, horizon=3), imitate=0, warm_up=0)
    config = replace(config, worlds=2, decisions=4, episodes=3, evaluate_every=3)
    trainer = Trainer(
        config, replace(ready, starts=(starts,), tests=(starts,), **expert), tmp_path / "run", lambda _: None
    )
    policy = load_policy(trainer.run())
    assert trainer.counters.episodes >= 3
    assert np.isfinite(trainer.counters.best)
    assert np.isfinite(policy.weights[0]).all()
    assert set(engines) == {"bullet"}
