"""Training with hands that differ: pools of one batch, their teacher, a run from end to end, a hand fitted from it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("jax", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")

import jax

from inhand.control.policy import load_policy, save_policy
from inhand.control.teacher import Teacher
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.pair_family import PairFamily
from inhand.hands.sides import rough_plan
from inhand.learning import experts, pair_pools, setup, training
from inhand.learning.beginning import begun, contract_for, policy_of
from inhand.learning.ddpgfd import new_learner
from inhand.learning.experts import expert_of
from inhand.learning.networks import act, layers_of, new_actor
from inhand.learning.pair_pools import DIRECTIONS, SIXTEEN, TURNS_TOO, Planned, pools_of
from inhand.learning.presets import family, hand_of_family
from inhand.learning.progress import EXPERT
from inhand.learning.recipe import Recording
from inhand.learning.run_cards import check
from inhand.learning.setup import Ready, load_ready, make_ready, save_ready
from inhand.learning.starts import Starts
from inhand.learning.training import Trainer
from inhand.learning.worlds import ManipulationWorlds
from inhand.sim.state import select

CUBE, ROUND = load_object("cube_39"), load_object("cylinder_40")
HELD = (
    Held(load_hand("2v2_50.50_50.50_1.1_53"), CUBE),
    Held(load_hand("2v2_35.65_50.50_1.1_63"), ROUND),
    Held(load_hand("2v3_50.50_40.30.30_1.1_63"), CUBE),
)
SMALL = family()
SMALL = replace(
    SMALL,
    pairs=len(HELD),
    interface=replace(SMALL.interface, horizon=25),
    recipe=replace(SMALL.recipe, episodes=12, midway=0.5),
    learning=replace(SMALL.learning, hidden=(8, 8), batch=16, critics=1),
    imitate=40,
    refit=40,
    rounds=1,
    relabelled=6,
    warm_up=0,
    episodes=2,
    worlds=4,
    decisions=25,
    updates=20,
    trials=1,
)
"""A run of seconds: rough grips need no search, an episode is half a second long, and no round updates values."""


def planned(held: Held, angles: tuple[float, ...], sides: tuple[float, ...]) -> Planned:
    """Return a pair with rough grips."""
    plan, count = rough_plan(*held), len(angles) + len(sides)
    turn = np.array([*np.zeros(len(angles)), *sides])
    return Planned(held, (plan,) * count, np.array([*angles, *np.zeros(len(sides))]), turn)


PAIRS = [planned(held, tuple(45.0 * k for k in range(DIRECTIONS)), TURNS_TOO) for held in HELD]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with all that such a run starts with."""
    found, patch = tmp_path_factory.mktemp("family"), pytest.MonkeyPatch()
    tests = [planned(HELD[0], SIXTEEN, ())]
    patch.setattr(setup, "planned_pairs", lambda *_: (PAIRS, tests))
    patch.setattr(experts, "LONGEST", 30)
    save_ready(make_ready(SMALL, found, lambda *_: None), found / "ready.npz")
    patch.undo()
    return found


@pytest.fixture(scope="module")
def ready(folder: Path) -> Ready:
    return load_ready(SMALL, folder / "ready.npz")


@pytest.fixture(scope="module")
def mixed() -> Starts:
    """Return starts of two pairs of one form, which nothing disturbs."""
    found = pools_of(replace(SMALL, disturb="none"), PAIRS, np.random.default_rng(0), lambda *_: None)[0]
    assert found.pairs is not None
    return found


def test_hands_of_one_form_are_one_pool_and_each_start_knows_its_own(ready: Ready) -> None:
    forms = [{len(held.hand.limits) for held in pool.pairs.held} for pool in ready.starts if pool.pairs]
    assert forms == [{4}, {5}]
    for pool in ready.starts:
        assert pool.pairs is not None
        assert pool.turn is not None
        assert len(pool.pairs.of) == len(pool.turn) == len(pool)
        assert (pool.angle_deg[pool.turn != 0] == 0).all()
        assert (pool.distance >= 0).all()
    assert {held for pool in ready.starts if pool.pairs for held in pool.pairs.held} == set(HELD)
    assert ready.columns.n == 6
    assert len(ready.angle_deg) == 16


def test_worlds_of_different_hands_go_as_each_hands_own_do(mixed: Starts) -> None:
    """In one batch, byte for byte, what they remember too, also after they have changed places or been written down."""
    assert mixed.pairs is not None
    worlds = ManipulationWorlds(HELD[0], mixed, len(mixed), SMALL.interface, np.random.default_rng(0), threads=1)
    rows = np.arange(len(mixed))[::-1].copy()
    seen = worlds.reset(rows)
    rng = np.random.default_rng(1)
    actions = 0.2 * rng.uniform(-1, 1, (6, len(mixed), 6))
    for action in actions:
        kept = worlds.state_dict()
        step = worlds.step(action)
    other = ManipulationWorlds(HELD[0], mixed, len(mixed), SMALL.interface, np.random.default_rng(0), threads=1)
    other.load_state_dict(kept)
    assert np.array_equal(other.step(actions[-1]).successor, step.successor)
    for number, held in enumerate(mixed.pairs.held):
        mine = np.flatnonzero(mixed.pairs.of[rows] == number)
        own = replace(mixed.rows(rows[mine]), pairs=None)
        alone = ManipulationWorlds(held, own, len(mine), SMALL.interface, rng, threads=1)
        assert np.array_equal(alone.reset(np.arange(len(mine))), seen[mine])
        for action in actions:
            own_step = alone.step(action[mine])
        assert np.array_equal(own_step.successor, step.successor[mine])
        assert np.array_equal(own_step.after.joint_angles, step.after.joint_angles[mine])


def test_a_world_that_begins_anew_keeps_its_hand(mixed: Starts) -> None:
    assert mixed.pairs is not None
    rows, rng = np.arange(len(mixed)), np.random.default_rng(0)
    again = np.stack([mixed.pairs.again(rows, rng) for _ in range(40)])
    assert (mixed.pairs.of[again] == mixed.pairs.of).all()
    assert set(again.ravel().tolist()) == set(rows.tolist())
    short = replace(SMALL.interface, horizon=2)
    worlds = ManipulationWorlds(HELD[0], mixed, len(mixed), short, np.random.default_rng(0), threads=1)
    worlds.reset(rows)
    links = [worlds.scene.arrays.links]
    for _ in range(4):
        worlds.step(np.zeros((len(mixed), 6)))
        links.append(worlds.scene.arrays.links)
    assert all(np.array_equal(each, links[0]) for each in links)


def test_each_pair_is_shown_by_its_own_teacher(mixed: Starts, ready: Ready) -> None:
    drawn = ready.starts[0]
    assert drawn.pairs is not None
    assert drawn.disturbed is not None
    worlds = ManipulationWorlds(HELD[0], drawn, len(drawn), SMALL.interface, np.random.default_rng(0), threads=1)
    worlds.reset(np.arange(len(drawn)))
    targets = expert_of("teacher", HELD[0], drawn, worlds)()
    for held, mine in drawn.pairs.apart():
        teacher = Teacher(*held, [drawn.disturbed[row] for row in mine], len(mine))
        assert np.array_equal(targets[mine], teacher.act(select(worlds.state, mine), worlds.asked.take(mine)))
    with pytest.raises(InputError, match="expert 'ik' knows one hand: hands that differ are shown by 'teacher'"):
        expert_of("ik", HELD[0], mixed, worlds)


def test_a_family_is_trained_and_a_hand_fitted_from_its_policy(
    folder: Path, ready: Ready, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training, "CHUNK", 40)
    losses: list[float] = []
    trainer = Trainer(SMALL, ready, folder, lambda found: losses.append(found.score))
    best = load_policy(trainer.run())
    assert trainer.counters.episodes >= 2
    assert (best.network, best.family, best.trained["pairs"]) == ("joints", PairFamily(), 3)
    assert len(losses) == 2
    own = replace(hand_of_family(), start=str(folder), learning=SMALL.learning, hand="2v3_50.50_40.30.30_1.1_63")
    check(own)
    learner = begun(own, ready.columns)
    assert np.allclose(layers_of(learner.actor)[0].weight, best.weights[0])
    with pytest.raises(InputError, match=r"start .* sees joint-senses by a joints network, and what is to be trained"):
        begun(replace(own, learning=replace(own.learning, hidden=(16, 16))), ready.columns)
    with pytest.raises(InputError, match=r"palm width is 90 mm, the family's 40 to 80 mm: train without start"):
        check(replace(own, hand="2v2_50.50_50.50_1.1_90"))


def test_what_training_makes_worse_stays_as_it_began(
    folder: Path, ready: Ready, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scores: list[float] = []
    worse = jax.tree.map(lambda part: np.full_like(part, 3.0), new_learner(SMALL.learning, ready.columns, 0).actor)
    begins = policy_of(SMALL, contract_for(SMALL, ready.held), new_learner(SMALL.learning, ready.columns, 7).actor)
    save_policy(begins, tmp_path / "begins")
    monkeypatch.setattr(Trainer, "_fitted", lambda *_: worse)
    shutil.copy(folder / EXPERT, tmp_path / EXPERT)
    own = replace(SMALL, start=str(tmp_path / "begins"), rounds=0)
    best = load_policy(Trainer(own, ready, tmp_path, lambda found: scores.append(found.score)).run())
    assert scores[0] > max(scores[1:])
    np.testing.assert_allclose(best.weights[0], begins.weights[0], rtol=1e-6)


def test_every_layer_of_a_network_over_joints_learns(ready: Ready) -> None:
    actor = new_actor(jax.random.key(0), "joints", ready.columns, (4, 4))
    seen = jax.numpy.asarray(np.random.default_rng(0).uniform(-1, 1, (8, ready.columns.d)), np.float32)
    slopes = layers_of(jax.jit(jax.grad(lambda each: (act(each, seen) ** 2).sum()))(actor))
    assert all(np.abs(part).max() > 0 for layer in slopes for part in layer)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"pairs": -1}, "pairs -1: give a number of hands and objects"),
        (
            {"hand": "2v2_65.35_65.35_1.1_53"},
            "2v2_65.35_65.35_1.1_53 and cube_39 with a family, whose hands and objects are drawn: leave hand and"
            " object out, or take preset from-family",
        ),
        (
            {"recipe": replace(SMALL.recipe, turns=0.1)},
            "a family is learned with layout joints or joint-senses, a teacher and planned grasps, on primitives",
        ),
        (
            {"interface": replace(SMALL.interface, observation="grip")},
            "a network over joints sees layout joints or joint-senses, not",
        ),
        ({"start": "ik"}, "start 'ik' is no learned policy: give rl-family or the folder of a run"),
    ],
)
def test_families_that_cannot_be_trained_are_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        check(replace(SMALL, **change))


def test_pairs_are_drawn_and_planned_by_seeds_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair that no grasp holds is passed over; those that are tested with come after those that are learned with."""
    asked = []

    def plan(held: Held, angles: np.ndarray, sides: tuple[float, ...], _recording: Recording) -> Planned:
        asked.append(held)
        if len(asked) == 2:
            raise InputError("no grasp")
        return planned(held, tuple(angles.tolist()), sides)

    monkeypatch.setattr(pair_pools, "_planned", plan)
    monkeypatch.setattr(pair_pools, "TESTED", 1)
    learned, tested = pair_pools.planned_pairs(replace(SMALL, pairs=2), lambda *_: None)
    assert [each.held for each in (*learned, *tested)] == [asked[0], *asked[2:]]
    assert len(tested[0].angle_deg) == 16
    assert all(PairFamily().outside(held) is None for held in asked)
