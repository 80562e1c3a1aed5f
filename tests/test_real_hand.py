"""Driving a hand outside the simulator: what is taken in, what holds, what is refused; and a hand behind a socket."""

from __future__ import annotations

import logging
import runpy
import socket
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import inhand
from commands import in_a_process
from inhand.control.catalogue import ControllerEntry, find_controller, learned, rough_grasp
from inhand.control.contract import contract_of
from inhand.control.controller import Task
from inhand.control.drive import Driven, check_entry, drive
from inhand.control.link import Clock, DriveConfig
from inhand.control.phases import Grasp, placed_joints
from inhand.control.policy import Policy
from inhand.control.readings import Frame, Looks, Reading
from inhand.control.seen import SENSED, Seen
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import lab_limits
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.sim.disturbance import BENCH, FIELD
from test_policy import a_policy

ROOT = Path(__file__).resolve().parents[1]
HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), parse_object_name("cube_39")
GRASP = Grasp(
    np.array([[0.9648, -1.787, -0.9648, 1.787]]), np.array([[0.7969, -1.7751, -0.7969, 1.7751]]), np.array([0.057])
)
"""What `ik-sensed` plans for Out, in few worlds."""
PLACED = placed_joints(HAND, GRASP)[0]
PERIOD = 0.02


@dataclass
class Time:
    """A clock that goes on only when somebody waits by it."""

    now: float = 10.0

    @property
    def clock(self) -> Clock:
        """The clock as the runner has it."""
        return Clock(lambda: self.now, self.wait)

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        assert seconds > 0
        self.now += seconds


@dataclass
class Hand:
    """A hand whose joints are where they were told to be, and that tells what a script makes of it."""

    time: Time
    script: Script
    joints: Array
    told: list[tuple[float, Array]] = field(default_factory=list)
    asked: int = 0

    def read(self) -> Reading | None:
        """Give what the script makes of how long the hand has been driven."""
        self.asked += 1
        return self.script(self, self.time.now - 10.0)

    def command(self, targets: Array) -> None:
        """Go there."""
        self.joints = targets
        self.told.append((self.time.now, targets))


Script = Callable[[Hand, float], Reading | None]
"""Makes what a hand tells of the time since the beginning."""


def fine(hand: Hand, since: float) -> Reading:
    """Tell where the joints are, and where the object stands in a frame of 40 ms before."""
    return Reading(since, hand.joints, [Frame(since - 0.04, HAND.start_pose)])


def until(end: float, then: Script, again: float = np.inf) -> Script:
    """Return a script that is fine but for a while."""
    return lambda hand, since: then(hand, since) if end <= since < again else fine(hand, since)


def away(far: float, turned: float) -> Script:
    """Return a script with the object beside its place."""
    return lambda hand, since: Reading(
        since, hand.joints, [Frame(since, HAND.start_pose + np.array([0.0, far, turned]))]
    )


class Turner:
    """Closes a joint on and on; a controller that reads what is sensed."""

    reads = SENSED
    grasp = "rough"
    step = 0.01

    def __init__(self, task: Task) -> None:
        """Have decided nothing."""
        self.saw: list[Seen] = []
        made.append(self)
        del task

    def begin(self, seen: Seen) -> None:
        """Begin."""
        self.first = seen.time[0]

    def act(self, seen: Seen) -> Array:
        """Turn the first joint on by a step."""
        self.saw.append(seen)
        return np.asarray(seen.targets + np.array([[self.step, 0.0, 0.0, 0.0]]))

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Have done after a second."""
        return np.asarray(seen.time - self.first >= 1.0)


class Leaping(Turner):
    """The same by as much as no servo turns."""

    step = 1.0


made: list[Turner] = []
"""What was made last of it."""


def driven(
    script: Script = fine,
    controller: type[Turner] = Turner,
    joints: Array = PLACED,
    policy: Policy | None = None,
    **settings: Any,
) -> tuple[Driven, Hand]:
    """Drive a hand by a script; return what that left and the hand."""
    time = Time()
    hand = Hand(time, script, joints)
    given: dict[str, Any] = {"grasp": GRASP, "clock": time.clock} | settings
    entry = ControllerEntry("turner", "a test's", rough_grasp, controller, policy, SENSED)
    return drive(hand.read, hand.command, controller=entry, **given), hand


@pytest.mark.parametrize(("seed", "by"), [(1, {}), (5, {}), (2, {"controller": "rl", "senses": "field"})])
def test_a_hand_behind_a_socket_carries_its_object_with_late_missing_and_repeated_frames(
    seed: int, by: dict[str, Any]
) -> None:
    """By `ik-sensed`, and by the policy that ships."""
    simulated, real = (runpy.run_path(str(ROOT / "examples" / f"{name}_hand.py")) for name in ("simulated", "real"))
    with socket.create_server(("127.0.0.1", 0)) as listener, ThreadPoolExecutor() as pool:
        listener.settimeout(20.0)
        served = pool.submit(simulated["serve"], listener, HAND, CUBE, seed=seed)
        found = real["main"](listener.getsockname(), grasp=GRASP, clock=Time().clock, **by)
        end = served.result(timeout=20.0)
    assert (found.outcome, found.message) == ("reached", "")
    assert end.touching.all()
    way = end.pose[0] - HAND.start_pose
    assert way[1] > 0.045
    assert np.abs(way[[0, 2]]).max() < 0.12
    assert found.moved[1] == pytest.approx(way[1], abs=0.012)
    assert 3 <= found.held < 30  # commands for which no time had passed
    steps = np.diff(found.array("time"))
    assert {0.0, 0.02, 0.04} == set(np.round(steps, 9).tolist())
    ages = found.array("time") - found.array("frame_time")
    assert ages.max() > 0.07
    assert len(set(found.array("frame_time").tolist())) < 0.8 * len(ages)


def test_the_phases_are_those_of_a_trial_and_begin_where_the_hand_is() -> None:
    found, _ = driven(joints=np.array([1.4, -1.2, -1.4, 1.2]))
    assert found.outcome == "reached"
    names, counts = np.unique(found.array("phase"), return_counts=True)
    took = dict(zip(names.tolist(), (counts * PERIOD).tolist(), strict=True))
    assert list(dict.fromkeys(found.array("phase").tolist())) == ["open", "place", "grasp", "manipulate"]
    assert took["place"] == pytest.approx(0.5)
    assert took["grasp"] == pytest.approx(1.2)
    opened = found.array("targets")[found.array("phase") == "open"]
    np.testing.assert_allclose(opened[-1], PLACED, atol=1e-3)
    assert np.abs(np.diff(opened, axis=0)).max() < 1.3 * PERIOD
    closed = found.array("targets")[found.array("phase") == "grasp"]
    np.testing.assert_allclose(closed[-1], GRASP.closed[0], atol=1e-3)


def test_targets_keep_to_a_speed_and_to_the_joints() -> None:
    limited = inhand.hand("2v2_50.50_50.50_1.1_53:lab-limits")
    found, _ = driven(controller=Leaping, hand=limited, config=DriveConfig(fastest=3.0))
    targets = found.array("targets")
    assert np.abs(np.diff(targets, axis=0)).max() == pytest.approx(3.0 * PERIOD)
    assert targets[:, 0].max() == pytest.approx(1.57)


def test_only_new_joint_angles_are_decided_on_and_the_hand_is_held_meanwhile() -> None:
    def every_third_is_repeated(hand: Hand, since: float) -> Reading | None:
        count = round(since / PERIOD)
        if count % 3 == 0:
            return None
        return fine(hand, (count - (count % 3 == 2)) * PERIOD)

    found, hand = driven(every_third_is_repeated)
    assert found.outcome == "reached"
    held, targets = found.array("held"), found.array("targets")
    assert 0.6 < held.mean() < 0.7
    np.testing.assert_array_equal(targets[1:][held[1:]], targets[:-1][held[1:]])
    seen = made[-1].saw
    assert (np.diff([each.time[0] for each in seen]) > 0).all()
    assert seen[-1].joint_velocities[0, 0] == pytest.approx(Turner.step / (3 * PERIOD))
    assert found.held == held.sum()
    assert len(hand.told) == len(found.rows)


def blind(hand: Hand, since: float) -> Reading:
    """Tell the joints and an old frame."""
    return Reading(since, hand.joints, [Frame(1.98, HAND.start_pose)])


def test_frames_that_stop_end_it_with_the_last_targets_held(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        found, hand = driven(until(2.3, blind))
    assert found.outcome == "frames stopped"
    assert found.message == caplog.records[-1].message
    assert "frames stopped: the newest frame is 1.4 s old; the hand holds its last targets. Mend" in found.message
    last = [row for row in found.rows if not row.held][-1]
    assert last.time - last.frame_time <= 0.4
    assert last.time == pytest.approx(2.38 + 0.26, abs=0.03)
    after = found.rows[found.rows.index(last) + 1 :]
    assert len(after) * PERIOD == pytest.approx(1.0, abs=0.05)
    assert all((row.targets == last.targets).all() and row.held for row in after)
    np.testing.assert_array_equal(hand.told[-1][1], last.targets)
    assert found.rows[-1].phase == "manipulate"


def test_after_a_while_without_frames_it_goes_on() -> None:
    found, _ = driven(until(2.3, blind, 3.2))
    assert (found.outcome, found.message) == ("reached", "")
    assert 0.3 / PERIOD < found.held < 0.7 / PERIOD


def test_encoders_that_stall_end_it_and_shortly_are_waited_for() -> None:
    def stalled(hand: Hand, since: float) -> Reading:
        return Reading(2.28, hand.joints, [Frame(since - 0.04, HAND.start_pose)] if since < 2.3 else [])

    found, _ = driven(until(2.3, stalled))
    assert found.outcome == "encoders stopped"
    assert "no new joint angles for 1.0 s; the hand holds its last targets" in found.message
    assert driven(until(2.3, stalled, 2.6))[0].outcome == "reached"
    assert driven(until(2.3, lambda *_: None))[0].outcome == "encoders stopped"


@pytest.mark.parametrize(
    ("script", "outcome", "text"),
    [
        (lambda hand, since: Reading(since, hand.joints), "frames stopped", "no frame has come yet; the hand was told"),
        (lambda *_: None, "encoders stopped", "no new joint angles for 1.0 s; the hand was told nothing"),
        (
            away(0.03, 0.0),
            "out of place",
            "is seen 30 mm and 0 deg from where the hand is to take it; the hand was told",
        ),
        (away(0.0, -0.5), "out of place", "is seen 0 mm and 29 deg from"),
    ],
)
def test_a_hand_that_says_nothing_is_told_nothing(script: Script, outcome: str, text: str) -> None:
    found, hand = driven(script)
    assert (found.outcome, found.rows, hand.told) == (outcome, (), [])
    assert text in found.message
    assert (found.moved == 0).all()


def test_a_loop_that_overruns_makes_nothing_up() -> None:
    def slow(hand: Hand, since: float) -> Reading:
        took = 0.11 if hand.asked % 8 == 0 else 0.004
        hand.time.now += took
        return fine(hand, since + took)

    found, hand = driven(slow)
    assert found.outcome == "reached"
    short = np.diff([time for time, _ in hand.told]) < PERIOD - 1e-9
    assert short.sum() == found.late // 5 > 5  # one after each that took long, five periods late
    assert not (short[1:] & short[:-1]).any()


def test_a_controller_that_gives_no_numbers_is_not_obeyed() -> None:
    found, hand = driven(controller=type("Lost", (Turner,), {"step": np.nan}))
    assert found.outcome == "no number"
    assert "gave the targets [nan" in found.message
    assert np.isfinite(found.array("targets")).all()
    np.testing.assert_array_equal(hand.told[-1][1], hand.told[-2][1])


def test_ctrl_c_holds_and_returns_what_was_done() -> None:
    def stop(*_: object) -> Reading:
        raise KeyboardInterrupt

    found, hand = driven(until(2.3, stop))
    assert found.outcome == "interrupted"
    assert found.message == "interrupted in phase manipulate; the hand holds its last targets"
    assert found.rows[-1].phase == "manipulate"
    assert len(hand.told) == len(found.rows) + 1
    np.testing.assert_array_equal(hand.told[-1][1], found.rows[-1].targets)


def test_time_that_is_up_is_told() -> None:
    assert driven(config=DriveConfig(longest=0.5))[0].outcome == "time out"


def test_frames_in_any_order_twice_or_broken_leave_the_newest() -> None:
    looks, pose = Looks(4), np.array([0.0, 0.09, 0.1])
    assert looks.take(Reading(1.0, np.zeros(4), [Frame(0.9, pose), Frame(0.95, pose + 1e-3), Frame(0.92, pose + 9)]))
    assert (looks.frame_time, looks.pose[0]) == (0.95, 1e-3)
    assert looks.age == pytest.approx(0.05)
    assert not looks.take(Reading(1.0, np.ones(4), [Frame(0.95, pose + 5), Frame(0.98, pose * np.nan)]))
    assert (looks.frame_time, looks.pose[0], looks.joints[0]) == (0.95, 1e-3, 0.0)
    assert not looks.take(Reading(1.02, np.full(4, np.nan), [Frame(0.99, pose)]))
    assert (looks.time, looks.frame_time) == (1.0, 0.99)
    assert looks.take(Reading(1.04, np.full(4, 0.02), []))
    np.testing.assert_allclose(looks.velocities, 0.5)
    seen = looks.seen(np.full(4, 0.3))
    assert (seen.n_worlds, seen.targets[0, 1], seen.age[0]) == (1, 0.3, pytest.approx(0.05))


@pytest.mark.parametrize(
    ("reading", "text"),
    [
        (Reading(1.0, np.zeros(5)), "joint angles of shape (5,); the hand has 4 joints: give one number for each"),
        (Reading(1.0, np.zeros(4), [Frame(1.0, np.zeros(2))]), "a frame of shape (2,); a pose is x, y, theta"),
        (Reading(1.0, np.zeros(4), [Frame(9.0, np.zeros(3))]), "a frame taken at 9 s and joint angles read at 1 s"),
    ],
)
def test_readings_that_are_none_are_refused(reading: Reading, text: str) -> None:
    with pytest.raises(InputError) as raised:
        Looks(4).take(reading)
    assert text in str(raised.value)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"controller": "ik"}, "controller 'ik' reads what no hand can know, true poses and contacts: use ik-sensed"),
    ({"direction": "train"}, "direction 'train' is 8 primitives: give one"),
    ({"grasp": replace(GRASP, closed=np.zeros((2, 4)))}, "grasp.closed has the shape (2, 4); it must be (1, 4)"),
    ({"senses": "feeld"}, "unknown disturbance 'feeld'; did you mean field?"),
    ({"hand": "nonsense"}, "nonsense"),
]
"""What cannot be driven, and what the text says of it."""


@pytest.mark.parametrize(("settings", "text"), REFUSED)
def test_what_cannot_be_driven_is_refused_before_the_hand_is_asked(settings: dict[str, Any], text: str) -> None:
    hand = Hand(Time(), fine, PLACED)
    with pytest.raises(InputError) as raised:
        drive(hand.read, hand.command, **({"grasp": GRASP} | settings))
    assert text in str(raised.value)
    assert hand.asked == 0


def test_settings_that_no_hand_can_have_are_refused() -> None:
    with pytest.raises(InputError, match=r"rate_hz is 0; it must be above 0"):
        DriveConfig(rate_hz=0)


def test_a_learned_policy_on_real_senses_drives_a_hand() -> None:
    policy = replace(a_policy("senses", strength=5.0), actions="fine", contract=contract_of(HAND, FIELD))
    time = Time()
    hand = Hand(time, fine, PLACED)
    settings: dict[str, Any] = {"controller": learned("mine", policy), "grasp": GRASP, "clock": time.clock}
    found = drive(hand.read, hand.command, senses="field", **settings)
    assert found.outcome in {"reached", "time out"}
    targets = found.array("targets")[found.array("phase") == "manipulate"]
    steps = np.abs(np.diff(targets, axis=0)).max(axis=1)
    assert 0.001 < steps.max() <= 0.01 + 1e-9
    with pytest.raises(InputError, match=r"camera.rate_hz 30 there, 25 here"):
        drive(hand.read, hand.command, senses="hard", **settings)


def test_a_policy_runs_with_the_rate_and_the_senses_of_its_contract_alone() -> None:
    policy = replace(a_policy(), contract=contract_of(HAND, FIELD))
    entry = ControllerEntry("mine", "a test's", rough_grasp, Turner, policy, reads=SENSED)
    check_entry(entry, FIELD, DriveConfig())
    limited = replace(policy, contract=contract_of(lab_limits(HAND), FIELD))
    found, _ = driven(controller=Leaping, policy=limited, senses=FIELD)
    assert found.array("targets")[:, 0].max() == pytest.approx(1.57)  # the contract's hand, where no other is given
    with pytest.raises(InputError, match=r"camera.rate_hz 30 there, 50 here"):
        check_entry(entry, BENCH, DriveConfig())
    with pytest.raises(InputError, match=r"trained with 50 decisions a second and here would make 25"):
        check_entry(entry, FIELD, DriveConfig(rate_hz=25))
    with pytest.raises(InputError, match=r"say what this hand's are, as senses='my_hand.toml'"):
        check_entry(entry, None, DriveConfig())
    with pytest.raises(InputError, match=r"policy 'mine' has no contract"):
        check_entry(replace(entry, policy=replace(policy, contract=None)), FIELD, DriveConfig())
    with pytest.raises(InputError, match=r"controller 'rl-privileged' reads what no hand can know"):
        check_entry(find_controller("rl-privileged"), FIELD, DriveConfig())


ALONE = """
import sys
import numpy as np
import inhand
from inhand.control.link import Clock, DriveConfig
from inhand.control.phases import Grasp

class Time:
    now = 0.0
    def wait(self, seconds): self.now += seconds

time, joints = Time(), [np.array([0.95, -1.787, -0.95, 1.787])]
grasp = Grasp(joints[0][None], np.array([[0.8, -1.775, -0.8, 1.775]]), np.array([0.02]))
driven = inhand.drive(
    lambda: inhand.Reading(time.now, joints[-1], [inhand.Frame(time.now, (0.0, 0.0936, 0.0))]),
    joints.append, grasp=grasp, clock=Clock(lambda: time.now, time.wait), config=DriveConfig(longest=0.5),
)
print(driven.rows[-1].phase, sorted({"numba", "mujoco", "scipy", "pybullet", "pandas"} & set(sys.modules)))
"""


def test_a_hand_is_driven_in_numpy_alone(tmp_path: Path) -> None:
    assert in_a_process(sys.executable, "-c", ALONE, cwd=tmp_path) == (0, "manipulate []\n", "")
