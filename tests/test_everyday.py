"""What every command has: settings from a file, silence, JSON; runs again; the doctor; completion."""

import json
import re
import shutil
import sys
import tomllib
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from commands import Call, in_a_process
from inhand.asterisk_test.config import AsteriskConfig
from inhand.cli import main
from inhand.cli.asked import asked
from inhand.cli.commands import COMMANDS, MetricsConfig
from inhand.cli.terminal import say
from inhand.errors import InputError
from inhand.learning import train
from inhand.learning.presets import preset
from inhand.repeats import NAME, settings_in, write_repeat
from inhand.sameness import compared

REACH = ("reach", "--directions", "Right", "--resolution-mm", 6)


@pytest.fixture(scope="module")
def reach(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run."""
    out = tmp_path_factory.mktemp("run") / "reach"
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()):
        patch.setattr(sys, "argv", ["inhand", *map(str, REACH), "--out", str(out)])
        main()
    return out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_options_of_all(command: str, inhand: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "1000")  # room for every text on one line: none is broken where its source is
    code, out, _ = inhand(command, "--help")
    assert code == 0
    assert out.startswith(f"usage: inhand {command} ")
    for option in ("--config", "--quiet", "--json"):
        assert option in out
    lines = [line.strip("│ ") for line in out.partition("options")[2].splitlines() if re.search("[a-z]", line)]
    texts = [line for line in lines if "  " in line or not line.startswith("-")]
    assert texts
    assert all(each.endswith((")", "exit")) for each in texts)


def test_settings_come_back_from_the_file_that_repeats_a_run(tmp_path: Path) -> None:
    config = AsteriskConfig(
        hand='a "hand"\\é\x7f\n', human=Path("p q"), twist=1e-7, label=("a", "b'"), compatible=True, out=tmp_path
    )
    write_repeat(tmp_path, "asterisk", config)
    assert AsteriskConfig(**settings_in(tmp_path / NAME, "asterisk", AsteriskConfig)) == config
    assert "overwrite" not in tomllib.loads((tmp_path / NAME).read_text(encoding="utf-8"))


def test_words_come_before_what_a_file_says(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('hand = "2v2_65.35_65.35_1.1_53"\ntrials = 7\nlabel = ["a", "b"]\ncompatible = true\n')
    found = asked(["asterisk", "--config", str(file), "--trials", "2", "--json"])
    assert found.config == AsteriskConfig(hand="2v2_65.35_65.35_1.1_53", trials=2, label=("a", "b"), compatible=True)
    assert (found.printing.json, found.printing.quiet, found.printing.config) == (True, False, file)
    file.write_text('command = "metrics"\nfiles = ["a.npz"]\n')
    assert asked(["metrics", f"--config={file}"]).config == MetricsConfig(files=(Path("a.npz"),))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("trails = 3", "unknown setting 'trails'; did you mean trials or"),
        ("trials = 'three'", "trials is 'three'; it must be a whole number"),
        ("engine = 'planer'", "engine is 'planer'; it must be planar or mujoco or bullet; did you mean planar"),
        ('command = "sweep"', "has the settings of `inhand sweep`, not of `inhand asterisk`"),
        ("trials = !", "is no TOML file: Invalid value (at line 1, column 10)"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(text: str, told: str, tmp_path: Path, inhand: Call) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    code, out, err = inhand("asterisk", "--config", file, "--out", tmp_path / "run")
    assert (code, out) == (2, "")
    assert err.startswith(f"inhand: {file}")
    assert told in err
    assert [each.name for each in tmp_path.iterdir()] == ["mine.toml"]
    missing = inhand("asterisk", "--config", tmp_path / "none.toml")
    told = f"there is no file {tmp_path / 'none.toml'}: give a TOML file, such as run.toml in the folder of a run"
    assert missing == (2, "", f"inhand: {told}\n")


def test_a_run_leaves_the_file_that_repeats_it(reach: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "by file"
    code, printed, _ = inhand("reach", "--config", reach / NAME, "--out", out, "--quiet")
    assert (code, printed) == (0, "")
    there, here = (json.loads((place / "reach.json").read_text()) for place in (reach, out))
    assert there["limits"] == here["limits"]
    assert {**there["config"], "out": None} == {**here["config"], "out": None}


def test_json_stands_alone_on_stdout(reach: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "run"
    code, printed, err = inhand(*REACH, "--out", out, "--json")
    told = json.loads(printed)
    assert (code, told["command"], told["out"]) == (0, "reach", str(out))
    limit = json.loads((reach / "reach.json").read_text())["limits"][0]
    (row,) = told["table"]
    assert (row["direction"], row["limit_mm"]) == ("Right", limit["limit_mm"])
    assert any(line.startswith("Written to") for line in told["told"])
    assert "Reach" not in err
    hands = json.loads(inhand("hands", "--json", "--quiet")[1])
    assert hands["table"][0]["links_mm"] == [[72.0, 72.0], [72.0, 72.0]]


def test_what_is_said_on_the_way_goes_to_stderr(tmp_path: Path, inhand: Call) -> None:
    (tmp_path / "notes.csv").write_text("a,b\n")
    (tmp_path / "p1_2v2_c_n_1.csv").write_text(
        "frame,x,y,rmag\n" + "".join(f"{i},{min(i, 30)},0,0\n" for i in range(60))
    )
    loud, quiet = (inhand("metrics", tmp_path, "--json", *words) for words in ((), ("--quiet",)))
    assert loud[0] == quiet[0] == 0
    assert "notes.csv" in loud[2]
    assert quiet[2] == ""
    assert json.loads(loud[1]) == json.loads(quiet[1])


def test_a_run_is_run_again_to_the_same_bits(reach: Path, inhand: Call) -> None:
    code, out, _ = inhand("again", reach)
    assert code == 0
    assert out.splitlines()[-1] == f"All 2 files of numbers hold what those of {reach} hold, to the last bit"
    assert (reach.with_name("reach-again") / NAME).is_file()
    code, _, err = inhand("again", reach)
    assert code == 2
    assert "holds the results of a run" in err


@pytest.mark.parametrize("place", [".", "inside"])
def test_a_run_is_not_run_again_over_itself(place: str, reach: Path, inhand: Call) -> None:
    before = (reach / "reach.json").read_bytes()
    code, _, err = inhand("again", reach, "--out", reach / place, "--overwrite")
    assert code == 2
    assert "is in the run's own folder: give another, so that both can be compared" in err
    assert ((reach / "reach.json").read_bytes(), (reach / "inside").exists()) == (before, False)


def test_again_tells_what_differs(reach: Path, tmp_path: Path, inhand: Call) -> None:
    old = tmp_path / "old"
    old.mkdir()
    content = json.loads((reach / "reach.json").read_text())
    content["limits"][0]["limit_mm"] += 1e-12
    content["versions"] |= {"numpy": "1.0"}
    (old / "reach.json").write_text(json.dumps(content))
    for name in (NAME, "limits.csv"):
        (old / name).write_bytes((reach / name).read_bytes())
    code, out, _ = inhand("again", old, "--out", tmp_path / "new")
    assert code == 1
    *_, versions, told = out.splitlines()
    assert versions == f"Other versions than those of {old}: numpy 1.0 there, {np.__version__} now"
    assert told == f"1 of 2 files of numbers differ from {old}: reach.json"
    (old / NAME).write_text('command = "fly"\n')
    assert "command is 'fly'; it must be a command, asterisk" in inhand("again", old)[2]
    for command in ("again", "doctor", "view", "metrics"):
        (old / NAME).write_text(f'command = "{command}"\n')
        assert f"command is '{command}'; it must be a command, asterisk" in inhand("again", old)[2]
    (old / NAME).unlink()
    assert f"{old} holds no run.toml: give the folder of a finished run" in inhand("again", old)[2]


def test_again_finds_the_files_of_a_run_from_another_folder(
    tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, other = tmp_path / "home", tmp_path / "other"
    home.mkdir()
    other.mkdir()
    (home / "mine.toml").write_text(
        'name = "mine"\npalm_width_mm = 53\n[left]\nlinks_mm = [72, 72]\n[right]\nlinks_mm = [72, 72]\n'
    )
    monkeypatch.chdir(home)
    words = ("reach", "--hand", "mine.toml", "--directions", "Right", "--resolution-mm", 6, "--out", "results/r")
    assert inhand(*words)[0] == 0
    monkeypatch.chdir(other)
    code, out, _ = inhand("again", "../home/results/r", "--out", "new")
    assert (code, (other / "new" / NAME).is_file()) == (0, True)
    assert out.splitlines()[-1].endswith("hold what those of ../home/results/r hold, to the last bit")
    shutil.copytree(home / "results" / "r", other / "moved")
    code, _, err = inhand("again", "moved")
    assert code == 2
    assert f"(files that moved/run.toml names are looked for from here, {other})" in err


def test_a_file_may_begin_with_the_mark_of_its_bytes(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("trials = 7\n", encoding="utf-8-sig")
    assert asked(["asterisk", "--config", str(tmp_path / "mine.toml")]).config == AsteriskConfig(trials=7)


def test_long_names_are_told_shortly(inhand: Call) -> None:
    for words in (("--hand", "x" * 5000), ("--hand", "3f_60.60_" + "9" * 400), ("--object", "cube_" + "9" * 400)):
        code, _, err = inhand("asterisk", *words)
        assert code == 2
        assert "[...]" in err
        assert len(err) < 700


def test_what_is_said_is_not_read_as_a_picture(capsys: pytest.CaptureFixture[str]) -> None:
    say("direction 1:100:2 [b]")
    assert capsys.readouterr().out == "direction 1:100:2 [b]\n"


def test_files_of_one_run_alone_differ(reach: Path, tmp_path: Path) -> None:
    (tmp_path / "more.csv").write_text("a\n")
    assert compared(reach, tmp_path).differ == ("limits.csv", "more.csv", "reach.json")
    (tmp_path / "reach.json").write_text('{"half":')
    with pytest.raises(InputError, match=re.escape(f"{tmp_path / 'reach.json'}: it is no JSON")):
        compared(tmp_path, reach)


def test_a_training_that_only_python_can_say_has_no_file(tmp_path: Path) -> None:
    smoke = preset("smoke")
    words = train.command_of(train.changed(smoke, {"seed": 3}), tmp_path)
    assert words is not None
    assert (words.preset, words.seed, words.demonstrations) == ("smoke", 3, None)
    assert train.command_of(train.changed(smoke, {"hidden": (8, 8)}), tmp_path) is None


def test_the_doctor_tells_what_is_missing(monkeypatch: pytest.MonkeyPatch, inhand: Call) -> None:
    monkeypatch.setattr(
        "inhand.doctor.metadata.requires",
        lambda _: ["numpy>=2.1", "rich>=99", "pytest; extra == 'dxf'", 'not-there>=1; extra == "onnx"'],
    )
    code, out, _ = inhand("doctor", "--json")
    found = {(row["part"], row["name"]): row for row in json.loads(out)["table"]}
    assert code == 1
    assert found["package", "numpy"]["state"] == "ok"
    rich = found["package", "rich"]
    assert rich["state"] == "missing"
    assert rich["told"].endswith("; needs >=99: pip install 'rich>=99'")
    assert found["extra", "dxf"]["state"] == "ok"
    assert found["extra", "onnx"]["told"].endswith("lacks not-there: pip install 'inhand[onnx]'")
    assert found["machine", "cores"]["told"].endswith("studies take them all (--jobs)")
    monkeypatch.setattr("inhand.doctor.metadata.requires", lambda _: ["numpy>=2.1"])
    code, out, _ = inhand("doctor")
    assert code == 0
    assert "All that the package itself needs is here" in out


def test_a_shell_completes_commands_and_options(inhand: Call) -> None:
    code, script, err = inhand("completion", "bash")
    assert (code, err) == (0, "")
    code, told, err = inhand("completion", "bash", "--json")
    assert (code, err, json.loads(told)["told"]) == (0, "", [script.rstrip("\n")])
    ask = "COMP_WORDS=(inhand {}); COMP_CWORD={}; _tyro_inhand; echo ${{COMPREPLY[@]}}\n"
    asks = ask.format("ast", 1) + ask.format("trace --sca", 2)
    code, out, err = in_a_process("bash", "-c", script + asks)
    assert (code, err) == (0, "")
    assert out.split() == ["asterisk", "--scale"]
