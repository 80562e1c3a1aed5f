"""Going on by feel: a policy goes beyond its planned way until a learned risk stops it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand.policies
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import sensed_plan
from inhand.control.catalogue import find_controller
from inhand.control.feeling import FARTHER, FeelingController, carrier_of
from inhand.control.grades import GRADES
from inhand.control.phases import GradedGrasp, Grasp, graded_grasp
from inhand.control.policy import Policy, load_policy
from inhand.control.risk import RISK, Risk, load_risk, save_risk
from inhand.control.seen import Seen
from inhand.control.sensed_plan import sensed_grasp
from inhand.control.sensed_policy import SensedPolicyController
from inhand.control.trial import LOST, Trial
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.files import load_object
from inhand.sim.disturbance import Disturbance
from inhand.tasks.paths import path_of, stacked, whole_path
from inhand.tasks.primitives import TURNS, primitive_at
from test_simulator import HAND

CUBE = load_object("cube_39")
SHIPPED = load_policy(Path(inhand.policies.__file__).parent / "default")
ASKED = AsteriskConfig(controller="rl", directions="Left,In-Right", trials=2, seed=8)
"""Left goes on by feel for 8 mm, In-Right for 1 mm: a plan knows its end well."""


def carried(
    policy: Policy, config: AsteriskConfig = ASKED, risks: tuple[float, ...] = (0.1, 0.03, 0.03)
) -> tuple[Trial, ...]:
    """Return trials with the grasps that ship, and other risks that the grades of a camera don't take."""
    kind, plain = SensedPolicyController if policy.risk is None else FeelingController, find_controller("rl").grasp

    def grip(*given: Any, **named: Any) -> Grasp:
        grasp = plain(*given, **named)
        assert isinstance(grasp, GradedGrasp)
        own = zip(grasp.graded, risks, strict=True)
        return graded_grasp([replace(each, risk=np.full(len(each.opened), risk)) for each, risk in own])

    entry = replace(find_controller("rl"), manipulate=partial(kind, policy=policy), grasp=grip)
    return simulate(config, replace(prepare(config), controller=entry))


def ways(trials: tuple[Trial, ...]) -> Array:
    """Return how far objects came at their ends [mm]."""
    return np.array([np.linalg.norm(trial.manipulated_path()[0][-1]) for trial in trials])


def always(chance: float) -> Risk:
    """Return a network that tells the same of whatever is felt."""
    size = len(SHIPPED.risk.middle) if SHIPPED.risk else 0
    bias = np.log(chance / (1 - chance))
    return Risk(((np.zeros((size, 1)), np.array([bias])),), np.zeros(size), np.ones(size))


@pytest.fixture(scope="module")
def planned() -> tuple[Trial, ...]:
    """Return trials that end where they were planned to."""
    return carried(replace(SHIPPED, risk=None))


def test_what_ships_goes_farther_than_planned_and_keeps_its_objects(planned: tuple[Trial, ...]) -> None:
    assert SHIPPED.risk is not None
    found = simulate(ASKED, prepare(ASKED))
    assert not any(trial.outcome in LOST for trial in found)
    gained = ways(found) - ways(planned)
    assert (gained > -1.5).all()
    assert gained.max() > 2.0
    assert (ways(found) < (FARTHER + 0.02) * ways(planned)).all()


@pytest.mark.parametrize(("chance", "stops"), [(0.11, True), (0.09, False)])
def test_a_risk_stops_where_it_passes_the_threshold_but_not_before_the_planned_end(
    planned: tuple[Trial, ...], chance: float, *, stops: bool
) -> None:
    gained = ways(carried(replace(SHIPPED, risk=always(chance)))) - ways(planned)
    assert (gained > -1.5).all()
    assert (gained < 2.0).all() if stops else (gained > 5.0).any()


def test_who_sees_worse_is_stopped_by_less(planned: tuple[Trial, ...]) -> None:
    """A risk between the thresholds stops who sees with a fiducial's noise and not who sees exactly."""
    risk, noisy = always(0.06), replace(ASKED, disturb="pose-noise-2mm")
    far, near = (ways(carried(replace(SHIPPED, risk=risk), config)) for config in (ASKED, noisy))
    assert (far - ways(planned)).max() > 5.0
    assert np.abs(near - ways(carried(replace(SHIPPED, risk=None), noisy))).max() < 2.0


class Daring(FeelingController):
    """Lets go 2 mm beyond its planned way where it is to take a risk of more than 0.1."""

    def act(self, seen: Seen) -> Array:
        """Return the policy's joint targets `(B, n_joints)` [rad], or straight fingers."""
        targets, risk = super().act(seen), self._task.risk
        assert risk is not None
        far = (self.progress > self._planned + 0.002) & (risk > 0.1)
        return np.where(far[:, None], 0.0, targets)


@pytest.mark.parametrize(
    ("feels", "price", "taken"), [(FeelingController, 1.0, 0.2), (FeelingController, 1e6, 0.05), (Daring, 1.0, 0.05)]
)
def test_a_path_is_planned_with_the_risk_that_is_worth_most(
    monkeypatch: pytest.MonkeyPatch, feels: type[FeelingController], price: float, taken: float
) -> None:
    for name, value in {"RISKS": (0.05, 0.2), "FELT": 2, "CANDIDATES": 1, "DARING": (price,)}.items():
        monkeypatch.setattr(sensed_plan, name, value)
    policy, still = replace(SHIPPED, risk=always(0.1)), replace(GRADES[0], worlds=Disturbance("still"), share=1.0)
    by = replace(carrier_of(policy), grades=(still,), feels=partial(feels, policy=policy), digest=feels.__name__)
    poses = HAND.start_pose + stacked([whole_path(path_of(each)) for each in (primitive_at(180.0), TURNS[0])])
    brief = replace(by, rounds=((2, 1),), stays=2, last=1, shares=(0.5,))  # ways that can be gone farther
    grasp = sensed_grasp(HAND, CUBE, poses, carrier=brief)
    assert grasp.risk is not None
    assert grasp.risk.tolist() == [taken, 0.05]  # turns end where they were planned to, whatever it is


def test_what_was_twisted_before_ends_where_it_was_planned_to() -> None:
    config = replace(ASKED, directions="Left", trials=1)
    plain = prepare(config)
    line = plain.hand.start_pose + np.stack([plain.assignments[0].path.poses] * 2)
    grip = plain.controller.grasp(plain.hand, plain.object, line)  # of the line alone, whose plan ships
    turned = replace(config, twist=5.0)
    found = []
    for risk in (always(0.001), None):
        policy = replace(SHIPPED, risk=risk)
        kind = SensedPolicyController if risk is None else FeelingController
        entry = replace(plain.controller, grasp=lambda *_, **__: grip, manipulate=partial(kind, policy=policy))
        found.append(simulate(turned, replace(prepare(turned), controller=entry))[0])
    np.testing.assert_array_equal(found[0].object_pose, found[1].object_pose)


def test_turns_end_where_they_were_planned_to() -> None:
    turns = replace(ASKED, directions="cw", trials=1)
    felt, ends = (carried(replace(SHIPPED, risk=risk), turns)[0] for risk in (always(0.001), None))
    np.testing.assert_array_equal(felt.object_pose, ends.object_pose)
    assert felt.outcome not in LOST


def test_a_risk_is_kept_and_only_that_of_the_policy_beside_it_is_taken(tmp_path: Path) -> None:
    assert SHIPPED.risk is not None
    save_risk(SHIPPED.risk, SHIPPED.digest, tmp_path)
    felt = np.random.default_rng(0).normal(size=(5, len(SHIPPED.risk.middle)))
    np.testing.assert_array_equal(load_risk(SHIPPED.digest, tmp_path)(felt), SHIPPED.risk(felt))
    with pytest.raises(InputError, match=f"was learned with policy {SHIPPED.digest}, and another lies beside it"):
        load_risk("another", tmp_path)
    (tmp_path / RISK).write_bytes((tmp_path / RISK).read_bytes()[:-8])
    with pytest.raises(InputError, match=r"risk\.safetensors, cannot be used"):
        load_risk(SHIPPED.digest, tmp_path)
    save_risk(replace(SHIPPED.risk, middle=np.zeros(3)), SHIPPED.digest, tmp_path)
    with pytest.raises(InputError, match="half has the shape"):
        load_risk(SHIPPED.digest, tmp_path)
