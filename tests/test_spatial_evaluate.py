"""A learned policy of a hand in space beside the expert: tables, page and folder, what is read back, and refusals."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import inhand
from commands import Call
from inhand.asterisk_test.spatial.run import SpatialSetup
from inhand.comparing import compared
from inhand.control.phases import Grasp
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.spatial_trial import SpatialTrial
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialHand
from inhand.learning import evaluate as evaluation
from inhand.learning.commands import EvaluateConfig
from inhand.learning.space_pools import TESTED
from inhand.learning.spatial_report import SpatialCompared
from inhand.tasks.spatial.primitives import parse_spatial_directions
from test_spatial_asterisk import limited
from test_spatial_learning import PLAIN

PAIR = ("3f_60.60_40_10", "cube_50")
ASKED = parse_spatial_directions("Out,turn+z")
WORDS = ("rl", "--hand", PAIR[0], "--object", PAIR[1])


def gripped_plainly(setup: object) -> SpatialSetup:
    assert isinstance(setup, SpatialSetup)
    entry = replace(setup.controller, grasp=lambda hand, *given, **_: plain(hand, given[3]))
    return replace(setup, controller=entry)


def plain(hand: SpatialHand, starts: Array) -> Grasp:
    return replace(closed_at(hand, [PLAIN] * len(starts), starts), way=np.full(len(starts), 0.02))


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SpatialCompared, Path]]:
    """Return a small evaluation, told to go 2 cm from plain grips that need no search, and its folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.asterisk_test.spatial.run.limits_in_space", limited)
        patch.setattr(evaluation, "SEEN", ASKED)
        patch.setattr(evaluation, "TESTED", TESTED[:1])
        config = EvaluateConfig(hand=PAIR[0], object=PAIR[1], gravity="down", trials=1, episodes=4, seed=8)
        known = evaluation.ready_evaluation(config)
        known = replace(known, setup=gripped_plainly(known.setup), expert=gripped_plainly(known.expert))
        made = evaluation.finish_evaluation(config, known)
        assert isinstance(made, SpatialCompared)
        folder = tmp_path_factory.mktemp("evaluation") / "run"
        made.save(folder)
        yield made, folder


def test_both_start_from_the_same_places(found: tuple[SpatialCompared, Path]) -> None:
    made, _ = found
    assert [each.name for each in (made.policy, made.expert)] == ["rl", "ik"]
    assert [result.direction for result in made.policy.results] == ["Out", "turn+z", TESTED[0].name, "Out"]
    assert len(made.table()) == 8
    assert not any(result.lost for each in (made.policy, made.expert) for result in each.results)
    assert {trial.passport.reads for trial in made.policy.trials} == {"sensed"}
    assert min(result.metrics.max_distance_mm for result in made.policy.results if result.direction == "Out") > 18.0
    for one, other in zip(made.policy.trials, made.expert.trials, strict=True):
        assert isinstance(one, SpatialTrial)
        assert one.object_pose[0].tobytes() == other.object_pose[0].tobytes()
        assert one.passport.gravity == other.passport.gravity == (0.0, 0.0, 9.81)


def test_directions_turns_and_those_never_shown_are_told_apart(found: tuple[SpatialCompared, Path]) -> None:
    made, folder = found
    tables = {title: (header, rows) for title, header, rows in made.tables}
    assert list(tables) == ["Directions", "Turns", "Directions never shown"]
    header, rows = tables["Turns"]
    assert header[:4] == ("Direction", "Limit [deg]", "Of limit", "Distance [deg]")
    assert [row[0] for row in rows] == ["turn+z", "all 1"]
    assert [row[0] for row in tables["Directions never shown"][1]] == [TESTED[0].name, "all 1"]
    assert tables["Directions"][1][0][-1] == "0 of 2 | 0 of 2"
    assert "Human [mm]" not in header
    assert {each.name for each in (folder / "figures").iterdir()} == {"policy.png", "expert.png", "replay.gif"}
    assert (folder / "run.toml").read_text().count('gravity = "down"') == 1
    report = (folder / "report.md").read_text()
    for text in ("gravity down", "Directions never shown", "ik-sensed closes the fingers and lifts the object"):
        assert text in report
    assert json.loads((folder / "metrics.json").read_text())["failed"] == {"policy": [], "expert": []}
    assert "Directions never shown" in (folder / "report.html").read_text()


def test_an_evaluation_in_space_is_read_back(found: tuple[SpatialCompared, Path]) -> None:
    made, folder = found
    again = inhand.load(folder)
    assert isinstance(again, SpatialCompared)
    assert again.policy.results == made.policy.results
    assert again.expert.results == made.expert.results
    assert again.notes == made.notes
    assert again.tables == made.tables


def test_it_stands_beside_runs_in_space_alone(found: tuple[SpatialCompared, Path], tmp_path: Path) -> None:
    made, folder = found
    page = compared([(folder, made), (tmp_path / "run", made.tested(made.expert))])
    assert "Maps of directions" in page
    assert page.count("All 3 trials kept the object") == 2
    planar = inhand.asterisk(directions="Out", trials=1, controller="thesis-ik")
    with pytest.raises(InputError, match=r"run is an evaluation in space, .*plane is a run of the Asterisk Test; give"):
        compared([(folder, made), (tmp_path / "plane", planar)])


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("ik", *WORDS[1:]), "'ik' is no learned policy: give the folder of a run of `inhand train`"),
        ((*WORDS, "--human", "people"), "--human with 3f_60.60_40_10, a hand in space"),
        ((*WORDS, "--gravity", "0,0,0"), "gravity '0,0,0' has no length"),
        ((*WORDS, "--episodes", 0), "--episodes 0: give at least one episode"),
        ((*WORDS, "--last"), "--last: rl holds no last policy"),
        ((*WORDS[:2], "4f_60.60_40_10", "--object", PAIR[1]), "4f_60.60_40_10' has fingers of 3, 3, 3, 3 joints"),
        (("rl", "--gravity", "up"), "--gravity up with 2v2_50.50_50.50_1.1_53, a hand in the plane"),
        (("no-such-run", *WORDS[1:]), "controller 'no-such-run' with a hand in space"),
    ],
)
def test_what_cannot_be_evaluated_in_space_is_refused(
    inhand: Call, tmp_path: Path, words: tuple[object, ...], told: str
) -> None:
    code, _, err = inhand("evaluate", *words, "--out", tmp_path / "out")
    assert (code, told in err) == (2, True), err
    assert list(tmp_path.iterdir()) == []
