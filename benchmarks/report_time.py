"""Time to wait for the 16-direction report, and for the command line's help.

Runs the commands as a user does, each in a new process, and takes the wall time from start to exit.

Bounds: the report in less than 30 s, the help in less than 0.5 s.
Run: python benchmarks/report_time.py
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from timing import environment, verdict

LONGEST_REPORT = 30.0
"""Longest time for the report [s]."""
START = "from inhand.cli import main; main()"
"""What the console script `inhand` runs."""
LONGEST_HELP = 0.5
"""Longest time for the help [s]."""


def wall_time(arguments: Sequence[str]) -> float:
    """Return the time that an `inhand` command takes from start to exit [s].

    Raises:
        RuntimeError: the command failed.
    """

    async def finish() -> int:
        command = [sys.executable, "-c", START, *arguments]
        process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.DEVNULL)
        return await process.wait()

    start = time.perf_counter()
    status = asyncio.run(finish())
    if status != 0:
        raise RuntimeError(f"inhand {' '.join(arguments)} ended with exit status {status}; its error text is above")
    return time.perf_counter() - start


def main() -> None:
    """Time both commands and print the results."""
    help_time = min(wall_time(["--help"]) for _ in range(5))
    report_times = []
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            out = str(Path(folder) / "report")
            report_times.append(wall_time(["asterisk", "--directions", "all", "--trials", "1", "--out", out]))
    report_time = min(report_times)
    print(environment())
    print(f"inhand --help    {help_time:6.2f} s  (at most {LONGEST_HELP}: {verdict(help_time < LONGEST_HELP)})")
    print(f"report of 16     {report_time:6.1f} s  (at most {LONGEST_REPORT}: {verdict(report_time < LONGEST_REPORT)})")


if __name__ == "__main__":
    main()
