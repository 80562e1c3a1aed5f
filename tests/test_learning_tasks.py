"""What a learned controller sees, does and is rewarded for."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand.control.memory import Memory
from inhand.control.seen import exact
from inhand.errors import InputError
from inhand.geometry import Array, inverse_transform, spatial
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.state import State
from inhand.tasks.decisions import (
    FINE_STEP,
    LARGEST_STEP,
    REWARDS,
    Actions,
    Decision,
    actions_of,
    find_reward,
    reward,
    targets_of,
)
from inhand.tasks.joint_rows import COLUMNS, ROWS
from inhand.tasks.joint_senses import BEFORE, WIDTH
from inhand.tasks.layouts import LAYOUTS, find_layout
from inhand.tasks.observations import LARGEST_SIZE, THESIS, Aim, Layout, Scene, by_rank, observe
from inhand.tasks.past import Past
from test_simulator import CUBE, HAND, mirrored_joints, run, shaken

SCENE = Scene(HAND, (CUBE,) * 3)
PLANAR = [name for name, layout in LAYOUTS.items() if not layout.space]


def viewed(layout: Layout, state: State) -> State | Past:
    """Return what a layout is of, where nothing has been sensed before a state."""
    return Memory(Held(HAND, CUBE), exact(state)).past if layout.sensed else state


KINDS: tuple[Actions, ...] = ("angles", "steps", "fine")


def held(count: int = 3, seed: int = 1) -> State:
    """Return worlds in motion that hold the object, each differently."""
    targets = np.stack([shaken(HAND, CUBE, 12, seed + k) for k in range(count)], axis=1)
    return run(MujocoSimulator(HAND, [CUBE] * count, threads=1), targets[:8], turn=0.05)[-1]


def at(state: State, *poses: tuple[float, float, float]) -> State:
    """Return the state with the objects elsewhere `(x, y, theta)`."""
    return replace(state, object_pose=spatial(np.array(poses), CUBE.height / 2))


def aimed(state: State, angles_deg: tuple[float, ...] = (0.0, 100.0, -170.0), distance: float = np.inf) -> Aim:
    start = state.pose - (0.004, -0.003, 0.02)
    end = start + np.array([0.02, -0.03, 0.1])
    return Aim(np.deg2rad(angles_deg), start, np.full(state.n_worlds, distance), 0.25, end)


# The aim.


def test_shift_is_told_along_and_to_the_left_of_the_direction() -> None:
    aim = Aim(np.deg2rad([90.0, 180.0]), np.array([[0.0, 0.1, 0.2], [0.01, 0.1, 3.1]]), np.array([0.03, np.inf]))
    pose = np.array([[0.004, 0.11, 0.1], [0.0, 0.098, -3.1]])
    expected = [[0.01, -0.004, -0.1], [0.01, 0.002, 2 * np.pi - 6.2]]
    np.testing.assert_allclose(aim.shift(pose), expected, atol=1e-12)
    np.testing.assert_allclose(aim.left(pose), [0.02, np.inf])
    np.testing.assert_allclose(aim.goal(np.array([0.02, 0.03])), [[0.0, 0.12, 0.2], [-0.02, 0.1, 3.1]], atol=1e-12)
    np.testing.assert_allclose(aim.shift(aim.goal(0.05)), [[0.05, 0.0, 0.0]] * 2, atol=1e-12)


# Observations.


def sizes(layout: Layout) -> list[tuple[str, int]]:
    """Return name and size of every part."""
    return [(part.name, part.size(HAND)) for part in layout.parts]


def test_the_thesis_layout_is_table_3_1() -> None:
    assert [name.split(" [")[0] for name, _ in sizes(THESIS)] == [
        "direction",
        "object position x, y",
        "object orientation",
        "object size l, b, h",
        "distance of each link to the object",
        "end of each link x, y",
        "joint angles",
    ]
    assert [size for _, size in sizes(THESIS)] == [1, 2, 1, 3, 4, 8, 4]
    assert THESIS.size(HAND) == 23
    assert THESIS.size(parse_hand_name("2v3_25.75_25.35.40_1.1_53")) == 27


def test_the_thesis_observation_is_every_number_over_its_range() -> None:
    state = held()
    seen = observe(THESIS, state, aimed(state), SCENE)
    (upper, lower), base = HAND.left.links, HAND.left.base
    reach = abs(base[0]) + upper + lower
    x, y, theta = state.pose.T
    rank = [0, 2, 1, 3]  # both proximal joints, left first, then both distal ones
    limits = HAND.limits[rank]
    np.testing.assert_allclose(seen[:, 0], [0.0, 100 / 180, -170 / 180])
    np.testing.assert_allclose(seen[:, 1:3], np.stack([x / reach, y / (reach / 2) - 1], axis=1))
    np.testing.assert_allclose(seen[:, 3], theta / np.pi)
    np.testing.assert_allclose(seen[:, 4:7], [[2 * length / LARGEST_SIZE - 1 for length in CUBE.size]] * 3)
    np.testing.assert_allclose(seen[:, 7:11], np.maximum(state.link_gaps[:, rank] / (reach / 2) - 1, -1.0))
    angles = state.joint_angles
    first = np.stack([-np.sin(angles[:, 0]), np.cos(angles[:, 0])], axis=1) * upper + base
    np.testing.assert_allclose(seen[:, 11:13], first / reach)
    both = angles[:, 2] + angles[:, 3]
    elbow = np.stack([-np.sin(angles[:, 2]), np.cos(angles[:, 2])], axis=1) * upper + HAND.right.base
    tip = elbow + np.stack([-np.sin(both), np.cos(both)], axis=1) * lower
    np.testing.assert_allclose(seen[:, 13:15], elbow / reach)
    np.testing.assert_allclose(seen[:, 17:19], tip / reach)
    expected = 2 * (angles[:, rank] - limits[:, 0]) / (limits[:, 1] - limits[:, 0]) - 1
    np.testing.assert_allclose(seen[:, 19:], expected, atol=1e-12)


def test_the_other_observations_are_every_number_over_its_scale() -> None:
    state = held()
    angles = np.deg2rad([0.0, 100.0, -170.0])
    start, x = state.pose - (0.004, -0.003, 0.02), np.stack([np.cos(angles), np.sin(angles)], axis=1)
    aim = Aim(angles, start, np.full(3, 0.009), 0.25, start + np.array([0.02, -0.03, 0.1]))
    y = np.stack([-x[:, 1], x[:, 0]], axis=1)
    gone, velocity, rank = (state.pose - start)[:, :2], state.object_velocity, [0, 2, 1, 3]
    along, left = (gone * x).sum(axis=1), (gone * y).sum(axis=1)
    columns = [
        *x.T,
        (0.009 - along) / 0.1,
        (0.009 - along) / 0.01,
        along / 0.1,
        left / 0.01,
        (state.pose - start)[:, 2] / 0.2,
        (velocity[:, :2] * x).sum(axis=1) / 0.2,
        (velocity[:, :2] * y).sum(axis=1) / 0.2,
        velocity[:, 5] / 2.0,
        *((state.pose[:, :2] - HAND.start_position) / 0.15).T,
        state.pose[:, 2] / 1.0,
        *(state.joint_angles[:, rank] / np.pi).T,
        *(state.joint_velocities[:, rank] / 4.0).T,
        *((state.targets - state.joint_angles)[:, rank] / 0.2).T,
        *(np.concatenate([inverse_transform(state.pose, state.object_points[:, i, :2]) for i in (0, 1)], 1) / 0.04).T,
        *(state.gaps / 0.005).T,
    ]
    numbers = np.stack(columns, axis=1)
    assert ((np.abs(numbers) < 1) & (np.abs(numbers) > 1e-6)).any(axis=0).all()
    ends = aim.end if aim.end is not None else np.empty(0)
    whole = [
        np.full(3, -0.5),
        *((ends[:, :2] - HAND.start_position) / 0.15).T,
        ends[:, 2] / 1.0,
        *(velocity[:, :2] / 0.2).T,
        *columns[9:],
    ]
    wanted = {"grip": columns, "grip-open": [*columns[:2], *columns[4:]], "whole": whole}
    for name, expected in wanted.items():
        seen = observe(find_layout(name), state, aim, SCENE)
        np.testing.assert_allclose(seen, np.clip(np.stack(expected, axis=1), -1.0, 1.0), atol=1e-9)


def test_joints_are_ranked_from_the_palm_outwards_in_fingers_of_any_length() -> None:
    assert by_rank(HAND) == [0, 2, 1, 3]
    assert by_rank(parse_hand_name("2v3_25.75_25.35.40_1.1_53")) == [0, 2, 1, 3, 4]


@pytest.mark.parametrize("name", PLANAR)
@pytest.mark.parametrize("far", [0.0, 1e-3, 10.0])
@pytest.mark.parametrize("distance", [np.inf, 0.02])
def test_observations_are_finite_numbers_within_one(name: str, far: float, distance: float) -> None:
    state = held()
    poses = state.pose + far * np.array([[1.0, 2.0, 0.3], [-3.0, 1.0, 2.0], [0.5, -9.0, -1.0]])
    wild = replace(
        at(state, *poses.tolist()),
        object_velocity=far * state.object_velocity * 1e3,
        joint_velocities=far * state.joint_velocities * 1e3,
        link_gaps=state.link_gaps + far,
        gaps=state.gaps + far,
    )
    layout = find_layout(name)
    seen = observe(layout, viewed(layout, wild), aimed(state, distance=distance), SCENE)
    assert seen.shape == (3, layout.size(HAND))
    assert np.isfinite(seen).all()
    assert np.abs(seen).max() <= 1.0


@pytest.mark.parametrize("name", PLANAR)
def test_an_observation_is_a_copy(name: str) -> None:
    state = held()
    aim, layout = aimed(state), find_layout(name)
    view = viewed(layout, state)
    seen = observe(layout, view, aim, SCENE)
    arrays = [getattr(view, field.name) for field in fields(view)] + [aim.angle, aim.start]
    assert not any(np.shares_memory(seen, array) for array in arrays)
    before = seen.copy()
    seen[:] = 7.0
    np.testing.assert_array_equal(observe(layout, view, aim, SCENE), before)


def mirrored(state: State) -> State:
    """Return the mirror image of a state, left for right."""
    flip = np.array([1.0, 1.0, -1.0, -1.0])

    def points(array: Array) -> Array:
        return np.asarray(array[:, ::-1] * (-1.0, 1.0, 1.0))

    pose = state.object_pose
    return replace(
        state,
        object_pose=np.concatenate([pose[:, :3] * (-1, 1, 1), pose[:, 3:] * flip], axis=1),
        object_velocity=state.object_velocity * (-1, 1, 1, 1, -1, -1),
        joint_angles=mirrored_joints(HAND, state.joint_angles),
        joint_velocities=mirrored_joints(HAND, state.joint_velocities),
        targets=mirrored_joints(HAND, state.targets),
        link_gaps=-mirrored_joints(HAND, state.link_gaps),
        contact_links=state.contact_links[:, ::-1],
        finger_points=points(state.finger_points),
        object_points=points(state.object_points),
        gaps=state.gaps[:, ::-1],
        forces=points(state.forces),
    )


ROW_SIGNS = (*[1.0] * 3, *[-1.0] * 12, *[1.0] * 3)
BELIEVED_SIGNS = (*ROW_SIGNS, *[-1.0] * len(BEFORE))
MIRRORED: tuple[tuple[str, tuple[int, ...], int | None, Any], ...] = (
    (f"{ROWS}, ", (WIDTH, 2, 3), 2, np.array(BELIEVED_SIGNS)[:, None, None]),
    ("for each joint's slot", (len(COLUMNS), 2, 3), 2, np.array(ROW_SIGNS)[:, None, None]),
    ("line between the contacts", (2,), None, (-1.0, 1.0)),
    ("object position from its start", (3,), None, (-1.0, 1.0, -1.0)),
    ("encoders", (-1, 2), 2, -1.0),
    ("frames", (-1, 3), None, (1.0, -1.0, -1.0)),
    ("object at the start", (-1, 3), None, (-1.0, 1.0, -1.0)),
    ("believed: way along", (-1, 3), None, (1.0, -1.0, -1.0)),
    ("believed: contacts", (-1, 2, 2), 2, (-1.0, 1.0)),
    ("believed: how askew", (-1, 2), 2, -1.0),
    ("joint", (-1, 2), 2, -1.0),
    ("commands", (-1, 2), 2, -1.0),
    ("distance", (-1, 2), 2, 1.0),
    ("gaps", (-1, 2), 2, 1.0),
    ("end of each", (-1, 2, 2), 2, (-1.0, 1.0)),
    ("contacts", (-1, 2, 2), 2, (-1.0, 1.0)),
    *(
        (name, (-1, 2), None, (-1.0, 1.0))
        for name in ("direction, unit", "object position", "end of the task from", "velocity x")
    ),
    ("velocity", (-1, 2), None, (1.0, -1.0)),
    *((name, (-1,), None, -1.0) for name in ("end of the task, orient", "object orientation", "way to the left")),
    *((name, (-1,), None, -1.0) for name in ("angle turned", "spin", "the same of a turn")),
)
"""Parts by how they begin: the shape of their numbers, the axis of fingers that changes sides, and signs."""


def mirrored_parts(name: str, seen: Array) -> Array:
    """Return one part of an observation as its mirror image, but for the direction in degrees."""
    for begins, shape, fingers, sign in MIRRORED:
        if name.startswith(begins):
            found = seen.reshape(len(seen), *shape)
            return np.asarray((found if fingers is None else np.flip(found, fingers)) * sign).reshape(seen.shape)
    return seen


@pytest.mark.parametrize("name", PLANAR)
def test_a_mirrored_state_gives_the_mirrored_observation(name: str) -> None:
    state, layout = held(), find_layout(name)
    aim = aimed(state, distance=0.03)
    assert aim.end is not None
    mirror = Aim(np.pi - aim.angle, aim.start * (-1, 1, -1), aim.distance, aim.share, aim.end * (-1, 1, -1))
    seen = observe(layout, viewed(layout, state), aim, SCENE)
    theirs = observe(layout, viewed(layout, mirrored(state)), mirror, SCENE)
    place = 0
    for part, size in sizes(layout):
        ours, other = seen[:, place : place + size], theirs[:, place : place + size]
        place += size
        if part == "direction [rad]":
            np.testing.assert_allclose(np.cos(np.pi * other), -np.cos(np.pi * ours), atol=1e-12)
            np.testing.assert_allclose(np.sin(np.pi * other), np.sin(np.pi * ours), atol=1e-12)
        else:
            np.testing.assert_allclose(other, mirrored_parts(part, ours), atol=1e-9, err_msg=part)
    assert place == seen.shape[1]


def test_the_grip_layout_tells_way_velocity_and_commands() -> None:
    state = held()
    aim = aimed(state, distance=0.03)
    layout = find_layout("grip")
    observed = observe(layout, state, aim, SCENE)
    names, counts = zip(*sizes(layout), strict=True)
    assert layout.size(HAND) == observed.shape[1] == 31
    seen = dict(zip(names, np.split(observed, np.cumsum(counts)[:-1], axis=1), strict=True))
    shift = aim.shift(state.pose)
    np.testing.assert_allclose(seen["way left to go [m]"][:, 0], (0.03 - shift[:, 0]) / 0.1)
    across = np.clip(shift[:, 1:2] / 0.01, -1, 1)
    np.testing.assert_allclose(seen["way to the left [m]"], across)
    speed = state.object_velocity[:, 0] * np.cos(aim.angle) + state.object_velocity[:, 1] * np.sin(aim.angle)
    np.testing.assert_allclose(seen["velocity along and to the left [m/s]"][:, 0], speed / 0.2)
    ahead = (state.targets - state.joint_angles)[:, [0, 2, 1, 3]]
    np.testing.assert_allclose(seen["commands ahead of the joints [rad]"], ahead / 0.2)
    np.testing.assert_allclose(seen["gaps of the fingers [m]"], state.gaps / 0.005)


def test_the_open_layout_is_the_grip_layout_without_the_way_left() -> None:
    state = held()
    near, far = (observe(find_layout("grip-open"), state, aimed(state, distance=d), SCENE) for d in (0.01, 0.08))
    np.testing.assert_array_equal(near, far)
    grip = [name for name, _ in sizes(find_layout("grip"))]
    assert [name for name in grip if "go" not in name and "end" not in name] == [
        name for name, _ in sizes(find_layout("grip-open"))
    ]


# Actions.


@pytest.mark.parametrize("kind", KINDS)
@given(shares=st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12))
def test_targets_come_back_from_the_actions_that_command_them(kind: Actions, shares: list[float]) -> None:
    limits, share = HAND.limits, np.array(shares).reshape(3, 4)
    low = np.tile(limits[:, 0], (3, 1))
    state = replace(REST, targets=low + 0.5 * (limits[:, 1] - low))
    most = {"steps": LARGEST_STEP, "fine": FINE_STEP}
    within = most[kind] * (2 * share - 1) + state.targets if kind in most else low + share * (limits[:, 1] - low)
    actions = actions_of(within, kind, HAND, state)
    assert np.abs(actions).max() <= 1.0
    np.testing.assert_allclose(targets_of(actions, kind, HAND, state), within, atol=1e-12)


REST = held()


def test_angles_span_the_limits_of_the_joints() -> None:
    low, high = HAND.limits.T
    for action, expected in ((-1.0, low), (0.0, (low + high) / 2), (1.0, high), (-3.0, low), (np.inf, high)):
        found = targets_of(np.full((3, 4), action), "angles", HAND, REST)
        np.testing.assert_allclose(found, np.tile(expected, (3, 1)), atol=1e-12)
    np.testing.assert_array_equal(actions_of(np.tile(high + 1.0, (3, 1)), "angles", HAND, REST), np.ones((3, 4)))


def test_steps_move_the_last_targets_on_and_stay_within_the_limits() -> None:
    moved = targets_of(np.full((3, 4), 0.5), "steps", HAND, REST)
    np.testing.assert_allclose(moved, REST.targets + 0.5 * LARGEST_STEP)
    fine = targets_of(np.full((3, 4), 0.5), "fine", HAND, REST)
    np.testing.assert_allclose(fine, REST.targets + 0.5 * FINE_STEP)
    np.testing.assert_allclose(targets_of(np.full((3, 4), -8.0), "steps", HAND, REST), REST.targets - LARGEST_STEP)
    edge = replace(REST, targets=np.tile(HAND.limits[:, 1], (3, 1)))
    np.testing.assert_array_equal(targets_of(np.ones((3, 4)), "steps", HAND, edge), edge.targets)
    np.testing.assert_array_equal(actions_of(REST.targets + 1.0, "steps", HAND, REST), np.ones((3, 4)))
    assert targets_of(np.zeros((3, 4)), "steps", HAND, REST) is not REST.targets


# Rewards.


def decision(
    after: State, before: State | None = None, distance: float = np.inf, dropped: tuple[bool, ...] = (False, False)
) -> Decision:
    """Return a decision of two worlds: one that moves along +y from 0.1, one along -x from 0.02."""
    aim = Aim(np.deg2rad([90.0, 180.0]), np.array([[0.0, 0.1, 0.0], [0.02, 0.1, 0.5]]), np.full(2, distance))
    action = np.array([[0.0, 0.5, 1.0, -1.0], [0.0] * 4])
    last = np.array([[0.0, 0.0, 0.0, 1.0], [0.0] * 4])
    return Decision(after if before is None else before, after, action, last, np.array(dropped), aim)


def test_the_thesis_reward_is_its_formula() -> None:
    gaps = np.array([[0.002, -0.001], [0.0, 0.0]])
    state = replace(at(held(2), (0.004, 0.11, 0.0), (0.05, 0.098, 0.5)), gaps=gaps)
    total, terms = reward(find_reward("thesis"), decision(state))
    np.testing.assert_allclose(terms["contact"], [-np.exp(0.002) / 100, -0.01])
    np.testing.assert_allclose(terms["direction"], [100 * (0.01 - 0.002), 100 * (-0.03 - 0.001)])
    np.testing.assert_allclose(total, terms["contact"] + terms["direction"])


def test_the_contact_reward_is_cut_where_the_gap_is_metres_wide() -> None:
    gaps = np.array([[3.5, 3.5], [3.0, 3.0]])
    _, terms = reward(find_reward("thesis"), decision(replace(held(2), gaps=gaps)))
    np.testing.assert_allclose(terms["contact"], [-100.0, -np.exp(6.0) / 100])


def test_the_terms_of_progress_are_what_they_say() -> None:
    start = held(2)
    before = at(start, (0.0, 0.145, 0.0), (0.0, 0.1, 0.5))
    after = at(start, (0.0015, 0.155, -0.03), (-0.0105, 0.1, 0.5))
    total, terms = reward(find_reward("progress"), decision(after, before, 0.05, (False, True)))
    np.testing.assert_allclose(terms["progress"], [100 * 0.005, 100 * 0.0105])
    np.testing.assert_allclose(terms["waiting"], [0.0, -0.01])
    np.testing.assert_allclose(terms["astray"], [-10 * (0.001 + 0.1 * 0.02 + 0.004), 0.0], atol=1e-12)
    np.testing.assert_allclose(terms["jerk"], [-0.002 * (0.25 + 1.0 + 4.0) / 4, 0.0])
    np.testing.assert_array_equal(terms["drop"], [0.0, -10.0])
    np.testing.assert_allclose(total, sum(terms.values()))


def test_an_object_that_waits_at_its_end_earns_nothing_and_loses_nothing() -> None:
    there = at(held(2), (0.0, 0.1495, 0.0), (-0.0305, 0.1, 0.5))
    total, _ = reward(find_reward("progress")[:3], decision(there, None, 0.05))
    np.testing.assert_allclose(total, 0.0, atol=1e-12)


@pytest.mark.parametrize("name", REWARDS)
def test_terms_sum_to_the_reward_even_where_no_end_is_given(name: str) -> None:
    total, terms = reward(find_reward(name), decision(held(2)))
    assert tuple(terms) == tuple(term.name for term in REWARDS[name])
    assert np.isfinite(total).all()
    np.testing.assert_allclose(total, sum(terms.values()))


# Names.


def test_unknown_names_are_met_with_near_ones() -> None:
    with pytest.raises(
        InputError, match=r"unknown observation 'tesis'; did you mean thesis or space-thesis\?; allowed are thesis, gr"
    ):
        find_layout("tesis")
    with pytest.raises(InputError, match=r"unknown reward 'progres'; did you mean progress\?; allowed are thesis, pr"):
        find_reward("progres")
    with pytest.raises(InputError, match="unknown reward '7'; allowed are thesis, progress"):
        find_reward("7")
