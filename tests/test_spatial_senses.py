"""A policy in space on what a hand can know: its memory and layout, its teacher, its worlds, the controller it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("tensorboardX", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")

from inhand.asterisk_test.config import AsteriskConfig
from inhand.caches import PLACE
from inhand.control import spatial_sensed_plan
from inhand.control.contract import contract_in_space
from inhand.control.controller import SpatialTask
from inhand.control.draws import disturbance_notes
from inhand.control.estimator import WAIT
from inhand.control.loop import Bench, simulate
from inhand.control.memory import Memory
from inhand.control.policy import Policy
from inhand.control.seen import SENSED, Seen, exact
from inhand.control.shipped_plans import shipped
from inhand.control.spatial_catalogue import find_spatial_controller, learned_in_space, notes_in_space
from inhand.control.spatial_ik_sensed import SpatialIkSensedController
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.spatial_sensed_plan import CARRIER, carrier_in_space, plan_keys_in_space, sensed_in_space
from inhand.control.spatial_sensed_policy import SpatialSensedPolicyController
from inhand.control.spatial_teacher import SpatialTeacher
from inhand.control.trial import REACHED
from inhand.control.underway import SETTLE
from inhand.geometry import Array
from inhand.hands.spatial.gravity import PALMS, gravity_of
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning import space_pools
from inhand.learning.experts import taught_reach
from inhand.learning.presets import spatial
from inhand.learning.recipe import SEEN
from inhand.learning.run_cards import check
from inhand.learning.setup import load_ready, make_ready, save_ready
from inhand.learning.space import space_of
from inhand.learning.space_pools import Planned, gripped, pool_of
from inhand.learning.starts import Noise, Starts
from inhand.learning.worlds import ManipulationWorlds
from inhand.rotations import change_between, pose_from
from inhand.sim.disturbance import FIELD
from inhand.sim.drawn import Disturbed, Drawn, truths
from inhand.sim.engines import make_simulator
from inhand.sim.names import SPATIAL
from inhand.sim.spatial_engine import SpatialSimulator
from inhand.sim.state import SpatialState, select
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import DRAWN, Scene, observe
from inhand.tasks.past import LAGS
from inhand.tasks.spatial.aims import SpatialAim
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from test_disturbances import PERIOD
from test_spatial_engine import CUBE, HAND
from test_spatial_learning import ASKED, HELD, PLAIN, PULLS, in_space

SENSES, SPACE, TRUTH = (find_layout(name) for name in ("space-senses", "space", "space-truth"))
SMALL = spatial()
SMALL = replace(
    SMALL, interface=replace(SMALL.interface, horizon=25), recipe=replace(SMALL.recipe, episodes=12, midway=0.5)
)


@pytest.fixture(scope="module")
def starts() -> Starts:
    """One start of each primitive in a world of `field` of its own."""
    asked = space_of(ASKED, PULLS)
    found = gripped(HELD, [PLAIN] * len(ASKED), asked, np.random.default_rng(3), Noise(), disturb=FIELD)
    assert len(found) == len(ASKED)
    return replace(found, distance=np.full(len(found), 0.01))


@pytest.fixture(scope="module")
def policy() -> Policy:
    """Return a policy that leaves every command as it is."""
    arrays = np.zeros((SENSES.size(HAND), HAND.n_joints)), np.zeros(HAND.n_joints)
    trained, space = {"hand": SMALL.hand, "object": SMALL.object}, contract_in_space(HELD, FIELD)
    return Policy((arrays[0],), (arrays[1],), "space-senses", "steps", "sensed", trained, space=space)


def seen_at(starts: Starts, decision: int, moved: Array | None = None) -> Seen:
    """Return what is sensed some decisions after the starts where all stands still; a frame `moved` on is a new one."""
    seen = exact(starts.state)
    time = seen.time + PERIOD * decision
    if moved is None:
        return replace(seen, time=time)
    return replace(seen, time=time, frame_pose=pose_from(seen.frame_pose, *np.split(moved, 2)), frame_time=time)


def aim_of(starts: Starts) -> SpatialAim:
    space = starts.asked_in_space
    return SpatialAim(space.along, space.about, starts.state.object_pose)


def test_what_is_remembered_in_space_counts_from_the_wait(starts: Starts) -> None:
    memory, pose, last = Memory(HELD, seen_at(starts, 0)), starts.state.object_pose, round(WAIT / PERIOD)
    step = np.array([0.0005, 0.0, -0.001, 0.0, 0.004, 0.0])
    asked = replace(aim_of(starts), distance=np.full(4, 0.03))
    for decision in range(1, last + 1):
        assert memory.past.waiting.all()
        np.testing.assert_array_equal(memory.past.aimed(asked).distance, np.zeros(4))
        seen = seen_at(starts, decision, decision * step)
        memory.take(replace(seen, joint_angles=seen.joint_angles + 0.001 * decision))
    past, wanted = memory.past, np.tile(np.arange(last + 1).mean() * step, (4, 1))
    np.testing.assert_allclose(change_between(pose, past.start), wanted, atol=1e-9)
    for lag, found in zip(LAGS, past.joints, strict=True):
        np.testing.assert_allclose(found, starts.state.joint_angles + 0.001 * (last - lag), atol=1e-12)
    np.testing.assert_array_equal(past.aimed(asked).distance, asked.distance)
    np.testing.assert_allclose(past.shift(asked), 0.0, atol=1e-12)
    ahead = replace(past, pose=pose_from(past.believed, 0.02 * asked.along, 0.8 * asked.about))
    np.testing.assert_allclose(ahead.shift(asked)[:, 0], [0.02, 0.02, 0.02, 0.025 * 0.8], atol=1e-9)
    assert np.abs(ahead.shift(asked)[:, 1:]).max() < 1e-9


def test_layout_of_senses_tells_what_space_does_of_what_is_believed(starts: Starts) -> None:
    """Where an object rests and senses are exact the estimate is near the truth; the critics' layout is the truth."""
    memory = Memory(HELD, seen_at(starts, 0))
    for decision in range(1, 20):
        memory.take(seen_at(starts, decision, np.zeros(6)))
    scene = Scene(HAND, (CUBE,) * 4, gravity=starts.asked_in_space.gravity, drawn=np.full((4, DRAWN), 1.5))
    aim = replace(aim_of(starts), distance=np.full(4, 0.03))
    still = replace(starts.state, object_velocity=np.zeros((4, 6)), joint_velocities=np.zeros((4, 9)))
    mine, true = observe(SENSES, memory.past, memory.past.aimed(aim), scene), observe(TRUTH, still, aim, scene)
    assert (mine.shape, true.shape) == ((4, 257), (4, 171 + DRAWN))
    np.testing.assert_array_equal(true[:, :171], observe(SPACE, still, aim, scene))
    np.testing.assert_array_equal(true[:, 171:], 0.5)
    # An object is larger or smaller than drawn, so contacts lie beside where they are believed.
    assert np.median(np.abs(mine[:, :171] - true[:, :171])) < 0.02
    assert np.abs(mine[:, 117:171] - true[:, 117:171]).max() < 0.3
    np.testing.assert_allclose(mine[:, -len(LAGS) :], PERIOD / 0.1)  # no frame is younger in training
    later = observe(SENSES, replace(memory.past, ages=np.full((5, 4), 0.05)), memory.past.aimed(aim), scene)
    np.testing.assert_allclose(later[:, -len(LAGS) :], 0.5)


def test_the_teacher_knows_each_world_as_it_is_drawn(starts: Starts) -> None:
    state, one = starts.state, np.array([2])
    drawn = Drawn((), friction=0.15, mass=3.0, stiffness=1.1, damping=0.9, centre=(0.003, 0.0, -0.002))
    given = Disturbed(FIELD, replace(drawn, zero=tuple(0.01 * np.arange(9)), command_s=0.02))
    hand = replace(HAND, friction=0.15 * HAND.friction, stiffness=1.1 * HAND.stiffness, damping=0.9 * HAND.damping)
    thing = replace(CUBE, mass=3.0 * CUBE.mass, centre=(0.003, 0.0, -0.002))
    known, plain = SpatialTeacher(HELD, [given], 1), SpatialTeacher(SpatialPair(hand, thing), None, 1)
    space, now = starts.asked_in_space, state.object_pose[one]
    for distance in (0.0, 0.03):
        aim = SpatialAim(space.along[one], space.about[one], now, np.full(1, distance))
        there = replace(select(state, one), object_velocity=np.zeros((1, 6)))
        mine, theirs = (each.act(there, aim, PULLS[one]) for each in (known, plain))
        ahead = mine - theirs - given.drawn.zero
        # Commands come late: on the way they are ahead by what joints move until then.
        if distance:
            assert np.abs(ahead).max() > 1e-3
        else:
            np.testing.assert_allclose(ahead, 0.0, atol=1e-12)
        nominal = SpatialTeacher(HELD, None, 1).act(there, aim, PULLS[one])
        assert np.abs(theirs - nominal).max() > 0.01


def test_starts_in_worlds_that_differ_go_on_as_they_did(starts: Starts) -> None:
    """Each has a world of its own, in which the teacher carries it; what was kept goes on byte for byte."""
    assert starts.disturbed is not None
    assert len({world.drawn.mass for world in starts.disturbed}) == len(starts)
    interface = replace(SMALL.interface, horizon=60)

    def worlds() -> ManipulationWorlds:
        return ManipulationWorlds(HELD, starts, 4, interface, np.random.default_rng(0), threads=1)

    one, rows = worlds(), np.array([2, 0, 3, 1])
    assert one.reset(rows).shape == (4, 257 + 171 + DRAWN)
    assert isinstance(one.simulator, SpatialSimulator)
    np.testing.assert_allclose(one.simulator.gravity, PULLS[rows])
    true = truths(starts.disturbed, HAND, [CUBE] * 4, starts.asked_in_space.scenes)
    other, still = make_simulator(SPATIAL, *true), starts.state.targets + 0.1
    for simulator in (one.simulator, other):
        simulator.restore(np.arange(4), starts.snapshot, rows, rows)
    moved = [each.step(still[rows], 5).object_pose for each in (one.simulator, other)]
    np.testing.assert_array_equal(moved[0], moved[1])
    one.reset(rows)
    actions = 0.1 * np.random.default_rng(1).uniform(-1, 1, (8, 4, HAND.n_joints))
    for number, action in enumerate(actions):
        if number == 5:
            kept = one.state_dict()
        found = one.step(action)
    later = worlds()
    later.load_state_dict(kept)
    for action in actions[5:]:
        again = later.step(action)
    np.testing.assert_array_equal(again.successor, found.successor)
    reach = taught_reach(HELD, starts, np.random.default_rng(0), "teacher")
    assert (reach > 0.01).all()


def test_a_training_on_senses_begins_with_worlds_of_field(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are kept as they are, and told as far as the teacher comes."""
    plans = Planned(ASKED, ((PLAIN,),) * len(ASKED), PULLS)
    told = list[int]()

    def reach(_held: object, starts: Starts, *_: object) -> Array:
        told.append(len(starts))
        return np.full(len(starts), 0.02)

    monkeypatch.setattr(space_pools, "taught_reach", reach)
    monkeypatch.setattr(space_pools, "planned", lambda *_: plans)
    monkeypatch.setattr(
        space_pools, "tests_of", lambda *_: pool_of(in_space(SMALL), plans, 4, np.random.default_rng(1))
    )
    check(SMALL)
    ready = make_ready(SMALL, tmp_path, lambda *_: None)
    save_ready(ready, tmp_path / "ready.npz")
    again = load_ready(SMALL, tmp_path / "ready.npz")
    (pool,) = again.starts
    assert len(told) == 3
    assert pool.disturbed is not None
    assert pool.disturbed == ready.starts[0].disturbed
    assert {world.spec for world in pool.disturbed} == {FIELD}
    assert isinstance(pool.state, SpatialState)
    assert pool.distance.max() <= 0.02
    assert (again.columns.d, again.columns.c) == (257, 171 + DRAWN)


def test_commands_stay_as_they_are_at_the_end_of_the_way(starts: Starts, policy: Policy) -> None:
    moving = replace(policy, biases=(policy.biases[0] + 0.5,))
    paths = stacked_paths([spatial_path_of(each) for each in ASKED])
    task = SpatialTask(HAND, (CUBE,) * 4, paths, gravity=PULLS, distance=np.array([-1e-4, -1e-4, -1e-4, 0.02]))
    carrying, last = SpatialSensedPolicyController(task, moving), round(WAIT / PERIOD)
    carrying.begin(seen_at(starts, 0))
    for decision in range(1, last + round(SETTLE / PERIOD) + 1):
        seen = seen_at(starts, decision, np.zeros(6))
        ahead = carrying.act(seen) - seen.targets
        done = carrying.finished(seen)
        assert (ahead[:3].any() and not done.any()) == (decision < last), decision
        assert ahead[3].any()
    assert done.tolist() == [True, True, True, False]


def test_a_policy_on_senses_holds_what_ik_sensed_has_lifted(policy: Policy, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = learned_in_space("mine", policy)
    assert (entry.reads, entry.holds) == (SENSED, SpatialIkSensedController)
    assert entry.contract is not None
    assert entry.contract.camera == FIELD.camera
    assert disturbance_notes(AsteriskConfig(disturb="field"), SENSED, entry.contract, space=True)[1:] == (
        "In space there is no floor: differs.floor has no effect.",
    )
    hard = disturbance_notes(AsteriskConfig(disturb="hard"), SENSED, entry.contract, space=True)
    assert "trained with other senses: " in hard[-1]
    assert notes_in_space(entry, HAND, CUBE)[0].startswith("ik-sensed closes the fingers")
    paths = [spatial_path_of(each) for each in ASKED]
    task = SpatialTask(HAND, (CUBE,) * 4, stacked_paths(paths), gravity=PULLS)
    task, poses = replace(task, distance=np.full(4, 0.02)), np.tile(HAND.start_pose, (4, 1))
    made = list[SpatialSensedPolicyController]()

    def carrying(task: SpatialTask) -> SpatialSensedPolicyController:
        made.append(SpatialSensedPolicyController(task, policy))
        return made[-1]

    grasp, bench = closed_at(HAND, [PLAIN] * 4, poses), Bench("mujoco", threads=1)
    _, found = simulate(task, grasp, poses, carrying, bench, holds=entry.holds)
    assert set(found.outcomes) == {REACHED}
    assert np.abs(made[-1].progress).max() < 1e-3
    asked, prices = list[object](), list[float]()

    def tried(who: tuple[object, Any], *_: object) -> list[Any]:
        asked.append(who[1].make(task))
        prices.append(who[1].grades[0].price)
        raise InterruptedError

    monkeypatch.setattr(spatial_sensed_plan, "_tried", tried)
    monkeypatch.setattr(spatial_sensed_plan, "searched", lambda *_: {path.name: [PLAIN] for path in paths})
    monkeypatch.setenv(PLACE, "off")
    with pytest.raises(InterruptedError):
        entry.grasp(HAND, CUBE, paths, PULLS, poses, bench=bench)
    with pytest.raises(InterruptedError):
        sensed_in_space(HAND, CUBE, paths, PULLS, poses, bench=bench)
    assert [type(each) for each in asked] == [SpatialSensedPolicyController, SpatialIkSensedController]
    assert prices == [6.0, 4.0]
    assert CARRIER.grades[1].worlds == FIELD


def test_the_standard_pair_is_planned_under_every_palm(monkeypatch: pytest.MonkeyPatch) -> None:
    entry, known = find_spatial_controller("rl"), shipped()
    assert entry.policy is not None
    by, paths = carrier_in_space(entry.policy), [spatial_path_of(each) for each in SEEN]
    starts = np.tile(HAND.start_pose, (len(paths), 1))
    monkeypatch.setattr(spatial_sensed_plan, "_planned", lambda *_: pytest.fail("planned"))
    for palm in PALMS:
        gravity = np.array([gravity_of(palm)])
        keys = plan_keys_in_space((HAND, CUBE), paths, gravity, by)
        missing = [path.name for path, key in zip(paths, keys, strict=True) if key not in known]
        assert not missing, "run `python studies/plans.py`: the policy or a number of planning has changed"
        pulls = np.repeat(gravity, len(paths), axis=0)
        grasp = entry.grasp(HAND, CUBE, paths, pulls, starts, bench=Bench("mujoco"))
        assert grasp.way is not None
        assert grasp.way.min() > 0.01
    dearer = replace(by, grades=(replace(by.grades[0], price=8.0),))
    assert not set(plan_keys_in_space((HAND, CUBE), paths, gravity, dearer)) & set(known)
