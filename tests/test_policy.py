"""A learned policy: its file, the function it is, when it holds, and what it refuses."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from inhand import geometry
from inhand.asterisk_test.cells import job_of
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.catalogue import find_controller, learned, policy_of
from inhand.control.contract import ANGLES, check_senses, contract_of
from inhand.control.controller import Task
from inhand.control.draws import disturbance_notes
from inhand.control.notes import notes_of
from inhand.control.policy import (
    CARD,
    STILL_TIME,
    Policy,
    PolicyController,
    load_policy,
    save_policy,
)
from inhand.control.policy_arrays import ACTOR
from inhand.control.route_policy import RouteController
from inhand.control.run_config import RunConfig
from inhand.control.seen import SENSED
from inhand.errors import InputError
from inhand.hands.files import assumed
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.records import table_of
from inhand.sim.disturbance import FIELD, Camera, Commands, Encoders
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SUBSTEPS
from inhand.sim.state import State
from inhand.tasks.cards import interface_card
from inhand.tasks.layouts import find_layout
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN, primitive_at

HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), parse_object_name("cube_39")
LARGER = "2v3_25.75_25.35.40_1.1_53"
OTHER = parse_hand_name(LARGER)
MADE = {"preset": "default", "hand": HAND.name, "object": CUBE.name, "seed": 3}


def a_policy(layout: str = "grip", strength: float = 1.0) -> Policy:
    """Return a policy with drawn weights; with strength 0 it does nothing."""
    rng, size = np.random.default_rng(5), find_layout(layout).size(HAND)
    sizes = [size, 16, 16, find_layout(layout).actions(HAND)]
    drawn = [strength * rng.standard_normal((a, b)) / np.sqrt(a) for a, b in pairwise(sizes)]
    weights = tuple(weight.astype(np.float32).astype(float) for weight in drawn)
    biases = tuple(np.zeros(b) for b in sizes[1:])
    return Policy(weights, biases, layout, "steps", "planned", MADE, contract_of(HAND, None))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the folder of a training run with a best and a last policy."""
    save_policy(a_policy(), tmp_path / "my run" / "best")
    save_policy(a_policy(strength=0.5), tmp_path / "my run" / "last")
    return tmp_path / "my run"


def task(angles: tuple[float, ...] = (90.0,), distance: float | None = 0.05) -> Task:
    paths = np.stack([straight_path(primitive_at(angle)).poses for angle in angles])
    far = None if distance is None else np.full(len(paths), distance)
    return Task(HAND, (CUBE,) * len(paths), geometry.Path(paths), 0.004, distance=far)


def held(count: int = 1) -> State:
    """Return the state of worlds with the object at its start."""
    simulator = MujocoSimulator(HAND, [CUBE] * count)
    start = np.tile(HAND.start_pose, (count, 1))
    return simulator.reset(start, np.tile(HAND.limits.mean(axis=1), (count, 1)))


def moved(state: State, way: float) -> State:
    """Return a state with every object moved Out by some way [m]."""
    return replace(state, object_pose=state.object_pose + np.array([0.0, way, 0, 0, 0, 0, 0]))


def test_a_policy_comes_back_as_it_was_and_as_the_same_bytes(tmp_path: Path) -> None:
    policy = a_policy()
    save_policy(policy, tmp_path / "a")
    back = load_policy(tmp_path / "a")
    save_policy(back, tmp_path / "b")
    for name in (ACTOR, CARD):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    seen = np.random.default_rng(0).uniform(-1, 1, (7, policy.weights[0].shape[0]))
    np.testing.assert_array_equal(policy(seen), back(seen))
    assert (back.observation, back.actions, back.grasp, back.trained) == ("grip", "steps", "planned", MADE)
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == [CARD, ACTOR]


@pytest.mark.skipif(importlib.util.find_spec("jax") is None, reason="needs the extra `rl`: pip install 'inhand[rl]'")
def test_a_cell_of_a_sweep_knows_its_policy_by_what_it_is_not_by_its_place(folder: Path, tmp_path: Path) -> None:
    names = "a", "with", "b"
    config = AsteriskConfig(controller=str(folder))
    before, again = (job_of(config, Held(HAND, CUBE), {}, tmp_path, names).settings for _ in range(2))
    assert before == again
    save_policy(a_policy(strength=0.9), folder / "best")
    after = job_of(config, Held(HAND, CUBE), {}, tmp_path, names).settings
    assert [key for key in after if after[key] != before[key]] == ["policy"]


def test_numpy_and_jax_act_alike() -> None:
    import jax.numpy as jnp

    from inhand.learning.networks import Layer, act

    policy = a_policy()
    network = tuple(Layer(jnp.asarray(w), jnp.asarray(b)) for w, b in zip(policy.weights, policy.biases, strict=True))
    seen = np.random.default_rng(1).uniform(-1, 1, (100, policy.weights[0].shape[0]))
    np.testing.assert_allclose(policy(seen), np.asarray(act(network, jnp.asarray(seen))), atol=1e-5)


CARDS: list[tuple[Callable[[dict[str, Any]], object], str]] = [
    (lambda card: card.update(format=1), "it has format 1; this version reads 2, which has the scales of observations"),
    (lambda card: card.pop("layers"), "it has no field layers"),
    (lambda card: card.update(layers=-1), "layers is -1, and actor.safetensors has 6 arrays"),
    (lambda card: card.update(layers=2), "layers is 2, and actor.safetensors has 6 arrays"),
    (lambda card: card.update(layers=10**12), "layers is 1000000000000, and"),
    (lambda card: card.update(observation="gryp"), "unknown observation 'gryp'"),
    (lambda card: card.update(observation="thesis"), "layout: grip-1 there, thesis-1 here"),
    (lambda card: card.update(actions="leaps"), "actions is 'leaps'; it must be angles or steps or fine"),
    (lambda card: card.update(grasp=["rough"]), "grasp is ['rough']; it must be"),
    (lambda card: card.update(trained=None), "trained is None; it must be a table"),
    (lambda card: card["interface"].update(parts=None), "interface.parts is None; it must be a list"),
    (lambda card: card["interface"]["parts"][7].update(scale=[2.5]), "spin [rad/s]: scale 2.5 there, 2 here"),
    (lambda card: card["interface"]["parts"][7].update(middle=[1]), "spin [rad/s]: middle 1 there, 0 here"),
    (lambda card: card["interface"]["parts"][7].update(fixed=2), "spin [rad/s]: fixed 2 there, 1 here"),
    (lambda card: card["interface"]["parts"][7].update(fixed=10**12), "has 1000000000000 numbers, 0 for each joint"),
    (lambda card: card["interface"]["parts"].pop(), "gaps of the fingers [m]: here alone"),
    (lambda card: card["interface"]["parts"].reverse(), "the order of the observation's parts"),
    (lambda card: card["interface"].update(largest_step=0.1), "largest step: 0.1 there, 0.04 here"),
    (lambda card: card["contract"].update(rate_hz=0), "rate_hz is 0; it must be a positive number of decisions"),
    (lambda card: card["contract"]["joints"].reverse(), "joints are right 1, right 0, left 1, left 0; hand"),
    (lambda card: card["contract"]["camera"].update(missing=1.0), "missing is 1; it must be a share below 1"),
    (
        lambda card: card.update(contract=table_of(contract_of(parse_hand_name(LARGER), None))),
        "4 outputs, and the hand",
    ),
]
"""Changes of a policy's card, and what the text says of them."""


@pytest.mark.parametrize(("change", "text"), CARDS)
def test_a_card_that_cannot_be_is_refused(folder: Path, change: Callable[[dict[str, Any]], object], text: str) -> None:
    path = folder / "best" / CARD
    card = json.loads(path.read_text())
    change(card)
    path.write_text(json.dumps(card))
    with pytest.raises(InputError, match=rf"cannot be used: .*{re.escape(text)}.*; train it again"):
        load_policy(folder / "best")


WEIGHTS: list[tuple[dict[str, Any], str]] = [
    ({"1.weight": None, "one": np.zeros(3)}, "actor.safetensors has no array 1.weight"),
    ({"1.weight": np.zeros((16, 15))}, "1.bias has the shape (16,); it must be (15,)"),
    ({"1.weight": np.zeros((4, 16))}, "1.weight has the shape (4, 16); it must be (16, 16)"),
    ({"1.weight": np.zeros(16)}, "1.weight has the shape (16,)"),
    ({"0.weight": np.zeros((30, 16))}, "it has 30 inputs and 4 outputs; layout grip-1 has 31 numbers"),
    ({"2.weight": np.full((16, 4), np.nan)}, "2.weight holds float64"),
    ({"2.weight": np.zeros((16, 4), int)}, "2.weight holds int64"),
    ({"3.weight": np.zeros((4, 4))}, "layers is 3, and actor.safetensors has 7 arrays"),
]
"""Arrays in the place of a policy's, and what the text says of them."""


@pytest.mark.parametrize(("changed", "text"), WEIGHTS)
def test_weights_that_cannot_be_are_refused(folder: Path, changed: dict[str, Any], text: str) -> None:
    path = folder / "best" / ACTOR
    arrays = load_file(path) | changed
    save_file({name: array for name, array in arrays.items() if array is not None}, path)
    with pytest.raises(InputError, match=rf"cannot be used: .*{re.escape(text)}.*; train it again"):
        load_policy(folder / "best")


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        (ACTOR, None, "no trained policy in"),
        (ACTOR, b"nothing", "cannot be used"),
        (CARD, b"{", "it is no JSON"),
        (CARD, b"[1]", "it is [1]; it must be a table"),
        (CARD, b"\xff\xfe", "it is no JSON"),
        (CARD, b"[" * 100_000, "its JSON is nested too deeply"),
        (CARD, b'{"format": 2, "trained": ' + b'{"a": ' * 900 + b"1" + b"}" * 901, "cannot be used"),
    ],
)
def test_files_that_are_no_policy_are_refused(folder: Path, name: str, content: bytes | None, text: str) -> None:
    (folder / "best" / name).unlink()
    if content is not None:
        (folder / "best" / name).write_bytes(content)
    with pytest.raises(InputError, match=re.escape(text)):
        load_policy(folder / "best")


def test_every_change_of_what_a_scale_depends_on_changes_the_card() -> None:
    layout = find_layout("thesis")
    cards = {interface_card(layout)}
    for number, part in enumerate(layout.parts):
        for other in (
            replace(part, half=0.05),
            replace(part, middle=0.01),
            replace(part, half=lambda hand: hand.palm_width),
        ):
            cards.add(
                interface_card(replace(layout, parts=(*layout.parts[:number], other, *layout.parts[number + 1 :])))
            )
    assert len(cards) == 1 + 3 * len(layout.parts)
    assert (interface_card(layout).largest_step, interface_card(layout, "fine").largest_step) == (0.04, 0.01)


def test_a_folder_says_what_it_drives_and_what_it_was_trained_to_sense(tmp_path: Path) -> None:
    save_policy(replace(a_policy(), contract=contract_of(HAND, FIELD)), tmp_path)
    told = json.loads((tmp_path / CARD).read_text())["contract"]
    assert told["joints"] == ["left 0", "left 1", "right 0", "right 1"]
    assert told["observed"] == ["left 0", "right 0", "left 1", "right 1"]
    assert (told["rate_hz"], told["angles"], told["hand"]["name"]) == (50.0, ANGLES, HAND.name)
    assert told["encoders"]["resolution_deg"] == 0.09
    assert (told["camera"]["rate_hz"], told["camera"]["delay_ms"]) == (30.0, [20.0, 60.0])
    assert told["commands"]["delay_ms"] == [0.0, 20.0]
    assert load_policy(tmp_path).contract == contract_of(HAND, FIELD)


def test_another_rate_than_the_contracts_is_refused() -> None:
    PolicyController(replace(task(), substeps=SUBSTEPS), a_policy())
    with pytest.raises(InputError, match="trained with 50 decisions a second and here would make 25: run it at its"):
        PolicyController(replace(task(), substeps=2 * SUBSTEPS), a_policy())
    with pytest.raises(InputError, match="50 decisions a second and here would make 100"):
        RouteController(replace(task(), timestep=0.002), a_policy())


OTHERS: list[tuple[str, dict[str, Any], str]] = [
    ("encoders", {"resolution_deg": 0.29}, "encoders.resolution_deg 0.09 there, 0.29 here"),
    ("camera", {"rate_hz": 15.0}, "camera.rate_hz 30 there, 15 here"),
    ("camera", {"rate_hz": 0.0}, "camera.rate_hz 30 there, 50 here"),
    ("camera", {"delay_ms": (40.0, 80.0)}, "camera.delay_ms 20 to 60 there, 40 to 80 here"),
    ("camera", {"delay_ms": (0.0, 40.0)}, "camera.delay_ms 20 to 60 there, 0 to 40 here"),
    ("camera", {"missing": 0.2, "missing_run": (1, 3)}, "camera.missing 0.05 there, 0.2 here; camera.missing_run 1"),
    ("commands", {"delay_ms": (30.0, 30.0)}, "commands.delay_ms 0 to 20 there, 30 here"),
]
"""What a hand has in the place of `field`, and what the text says of it."""


@pytest.mark.parametrize(("part", "changed", "text"), OTHERS)
def test_senses_that_were_not_trained_are_refused(part: str, changed: dict[str, Any], text: str) -> None:
    mine = replace(FIELD, name="my hand", **{part: replace(getattr(FIELD, part), **changed)})
    with pytest.raises(InputError, match=rf"with other senses than 'my hand' has: .*{re.escape(text)}.*inhand train"):
        check_senses(contract_of(HAND, FIELD), mine)


def test_senses_within_what_was_trained_are_taken() -> None:
    camera = replace(FIELD.camera, rate_hz=29.97, delay_ms=(30.0, 40.0), noise_mm=0.5, missing=0.0, missing_run=(2, 5))
    fine = replace(FIELD, encoders=replace(FIELD.encoders, resolution_deg=0.01), camera=camera)
    check_senses(contract_of(HAND, FIELD), fine)
    check_senses(contract_of(HAND, None), replace(FIELD, encoders=Encoders(), camera=Camera(50.0), commands=Commands()))


def test_a_disturbed_run_says_which_senses_its_policy_was_not_trained_with() -> None:
    contract = contract_of(HAND, FIELD)
    first, *others = disturbance_notes(RunConfig(disturb="hard"), "sensed", contract)
    assert "reads what is sensed" in first
    assert [note.split(": ")[0] for note in others] == ["The policy was trained with other senses"]
    assert "camera.rate_hz 30 there, 25 here; " in others[0]
    assert len(disturbance_notes(RunConfig(disturb="field"), "sensed", contract)) == 1
    assert disturbance_notes(RunConfig(), "sensed", contract) == ()
    assert find_controller("rl-privileged").contract == contract_of(HAND, None)
    assert find_controller("ik").contract is None


def test_a_policy_has_finished_once_nothing_is_gained_for_a_while() -> None:
    controller, state = PolicyController(task(), a_policy()), held()
    controller.begin(state)
    decisions = round(STILL_TIME / 0.02)
    assert [bool(controller.finished(moved(state, 1e-3))[0]) for _ in range(decisions)] == [False] * decisions
    assert controller.finished(moved(state, 1e-3))[0]
    assert not controller.finished(moved(state, 2e-3))[0]  # a gain starts the time anew
    back = [bool(controller.finished(moved(state, 0.0))[0]) for _ in range(decisions)]
    assert back == [False] * (decisions - 1) + [True]
    controller.begin(state)
    assert not controller.finished(state)[0]


def test_creeping_less_than_is_seen_is_no_gain() -> None:
    controller, state = PolicyController(task(), a_policy()), held()
    controller.begin(state)
    steps = round(STILL_TIME / 0.02)
    done = [bool(controller.finished(moved(state, 2e-4 * k / steps))[0]) for k in range(steps)]
    assert done == [False] * (steps - 1) + [True]


def test_targets_are_those_of_the_policy_and_stay_within_the_joints() -> None:
    still, state = PolicyController(task((90.0, 0.0)), a_policy(strength=0.0)), held(2)
    still.begin(state)
    np.testing.assert_allclose(still.act(state), state.targets)
    wild = PolicyController(task((90.0, 0.0)), a_policy(strength=50.0))
    wild.begin(state)
    targets = wild.act(state)
    assert np.abs(targets - state.targets).max() > 0.01
    assert ((targets >= HAND.limits[:, 0]) & (targets <= HAND.limits[:, 1])).all()


def test_paths_that_bend_or_turn_are_refused() -> None:
    straight = task()
    bent, turned = straight.path.poses.copy(), straight.path.poses.copy()
    bent[:, len(bent[0]) // 2, 0] += 1e-3
    turned[..., 2] = 0.1
    for paths in (bent, turned):
        with pytest.raises(InputError, match="knows straight primitives"):
            PolicyController(replace(straight, path=geometry.Path(paths)), a_policy())


def test_a_hand_with_other_joints_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=f"trained with {HAND.name} and takes .* hand {LARGER!r} gives .*: use a hand"):
        PolicyController(replace(task(), hand=parse_hand_name(LARGER)), a_policy())
    with pytest.raises(InputError, match="use a hand with as many joints"):
        prepare(AsteriskConfig(controller=str(folder), hand=LARGER))
    with pytest.raises(InputError, match="knows straight primitives"):
        prepare(AsteriskConfig(controller=str(folder), directions="twist"))


def test_a_run_and_its_policies_are_controllers(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (folder, folder / "best"):
        entry = find_controller(str(name))
        assert entry.name == "my_run"
        assert entry.policy is not None
        assert entry.policy.trained == MADE
    shutil.copytree(folder / "last", folder / "imitated")
    for other in ("last", "imitated"):
        assert find_controller(str(folder / other)).name == f"my_run-{other}"
    (folder.parent / "ik").mkdir()
    save_policy(a_policy(), folder.parent / "ik")
    assert policy_of(folder.parent / "ik")[0] == "ik-policy"
    monkeypatch.chdir(folder.parent)  # where a folder that happens to be called like a controller does not stand for it
    assert find_controller("ik").policy is None
    assert find_controller("./ik").policy is not None
    (folder.parent / "empty").mkdir()
    with pytest.raises(InputError, match=r"no trained policy in .*empty"):
        find_controller(str(folder.parent / "empty"))
    with pytest.raises(
        InputError,
        match=r"allowed are ik, ik-cautious, .*rl, rl-privileged, rl-family, rl-family-privileged, the folder of",
    ):
        find_controller(str(folder / "nothing"))


def test_the_policy_of_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.resources.files", lambda _: tmp_path)
    with pytest.raises(InputError, match="train one with `inhand train"):
        find_controller("rl")
    save_policy(a_policy(), tmp_path / "policies" / "default")
    assert find_controller("rl").name == "rl"


def test_a_run_says_what_the_policy_was_trained_with() -> None:
    entry = learned("mine", a_policy())
    free = assumed([HAND.name])
    assert notes_of(entry, HAND.name, CUBE.name) == free
    assert notes_of(find_controller("ik"), LARGER, "cylinder_40") == assumed([LARGER])
    assert notes_of(entry, HAND.name, "cylinder_40") == (
        *free,
        f"The policy mine was trained with cube_39 and {HAND.name}; here it moves cylinder_40 with {HAND.name}.",
    )


def test_rl_runs_hands_and_objects_that_differ_by_the_policy_of_the_family() -> None:
    own, other = Held(HAND, CUBE), Held(parse_hand_name(LARGER), CUBE)
    asked = (("rl", None), ("rl-family", None), ("rl", own), ("rl", Held(HAND, parse_object_name("cylinder_40"))))
    found = [find_controller(name, held) for name, held in (*asked, ("rl", other), ("rl-family", own))]
    assert [entry.name for entry in found] == ["rl", "rl-family", "rl", "rl", "rl", "rl-family"]
    assert {entry.reads for entry in found} == {SENSED}
    alone, family, *others = (entry.policy.digest for entry in found if entry.policy)
    assert others == [alone, family, family, family]
    told = f"rl moves cube_39 with {LARGER} by the policy for hands and objects that differ, rl-family"
    assert notes_of(find_controller("rl", other), LARGER, CUBE.name)[-1] == told
    with pytest.raises(InputError, match=r"palm width is 90 mm, the family's 40 to 80 mm; use a hand within, or train"):
        prepare(AsteriskConfig(controller="rl", hand="2v2_50.50_50.50_1.1_90"))


@pytest.mark.parametrize("grasp", ["planned", "rough"])
def test_an_object_is_held_where_it_stands_and_carried_by_the_policy(grasp: Literal["planned", "rough"]) -> None:
    entry = learned("mine", replace(a_policy(strength=0.0), grasp=grasp))
    config = AsteriskConfig(directions="Right", trials=2)
    trials = simulate(config, replace(prepare(config), controller=entry))
    for trial in trials:
        assert trial.passport.controller == "mine"
        assert trial.touching[trial.manipulation].all()
        assert trial.outcome == "no movement"
        assert np.ptp(trial.targets[trial.manipulation], axis=0).max() < 1e-9
    assert np.abs(trials[0].targets[-1] - trials[1].targets[-1]).max() > 1e-3
    assert TRAIN[2].name == trials[0].passport.primitive
