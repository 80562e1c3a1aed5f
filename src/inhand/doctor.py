"""What this installation has: versions, cores, engines, extras, pictures, caches; how to get what is missing."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections import defaultdict
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from packaging.requirements import Requirement

from inhand.caches import PLACE, base
from inhand.cores import usable
from inhand.versions import versions

State = Literal["ok", "missing", "told"]
NAMES = ("dev",)
"""Extras that are for working on the package itself."""
GIVES = {
    "viewer": "`inhand view` in MuJoCo's window",
    "bullet": "--engine bullet",
    "dask": "studies on a Dask cluster",
    "design": "`inhand design`",
    "dxf": "outlines and drawings from DXF files",
    "lerobot": "LeRobotDatasets in and out",
    "onnx": "policies as ONNX models",
    "ray": "studies on a Ray cluster",
    "rerun": "`inhand view --rerun`",
    "rl": "`inhand record`, `train` and environments",
    "slurm": "studies as arrays of SLURM's jobs",
    "sb3": "training with Stable-Baselines3",
    "video": "films of environments (Gymnasium's RecordVideo)",
}
"""What an extra is for."""


@dataclass(frozen=True)
class Found:
    """One thing that was looked at."""

    part: str
    """What it belongs to: package, machine, engine, extra, pictures, cache."""
    name: str
    state: State
    """ok, missing, or told where there is nothing to be right or wrong."""
    told: str
    """What was found, and how to get what is missing."""


def look() -> tuple[Found, ...]:
    """Return all that was looked at, in the order in which it is told."""
    return (*_packages(), *_machine(), *_engines(), *_extras(), *_pictures(), *_caches())


def _packages() -> list[Found]:
    """Return this package, Python, and what of its own requirements is missing or of another version."""
    told = versions()
    found = [Found("package", "inhand", "ok", f"{told['inhand']}, source {told['source'][:12]}")]
    found.append(Found("package", "python", "ok", f"{told['python']} at {sys.executable}"))
    for requirement in _requirements()[""]:
        here, fits = _installed(requirement)
        wanted = f"{requirement.name}{requirement.specifier}"
        mend = "" if fits else f"; needs {requirement.specifier}: pip install '{wanted}'"
        found.append(Found("package", requirement.name, "ok" if fits else "missing", here + mend))
    return found


def _requirements() -> dict[str, list[Requirement]]:
    """Return what the package requires, by extra; of the package itself under an empty name."""
    found: dict[str, list[Requirement]] = defaultdict(list)
    for text in metadata.requires("inhand") or ():
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", text)
        found[extra[1] if extra else ""].append(Requirement(text))
    return found


def _installed(requirement: Requirement) -> tuple[str, bool]:
    """Return which version of a requirement is here, and whether that will do."""
    try:
        here = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return "not installed", False
    return here, requirement.specifier.contains(here, prereleases=True)


def _machine() -> list[Found]:
    told = f"{usable()} of {os.cpu_count()}; studies take them all (--jobs)"
    return [Found("machine", "system", "told", platform.platform()), Found("machine", "cores", "told", told)]


def _engines() -> list[Found]:
    bullet = find_spec("pybullet") is not None
    return [
        Found("engine", "planar", "ok", "MuJoCo's contact law in the plane, the engine where none is asked for"),
        Found("engine", "mujoco", "ok", "in three dimensions"),
        Found("engine", "bullet", *(("ok", "the witness") if bullet else ("missing", _cure("bullet")))),
    ]


def _extras() -> list[Found]:
    found = []
    for extra, requirements in sorted(_requirements().items()):
        if extra in {"", *NAMES}:
            continue
        lacking = [each.name for each in requirements if not _installed(each)[1]]
        told = f"for {GIVES.get(extra, 'more')}" + (f"; lacks {', '.join(lacking)}: {_cure(extra)}" if lacking else "")
        found.append(Found("extra", extra, "missing" if lacking else "ok", told))
    return found


def _pictures() -> list[Found]:
    screens = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    screen = bool(screens) or not sys.platform.startswith("linux")
    window = "a screen is there" if screen else "no screen here: reports and replays need none, `inhand view` does"
    return [
        Found("pictures", "figures", "ok", "PNG, PDF, SVG and GIF by matplotlib and Pillow, without a screen or GL"),
        Found("pictures", "screen", "ok" if screen else "told", window),
    ]


def _caches() -> list[Found]:
    place = base()
    kept = "off (results are not kept)" if os.environ.get(PLACE) == "off" else str(place)
    code = Path(os.environ.get("NUMBA_CACHE_DIR") or place / "compiled")
    ready = code.is_dir() and any(code.iterdir())
    told = str(code) if ready else f"{code}: empty; the first run compiles for some 25 s"
    return [Found("cache", "results", "told", kept), Found("cache", "compiled code", "told", told)]


def _cure(extra: str) -> str:
    return f"pip install 'inhand[{extra}]'"
