"""What the benchmarks share: interleaved best-of-N timing, and a line on where they ran."""

from __future__ import annotations

import asyncio
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

START = "from inhand.cli import main; main()"
"""What the console script `inhand` runs."""
PACKAGES = ("inhand", "mujoco-core", "numpy", "pybullet")
"""Packages whose versions a result depends on."""


def best_times(
    cases: Mapping[str, Callable[[], object]], clock: Callable[[], float], repeats: int = 150, calls: int = 3
) -> dict[str, float]:
    """Return the shortest mean time of one call of each case [s].

    The cases take short turns, so that a busy moment of the machine falls on all of them, and the best of the many
    repeats counts, because other work only ever makes a case slower.

    Args:
        cases: what to time.
        clock: `time.process_time` for work on one thread, `time.perf_counter` for work on several.
        repeats: how often each case has its turn.
        calls: calls in one turn.
    """
    best = dict.fromkeys(cases, float("inf"))
    for _ in range(repeats):
        for name, case in cases.items():
            start = clock()
            for _ in range(calls):
                case()
            best[name] = min(best[name], (clock() - start) / calls)
    return best


def wall_time(words: Sequence[str], variables: Mapping[str, str] | None = None, status: int = 0) -> float:
    """Return the time that a command takes from start to exit [s], with environment variables of its own.

    Raises:
        RuntimeError: it ended with another status.
    """

    async def finish() -> tuple[int | None, bytes]:
        pipe, kept = asyncio.subprocess.PIPE, {"PYTHONDONTWRITEBYTECODE": ""}  # compiled modules, as in any install
        given = dict(os.environ if variables is None else variables)
        process = await asyncio.create_subprocess_exec(*words, env=given | kept, stdout=pipe, stderr=pipe)
        errors = (await process.communicate())[1]
        return process.returncode, errors

    start = time.perf_counter()
    ended, errors = asyncio.run(finish())
    took = time.perf_counter() - start
    if ended != status:
        raise RuntimeError(f"{' '.join(words)} ended with exit status {ended}: {errors.decode()[-2000:]}")
    return took


def environment() -> str:
    """Return one line that names the cores, the processor and the versions of Python and the packages."""
    found = [f"{name} {_version(name)}" for name in PACKAGES]
    return f"{os.cpu_count()} cores, {_processor()}, Python {platform.python_version()}, {', '.join(found)}"


def verdict(passed: bool) -> str:
    """Return the word that stands behind a bound."""
    return "meets the bound" if passed else "MISSES the bound"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def _processor() -> str:
    """Return the processor's model where the system tells it, else its family."""
    table = Path("/proc/cpuinfo")
    lines = table.read_text(encoding="utf-8").splitlines() if table.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
