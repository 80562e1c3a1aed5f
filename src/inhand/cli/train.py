"""`inhand train`: train a controller, watched; stopped and gone on with; its curves and table at the end."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Group
from rich.live import Live
from rich.table import Table

from inhand.cli.learning_config import TrainConfig
from inhand.cli.terminal import bar, print_table, say
from inhand.errors import InputError, needs_extra
from inhand.learning.progress import HEADER, Evaluated, evaluation_rows, joined, read_learning
from inhand.learning.report import write_training
from inhand.tasks.primitives import TRAIN, UNSEEN

if TYPE_CHECKING:
    from inhand.learning.config import Training
    from inhand.learning.journal import Counters, Evaluation

PACKAGES = ("jax", "optax", "tensorboardX")
"""What the extra `rl` brings and training cannot do without."""
CHOSEN = ("hand", "object", "directions", "engine", "seed", "episodes")
"""Settings of the command line that take the place of the preset's."""
WORDS = {
    "grasps": "planning grasps",
    "demonstrations": "recording demonstrations",
    "expert": "measuring the expert",
    "imitation": "imitating the demonstrations",
    "warm-up": "learning their values",
}
"""What the parts of a training are called on the screen."""


def run_train(config: TrainConfig) -> None:
    """Train or go on, tell how it goes, and end with curves, table and the place of the policy."""
    if any(importlib.util.find_spec(name) is None for name in PACKAGES):
        raise needs_extra("rl", "`inhand train`")
    from inhand.learning import runs

    training = runs.read_config(config.out) if config.resume else chosen(config)
    if config.resume:
        refuse_changes(config)
    try:
        with Watch(training, config.out) as watch:
            told = watch.prepared, watch.evaluated
            if config.resume:
                best = runs.resume(config.out, told)
            else:
                best = runs.train(training, config.out, told, overwrite=config.overwrite)
    except KeyboardInterrupt:
        for line in kept(config.out):
            say(line)
        sys.exit(130)
    _report(config.out, training, best)


def chosen(config: TrainConfig) -> Training:
    """Return the preset's training with what the command line gives."""
    from inhand.learning import runs

    given = {name: value for name in CHOSEN if (value := getattr(config, name)) is not None}
    return replace(runs.preset(config.preset or "default"), **given)


def refuse_changes(config: TrainConfig) -> None:
    """Refuse settings beside --resume, which goes on with the run's own.

    Raises:
        InputError: the text names them.
    """
    given = [f"--{name}" for name in ("preset", *CHOSEN) if getattr(config, name) is not None]
    given += ["--overwrite"] if config.overwrite else []
    if given:
        raise InputError(
            f"--resume goes on with the configuration of the run in {config.out}: leave out {', '.join(given)}, or"
            " train anew with another --out"
        )


def kept(out: Path) -> tuple[str, str]:
    """Return what a run that was stopped has kept, and how to go on with it."""
    again = f"Go on with: {shlex.join(['inhand', 'train', '--out', str(out), '--resume'])}"
    if (out / "checkpoint.npz").is_file():
        episode = read_learning(out).evaluations[-1].episode
        return f"Stopped. Kept: the run up to episode {episode}, and its best policy in {out / 'best'}.", again
    if (out / "ready.npz").is_file():
        return "Stopped before the first checkpoint. Kept: grasps and demonstrations.", again
    if out.is_dir():
        return "Stopped before all demonstrations were there; they will be recorded anew.", again
    return "Stopped before anything was written.", "Begin with the same command again."


class Watch:
    """Shows how far a training is: a bar and a table where somebody watches, and a line for every evaluation."""

    def __init__(self, training: Training, out: Path) -> None:
        """Show nothing yet."""
        self._training, self._out = training, out
        self._bar = bar()
        self._row = self._bar.add_task("preparing", total=None, more="")
        self._live = Live(self._bar, transient=True)
        self._first: Counters | None = None
        self._before: Counters | None = None

    def __enter__(self) -> Watch:
        """Start to show, where somebody watches."""
        if self._live.console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take bar and table away."""
        self._live.stop()

    def prepared(self, what: str, done: int, total: int) -> None:
        """Show how far a part of the training is."""
        words = WORDS.get(what, what)
        self._bar.update(self._row, description=words, completed=done, total=total, more=f"{done} of {total}")
        if not self._live.console.is_terminal and what != "learning":  # evaluations tell of that
            say(f"{words}: {done} of {total}")

    def evaluated(self, found: Evaluation) -> None:
        """Write a line about an evaluation and show it by direction."""
        counters, left = found.counters, self._left(found.counters)
        reached = read_learning(self._out).evaluations[-1]
        line = ", ".join(part for part in (line_of(reached), self._speed(counters), left) if part)
        self._first, self._before = self._first or counters, counters
        done, total = counters.episodes, self._training.episodes
        self._bar.update(self._row, description="learning", completed=done, total=max(done, total), more=left)
        if self._live.console.is_terminal:
            self._live.console.print(line, markup=False, highlight=False, soft_wrap=True)
            self._live.update(Group(_live_table(reached), self._bar))
        else:
            say(line)

    def _speed(self, now: Counters) -> str:
        """Return the updates in a second since the evaluation before."""
        if self._before is None or now.seconds <= self._before.seconds:
            return ""
        return f"{(now.updates - self._before.updates) / (now.seconds - self._before.seconds):.0f} updates/s"

    def _left(self, now: Counters) -> str:
        """Return the time that is left at the speed of this sitting."""
        left = self._training.episodes - now.episodes
        if self._first is None or now.episodes <= self._first.episodes or left <= 0:
            return ""
        seconds = left * (now.seconds - self._first.seconds) / (now.episodes - self._first.episodes)
        return f"about {seconds / 60:.0f} min left" if seconds >= 90 else f"about {seconds:.0f} s left"


def line_of(found: Evaluated) -> str:
    """Return an evaluation in one line."""
    whole = joined(list(found.directions.values()))
    shares = " and ".join(
        f"{found.over(group).fraction:.2f} {name}" for name, group in (("trained", TRAIN), ("unseen", UNSEEN))
    )
    return (
        f"episode {found.episode}: return {whole.total:.1f}, the expert's {whole.expert_total:.1f}; of the limit"
        f" {shares}; lost {whole.dropped} of {whole.trials}"
    )


def _live_table(found: Evaluated) -> Table:
    """Return share of the limit and lost objects of every direction, trained ones at the left."""
    table = Table("Trained", "Of limit", "Lost", "Unseen", "Of limit", "Lost")
    for pair in zip(TRAIN, UNSEEN, strict=True):
        cells = []
        for primitive in pair:
            reached = found.directions[primitive.name]
            cells += [primitive.name, f"{reached.fraction:.2f}", str(reached.dropped or "")]
        table.add_row(*cells)
    return table


def _report(out: Path, training: Training, best: Path) -> None:
    """Write curves and page, and print the table of the best policy."""
    found = read_learning(out)
    write_training(out, f"{training.preset} training, {training.object} with {training.hand}, seed {training.seed}")
    print_table(f"The best policy, at episode {found.best.episode}", HEADER, evaluation_rows(found.best))
    say(f"Curves: {out / 'report.md'}")
    say(f"Policy: {best}")
    say(f"Evaluate it: {shlex.join(['inhand', 'evaluate', str(out)])}")
