"""The rehearsal of grasps: the choice is that of carrying them all, and few are carried."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from inhand.control import rehearsal
from inhand.control.controller import Task
from inhand.control.ik import IkConfig
from inhand.control.phases import Phase
from inhand.control.rehearsal import LOSS, carried, first_best, rehearsed
from inhand.control.trial import LOST_CONTACT, REACHED, TIME_OUT
from inhand.geometry import Array, Path
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.sim import memory
from inhand.sim.engine import Simulator
from inhand.sim.state import State
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import primitive_at
from test_episodes import Scripted, state_with

Find = Callable[[NDArray[np.int64]], Array]


def best_of_all(worth: Array, most: Array, owner: NDArray[np.int64], find: Find) -> list[int]:
    """Choose as `first_best` does, but carry every grasp."""
    del most
    unknown = np.flatnonzero(np.isneginf(worth))
    worth[unknown] = find(unknown)
    return [int(np.flatnonzero(owner == k)[worth[owner == k].argmax()]) for k in range(owner[-1] + 1)]


@given(st.lists(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5)), min_size=1, max_size=6), min_size=1))
def test_the_first_of_the_best_is_found_whatever_the_bounds_and_the_ties(groups: list[list[tuple[int, int]]]) -> None:
    """Each grasp has a bound and a way: short of it by some steps, lost at 4 of them, no grip at 5."""
    owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    most, short = np.array([pair for group in groups for pair in group], dtype=float).T
    real = np.where(short < 4, np.maximum(most - short, 0.0), most - 10.0)
    worth, asked = np.where(short == 5, -10.0, -np.inf), list[int]()

    def find(which: NDArray[np.int64]) -> Array:
        for k in which:  # none that cannot be the best any more
            others = worth[owner == owner[k]]
            assert most[k] >= others.max()
        asked.extend(which.tolist())
        return np.asarray(real[which])

    known = worth.copy()
    expected = best_of_all(known, most, owner, lambda which: real[which])
    assert first_best(worth, most, owner, find) == expected
    assert len(set(asked)) == len(asked)


def test_where_the_farthest_arrives_no_other_is_carried() -> None:
    most, asked = np.array([0.1, 0.3, 0.3, 0.2]), list[int]()

    def find(which: NDArray[np.int64]) -> Array:
        asked.extend(which.tolist())
        return np.asarray(most[which])

    assert first_best(np.full(4, -np.inf), most, np.zeros(4, dtype=np.int64), find) == [1]
    assert asked == [1]


@pytest.mark.parametrize(
    ("hand", "thing", "noise"),
    [
        ("2v2_50.50_50.50_1.1_53", "cube_39", 0.001),
        ("2v3_25.75_25.35.40_1.1_53", "ellipse_40x25", 0.003),
    ],
)
def test_the_choice_is_that_of_carrying_all(
    hand: str, thing: str, noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = Held(parse_hand_name(hand), OBJECTS[thing])
    lines = [straight_path(primitive_at(angle)).poses for angle in (0.0, -112.5)]
    poses = held.hand.start_pose + np.repeat(np.stack(lines), 2, axis=0)
    starts = poses[:, 0] + np.random.default_rng(1).normal(0.0, (noise, noise, 20 * noise), (4, 3))
    counts = list[int]()

    def counted(
        simulator: Simulator, task: Task, gripped: State, worlds: NDArray[np.int64], config: IkConfig | None
    ) -> Array:
        counts[-1] += len(worlds)
        return carried(simulator, task, gripped, worlds, config)

    monkeypatch.setattr(rehearsal, "carried", counted)
    found = []
    for choose in (first_best, best_of_all):
        counts.append(0)
        monkeypatch.setattr(rehearsal, "first_best", choose)
        found.append(rehearsed(held, poses, starts, engine="planar")[0])
    lazy, everything = found
    for one, other in zip(lazy, everything, strict=True):
        np.testing.assert_array_equal(one.contacts, other.contacts)
        np.testing.assert_array_equal(one.joints, other.joints)
        assert one.drawn == other.drawn
    assert counts[0] < 0.6 * counts[1]


def test_worlds_are_rehearsed_in_parts_that_hold_whole_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "REHEARSALS", 5 * memory.WORLD_BYTES["bullet"])
    assert list(memory.batches("bullet", [2, 2, 2, 5, 7, 1])) == [
        slice(0, 2),
        slice(2, 3),
        *map(slice, (3, 4, 5), (4, 5, 6)),
    ]
    assert list(memory.batches("planar", [2] * 1000)) == [slice(0, 1000)]
    held = Held(parse_hand_name("2v2_50.50_50.50_1.1_53"), OBJECTS["cube_39"])
    poses = held.hand.start_pose + np.stack([straight_path(primitive_at(angle), 0.03).poses for angle in (0.0, 90.0)])
    whole = rehearsed(held, poses, poses[:, 0])[0]
    monkeypatch.setattr(memory, "REHEARSALS", 1.0)
    for one, other in zip(whole, rehearsed(held, poses, poses[:, 0])[0], strict=True):
        np.testing.assert_array_equal(one.joints, other.joints)


def test_a_grasp_is_worth_how_far_it_goes_and_a_lost_object_costs_more_than_any_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hand, cube = parse_hand_name("2v2_50.50_50.50_1.1_53"), OBJECTS["cube_39"]
    paths = np.tile(straight_path(primitive_at(90.0)).poses, (4, 1, 1))
    task = Task(hand, (cube,) * 4, Path(paths), distance=np.full(4, 0.1))
    gripped, worlds = state_with(np.ones((4, 2), dtype=bool)), np.array([0, 2, 3])

    longest = list[float]()

    def run(
        _: Simulator, task: Task, phases: tuple[Phase], start: State, *, worlds: NDArray[np.bool_]
    ) -> SimpleNamespace:
        assert worlds.tolist() == [True, False, True, True]
        (phase,) = phases
        longest.append(phase.longest)
        controller = phase.controller(task)
        controller.begin(start)
        for _number in range(30):
            np.testing.assert_array_equal(controller.act(start)[1], start.targets[1])
        assert controller.finished(start)[1]
        return SimpleNamespace(outcomes=(REACHED, TIME_OUT, LOST_CONTACT, TIME_OUT), last=np.array([30, 0, 30, 10]))

    monkeypatch.setattr(rehearsal, "run_episodes", run)
    found = carried(Scripted(np.ones((1, 4, 2), dtype=bool)), task, gripped, worlds, None)
    assert 0 < found[2] < found[0] < 0.1
    assert found[1] == found[0] - LOSS
    far = replace(task, distance=np.array([0.1, 0.0, 2.0, 0.1]))
    carried(Scripted(np.ones((1, 4, 2), dtype=bool)), far, gripped, worlds, None)
    assert longest == [8.0, 100.0]  # to the end of the longest way


@pytest.mark.parametrize("fixed", [False, True])
def test_a_drawing_is_rehearsed_where_it_is(fixed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    held = Held(parse_hand_name("2v2_50.50_50.50_1.1_53"), OBJECTS["cube_39"])
    poses = held.hand.start_pose + straight_path(primitive_at(0.0), 0.04).poses[None]
    starts = poses[:, 0] - np.array([0.004, 0.0, 0.0])
    ends = list[float]()

    def followed(
        simulator: Simulator, task: Task, gripped: State, worlds: NDArray[np.int64], config: IkConfig | None
    ) -> Array:
        found = carried(simulator, task, gripped, worlds, config)
        ends.extend((simulator.measure().pose[worlds, 0] - poses[0, 0, 0]).tolist())
        return found

    monkeypatch.setattr(rehearsal, "carried", followed)
    rehearsed(held, poses, starts, engine="planar", fixed=fixed)
    assert ends[0] == pytest.approx(0.04 if fixed else 0.036, abs=5e-4)
