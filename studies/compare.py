"""Primitives in sequence against training end to end: `python studies/compare.py --help`."""

from __future__ import annotations

import importlib.util
import sys

import tyro
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from compare_config import CompareConfig
from inhand.cli.terminal import print_table, say
from inhand.errors import InputError, needs_extra

PACKAGES = ("jax", "optax", "tensorboardX")
"""What the extra `rl` brings and the study cannot do without."""


def run_compare(config: CompareConfig) -> None:
    """Train what the folder does not hold yet, try everything on every task, and write table, figure and page."""
    if any(importlib.util.find_spec(name) is None for name in PACKAGES):
        raise needs_extra("rl", "this study")
    import compare_study as compare
    from compare_page import HEADER, table_rows, write_compare

    compare.check_compare(config)
    try:
        with Progress(
            TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), transient=True
        ) as bar:
            row = bar.add_task("compare", total=1)
            last = ""

            def told(text: str, done: int, total: int) -> None:
                nonlocal last
                bar.update(row, description=text, completed=done, total=total)
                if text != last and not bar.console.is_terminal:
                    say(f"{done + 1} of {total}: {text}")
                last = text

            compare.trained(config, told)
            found = compare.evaluated(config, told)
            few = compare.adapted(config, told)
    except KeyboardInterrupt:
        say(f"What is finished is kept in {config.out}; the same command goes on from there")
        raise
    every = write_compare(config, found, few)
    print_table("Primitives in sequence against training end to end", HEADER, table_rows(every), numbers=3)
    say(f"Report: {config.out / 'report.md'}")


if __name__ == "__main__":
    try:
        run_compare(tyro.cli(CompareConfig, description=CompareConfig.__doc__))
    except InputError as error:
        sys.exit(f"compare: {error}")
