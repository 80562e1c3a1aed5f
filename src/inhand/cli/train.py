"""`inhand train`: train a controller, watched; stopped and gone on with; its curves and table at the end."""

from __future__ import annotations

import os
import shlex
import sys
import threading
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from rich.table import Table

from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import Screen, progress, say
from inhand.learning import train
from inhand.learning.commands import TrainConfig
from inhand.learning.progress import (
    COMPILING,
    HEADER,
    IN_PLANE,
    Evaluated,
    evaluation_rows,
    joined,
    read_learning,
)

if TYPE_CHECKING:
    from inhand.learning.journal import Counters, Evaluation


def run_train(config: TrainConfig) -> Answer:
    """Train or go on, tell how it goes, and end with curves, table and the place of the policy."""
    if config.seeds:
        return _several(config)
    try:
        with progress(spoken=True) as screen:
            watch = Watch(screen, config.out)
            done = train.run_train(config, (watch.prepared, watch.evaluated))
    except KeyboardInterrupt:
        for line in train.kept(config.out):
            say(line)
        _leave()
    best = done.learned.best
    table = Listing(f"The best policy, at episode {best.episode}", HEADER, evaluation_rows(best))
    evaluate = f"Evaluate it: {shlex.join(['inhand', 'evaluate', str(config.out)])}"
    told = f"Curves: {config.out / 'report.html'}", f"Policy: {done.best}", evaluate
    return of_run(done, config.out, [table], told)


def _leave() -> NoReturn:
    """End with exit code 130, and at once where JAX still compiles: the end of Python would wait for its thread."""
    if any(thread.name.startswith(COMPILING) for thread in threading.enumerate()):
        sys.stdout.flush()
        os._exit(130)
    sys.exit(130)


def _several(config: TrainConfig) -> Answer:
    """Train once with each seed, and end with a table of all."""
    from inhand.learning import seeds

    jobs = seeds.planned(config)
    done = 0
    with progress(spoken=True) as tell:
        tell("seeds", done, len(jobs))
        try:
            for job in seeds.computed(jobs, config):
                done += 1
                tell(f"seed {job.config.seed}", done, len(jobs))
        except KeyboardInterrupt:
            say(f"{done} of {len(jobs)} seeds are trained; the same command goes on from there")
            raise
    table = seeds.finish(jobs, config)
    listing = Listing("The best policy of each seed", seeds.HEADER, seeds.rows(table), numbers=1)
    beside = shlex.join(["inhand", "report", *(str(job.out) for job in jobs)])
    sentences = (f"Written to {config.out}", f"Side by side on one page: {beside}")
    return Answer((listing,), sentences, lambda: table.to_dict("records"), config.out)


class Watch:
    """Shows how far a training is, and writes a line for every evaluation."""

    def __init__(self, screen: Screen, out: Path) -> None:
        """Show nothing yet."""
        self._screen, self._out, self._total, self._left = screen, out, 0, ""
        self._first: Counters | None = None
        self._before: Counters | None = None

    def prepared(self, what: str, done: int, total: int) -> None:
        """Show how far a part of the training is; of its episodes evaluations tell."""
        self._total = total
        learning = what == "learning"
        self._screen(what, done, total, more=self._left if learning else "", silent=learning)

    def evaluated(self, found: Evaluation) -> None:
        """Write a line about an evaluation and show it by direction."""
        now = found.counters
        reached = read_learning(self._out).evaluations[-1]
        self._left = self._time_left(now)
        line = ", ".join(part for part in (line_of(reached), self._speed(now), self._left) if part)
        self._first, self._before = self._first or now, now
        self._screen.line(line, _table(reached))

    def _speed(self, now: Counters) -> str:
        if self._before is None or now.seconds <= self._before.seconds:
            return ""
        return f"{(now.updates - self._before.updates) / (now.seconds - self._before.seconds):.0f} updates/s"

    def _time_left(self, now: Counters) -> str:
        left = self._total - now.episodes
        if self._first is None or now.episodes <= self._first.episodes or left <= 0:
            return ""
        seconds = left * (now.seconds - self._first.seconds) / (now.episodes - self._first.episodes)
        return f"about {seconds / 60:.0f} min left" if seconds >= 90 else f"about {seconds:.0f} s left"


def line_of(found: Evaluated) -> str:
    """Return an evaluation in one line."""
    whole = joined(list(found.directions.values()))
    shares = " and ".join(f"{found.over(group.names).fraction:.2f} {group.word}" for group in found.groups)
    return (
        f"episode {found.episode}: return {whole.total:.1f}, the expert's {whole.expert_total:.1f}; of the limit"
        f" {shares}; lost {whole.dropped} of {whole.trials}"
    )


def _table(found: Evaluated) -> Table:
    """Return share of the limit and lost objects of every direction; of the plane, trained ones at the left."""
    words = ("Trained", "Unseen") if found.groups[0] == IN_PLANE[0] else ("Primitive", "Primitive")
    table = Table(*(title for word in words for title in (word, "Of limit", "Lost")))
    names = [name for group in found.groups for name in group.names]
    half = -(-len(names) // 2)
    for pair in zip_longest(names[:half], names[half:]):
        cells = []
        for name in filter(None, pair):
            reached = found.directions[name]
            cells += [name, f"{reached.fraction:.2f}", str(reached.dropped or "")]
        table.add_row(*cells)
    return table
