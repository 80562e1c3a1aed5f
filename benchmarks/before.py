"""What users wait for: this checkout against the commit before the planar engine, in one run, in turns.

The other commit is checked out beside this one and runs with the same Python and packages. Every command is a new
process, timed from start to exit; the best of several counts. Compiled code is warm for both. "first" computes reach
and grasps anew, "again" finds them where an earlier run kept them.

Bounds: `RATIOS` (how many times as fast as before) and `LONGEST` [s].
Run: python benchmarks/before.py [--long]     (--long: also records 5,000 episodes and trains `privileged`, minutes)
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from timing import START, environment, verdict, wall_time

BEFORE = "ecd1d6f"
"""The last commit without the planar engine."""
CELL = ["sweep", "--hands", "2v2_65.35_65.35_1.1_53", "--objects", "cylinder_40", "--jobs", "1"]
CASES: dict[str, list[str]] = {
    "inhand --help": ["--help"],
    "import inhand": [],
    "a wrong name": ["asterisk", "--hand", "2v2_50.50", "--out", "OUT"],
    "asterisk, 16 x 3": ["asterisk", "--out", "OUT"],
    "trace --path R": ["trace", "--path", "R", "--out", "OUT"],
    "a sweep cell": [*CELL, "--out", "OUT"],
}
"""Commands by what the table calls them; no words are `import inhand` alone. OUT is a new folder."""
LONG: dict[str, list[str]] = {
    "record, 5,000 episodes": ["record", "--out", "OUT"],
    "train, privileged": ["train", "--preset", "privileged", "--out", "OUT"],
}
WAS = {"privileged": "default"}
"""Names of before by those of now: that training is on perfect knowledge, and today's `default` is not."""
TURNS = {"asterisk, 16 x 3": 3, "trace --path R": 3, "a sweep cell": 3} | dict.fromkeys(LONG, 1)
"""How often a case runs in each checkout; 7 times where nothing is said."""
RATIOS = {"a sweep cell": 4.0}
LONGEST = {
    "inhand --help": 0.3,
    "import inhand": 0.3,
    "a wrong name": 0.5,
    "asterisk, 16 x 3": 6.0,
    "trace --path R": 5.0,
    "record, 5,000 episodes": 30.0,
    "train, privileged": 60.0,
}


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """Give a folder with another commit of this repository, removed afterwards."""
    here = Path(__file__).parent
    git = shutil.which("git") or "git"
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "before"
        wall_time([git, "-C", str(here), "worktree", "add", "--detach", str(place), commit])
        try:
            yield place
        finally:
            wall_time([git, "-C", str(here), "worktree", "remove", "--force", str(place)])


def waited(words: list[str], root: Path, kept: Path) -> float:
    """Return the time that an `inhand` command of a checkout takes from start to exit [s].

    `kept` is the folder in which it keeps what it has computed.
    """
    with tempfile.TemporaryDirectory() as folder:
        given = [str(Path(folder) / "run") if word == "OUT" else word for word in words]
        command = [sys.executable, "-c", START if words else "import inhand", *given]
        variables = os.environ | {"PYTHONPATH": str(root / "src"), "INHAND_CACHE": str(kept)}
        return wall_time(command, variables, 2 if words == CASES["a wrong name"] else 0)


def times(name: str, words: list[str], roots: Mapping[str, Path], kept: Path) -> dict[str, float]:
    """Return the best time of a case before, now with nothing kept, and now once more [s]."""
    found: dict[str, list[float]] = {"before": [], "first": [], "again": []}
    waited(words, roots["now"], kept / name)  # fills what is kept, and reads the files once
    for turn in range(TURNS.get(name, 7)):
        found["before"].append(waited([WAS.get(word, word) for word in words], roots["before"], kept / "none"))
        found["first"].append(waited(words, roots["now"], kept / f"{name} {turn}"))
        found["again"].append(waited(words, roots["now"], kept / name))
    return {when: min(each) for when, each in found.items()}


def main() -> None:
    """Time every case in both checkouts and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--long", action="store_true", help="record and train too")
    cases = CASES | (LONG if parser.parse_args().long else {})
    print(environment())
    print(f"{'[s]':24} {'before':>7} {'first':>7} {'again':>7}   ratio first, again")
    with checkout(BEFORE) as before, tempfile.TemporaryDirectory() as kept:
        roots = {"before": before, "now": Path(__file__).resolve().parents[1]}
        for name, words in cases.items():
            took = times(name, words, roots, Path(kept))
            ratios = [took["before"] / took[when] for when in ("first", "again")]
            told = " ".join(f"{took[when]:7.2f}" for when in ("before", "first", "again"))
            print(f"{name:24} {told}   {ratios[0]:5.1f} {ratios[1]:5.1f}  {_bounds(name, took, ratios[0])}", flush=True)


def _bounds(name: str, took: Mapping[str, float], ratio: float) -> str:
    """Return what is asked of a case, and whether it is met."""
    if name in RATIOS:
        return f"(at least {RATIOS[name]:g} times: {verdict(ratio >= RATIOS[name])})"
    return f"(at most {LONGEST[name]:g} s: {verdict(took['again'] <= LONGEST[name])})"


if __name__ == "__main__":
    main()
