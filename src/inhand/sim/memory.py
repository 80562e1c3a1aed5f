"""Memory: what worlds take, and whether the machine has it."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from inhand.errors import InputError
from inhand.sim.names import Engine

WORLD_BYTES: dict[str, float] = {"mujoco": 6.5e3, "planar": 2.1e3, "bullet": 33e6}
"""What a world takes while it is stepped [B]: how far the peak of a process's memory (VmHWM) rose for 20,000 worlds of
MuJoCo (5.4 kB with four joints, 6.3 kB with six) and of the planar engine (1.5 and 2.1 kB), and for 40 of PyBullet,
each a server of its own."""
START_BYTES: dict[Engine, float] = {"mujoco": 130e3, "planar": 130e3, "bullet": 33e6}
"""What a start takes while it is made [B], with every state of its placing and gripping: the same for 2,000 starts of
`inhand/AsteriskEasy-v0`, whose way left is predicted; without that it is 17 kB in MuJoCo and 11 kB in the plane."""
REHEARSALS = 2e9
"""What worlds of rehearsals may take at a time [B]: 60 of PyBullet, and more than are asked for of other engines."""
TABLE = Path("/proc/meminfo")
"""Where Linux tells how much memory programs may still take."""


def batches(engine: str, sizes: Sequence[int]) -> Iterator[slice]:
    """Give parts of a sequence of groups of worlds whose worlds may be there together; a group is never cut."""
    most = REHEARSALS / WORLD_BYTES[engine]
    begin, count = 0, 0
    for number, size in enumerate(sizes):
        if count and count + size > most:
            yield slice(begin, number)
            begin, count = number, 0
        count += size
    yield slice(begin, len(sizes))


def available() -> float | None:
    """Return how much memory this machine has for programs [B], or has at all; None where it does not tell."""
    if TABLE.is_file():
        told = dict(line.split(":") for line in TABLE.read_text(encoding="ascii").splitlines())
        if "MemAvailable" in told:
            return 1024.0 * float(told["MemAvailable"].split()[0])
    if "SC_PHYS_PAGES" in getattr(os, "sysconf_names", {}):
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return None


def check_memory(given: str, count: int, each: float) -> None:
    """Refuse more of something than the machine has memory for, where `count` are asked for that take `each` [B].

    Raises:
        InputError: the text says what was given, and tells the estimate and the limit.
    """
    room = available()
    if room is not None and count * each > room:
        raise InputError(
            f"{given} would take about {count * each / 1e9:.3g} GB of memory, {each / 1e3:.3g} kB each, and this"
            f" machine has {room / 1e9:.3g} GB left: give at most {int(room // each)}"
        )
