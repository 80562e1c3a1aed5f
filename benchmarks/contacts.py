"""Contacts of fingertips and outlines, which estimators ask for twice a decision: compiled against NumPy.

Run: OMP_NUM_THREADS=1 python benchmarks/contacts.py
"""

from __future__ import annotations

import time
from functools import partial
from unittest import mock

import numpy as np

from inhand.geometry import Array
from inhand.hands import polygons
from timing import best_times, environment

WORLDS = 256
TIP = 19
"""Corners of the last link of a finger."""


def outlines(count: int, rng: np.random.Generator) -> Array:
    """Return convex outlines of so many corners, one a world, at places of their own [m]."""
    angle = np.linspace(0.0, 2 * np.pi, count, endpoint=False) + rng.uniform(0.0, 2 * np.pi, (WORLDS, 1))
    return 0.02 * np.stack([np.cos(angle), np.sin(angle)], axis=-1) + rng.normal(0.0, 0.02, (WORLDS, 1, 2))


def plain(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return `contact` as NumPy finds it."""
    with mock.patch.object(polygons, "MANY", np.inf):
        return polygons.contact(first, second)


def main() -> None:
    """Compare and print."""
    print(environment())
    rng = np.random.default_rng(0)
    tips = outlines(TIP, rng)
    for count in (4, 24, 48):
        objects = outlines(count, rng)
        ways = {"compiled": partial(polygons.contact, tips, objects), "NumPy": partial(plain, tips, objects)}
        found = [way() for way in ways.values()]
        same = all(one.tobytes() == other.tobytes() for one, other in zip(*found, strict=True))
        times = best_times(ways, time.process_time, repeats=30)
        told = ", ".join(f"{name} {1e6 * seconds:.0f} us" for name, seconds in times.items())
        faster = times["NumPy"] / times["compiled"]
        print(f"{count} corners, {WORLDS} worlds, same bytes {same}: {told}: {faster:.1f} times as fast", flush=True)


if __name__ == "__main__":
    main()
