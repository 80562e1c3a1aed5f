"""The policies that ship: small, made by known configurations, and able to do what the documentation says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import inhand.policies
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.names import SHIPPED
from inhand.control.policy import load_policy
from inhand.control.spatial_catalogue import SHIPPED as SHIPPED_IN_SPACE
from inhand.records import read_record
from inhand.tasks.cards import InterfaceCard, interface_card
from inhand.tasks.layouts import find_layout

PLACE = Path(inhand.policies.__file__).parent


@pytest.mark.parametrize("name", [*SHIPPED.values(), *SHIPPED_IN_SPACE.values()])
def test_they_are_small_and_say_how_they_were_made(name: str) -> None:
    folder = PLACE / name
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1_000_000
    card = json.loads((folder / "config.json").read_text())
    made = card["config"]
    seen = read_record(card["interface"], InterfaceCard)
    assert seen == interface_card(find_layout(made["interface"]["observation"]))
    trained = load_policy(folder).trained
    disturb = {"disturb": made["disturb"]} if made["disturb"] != "none" else {}
    pairs = {"pairs": made["pairs"]} if made.get("pairs") else {}
    assert {key: made[key] for key in ("preset", "hand", "object", "seed")} | disturb | pairs == trained
    assert made["directions"] == "continuous"


def test_it_carries_the_cube_in_trained_and_unseen_directions() -> None:
    config = AsteriskConfig(
        controller="rl-privileged", directions="Out,Right,In,In-Left,Out',In'-Right'", trials=2, seed=7
    )
    results = [result_of_trial(trial) for trial in simulate(config, prepare(config))]
    assert [result.outcome for result in results] == ["end of grip"] * 12
    assert min(result.fraction or 0.0 for result in results) > 0.75
    assert max(result.metrics.lateral_max_mm for result in results) < 3.0
    assert max(result.metrics.rotation_max_deg for result in results) < 8.0
