"""Nothing but hands and the planar controllers assumes two fingers: three go through all the rest."""

from dataclasses import fields, replace

import numpy as np
import pytest

from inhand.control.loop import control_step, dropped, lost_steps
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.state import State, select
from inhand.tasks.decisions import REWARDS, Decision, reward
from inhand.tasks.layouts import LAYOUTS
from inhand.tasks.observations import Aim, Scene, observe
from inhand.tasks.past import LAGS, Past

CUBE = CATALOGUE["cube_39"]


class ThreeFingers(HandSpec):
    """The default hand with a short finger in the middle of the palm, which does not reach the object."""

    @property
    def fingers(self) -> tuple[FingerSpec, ...]:
        """The two of every hand, and the third."""
        return self.left, self.right, FingerSpec((0.0, 0.0), (0.02, 0.015), ((-1.0, 1.0), (-1.0, 1.0)), 1)

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Names of all three."""
        return "left", "right", "middle"


TWO = parse_hand_name("2v2_50.50_50.50_1.1_53")
HAND = ThreeFingers(**{field.name: getattr(TWO, field.name) for field in fields(TWO)})


@pytest.fixture(scope="module")
def stepped() -> tuple[State, State]:
    """Return the states of two worlds before and after a step."""
    simulator = MujocoSimulator(HAND, [CUBE, CUBE], threads=1)
    before = simulator.reset(np.tile(HAND.start_pose, (2, 1)), np.tile([0.4, 0.0, -0.4, 0.0, 0.0, 0.0], (2, 1)))
    after, _ = control_step(simulator, before.targets, np.zeros(2, dtype=np.int64), 5)
    return before, after


def test_a_simulator_measures_every_finger(stepped: tuple[State, State]) -> None:
    state = stepped[1]
    for points in (state.finger_points, state.object_points, state.normals, state.forces):
        assert points.shape == (2, 3, 3)
    assert state.gaps.shape == state.contact_links.shape == state.touching.shape == (2, 3)
    assert state.link_gaps.shape == (2, 6)
    middle = HAND.start_position[1] - 0.039 / 2 - 0.035  # straight up to the cube's side
    np.testing.assert_allclose(state.gaps[:, 2], middle, atol=1e-3)


@pytest.mark.parametrize(
    "name", [name for name, layout in LAYOUTS.items() if not (layout.sensed or layout.columns or layout.space)]
)
def test_every_layout_sees_every_finger(name: str, stepped: tuple[State, State]) -> None:
    layout, state = LAYOUTS[name], replace(stepped[1], gaps=np.zeros((2, 3)), link_gaps=np.zeros((2, 6)))
    aim = Aim(np.zeros(2), state.pose, np.full(2, 0.05), 0.0, state.pose)
    seen = observe(layout, state, aim, Scene(HAND, (CUBE, CUBE)))
    assert seen.shape == (2, layout.size(HAND))
    for finger in range(3):
        gaps, link_gaps = state.gaps.copy(), state.link_gaps.copy()
        gaps[:, finger], link_gaps[:, HAND.slices[finger]] = 0.004, 0.004
        other = replace(state, gaps=gaps, link_gaps=link_gaps)
        assert (observe(layout, other, aim, Scene(HAND, (CUBE, CUBE))) != seen).any()


@pytest.mark.parametrize("name", ["joints", "commands", "first", "points", "askew"])
def test_what_is_sensed_of_every_finger_is_seen(name: str) -> None:
    lags, poses = len(LAGS), np.zeros((2, 3))
    joints, frames = np.zeros((lags, 2, HAND.n_joints)), np.zeros((lags, 2, 3))
    grips = np.zeros((2, 3, 2)), np.zeros((2, 3))
    past = Past(
        joints, joints, frames, np.zeros((lags, 2)), joints[0], poses, np.ones(2, bool), poses, poses, poses, *grips
    )
    layout, aim, scene = LAYOUTS["senses"], Aim(np.zeros(2), poses, np.full(2, 0.05)), Scene(HAND, (CUBE, CUBE))
    seen = observe(layout, past, aim, scene)
    assert seen.shape == (2, layout.size(HAND))
    for finger in range(3):
        of_finger = HAND.slices[finger] if name in ("joints", "commands", "first") else finger
        values = getattr(past, name).copy()
        values[(..., of_finger, slice(None)) if name == "points" else (..., of_finger)] = 0.01
        assert (observe(layout, replace(past, **{name: values}), aim, scene) != seen).any()


@pytest.mark.parametrize("name", REWARDS)
def test_every_reward_is_paid_for_every_finger(name: str, stepped: tuple[State, State]) -> None:
    before, after = stepped
    decision = Decision(
        before, after, np.zeros((2, 6)), np.zeros((2, 6)), np.zeros(2, dtype=bool), Aim(np.zeros(2), after.pose, 0.05)
    )
    value, terms = reward(REWARDS[name], decision)
    assert value.shape == (2,)
    if "contact" in terms:
        np.testing.assert_allclose(terms["contact"], -np.exp(after.gaps.sum(axis=1)) / 100)


def test_an_object_is_held_while_every_finger_touches(stepped: tuple[State, State]) -> None:
    touching = replace(select(stepped[1], slice(None)), gaps=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.01]]))
    lost = lost_steps(np.array([15, 20]), touching, 5)
    np.testing.assert_array_equal(lost, [0, 25])
    np.testing.assert_array_equal(dropped(touching, lost), [False, True])
