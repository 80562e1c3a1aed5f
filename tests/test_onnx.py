"""A policy as an ONNX model: the same actions, a card that says what its numbers are, and what is refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import inhand as front
from commands import Call
from inhand.control.contract import contract_in_space
from inhand.control.onnx_export import CARD, NAMES, OPSET, ModelCard, card_of, model_of
from inhand.control.policy import Policy, save_policy
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.pair import SpatialPair, load_held
from inhand.records import read_json, read_record
from inhand.sim.disturbance import FIELD
from inhand.tasks.layouts import LAYOUTS, find_layout
from inhand.tasks.observations import numbers_for
from inhand.tasks.past import LAGS
from test_joint_rows import a_policy as over_joints
from test_policy import HAND, a_policy

onnxruntime = pytest.importorskip("onnxruntime", reason="needs the extra `onnx`: pip install 'inhand[onnx]'")
MANY = 4000


def ran(content: bytes, observed: Array) -> Array:
    """Return the actions of a model for numbers as they are measured."""
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return np.asarray(session.run(None, {NAMES[0]: observed.astype(np.float32)})[0])


def measured(layout: str, scaled: Array) -> Array:
    """Return numbers as they are measured, part by part of a layout, of such as policies take."""
    parts = find_layout(layout).parts
    given = np.split(scaled, np.cumsum([part.size(HAND) for part in parts])[:-1], axis=1)
    found = [
        each * numbers_for(part.half, HAND) + numbers_for(part.middle, HAND)
        for each, part in zip(given, parts, strict=True)
    ]
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_model_acts_as_its_policy(layout: str) -> None:
    policy = a_policy(layout, strength=2.0)
    scaled = np.random.default_rng(3).uniform(-1.5, 1.5, (MANY, len(policy.weights[0])))
    found = ran(model_of(policy).SerializeToString(), measured(layout, scaled))
    wanted = policy(np.clip(scaled, -1.0, 1.0))
    assert np.abs(wanted).mean() > 0.3
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_a_model_of_a_network_over_joints_acts_as_its_policy() -> None:
    policy = over_joints()
    scaled = np.random.default_rng(5).uniform(-1.5, 1.5, (MANY, find_layout("joints").size(HAND)))
    scaled[:, [2, 5]] = 0.0  # two links a finger
    found = ran(model_of(policy).SerializeToString(), measured("joints", scaled))
    wanted = policy(np.clip(scaled, -1.0, 1.0))
    assert np.abs(wanted[:, 0]).mean() > 0.3
    assert (found[:, [2, 5]] == 0).all()
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_the_shipped_policy_as_a_file_and_its_card(tmp_path: Path) -> None:
    import onnx

    from inhand.control.catalogue import find_controller

    place = front.export("rl", tmp_path / "new" / "policy.onnx")
    policy = find_controller("rl").policy
    assert policy is not None
    scaled = np.random.default_rng(4).uniform(-1, 1, (MANY, len(policy.weights[0])))
    found = ran(place.read_bytes(), measured(policy.observation, scaled))
    np.testing.assert_allclose(found, policy(scaled), atol=1e-5)
    model = onnx.load(place)
    (told,) = model.metadata_props
    assert (told.key, model.opset_import[0].version) == (CARD, OPSET)
    assert read_record(read_json(told.value), ModelCard) == card_of(policy)


def test_a_card_tells_every_number_of_an_observation() -> None:
    policy = a_policy("thesis")
    card = card_of(policy)
    assert [part.name for part in card.inputs] == [part.name for part in find_layout("thesis").parts]
    assert [part.first for part in card.inputs] == [0, 1, 3, 4, 7, 11, 19]
    assert sum(part.count for part in card.inputs) == len(policy.weights[0])
    reach = card.inputs[1]
    assert reach.middle[0] == 0.0
    assert reach.half[1] == pytest.approx(reach.half[0] / 2)
    assert (card.actions, card.largest_step, card.lags) == ("steps", 0.04, ())
    counts = {part.name: part.count for part in card_of(a_policy("senses")).inputs}
    lags = card_of(a_policy("senses")).lags
    assert lags == (0, 1, 2, 4, 8)
    assert counts["encoders [rad]"] == len(lags) * HAND.n_joints
    assert card.contract is not None
    assert card.contract.joints == ("left 0", "left 1", "right 0", "right 1")


def test_the_policy_for_a_hand_in_space_tells_its_own_contract(tmp_path: Path) -> None:
    policy = find_spatial_controller("rl").policy
    assert policy is not None
    held, size = load_held(policy.trained["hand"], policy.trained["object"]), len(policy.weights[0])
    assert isinstance(held, SpatialPair)
    contract = contract_in_space(held, FIELD)
    save_policy(policy, tmp_path / "mine")
    front.export(tmp_path / "mine", tmp_path / "policy.onnx")
    card = card_of(policy)
    assert (card.contract, card.space, card.lags) == (None, contract, LAGS)
    assert contract.observed[:3] == tuple(f"{name} 0" for name in held.hand.finger_names)
    assert sum(part.count for part in card.inputs) == size
    scale = [(np.array(part.middle), np.array(part.half)) for part in card.inputs]
    middle, half = (np.concatenate(each) for each in zip(*scale, strict=True))
    scaled = np.random.default_rng(6).uniform(-1.0, 1.0, (MANY, size))
    found = ran((tmp_path / "policy.onnx").read_bytes(), middle + half * scaled)
    np.testing.assert_allclose(found, policy(scaled), atol=1e-4)


@pytest.mark.parametrize(
    ("asked", "layout"),
    [
        (("2v2_50.50_50.50_1.1_53", None), "senses-1"),
        ((None, "cylinder_36"), "joint-senses-1"),
        (("2v3_50.50_40.30.30_1.1_53", None), "joint-senses-1"),
        (("3f_60.60_40_10", None), "space-senses-1"),
    ],
)
def test_rl_is_what_it_is_with_the_hand_and_the_object(
    asked: tuple[str | None, str | None], layout: str, tmp_path: Path
) -> None:
    import onnx

    place = front.export("rl", tmp_path / "policy.onnx", hand=asked[0], object=asked[1])
    (told,) = onnx.load(place).metadata_props
    assert read_record(read_json(told.value), ModelCard).layout == layout


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("rl", "--hand", "2v2_50.50_50.50_1.1_20"), "is outside of the policy's family"),
        (("rl-family", "--hand", "3f_60.60_40_10"), "controller 'rl-family' with a hand in space"),
        (("rl", "--hand", "4f_60.60.60_40_10"), "use a hand with as many, --controller ik, or train one"),
        (("ik", "--hand", "3f_60.60_40_10"), "ik is no learned policy"),
        (("rl", "--as", "csv", "--object", "cube_39"), "leave them out with trials and demonstrations"),
    ],
)
def test_what_does_not_know_a_hand_is_not_exported_for_it(
    words: tuple[str, ...], text: str, tmp_path: Path, inhand: Call
) -> None:
    code, _, error = inhand("export", *words, "--out", tmp_path / "policy.onnx")
    assert (code, text in error) == (2, True), error
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_a_model_and_refuses_to_replace_one(inhand: Call, tmp_path: Path) -> None:
    save_policy(a_policy(), tmp_path / "mine")
    out = tmp_path / "policy.onnx"
    code, told, _ = inhand("export", tmp_path / "mine", "--out", out)
    assert (code, str(out) in told) == (0, True)
    first = out.read_bytes()
    code, _, error = inhand("export", tmp_path / "mine", "--out", out)
    assert (code, error) == (2, f"inhand: --out {out} exists; give another name, or --overwrite to replace it\n")
    save_policy(a_policy(strength=2.0), tmp_path / "mine")
    assert inhand("export", tmp_path / "mine", "--out", out, "--overwrite")[0] == 0
    assert out.read_bytes() != first


def no_contract() -> Policy:
    return replace(a_policy(), contract=None)


@pytest.mark.parametrize(
    ("policy", "out", "text"),
    [
        (a_policy(), "policy.pt", "policy.pt does not end with .onnx: give the name of an ONNX file"),
        (no_contract(), "policy.onnx", "the policy has no contract, so that nobody knows what its numbers are"),
        ("ik", "policy.onnx", "ik is no learned policy: give the folder of a run of `inhand train`, or rl"),
        ("nothing", "policy.onnx", "unknown controller 'nothing'"),
    ],
)
def test_what_cannot_be_a_model_is_refused(policy: str | Policy, out: str, text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=text):
        front.export(policy, tmp_path / out)
    assert not list(tmp_path.iterdir())


def test_without_the_extra_its_name_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(InputError, match=r"an ONNX model needs the extra `onnx`: pip install 'inhand\[onnx\]'"):
        front.export(a_policy(), tmp_path / "policy.onnx")
