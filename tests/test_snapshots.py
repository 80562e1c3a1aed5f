"""Worlds put back to an earlier state go on as they did then, and the others as if nothing had happened."""

import re
from dataclasses import fields, replace

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.snapshot import Snapshot, join
from inhand.sim.state import State, select
from test_simulator import BOXES, CUBE, HAND, assert_same, run, shaken

BEFORE, AFTER = 12, 15
"""Control steps before a snapshot is taken, and after."""
WORLDS = BOXES[:4]


def at(*indices: int) -> NDArray[np.int64]:
    return np.array(indices, dtype=np.int64)


def commands(seed: int) -> Array:
    """Targets of four worlds that hold the object and move it about, each differently, `(S, 4, n)`."""
    steps = BEFORE + AFTER
    return np.stack([shaken(HAND, spec, steps, seed + k) for k, spec in enumerate(WORLDS)], axis=1)


def half_run(specs: list[ObjectSpec], targets: Array) -> MujocoSimulator:
    """Return worlds that hold their objects and have followed the first commands `(S, B, n)`."""
    simulator = MujocoSimulator(HAND, specs, threads=1)
    run(simulator, targets[:BEFORE])
    return simulator


def follow(simulator: MujocoSimulator, targets: Array) -> list[State]:
    return [simulator.step(row, 6) for row in targets]


def test_a_snapshot_holds_all_that_the_future_depends_on() -> None:
    """Of the rest of MuJoCo's state, forces that nobody applies are all there is."""
    model = build_model(HAND, CUBE, SceneSpec())
    sizes = {name: int(np.prod(getattr(mujoco.MjData(model), name).shape)) for name in ("qfrc_applied", "xfrc_applied")}
    snapshot = MujocoSimulator(HAND, [CUBE]).snapshot()
    others = {"forces", "centre", "held"}
    kept = sum(getattr(snapshot, field.name).size for field in fields(Snapshot) if field.name not in others)
    assert kept + sum(sizes.values()) == mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_INTEGRATION))


def test_a_restored_batch_goes_on_as_it_did() -> None:
    targets = commands(seed=40)
    simulator = half_run(WORLDS, targets)
    kept, instant = simulator.snapshot(), simulator.measure()
    first = follow(simulator, targets[BEFORE:])
    simulator.restore(np.arange(4), kept, np.arange(4))
    assert_same([instant], [simulator.measure()])
    assert_same(first, follow(simulator, targets[BEFORE:]))
    assert np.abs(first[-1].object_pose - instant.object_pose).max() > 1e-3


@pytest.mark.parametrize("threads", [1, 2])
def test_a_world_goes_on_in_another_batch_and_leaves_the_others_alone(threads: int) -> None:
    targets, theirs = commands(seed=50), commands(seed=60)
    source = half_run(WORLDS, targets)
    kept = source.snapshot()
    onward = follow(source, targets[BEFORE:])
    order = [0, 3, 2, 1, 0, 1]
    specs = [WORLDS[k] for k in order]
    untouched = MujocoSimulator(HAND, specs, threads=threads)
    other = MujocoSimulator(HAND, specs, threads=threads)
    for simulator in (untouched, other):
        run(simulator, theirs[:BEFORE, order])
    other.restore(at(5, 1), kept, at(1, 3))  # worlds 1 and 3 of the source
    mixed = theirs[BEFORE:, order]
    alone = follow(untouched, mixed)
    mixed = mixed.copy()
    mixed[:, [5, 1]] = targets[BEFORE:, [1, 3]]
    states = follow(other, mixed)
    moved = [select(state, at(5, 1)) for state in states]
    assert_same(moved, [select(state, at(1, 3)) for state in onward])
    rest = at(0, 2, 3, 4)
    assert_same([select(state, rest) for state in states], [select(state, rest) for state in alone])


def test_restoring_is_seen_by_measure_and_only_in_its_worlds() -> None:
    targets = commands(seed=70)
    simulator = half_run(WORLDS, targets)
    kept, then = simulator.snapshot(), simulator.measure()
    now = follow(simulator, targets[BEFORE:])[-1]
    simulator.restore(at(2), kept, at(2))
    mixed = simulator.measure()
    assert_same([select(mixed, at(2))], [select(then, at(2))])
    assert_same([select(mixed, at(0, 1, 3))], [select(now, at(0, 1, 3))])


def test_one_row_may_go_into_many_worlds() -> None:
    targets = commands(seed=80)[:, :1]
    source = half_run([WORLDS[0]], targets)
    many = MujocoSimulator(HAND, [WORLDS[0]] * 3, threads=2)
    many.restore(np.arange(3), source.snapshot(), at(0, 0, 0))
    alone = follow(source, targets[BEFORE:])
    together = follow(many, np.repeat(targets[BEFORE:], 3, axis=1))
    for world in range(3):
        assert_same(alone, together, slice(world, world + 1))


def test_a_snapshot_does_not_change_when_the_simulator_goes_on() -> None:
    targets = commands(seed=90)
    simulator = half_run(WORLDS, targets)
    kept = simulator.snapshot()
    copy = kept.take(np.arange(4))
    follow(simulator, targets[BEFORE:])
    simulator.restore(at(0), kept, at(1))
    follow(simulator, targets[BEFORE:])
    for field in fields(Snapshot):
        np.testing.assert_array_equal(getattr(kept, field.name), getattr(copy, field.name))


def test_snapshots_are_taken_apart_and_joined() -> None:
    first, second = (half_run(WORLDS, commands(seed)).snapshot() for seed in (100, 110))
    both = join([first.take(at(3, 0, 3)), second])
    assert (first.n_worlds, both.n_worlds) == (4, 7)
    for field in fields(Snapshot):
        left, right = getattr(first, field.name), getattr(second, field.name)
        np.testing.assert_array_equal(getattr(both, field.name), np.concatenate([left[[3, 0, 3]], right]))
    assert first.take(at()).n_worlds == 0


def test_nothing_to_restore_changes_nothing() -> None:
    targets = commands(seed=120)
    simulator = half_run(WORLDS, targets)
    before = simulator.measure()
    simulator.restore(at(), simulator.snapshot(), at())
    assert_same([before], [simulator.measure()])


@pytest.mark.parametrize(
    ("worlds", "rows", "text"),
    [
        (at(0, 4), at(0, 1), "world 4 of 4; worlds count from 0 to 3"),
        (at(-1), at(0), "world -1 of 4; worlds count from 0 to 3"),
        (at(0), at(2), "row 2 of 2; rows count from 0 to 1"),
        (at(0), at(-1), "row -1 of 2; rows count from 0 to 1"),
        (at(0, 1), at(0), "1 rows for 2 worlds; give one row of the snapshot for each world"),
        (at(3, 1, 3), at(0, 1, 1), "world 3 is named twice"),
        (np.array([True, False, False, False]), at(0), "worlds of shape (4,) and type bool"),
        (at(0), np.array([0.0]), "rows of shape (1,) and type float64"),
        (at(0).reshape(1, 1), at(0), "worlds of shape (1, 1)"),
    ],
)
def test_worlds_and_rows_that_are_not_there_are_refused(
    worlds: NDArray[np.int64], rows: NDArray[np.int64], text: str
) -> None:
    simulator = half_run(WORLDS, commands(seed=130))
    kept, before = simulator.snapshot().take(at(0, 1)), simulator.measure()
    with pytest.raises(InputError, match=re.escape(text)):
        simulator.restore(worlds, kept, rows)
    assert_same([before], [simulator.measure()])


def test_rows_that_are_not_there_cannot_be_taken() -> None:
    with pytest.raises(InputError, match=re.escape("row 1 of 1; rows count from 0 to 0")):
        MujocoSimulator(HAND, [CUBE]).snapshot().take(at(1))


def test_snapshots_of_other_hands_are_refused() -> None:
    three = MujocoSimulator(parse_hand_name("2v3_25.75_25.35.40_1.1_53"), [CUBE]).snapshot()
    two = MujocoSimulator(HAND, [CUBE])
    text = "a snapshot of a hand of 5 joints for one of 4; put worlds back to snapshots of their own hand"
    with pytest.raises(InputError, match=text):
        two.restore(at(0), three, at(0))
    with pytest.raises(InputError, match="snapshots of 4 and of 5 joints to join: join those of one hand"):
        join([three, two.snapshot()])
    with pytest.raises(InputError, match="no snapshots to join: give at least one"):
        join([])


def test_a_like_object_of_another_size_takes_the_pose_over() -> None:
    wide = replace(CUBE, size=(0.041, 0.039, 0.039), mass=0.05)
    source = MujocoSimulator(HAND, [CUBE], threads=1)
    held = run(source, shaken(HAND, CUBE, 5, seed=140))[-1]
    other = MujocoSimulator(HAND, [wide], threads=1)
    other.restore(at(0), source.snapshot(), at(0))
    measured = other.measure()
    np.testing.assert_array_equal(measured.object_pose, held.object_pose)
    np.testing.assert_allclose(measured.gaps, held.gaps - 0.001, atol=2e-4)
