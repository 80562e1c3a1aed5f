"""Time to wait for whole runs, and for commands that have nothing to do.

Runs each as a user does, in a process of its own, and takes the wall time from start to exit, the least of several.
Whole runs are warm: the first, which fills the caches on disk, does not count.

Bounds on two idle cores: a report of 16 directions with 3 trials each in 6 s, the letter R traced in 5 s; help and
import in 0.3 s, a wrong name told in 0.5 s.
Run: python benchmarks/report_time.py
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from timing import START, environment, verdict, wall_time

QUICK: dict[str, tuple[float, int, tuple[str, ...]]] = {
    "python alone": (0.3, 0, ("-c", "pass")),
    "import inhand": (0.3, 0, ("-c", "import inhand")),
    "inhand --help": (0.3, 0, ("-c", START, "--help")),
    "inhand asterisk, a wrong hand": (0.5, 2, ("-c", START, "asterisk", "--hand", "nonsense")),
    "inhand trace, a wrong path": (0.5, 2, ("-c", START, "trace", "--path", "nonsense")),
    "inhand train, a wrong object": (0.5, 2, ("-c", START, "train", "--object", "nonsense")),
    "inhand sweep, a wrong direction": (0.5, 2, ("-c", START, "sweep", "--directions", "nonsense")),
}
"""Longest time [s], exit status and words of what has nothing to do."""
RUNS: dict[str, tuple[float, tuple[str, ...]]] = {
    "inhand asterisk, 16 x 3": (6.0, ("asterisk",)),
    "inhand trace --path R": (5.0, ("trace", "--path", "R")),
}
"""Longest time [s] and words of whole runs."""


def run_time(words: Sequence[str]) -> float:
    """Return the time of a command that writes a folder [s], the second and third time that it runs."""
    with tempfile.TemporaryDirectory() as folder:
        times = [
            wall_time((sys.executable, "-c", START, *words, "--out", str(Path(folder) / str(number))))
            for number in range(3)
        ]
    return min(times[1:])


def main() -> None:
    """Time everything and print the results."""
    print(environment())
    for name, (longest, status, words) in QUICK.items():
        _tell(name, min(wall_time((sys.executable, *words), status=status) for _ in range(5)), longest)
    for name, (longest, words) in RUNS.items():
        _tell(name, run_time(words), longest)


def _tell(name: str, seconds: float, longest: float) -> None:
    print(f"{name:32} {seconds:6.2f} s  (at most {longest}: {verdict(seconds < longest)})", flush=True)


if __name__ == "__main__":
    main()
