"""One place turns what is into what is seen: replacing it changes what controllers see and nothing that is judged."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from inhand.control import loop
from inhand.control.between import Between
from inhand.control.catalogue import rough_grasp
from inhand.control.controller import Controller, Task
from inhand.control.ik import IkController
from inhand.control.loop import Bench, Recording, simulate
from inhand.control.policy import PolicyController
from inhand.control.seen import PRIVILEGED, Reads, View
from inhand.control.user_policy import user_policy
from inhand.geometry import Array, Path
from inhand.learning.batch import Batch
from inhand.learning.environment_config import EnvironmentConfig
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from inhand.tasks.layouts import find_layout
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import parse_directions
from test_simulator import CUBE, HAND

AWAY = np.array([0.003, -0.002, 0.0])
"""How far beside itself the object is seen [m]."""


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The object is seen beside where it is."""

    def sense(state: State, between: Between | None = None, reads: Reads = PRIVILEGED) -> View:
        pose = state.object_pose.copy()
        pose[:, :3] += AWAY
        return before(replace(state, object_pose=pose), between, reads)

    before = loop.sense

    monkeypatch.setattr(loop, "sense", sense)


def carried(make: Callable[[Task], Controller]) -> tuple[Recording, State]:
    """Return what one world left that is carried to the right for a tenth of a second, and the simulator's own end."""
    poses, start = straight_path(parse_directions("Right")[0]).poses[None], HAND.start_pose[None]
    task, grasp = Task(HAND, (CUBE,), Path(poses), SceneSpec().timestep), rough_grasp(HAND, CUBE, start[:, None])
    simulator, recording = simulate(task, grasp, start, make, Bench(threads=1), longest=0.1)
    return recording, simulator.measure()


class Watched(IkController):
    """The expert, with what it saw."""

    def __init__(self, task: Task) -> None:
        """See nothing yet."""
        super().__init__(task)
        self.saw: list[Array] = []

    def begin(self, state: State) -> None:
        """Begin as the expert does."""
        self.began = state.object_pose[0, :3]
        super().begin(state)

    def act(self, state: State) -> Array:
        """Decide as the expert does."""
        self.saw.append(state.object_pose[0, :3])
        return super().act(state)


def expert() -> tuple[Recording, Array, State]:
    """Return what the expert left, where it saw the object, first as it began, and the end."""
    made: list[Watched] = []

    def make(task: Task) -> Watched:
        made.append(Watched(task))
        return made[0]

    recording, end = carried(make)
    return recording, np.array([made[0].began, *made[0].saw]), end


def places(recording: Recording) -> Array:
    """Return where the object was as the last phase began and when it decided `(1 + T, 3)` [m]."""
    last = np.flatnonzero(recording.phase == len(recording.phases) - 1) - 1
    return np.array([recording.states[index].object_pose[0, :3] for index in (last[0], *last)])


@pytest.mark.usefixtures("beside")
def test_an_expert_decides_on_what_is_seen_and_the_recording_holds_what_is() -> None:
    recording, saw, end = expert()
    np.testing.assert_allclose(saw - places(recording), np.tile(AWAY, (len(saw), 1)), atol=1e-12)
    np.testing.assert_array_equal(recording.states[-1].object_pose, end.object_pose)


def test_today_all_is_seen_as_it_is() -> None:
    recording, saw, _ = expert()
    np.testing.assert_array_equal(saw, places(recording))


@pytest.mark.usefixtures("beside")
def test_a_policy_decides_on_what_is_seen() -> None:
    saw: list[NDArray[np.float32]] = []

    def act(seen: NDArray[np.float32]) -> Array:
        saw.append(seen[0])
        return np.zeros((len(seen), 4))

    recording, _ = carried(partial(PolicyController, policy=user_policy(act, "grip", stop=False)))
    place, half = offset("object position from the start [m]")
    from_start = places(recording)[1:, :2] - np.array(HAND.start_position) + AWAY[:2]
    np.testing.assert_allclose(np.array(saw)[:, place : place + 2], from_start / half, atol=1e-6)


@pytest.mark.usefixtures("beside")
def test_an_environment_tells_what_is_seen_and_judges_what_is() -> None:
    config = EnvironmentConfig(directions=[0], starts=2, grasp="rough", observation="grip", actions="steps", threads=1)
    batch: Batch[EnvironmentConfig] = Batch(config, 1, None)
    place, half = offset("object position from the start [m]")
    first, _ = batch.reset(np.random.default_rng(0), None)
    begun = batch.worlds.state.pose
    found = batch.step(np.full((1, 4), -0.1))
    for seen, pose in ((first, begun), (found.successor, found.after.pose)):
        from_start = pose[0, :2] - np.array(HAND.start_position) + AWAY[:2]
        np.testing.assert_allclose(seen[0, place : place + 2], from_start / half, atol=1e-6)
    assert found.info["along"][0] == pytest.approx(found.after.pose[0, 0] - begun[0, 0], abs=1e-12)
    expected = 100 * (found.info["along"][0] - 0.5 * abs(found.info["left"][0]))
    assert found.info["terms"]["direction"][0] == pytest.approx(expected)


def offset(name: str) -> tuple[int, float]:
    """Return where a part of layout `grip` begins, and what in it becomes 1."""
    at = 0
    for part in find_layout("grip").parts:
        if part.name == name:
            return at, float(np.asarray(part.half))
        at += part.size(HAND)
    raise AssertionError(name)
