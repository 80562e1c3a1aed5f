"""Any hand told alike: rows of joints, outlines, and the network over them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand import geometry
from inhand.control.contract import contract_of
from inhand.control.controller import Task
from inhand.control.joint_network import actions_of_joints, joint_sizes
from inhand.control.knowing import check_held
from inhand.control.policy import Policy, PolicyController, load_policy, save_policy
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, inverse_transform, rotate, unit
from inhand.hands.files import load_hand, load_object
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import hand_positions
from inhand.hands.pair_family import PairFamily
from inhand.hands.sides import side_joints
from inhand.sim.engines import make_simulator
from inhand.sim.scene import DECISION_S
from inhand.sim.state import State
from inhand.tasks.hand_arrays import RAYS, SLOTS, arrays_of, ray_lengths, slots_of
from inhand.tasks.joint_rows import COLUMNS, JOINTS
from inhand.tasks.joint_senses import JOINT_SENSES
from inhand.tasks.observations import Aim, Scene, observe
from inhand.tasks.past import LAGS, Past
from inhand.tasks.paths import stacked, straight_path
from inhand.tasks.primitives import TURNS, primitive_at

TWO, THREE = load_hand("2v2_50.50_50.50_1.1_53"), load_hand("2v3_25.75_25.35.40_1.1_53")
CUBE = load_object("cube_39")
NAMES = [name for name, _ in COLUMNS]


def touched(hand: HandSpec, count: int = 1) -> State:
    """Return worlds in which both fingers touch the middle of the cube's sides."""
    simulator = make_simulator("planar", hand, [CUBE] * count, threads=1)
    return simulator.reset(np.tile(hand.start_pose, (count, 1)), np.tile(side_joints(hand, CUBE, 0.0), (count, 1)))


def rows(hand: HandSpec, state: State, aim: Aim) -> dict[str, Array]:
    """Return the rows by name `(B, SLOTS)`, as numbers with their units."""
    seen = observe(replace(JOINTS, parts=JOINTS.parts[:1]), state, aim, Scene(hand, (CUBE,) * state.n_worlds))
    halves = np.array([half for _, half in COLUMNS])
    found = seen.reshape(state.n_worlds, len(COLUMNS), SLOTS) * halves[:, None]
    return dict(zip(NAMES, np.moveaxis(found, 1, 0), strict=True))


def contacts(hand: HandSpec, state: State, world: int, angles: Array) -> Array:
    """Return where the points of the last links that touch in a world come to at other angles `(2, 2)` [m]."""
    found = []
    for i, place in enumerate(hand.slices):
        tip, turned = place.stop + i, (angles - state.joint_angles[world])[place].sum()
        was, now = (hand_positions(hand, each)[tip] for each in (state.joint_angles[world], angles))
        found.append(now + rotate(turned, state.finger_xy[world, i] - was))
    return np.array(found)


@pytest.mark.parametrize("hand", [TWO, THREE])
def test_steps_carry_both_contacts_as_the_object_moves(hand: HandSpec) -> None:
    """By finite differences: the joints' step for 1 mm on moves each contact by that, along the aim or round a turn."""
    state = touched(hand, 2)
    aim = Aim(np.array([0.7, 0.0]), state.pose, 0.05, turn=np.array([0.0, 1.0]))
    found, places = rows(hand, state, aim), slots_of(hand)
    for world in (0, 1):
        step = found["step for 1 mm on [rad]"][world][places]
        before, after = (contacts(hand, state, world, state.joint_angles[world] + k * step) for k in (0.0, 1.0))
        arm = state.finger_xy[world] - state.pose[world, :2]
        turned = 1e-3 / TURN_ARM * np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        wanted = np.tile(1e-3 * unit(0.7), (2, 1)) if world == 0 else turned
        assert np.allclose(after - before, wanted, atol=6e-5)
    assert np.allclose(found["command ahead of the joint [rad]"][:, places], state.targets - state.joint_angles)
    empty = np.setdiff1d(np.arange(SLOTS), places)
    assert all((found[name][:, empty] == 0).all() for name in NAMES)
    assert (found["there"][:, places] == 1).all()


def test_what_the_object_is_off_is_told_as_steps_back_and_what_is_asked_is_not() -> None:
    state = touched(TWO)
    start = state.pose - [[0.0, 0.002, 0.0]]  # the object is 2 mm away from the palm of where it began
    off, on = (rows(TWO, state, Aim(np.array([a]), start, 0.05)) for a in (0.0, np.pi / 2))
    back, ahead = "step back to the line [rad]", "step for 1 mm on [rad]"
    assert np.allclose(off[back], -2 * on[ahead], atol=1e-9)
    assert np.allclose(on[back], 0.0, atol=1e-12)
    assert np.allclose(on["step to the end, at most 10 mm [rad]"], 10 * on[ahead])
    near = rows(TWO, state, Aim(np.array([np.pi / 2]), start, 0.003))
    assert np.allclose(near["step to the end, at most 10 mm [rad]"], on[ahead], atol=1e-9)


def test_the_grip_angle_presses_each_finger_on_the_object() -> None:
    """Commands that far beyond the joints push both fingertips towards each other."""
    state = touched(TWO)
    angle = rows(TWO, state, Aim(np.zeros(1), state.pose, 0.05))["angle of the grip [rad]"][0][slots_of(TWO)]
    before, after = (hand_positions(TWO, state.joint_angles[0] + k * angle) for k in (0.0, 0.01))
    assert (after - before)[2, 0] > 0 > (after - before)[5, 0]


@pytest.mark.parametrize("hand", [TWO, THREE])
def test_what_is_believed_is_told_as_what_is_so_and_what_was_before_beside_it(hand: HandSpec) -> None:
    """Where the belief is true and fingers touch without a gap the rows are those of the state."""
    state, places = touched(hand, 2), slots_of(hand)
    state = replace(state, gaps=np.zeros((2, 2)), object_points=state.finger_points)
    before = state.joint_angles - 0.01 * np.arange(len(LAGS))[:, None, None]
    commands = np.stack([state.targets, *[before[k] + 0.02 * k for k in range(1, len(LAGS))]])
    velocity = np.array([[0.03, -0.01, 0.2], [0.0, 0.02, -0.1]])
    points = inverse_transform(state.pose[:, None], state.finger_xy)
    frames, none = np.repeat(state.pose[None], len(LAGS), axis=0), np.zeros((len(LAGS), 2))
    still = before[0], state.pose, np.zeros(2, bool), state.pose, state.pose
    past = Past(before, commands, frames, none, *still, velocity, points, np.zeros((2, 2)))
    scene, aim = Scene(hand, (CUBE, CUBE)), Aim(np.array([0.7, 0.0]), state.pose, 0.05, turn=np.array([0.0, 1.0]))
    speed = (before[0] - before[2]) / (LAGS[2] * DECISION_S)
    linear = np.pad(velocity[:, :2], ((0, 0), (0, 3)))
    true = replace(state, joint_velocities=speed, object_velocity=np.hstack([linear, velocity[:, 2:]]))
    seen, told = observe(JOINT_SENSES, past, aim, scene), observe(JOINTS, true, aim, scene)
    count = len(COLUMNS) * SLOTS
    assert np.allclose(seen[:, :count], told[:, :count], atol=1e-9)
    whole = told.shape[1] - count
    start = JOINT_SENSES.columns * SLOTS
    assert np.allclose(seen[:, start : start + whole], told[:, count:], atol=1e-9)
    own = seen[:, count:start].reshape(2, -1, SLOTS)[:, :, places]
    assert np.allclose(own[:, :4], np.clip(30 * 0.01 * np.arange(1, 5), -1, 1)[:, None])
    assert np.allclose(own[:, 4:], 5 * 0.02 * np.arange(1, 5)[:, None])


def test_outlines_are_distances_over_angles() -> None:
    rays = ray_lengths(CUBE)
    assert np.allclose(rays[[0, 2, 4]], [0.0195, 0.0195 * np.sqrt(2), 0.0195])
    assert np.allclose(ray_lengths(load_object("cylinder_40")), 0.02, atol=2e-4)
    assert (ray_lengths(load_object("hourglass")) > 0.01).all()
    arrays = arrays_of([TWO, TWO], [CUBE, load_object("cylinder_40")])
    assert np.array_equal(arrays.outline[0], rays)
    assert arrays.outline.shape == (2, RAYS)


def layers(seed: int = 3) -> list[tuple[Array, Array]]:
    rng, size = np.random.default_rng(seed), JOINTS.size(TWO)
    return [
        (rng.standard_normal(s) / np.sqrt(s[0]), rng.standard_normal(s[1]))
        for s in joint_sizes(size, len(COLUMNS), (8, 8))
    ]


def test_the_network_says_the_same_of_joints_in_another_order_and_nothing_of_empty_slots() -> None:
    rng = np.random.default_rng(0)
    seen = rng.uniform(-1, 1, (5, JOINTS.size(TWO)))
    count = len(COLUMNS) * SLOTS
    seen[:, :SLOTS] = 1.0
    swapped = seen.copy()
    order = np.array([3, 4, 5, 0, 1, 2])  # the fingers change places
    swapped[:, :count] = seen[:, :count].reshape(5, -1, SLOTS)[..., order].reshape(5, -1)
    one, other = (actions_of_joints(layers(), each, np) for each in (seen, swapped))
    assert one.shape == (5, SLOTS)
    assert np.allclose(one[:, order], other)
    seen[:, [2, 5]] = 0.0
    few = actions_of_joints(layers(), seen, np)
    assert (few[:, [2, 5]] == 0).all()
    changed = seen.copy()
    changed[:, SLOTS + 2] = 0.5  # a number of an empty slot
    assert np.array_equal(actions_of_joints(layers(), changed, np), few)
    assert not np.allclose(few[:, 0], one[:, 0])


def test_jax_and_numpy_give_the_same_actions() -> None:
    jax = pytest.importorskip("jax", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")
    seen = np.random.default_rng(1).uniform(-1, 1, (4, JOINTS.size(TWO))).astype(np.float32)
    found = actions_of_joints(layers(), jax.numpy.asarray(seen), jax.numpy)
    assert np.allclose(found, actions_of_joints(layers(), seen, np), atol=1e-5)


def a_policy(family: PairFamily | None = None) -> Policy:
    weights, biases = zip(*layers(), strict=True)
    trained = {"hand": TWO.name, "object": CUBE.name}
    seen = Policy(weights, biases, "joints", "steps", "planned", trained, contract_of(TWO, None))
    return replace(seen, network="joints", family=family)


def test_a_policy_over_joints_is_kept_with_its_family_and_runs_on_any_form_of_hand(tmp_path: Path) -> None:
    save_policy(a_policy(PairFamily()), tmp_path)
    policy = load_policy(tmp_path)
    assert (policy.network, policy.family) == ("joints", PairFamily())
    for hand in (TWO, THREE):
        paths = stacked([straight_path(each).poses for each in (primitive_at(45.0), *TURNS)])
        task = Task(hand, (CUBE,) * 3, geometry.Path(paths), distance=np.full(3, 0.02))
        controller, state = PolicyController(task, policy), touched(hand, 3)
        controller.begin(state)
        targets = controller.act(state)
        assert targets.shape == (3, hand.n_joints)
        assert not np.allclose(targets[1], targets[2])


def test_hands_and_objects_outside_the_family_are_refused_with_the_range() -> None:
    policy = a_policy(PairFamily())
    check_held(policy, THREE, (CUBE,))
    with pytest.raises(InputError, match=r"palm width is 90 mm, the family's 40 to 80 mm; use a hand within, or train"):
        check_held(policy, load_hand("2v2_50.50_50.50_1.1_90"))
    with pytest.raises(InputError, match=r"longer side is 60\.0 mm.*; use an object within, or train"):
        check_held(policy, TWO, (CUBE, load_object("cube_60")))
    check_held(a_policy(), load_hand("2v2_50.50_50.50_1.1_90"))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"observation": "grip"}, "a network over joints has two layers or more and sees a layout with slots"),
        ({"weights": tuple(w[:-1] if k == 1 else w for k, (w, _) in enumerate(layers()))}, "1.weight has the shape"),
    ],
)
def test_weights_that_fit_no_network_over_joints_are_refused(change: dict[str, Any], text: str, tmp_path: Path) -> None:
    save_policy(replace(a_policy(), **change), tmp_path)
    with pytest.raises(InputError, match=text):
        load_policy(tmp_path)


def test_hidden_layers_of_a_network_over_joints_have_one_size() -> None:
    with pytest.raises(InputError, match=r"hidden layers of \(8, 16\) units: a network over joints has one size"):
        joint_sizes(JOINTS.size(TWO), len(COLUMNS), (8, 16))
