"""Routes: the aim a little ahead, the place that an object has come to, and worlds that follow whole routes."""

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.hands.fit import Held
from inhand.learning.demonstrations import recorded, route_pool, route_starts
from inhand.learning.recipe import Recipe, Recording
from inhand.learning.starts import Noise, Starts
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.sim.disturbance import Camera, Disturbance
from inhand.tasks.layouts import find_layout
from inhand.tasks.routes import LOOK, NEAR, SPACING, Routes, routes_of
from test_simulator import CUBE, HAND

HELD = Held(HAND, CUBE)
CORNER = np.array([[0.0, 0.1, 0.0], [0.03, 0.1, 0.0], [0.03, 0.13, 0.0]])
KEY = np.array([[0.0, 0.1, 0.0], [0.0, 0.12, 0.0], [0.0, 0.12, 0.5], [0.0, 0.12, 0.0], [0.0, 0.1, 0.0]])
ONE = np.zeros(1, dtype=np.int64)


def place_of(routes: Routes, way: float) -> np.ndarray:
    """Return the place on the only route that lies at a way [m]."""
    return np.array([int(np.searchsorted(routes.way[0], way - 1e-9))])


def test_poses_are_spaced_evenly_and_end_where_the_path_does() -> None:
    routes = routes_of([CORNER, KEY])
    assert len(routes) == 2
    np.testing.assert_allclose(routes.way[:, -1], [0.06, 0.04 + TURN_ARM], atol=1e-9)
    assert np.diff(routes.way, axis=1).max() <= SPACING + 1e-9
    np.testing.assert_allclose(routes.poses[:, -1], [CORNER[-1], KEY[-1]], atol=1e-12)


def test_the_aim_points_along_the_route_and_turns_before_a_corner() -> None:
    routes = routes_of([CORNER])
    straight, near, after = (routes.aim(ONE, place_of(routes, way)) for way in (0.01, 0.03 - LOOK / 2, 0.035))
    np.testing.assert_allclose(straight.angle, 0.0, atol=1e-12)
    np.testing.assert_allclose(near.angle, np.pi / 4, atol=0.02)
    np.testing.assert_allclose(after.angle, np.pi / 2, atol=1e-9)
    np.testing.assert_allclose(straight.share, 0.01 / 0.06, atol=1e-9)
    assert straight.end is not None
    np.testing.assert_array_equal(straight.end, CORNER[-1:])
    np.testing.assert_allclose(straight.distance, 0.05, atol=1e-9)


def test_a_turn_on_the_spot_asks_for_an_angle_and_for_no_way() -> None:
    routes = routes_of([KEY])
    aim = routes.aim(ONE, place_of(routes, 0.02 + 0.1 * TURN_ARM))
    np.testing.assert_allclose(aim.distance, 0.0, atol=1e-9)
    assert aim.start[0, 2] == pytest.approx(0.1 + LOOK / TURN_ARM, abs=0.03)
    np.testing.assert_allclose(aim.angle, np.pi / 2)
    before = routes.aim(ONE, place_of(routes, 0.005))
    np.testing.assert_allclose(before.distance, 0.015, atol=1e-9)


def test_the_place_moves_on_and_never_back_and_only_with_an_object_that_is_near() -> None:
    routes = routes_of([CORNER])
    come = routes.advance(ONE, ONE, np.array([[0.006, 0.1005, 0.0]]))
    assert routes.way[0, come[0]] == pytest.approx(0.006, abs=SPACING)
    np.testing.assert_array_equal(routes.advance(ONE, come, np.array([[0.001, 0.1, 0.0]])), come)
    far = np.array([[0.01, 0.1 + 1.5 * NEAR, 0.0]])
    np.testing.assert_array_equal(routes.advance(ONE, come, far), come)
    turned = np.array([[0.01, 0.1, 1.5 * NEAR / TURN_ARM]])
    np.testing.assert_array_equal(routes.advance(ONE, come, turned), come)


def test_a_shortcut_over_a_loop_does_not_count() -> None:
    loop = np.array([[0.0, 0.1, 0], [0.03, 0.1, 0], [0.03, 0.13, 0], [0.0, 0.13, 0], [0.0, 0.1, 0]])
    routes = routes_of([loop])
    np.testing.assert_array_equal(routes.advance(ONE, ONE, np.array([[0.0, 0.1, 0.0]])), 0)


def test_off_is_beside_and_away_in_angle() -> None:
    routes = routes_of([CORNER])
    across, turned = routes.off(ONE, place_of(routes, 0.01), np.array([[0.02, 0.102, -0.1]]))
    np.testing.assert_allclose([across[0], turned[0]], [0.002, 0.1], atol=1e-9)


@pytest.fixture(scope="module")
def starts() -> Starts:
    """Four starts of the key task."""
    return route_starts(HELD, route_pool(HELD, "key", 3, (0, 1)), 4, np.random.default_rng(0), Noise())


@pytest.fixture(scope="module")
def seen() -> Starts:
    """The same in worlds whose camera is late and off by 3 mm, by grasps that are searched for several frictions."""
    away = Disturbance("away", camera=Camera(rate_hz=50.0, delay_ms=(40.0, 40.0), bias_mm=3.0))
    pool = route_pool(HELD, "key", 3, (0, 1), varied=True)
    return route_starts(HELD, pool, 4, np.random.default_rng(0), Noise(), disturb=away)


SENSED = Interface("senses", "steps", "progress", horizon=190, truth="truth")


def test_a_teacher_goes_through_a_whole_route_and_what_is_sensed_is_asked_from_where_it_is_believed(
    seen: Starts,
) -> None:
    recording = Recording(*HELD, (), Recipe(push=0.0, expert="mild-teacher"), SENSED, Noise(), seed=0)
    episodes = recorded(recording, seen, np.random.default_rng(0))
    assert not episodes.terminated.any()
    assert seen.routes is not None
    assert (episodes.distance >= seen.routes.way[:, -1] - 0.002).all()
    size, aside = find_layout("senses").size(HAND), "believed: way along and to the left [m], angle turned [rad]"
    names = [part.name for part in find_layout("senses").parts]
    first = sum(part.size(HAND) for part in find_layout("senses").parts[: names.index(aside)])
    sensed, true = episodes.observations[..., :size], episodes.observations[..., size:]
    assert true.shape[-1] == find_layout("truth").size(HAND)
    assert (np.abs(sensed[40:, :, first]) * 0.1 < 0.0045).all()  # but for the bias; since the start it has come 20
    assert (np.abs(sensed[:10, :, 3]) == 0.0).all()  # no way to go while first frames come in


@pytest.mark.parametrize("layout", ["grip", "whole"])
def test_the_expert_goes_through_a_whole_route_in_worlds(starts: Starts, layout: str) -> None:
    interface = Interface(layout, "steps", "progress", horizon=190)
    recording = Recording(*HELD, (), Recipe(push=0.0), interface, Noise(), seed=0)
    episodes = recorded(recording, starts, np.random.default_rng(0))
    assert not episodes.terminated.any()
    assert starts.routes is not None
    assert (episodes.distance >= starts.routes.way[:, -1] - 0.002).all()
    assert episodes.observations.shape[-1] == find_layout(layout).size(HAND)
    gained = (episodes.rewards * episodes.valid).sum(axis=0)
    assert (gained > 3.0).all(), "the way, less what waiting and leaving it cost"


@pytest.mark.parametrize("layout", ["grip", "senses"])
def test_route_worlds_go_on_byte_for_byte_from_what_they_kept(starts: Starts, seen: Starts, layout: str) -> None:
    pool, interface = seen if layout == "senses" else starts, Interface(layout, "steps", "progress", 12)

    def worlds() -> ManipulationWorlds:
        return ManipulationWorlds(HELD, pool, 3, interface, np.random.default_rng(5), threads=1)

    rng = np.random.default_rng(1)
    actions = rng.uniform(-0.2, 0.2, (20, 3, HAND.n_joints))
    one, other = worlds(), worlds()
    for action in actions[:8]:
        one.step(action)
    other.load_state_dict(one.state_dict())
    for action in actions[8:]:
        ours, theirs = one.step(action), other.step(action)
        np.testing.assert_array_equal(ours.observation, theirs.observation)
        np.testing.assert_array_equal(ours.reward, theirs.reward)


def test_the_whole_layout_needs_a_whole_task() -> None:
    from inhand.sim.mujoco_engine import MujocoSimulator
    from inhand.tasks.observations import Aim, Scene, observe

    simulator = MujocoSimulator(HAND, [CUBE])
    state = simulator.measure()
    with pytest.raises(InputError, match="whole task"):
        observe(find_layout("whole"), state, Aim(np.zeros(1), state.pose), Scene(HAND, simulator.objects))


def test_a_task_with_a_wall_is_refused() -> None:
    with pytest.raises(InputError, match="needs a wall"):
        route_pool(HELD, "wall", 1, (0, 0))


def test_drawn_routes_differ_and_fixed_ones_are_kept_once() -> None:
    assert len(route_pool(HELD, "key", 5, (0, 0))[0]) == 1
    assert len(route_pool(HELD, "place", 3, (0, 0))[0]) == 3
