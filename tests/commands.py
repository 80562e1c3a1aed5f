"""The command line, called in the process of the tests or in one of its own."""

import asyncio
from pathlib import Path
from typing import Protocol


class Call(Protocol):
    """Runs `inhand` in this process; returns its exit code and what it printed on stdout and stderr."""

    def __call__(self, *words: object) -> tuple[int, str, str]:
        """Run it with the words of a command line."""


def warm(err: str) -> str:
    """Return what was printed on stderr where all kernels are compiled: which test comes first is none of its part."""
    return "".join(line for line in err.splitlines(keepends=True) if "once for this machine" not in line)


def in_a_process(program: Path | str, *words: Path | str, cwd: Path | None = None) -> tuple[int, str, str]:
    """Run a program; return its exit code and what it printed on stdout and stderr."""

    async def run() -> tuple[int, str, str]:
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(program, *words, cwd=cwd, stdout=pipe, stderr=pipe)
        out, err = await asyncio.wait_for(process.communicate(), timeout=120)
        return process.returncode or 0, out.decode(), warm(err.decode())

    return asyncio.run(run())
