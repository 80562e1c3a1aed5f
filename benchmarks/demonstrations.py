"""Time of recording demonstrations to a dataset, and of the prediction that tells each episode how far to go.

Records what `inhand record` does by default (expert `ik`, the 8 training directions, 200 decisions an episode) into a
temporary folder, on every core. The prediction of one grip's reach is timed alone, on one core.

Bound: 5,000 episodes, planned, recorded and written, in 30 s on two cores. The clock counts; processor time beside it
tells what other work lengthened.
Run: python benchmarks/demonstrations.py [--episodes 1024]
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from inhand.learning.commands import RecordConfig
from inhand.learning.datasets import DatasetEpisode, write_dataset
from inhand.learning.demonstrations import demonstrations, plans_of
from inhand.learning.episodes import Episodes
from inhand.learning.recipe import Recording
from inhand.learning.record import head_of, recording_of
from inhand.learning.starts import gripped, plans_for, reach_of
from timing import best_times, environment, verdict

EPISODES, MOST = 5000, 30.0
"""Episodes of the bound, and the time they may take [s]."""
WORLDS = 512
"""Grips whose reach is predicted at once, as many as are recorded side by side."""


class Clock:
    """When the parts of a recording began."""

    def __init__(self) -> None:
        """Start."""
        self.began: dict[str, float] = {}
        self.waited = 0.0

    def told(self, what: str, done: int, total: int) -> None:
        """Note the time at which a part begins."""
        del done, total
        self.began.setdefault(what, time.perf_counter())

    def episodes(self, batches: Iterator[Episodes]) -> Iterator[DatasetEpisode]:
        """Give the episodes of batches and add up the time until each batch was there."""
        before = time.perf_counter()
        for batch in batches:
            self.waited += time.perf_counter() - before
            yield from batch.apart()
            before = time.perf_counter()


def recorded(recording: Recording) -> tuple[float, float, float]:
    """Record into a temporary folder; return the times for planning, recording and writing [s]."""
    clock = Clock()
    with tempfile.TemporaryDirectory() as folder:
        batches = demonstrations(recording, plans_of(recording, told=clock.told), np.random.default_rng(0), clock.told)
        write_dataset(Path(folder) / "data set", clock.episodes(batches), head_of(recording, "train"))
    end = time.perf_counter()
    planning = clock.began["recording demonstrations"] - clock.began["planning grasps"]
    recording_time = clock.waited
    return planning, recording_time, end - clock.began["recording demonstrations"] - recording_time


def prediction(recording: Recording) -> float:
    """Return the processor time for predicting the reach of one grip [s]."""
    held, rng = recording.held, np.random.default_rng(0)
    plans = plans_for(*held, recording.grid, engine=recording.engine)
    drawn = rng.choice(recording.grid, WORLDS)
    starts = gripped(*held, (plans, drawn), rng, recording.noise, engine=recording.engine)
    best = best_times({"reach": lambda: reach_of(held, starts)}, time.process_time, repeats=5, calls=1)
    return best["reach"] / WORLDS


def main() -> None:
    """Record, time, and print the rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    count = parser.parse_args().episodes
    recording = recording_of(RecordConfig(episodes=count))
    if not isinstance(recording, Recording):
        raise TypeError("the usual hand is one in the plane")
    print(environment())
    before = os.times()
    parts = recorded(recording)
    after = os.times()
    clock, work = sum(parts), after.user + after.system - before.user - before.system
    print(f"{count} episodes: {clock:.0f} s by the clock, {work:.0f} s of processor time")
    for name, seconds in zip(("planning grasps", "recording", "writing"), parts, strict=True):
        print(f"  {name:15} {seconds:6.1f} s  {seconds / clock:4.0%}")
    print(f"Recording and writing: {count / (parts[1] + parts[2]):.1f} episodes/s by the clock")
    whole = parts[0] + (clock - parts[0]) * EPISODES / count
    print(f"{EPISODES:,} episodes: {whole:.0f} s  (at most {MOST:.0f}: {verdict(whole <= MOST)})")
    print(f"Predicting the reach of a grip: {1e3 * prediction(recording):.2f} ms on one core")


if __name__ == "__main__":
    main()
