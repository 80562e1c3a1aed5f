"""Studies of hands in space: what robustness and sweeps make of trials in space, their pages, and what is refused."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.robustness.cases import FLOORS, cases_of
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.robustness.run import RobustnessRun
from inhand.asterisk_test.robustness.sensitivity import QUANTITIES
from inhand.asterisk_test.spatial.run import SpatialSetup, _passports
from inhand.asterisk_test.sweep.run import SweepRun
from inhand.control.draws import disturbed_worlds, keys_in_space
from inhand.control.spatial_catalogue import find_spatial_controller, notes_over_pairs
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.trial import GRIP_END, LOST_CONTACT
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import parse_solid_name
from inhand.sim.disturbance import Differences, Disturbance
from page_reader import Read

OFF = Disturbance("off", Differences(start_mm=40.0, start_deg=5.0))


def carried(config: AsteriskConfig, setup: SpatialSetup, *_: object, **__: object) -> tuple[SpatialTrial, ...]:
    """Return trials that nobody simulated: each object goes half of its limit, and where worlds differ it is lost."""
    keys = keys_in_space(config, [each.trial for each in setup.assignments])
    worlds = disturbed_worlds(config, keys, setup.hand.n_joints, space=True)
    limits = {each.primitive: 3.0 if each.primitive.direction is None else 0.08 for each in setup.assignments}
    told = _passports(config, setup, limits, worlds or [None] * len(keys))
    return tuple(_half(signed, worlds is not None) for signed in told)


def _half(signed: SpatialPassport, lost: bool) -> SpatialTrial:
    rows, share = 11, np.linspace(0, 0.5, 11)[:, None]
    pose = np.zeros((rows, 7))
    if signed.along is None:
        pose[:, 3:] = np.hstack([np.cos(1.5 * share), np.sin(1.5 * share) * np.array(signed.about)])
    else:
        pose[:, :3], pose[:, 3] = 0.08 * share * np.array(signed.along), 1.0
    gaps = np.zeros((rows, 3))
    gaps[-1] = 0.05 * lost
    moved = [0.0 if signed.about else 0.1 * part for part in signed.along or (0.0,) * 3]
    reference = np.array([[0.0] * 6, [*moved, *(3.0 * part for part in signed.about or (0.0,) * 3)]])
    plain: dict[str, Array] = {name: np.zeros((rows, 9)) for name in ("joint_angles", "targets")}
    plain |= {name: np.ones((rows, 3, 3)) * gaps[..., None] for name in ("finger_points", "object_points", "forces")}
    links, phase = np.full((rows, 3), 2), np.zeros(rows, dtype=np.int64)
    return SpatialTrial(
        passport=signed, outcome=LOST_CONTACT if lost else GRIP_END, phases=("manipulate",), phase=phase,
        time=np.linspace(0.0, 0.2, rows), object_pose=pose, gaps=gaps, contact_links=links, reference=reference,
        penetration=np.zeros(rows), **plain,
    )  # fmt: skip


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inhand.asterisk_test.cells.run_setup", carried)


def test_robustness_tells_moves_and_turns_in_space_apart(tmp_path: Path) -> None:
    same: dict[str, Any] = {"hand": STANDARD, "object": "cube_50", "gravity": "sideways", "trials": 3}
    study = inhand.robustness("ik", OFF, curves=(), directions="Down,turn+z", out=tmp_path, **same)
    assert study.found.rows.lost.tolist() == [0, 6]
    assert study.found.rows.share.tolist() == [pytest.approx(0.5), 0.0]
    assert study.found.rows.turn_95_deg[0] == pytest.approx(0.0, abs=1e-6), "a turn is no deviation of a move"
    drawn = study.trials()[study.trials().disturb == "off"]
    start = np.stack(drawn["drawn.start"].to_list())
    np.testing.assert_allclose(QUANTITIES["start off"](drawn), np.linalg.norm(start[:, :3], axis=1))
    np.testing.assert_allclose(QUANTITIES["start turned"](drawn), np.linalg.norm(start[:, 3:], axis=1))
    assert isinstance(inhand.load(study.save(tmp_path)), RobustnessRun)
    player = Read((tmp_path / "report.html").read_text(encoding="utf-8")).views()["player"]
    assert len(player["trials"]) == 4
    assert len(player["hands"][0]["fingers"]) == 3
    assert "engine mujoco, gravity sideways" in (tmp_path / "report.md").read_text(encoding="utf-8")
    with pytest.raises(
        InputError, match=r"of ik under none gravity is \[0.0, -9.81, 0.0\] there and \[0.0, 0.0, -9.81"
    ):
        inhand.robustness("ik", OFF, curves=(), directions="Down,turn+z", out=tmp_path, **same | {"gravity": "up"})


def test_a_sweep_says_what_a_policy_was_trained_with_where_that_is_not_all_it_holds() -> None:
    policy = find_spatial_controller("rl")
    own, other = ((parse_spatial_name(STANDARD), parse_solid_name(name)) for name in ("cube_50", "sphere_50"))
    (lifts,) = notes_over_pairs(policy, [own])
    assert notes_over_pairs(policy, [own, other])[0] == lifts
    assert "rl was trained with cube_50 and 3f_60.60_40_10 alone" in notes_over_pairs(policy, [own, other])[1]
    assert notes_over_pairs(find_spatial_controller("ik"), [own, other]) == ()


def test_a_sweep_in_space_has_its_directions_as_they_were_asked_for(tmp_path: Path) -> None:
    hands = (STANDARD, "3f_70.50_40_10")
    found = inhand.sweep(hands, ("cube_50", "sphere_300"), directions="turn+z,Down,Up", gravity="down", out=tmp_path)
    assert found.sweep.directions == ("turn+z", "Down", "Up")
    assert found.sweep.alike == ("Down", "Up")
    assert found.sweep.cases.rotates.tolist() == 2 * [True, False, False]
    assert found.sweep.trials.finger_mm.to_numpy() == pytest.approx(120.0)
    assert found.sweep.cells.reason.notna().tolist() == [False, True, False, True]
    assert isinstance(inhand.load(found.save(tmp_path)), SweepRun)


def test_studies_leave_out_a_floor_that_is_not_there() -> None:
    planar, space = (
        {case.name for case in cases_of(each)} for each in (RobustnessConfig(), RobustnessConfig(hand=STANDARD))
    )
    assert planar - space == {each.name for each in FLOORS}
    assert space < planar


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda out: inhand.robustness("ik", gravity="up", out=out), "--gravity up with 2v2_50.50_50.50_1.1_53"),
        (lambda out: inhand.sweep(("2v2", STANDARD), ("cube_50",), out=out), "--hands 2v2 is in the plane and 3f_"),
        (lambda out: inhand.sweep((STANDARD,), ("cube_50",), "thesis-ik", out=out), "controller 'thesis-ik' with"),
        (lambda out: inhand.sweep((STANDARD,), ("cube_50",), gravity="0,0,0", out=out), "has no length"),
    ],
)  # fmt: skip
def test_what_no_study_of_hands_in_space_can_run_is_refused(
    ask: Callable[[Path], object], text: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        ask(tmp_path / "out")
    assert not (tmp_path / "out").exists()
