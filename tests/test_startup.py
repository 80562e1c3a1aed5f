"""What a command imports before it has something to do: nothing that takes long to import."""

import json
import sys
from pathlib import Path

import pytest

from commands import in_a_process
from inhand.cli.commands import COMMANDS
from inhand.control.catalogue import OWN
from inhand.control.names import EXPERTS

HEAVY = (
    "PIL", "ezdxf", "gymnasium", "h5py", "jax", "joblib", "matplotlib", "minari", "mujoco", "numba", "onnx", "optax",
    "optuna", "pandas", "pybullet", "scipy", "similaritymeasures", "svgpathtools", "tensorboardX", "threadpoolctl",
)  # fmt: skip
EACH = """
import contextlib, io, json, sys
from inhand.cli import main
lines, heavy = json.loads(sys.argv[1]), set(json.loads(sys.argv[2]))
for line in lines:
    sys.argv = ["inhand", *line.split()]
    code = 0
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            main()
        except SystemExit as stop:
            code = stop.code or 0
    print(json.dumps([line, code, sorted(heavy & set(sys.modules))]))
"""
WRONG = (
    *(f"{command} --{what} {name}"
      for command in ("asterisk", "trace", "reach", "robustness", "record", "train", "evaluate")
      for what in ("hand", "object") for name in ("nonsense", "missing.toml")),
    *(f"{command} --engine nonsense"
      for command in ("asterisk", "trace", "sweep", "robustness", "record", "train", "evaluate")),
    *(f"{command} --controller nonsense" for command in ("asterisk", "trace", "sweep")),
    *(f"{command} --directions nonsense"
      for command in ("asterisk", "reach", "sweep", "robustness", "record", "train")),
    "asterisk --human missing", "asterisk --beside missing", "asterisk --metrics nonsense",
    "asterisk --phases nonsense",
    "trace --path nonsense", "trace --path missing.svg", "trace --path missing.csv", "trace --path missing.dxf",
    "design --objects nonsense", "design --directions nonsense", "design --controllers nonsense",
    "design --aims nonsense",
    "sweep --hands nonsense", "sweep --objects nonsense", "robustness --controllers nonsense",
    "robustness --disturbances nonsense", "robustness --curves nonsense", "robustness --strengths nan",
    "train --preset nonsense", "train --out missing --resume",
    "export nonsense --as csv", "export nonsense --as policy", "import missing",
    "evaluate nonsense", "export nonsense", "export rl --out policy.pt",
    "metrics missing.npz", "metrics missing.csv", "metrics missing",
    "view missing.npz", "report missing", "again missing", "figures missing",
    "completion fish", "nonsense", "asterisk --nonsense", "asterisk --config missing.toml",
)  # fmt: skip


def imported_by(lines: tuple[str, ...], heavy: tuple[str, ...], place: Path) -> list[tuple[str, int, list[str]]]:
    """Run command lines one after the other in one process; return each with its exit code and what is imported."""
    code, out, err = in_a_process(sys.executable, "-c", EACH, json.dumps(lines), json.dumps(heavy), cwd=place)
    assert (code, err) == (0, "")
    found = [json.loads(line) for line in out.splitlines()]
    return [(line, code, names) for line, code, names in found]


def test_help_imports_not_even_numpy(tmp_path: Path) -> None:
    lines = ("--help", "--version", *(f"{command} --help" for command in COMMANDS))
    assert imported_by(lines, (*HEAVY, "numpy"), tmp_path) == [(line, 0, []) for line in lines]


def test_a_wrong_name_is_refused_before_anything_heavy_is_imported_or_written(tmp_path: Path) -> None:
    assert imported_by(WRONG, HEAVY, tmp_path) == [(line, 2, []) for line in WRONG]
    assert list(tmp_path.iterdir()) == []


TOLD_EARLY = (
    "asterisk --hand nonsense", "asterisk --hand 2v2_50.50_50.50_1.1", "asterisk --object cube_3x",
    "asterisk --controller nonsense", "asterisk --directions nonsense", "trace --path nonsense",
    "trace --path missing.csv", "sweep --hands nonsense", "sweep --directions Out,nonsense",
    "robustness --controllers nonsense", "train --object nonsense", "record --directions nonsense",
    "design --objects nonsense", "reach --directions nonsense",
)  # fmt: skip
"""Names that are looked up before the command that would run is imported."""


def test_a_wrong_name_is_told_before_its_command_is_imported(tmp_path: Path) -> None:
    commands = ("asterisk", "trace", "sweep", "robustness", "train", "record", "design", "reach")
    heavy = (
        "inhand.control.loop",
        "inhand.asterisk_test.asterisk",
        "inhand.asterisk_test.cells",
        *(f"inhand.cli.{each}" for each in commands),
    )
    assert imported_by(TOLD_EARLY, heavy, tmp_path) == [(line, 2, []) for line in TOLD_EARLY]


def test_the_names_of_controllers_are_those_of_the_catalogue() -> None:
    assert tuple(entry.name for entry in OWN) == EXPERTS


def test_every_command_has_a_wrong_name() -> None:
    assert {line.split()[0] for line in WRONG} >= set(COMMANDS) - {"hands", "objects", "doctor"}


@pytest.mark.parametrize("name", ["inhand", "inhand.cli"])
def test_importing_imports_nothing_heavy(name: str, tmp_path: Path) -> None:
    code, out, _ = in_a_process(sys.executable, "-c", f"import sys, {name}; print(*sys.modules)", cwd=tmp_path)
    assert code == 0
    assert name in out.split()
    assert not {*HEAVY, "numpy"} & set(out.split())
