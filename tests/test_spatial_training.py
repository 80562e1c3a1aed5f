"""What a training with a hand in space begins with and tells, and its policy as a controller of the test."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("tensorboardX", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")

import inhand
from inhand.cli.train import line_of
from inhand.control import spatial_rehearsal
from inhand.control.catalogue import check_known, find_controller, learned
from inhand.control.contract import contract_in_space, joint_names
from inhand.control.controller import SpatialTask
from inhand.control.loop import Bench, simulate
from inhand.control.policy import STILL_TIME, Policy, load_policy, save_policy
from inhand.control.spatial_catalogue import (
    CONTROLLERS,
    check_known_in_space,
    find_spatial_controller,
    learned_in_space,
    notes_in_space,
)
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_policy import SpatialPolicyController, shorter, units_of
from inhand.control.spatial_rehearsal import Tried, closed_at
from inhand.control.trial import REACHED
from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.spatial.names import parse_spatial_name
from inhand.learning import space_pools
from inhand.learning.commands import TrainConfig
from inhand.learning.config import Training
from inhand.learning.figures import directions_figure
from inhand.learning.journal import Counters, Evaluation, Journal
from inhand.learning.presets import preset, privileged_spatial
from inhand.learning.progress import NEVER_SHOWN, evaluation_rows, read_learning
from inhand.learning.run_cards import check
from inhand.learning.setup import Ready, load_ready, make_ready, save_ready
from inhand.learning.space import space_of
from inhand.learning.space_pools import Planned, pool_of
from inhand.learning.starts import Starts
from inhand.learning.train import asked, command_of
from inhand.learning.trying import tried_all
from inhand.rotations import SpatialPath
from inhand.sim.names import SPATIAL
from inhand.tasks.layouts import find_layout
from inhand.tasks.spatial.aims import SpatialAim
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import parse_spatial_directions
from test_spatial_engine import CUBE, HAND
from test_spatial_learning import ASKED, HELD, PLAIN, PULLS, in_space

SMALL = privileged_spatial()
SMALL = replace(
    SMALL, interface=replace(SMALL.interface, horizon=25), recipe=replace(SMALL.recipe, episodes=24, midway=0.5)
)
"""Demonstrations of half a second, from plain grips that need no search."""


def few_tests(*_: object) -> Starts:
    plans = Planned((*ASKED, space_pools.UNSEEN[0]), ((PLAIN,),) * 5, np.resize(PULLS, (5, 3)))
    config = replace(SMALL, recipe=replace(SMALL.recipe, grip_spread=0.0))
    return pool_of(in_space(config), plans, 8, np.random.default_rng(1))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with all that such a run starts with."""
    found, patch = tmp_path_factory.mktemp("space"), pytest.MonkeyPatch()
    patch.setattr(space_pools, "planned", lambda *_: Planned(ASKED, ((PLAIN,),) * len(ASKED), PULLS))
    patch.setattr(space_pools, "tests_of", few_tests)
    save_ready(make_ready(SMALL, found, lambda *_: None), found / "ready.npz")
    patch.undo()
    return found


@pytest.fixture(scope="module")
def ready(folder: Path) -> Ready:
    return load_ready(SMALL, folder / "ready.npz")


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Policy]:
    """Return a policy that leaves every command as it is, and its folder."""
    arrays = np.zeros((171, 9)), np.zeros(9)
    trained = {"hand": SMALL.hand, "object": SMALL.object, "preset": "spatial"}
    made = Policy((arrays[0],), (arrays[1],), "space", "steps", "planned", trained, space=contract_in_space(HELD))
    place = tmp_path_factory.mktemp("policy") / "still"
    save_policy(made, place)
    return place, load_policy(place)


def test_what_a_run_in_space_begins_with_is_kept(ready: Ready) -> None:
    (pool,), (tests,) = ready.starts, ready.tests
    assert len(pool) > 24  # those begun midway too
    assert pool.asked_in_space.gravity.shape == (len(pool), 3)
    assert (ready.columns.d, ready.columns.n, ready.unit) == (171, 9, "")
    assert set(ready.names) <= {each.name for each in ASKED} | {NEVER_SHOWN}
    assert np.array_equal(ready.trained, np.array(ready.names) != NEVER_SHOWN)
    assert np.isfinite(ready.expert_fraction).all()
    assert len(tests) == len(ready.limit)


def test_evaluations_in_space_are_told_by_groups(ready: Ready, policy: tuple[Path, Policy], tmp_path: Path) -> None:
    tried = tried_all(ready.held, ready.tests, SMALL.interface, policy[1])
    journal = Journal(tmp_path, 0)
    journal.evaluation(Evaluation(Counters(), tried, tried.distance / ready.limit, 0.0), ready)
    journal.close()
    found = read_learning(tmp_path)
    assert [group.word for group in found.groups] == ["directions", "turns", NEVER_SHOWN]
    rows = evaluation_rows(found.best)
    assert [row[0] for row in rows][-2:] == ["turns", "directions and gravities never shown"]
    assert {row[0] for row in rows} > {"Out", "turn+x", "directions"}
    assert line_of(found.best).startswith("episode 0: return ")
    assert len(directions_figure(found).axes) == len(found.names)


def test_a_policy_of_a_hand_in_space_is_a_controller_of_the_test(policy: tuple[Path, Policy]) -> None:
    """One that leaves commands as they are holds the object where it was lifted, and its episode ends."""
    entry = find_spatial_controller(str(policy[0]))
    assert entry.policy is not None
    assert (entry.name, entry.policy.digest) == ("still", policy[1].digest)
    assert entry.policy.space == contract_in_space(HELD)
    assert joint_names(HAND)[:3] == tuple(f"{HAND.finger_names[0]} {k}" for k in range(3))
    paths = stacked_paths([spatial_path_of(each) for each in parse_spatial_directions("Out,turn+z")])
    task = SpatialTask(HAND, (CUBE,) * 2, paths, gravity=PULLS[:2])
    starts = np.tile(HAND.start_pose, (2, 1))
    grasp, bench = closed_at(HAND, [PLAIN] * 2, starts), Bench("mujoco", threads=1)
    _, found = simulate(task, grasp, starts, entry.manipulate, bench, holds=SpatialIkController)
    assert found.outcomes == (REACHED, REACHED)
    begun = int(np.argmax(found.phase == len(found.phases) - 1))
    assert (len(found.phase) - begun) * task.control_period == pytest.approx(STILL_TIME)
    moved = found.states[-1].object_pose[:, :3] - found.states[begun - 1].object_pose[:, :3]
    assert np.abs(moved).max() < 1e-3


def test_the_policy_of_the_package_carries_objects_as_far_as_it_is_told() -> None:
    entry, way = find_spatial_controller("rl-privileged"), np.full(len(ASKED), 0.01)
    assert entry.policy is not None
    assert entry.policy.space == contract_in_space(HELD)
    paths = stacked_paths([spatial_path_of(each) for each in ASKED])
    task = SpatialTask(HAND, (CUBE,) * len(ASKED), paths, distance=way, gravity=PULLS)
    starts = np.tile(HAND.start_pose, (len(ASKED), 1))
    grasp, bench = closed_at(HAND, [PLAIN] * len(ASKED), starts), Bench("mujoco", threads=1)
    _, found = simulate(task, grasp, starts, entry.manipulate, bench, holds=SpatialIkController)
    assert set(found.outcomes) == {REACHED}
    begun = int(np.argmax(found.phase == len(found.phases) - 1))
    space = space_of(ASKED, PULLS)
    aim = SpatialAim(space.along, space.about, found.states[begun - 1].object_pose)
    last = np.stack([found.states[row].object_pose[k] for k, row in enumerate(found.last)])
    come, across, turned = aim.shift(last).T
    np.testing.assert_allclose(come, way, atol=1e-3)
    assert across.max() < 1e-3
    assert np.rad2deg(turned.max()) < 2.0


def test_a_policy_is_told_to_go_a_little_less_far_than_the_expert() -> None:
    paths = stacked_paths([spatial_path_of(each) for each in ASKED])
    way = np.array([0.05, 0.002, 0.06, 0.05])
    expected = [0.047, 0.0, 0.057, 0.05 - 0.1 * TURN_ARM]
    np.testing.assert_allclose(shorter(paths, way), expected, atol=1e-9)


def test_a_policys_grasps_are_the_experts_with_less_far_to_go(monkeypatch: pytest.MonkeyPatch) -> None:
    paths, count = [spatial_path_of(each) for each in ASKED], len(ASKED)
    tried = [Tried(PLAIN, 0.02 + 0.01 * k, 0.0) for k in range(count)]
    monkeypatch.setattr(spatial_rehearsal, "_searched_together", lambda *_: [])
    monkeypatch.setattr(spatial_rehearsal, "tried_together", lambda *_: tried)
    worlds = np.tile(PULLS[0], (count, 1)), np.tile(HAND.start_pose, (count, 1))
    expert, mine = (
        find_spatial_controller(name).grasp(HAND, CUBE, paths, *worlds, bench=Bench(SPATIAL), shared=True)
        for name in ("ik", "rl-privileged")
    )
    assert expert.way is not None
    assert mine.way is not None
    np.testing.assert_array_equal(mine.closed, expert.closed)
    np.testing.assert_array_equal(mine.way, shorter(stacked_paths(paths), expert.way))
    assert (mine.way < expert.way).all()


def test_hands_that_a_policy_does_not_know_are_refused(policy: tuple[Path, Policy]) -> None:
    entry = learned_in_space("mine", policy[1])
    check_known_in_space(entry, HAND)
    check_known_in_space(CONTROLLERS["ik"], parse_spatial_name("4f_60.60_40_10"))
    with pytest.raises(InputError, match=r"3f_60.60_40_10, fingers of 3, 3, 3 joints; hand '4f.* 3, 3, 3, 3"):
        check_known_in_space(entry, parse_spatial_name("4f_60.60_40_10"))
    assert len(notes_in_space(entry, HAND, CUBE)) == 1
    assert "here it moves sphere with" in notes_in_space(entry, HAND, replace(CUBE, name="sphere"))[1]
    assert notes_in_space(CONTROLLERS["ik"], HAND, CUBE) == ()
    held = Held(load_hand("2v2_50.50_50.50_1.1_53"), load_object("cube_39"))
    with pytest.raises(InputError, match=r"with 3f_60.60_40_10, a hand in space, and hand '2v2.*' is in the plane"):
        check_known(learned("mine", policy[1]), held, np.zeros((1, 2, 3)))
    with pytest.raises(InputError, match=r"policy 'rl' was trained with 2v2.* in the plane: train one with a hand"):
        learned_in_space("rl", find_controller("rl").policy or policy[1])


def test_sequences_in_space_are_not_a_policys(policy: tuple[Path, Policy]) -> None:
    with pytest.raises(InputError, match="a hand in space: a policy knows single primitives"):
        inhand.trace("helix", hand="3f_60.60_40_10", object="cube_50", controller=str(policy[0]))


def test_paths_that_a_policy_does_not_know_are_refused(policy: tuple[Path, Policy]) -> None:
    bent = np.array([[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.01, 0.0]]])
    with pytest.raises(InputError, match="straight primitives and turns about one axis; for paths that bend"):
        units_of(SpatialPath(bent, np.zeros_like(bent)))
    straight = np.array([[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]])
    with pytest.raises(InputError, match="one after the other"):
        units_of(SpatialPath(straight, straight / TURN_ARM))
    still = np.zeros((1, 2, 3))
    task = SpatialTask(HAND, (CUBE,), SpatialPath(still, still), gravity=PULLS[:1])
    assert SpatialPolicyController(task, policy[1]).reads == "privileged"


@pytest.mark.parametrize("name", ["default", "privileged", "thesis", "smoke"])
def test_presets_are_what_they_are_in_the_plane_with_a_hand_in_space_too(name: str) -> None:
    found = preset(name, SMALL.hand)
    check(found)
    assert (found.held, found.engine) == (HELD, SPATIAL)
    assert find_layout(found.interface.observation).sensed == (name == "default")
    assert preset(name, "2v2_50.50_50.50_1.1_53") == preset(name)
    if name == "thesis":
        assert (found.learning, found.episodes) == (preset(name).learning, preset(name).episodes)
        interface = replace(found.interface, observation="thesis")
        assert interface == preset(name).interface
        words = TrainConfig(preset="thesis", hand=SMALL.hand, object="cube_50")
        assert asked(words) == found
        told = command_of(found, Path("out"))
        assert told is not None
        assert asked(told) == found


def test_a_training_without_states_on_the_way_begins_with_its_pool(ready: Ready) -> None:
    recording = in_space(replace(SMALL, recipe=replace(SMALL.recipe, midway=0.0)))
    assert len(space_pools.midway(recording, ready.starts[0], 0, np.random.default_rng(0))) == 0


def test_the_preset_is_of_a_hand_in_space() -> None:
    config = Training("mine", hand="3f_60.60_40_10", object="cube_50")
    assert config.held == HELD == privileged_spatial().held
    assert privileged_spatial().shows.held == HELD
