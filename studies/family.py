"""One policy for hands and objects that it never saw: `python studies/family.py --help`."""

from __future__ import annotations

import importlib.util
import shlex
import sys
import time

import tyro

from family_config import FamilyConfig
from inhand.cli.cells import shown
from inhand.cli.terminal import print_table, say
from inhand.errors import InputError, needs_extra
from inhand.pages import options


def run_family(config: FamilyConfig) -> None:
    """Compute what the folder does not hold yet, and write table, heat map and page."""
    import family_study as study
    from family_page import HEADER, rows_of, write_family

    study.check_study(config)
    if config.new and importlib.util.find_spec("jax") is None:
        raise needs_extra("rl", "fitting a policy to a new hand (or give --new nothing)")
    began = time.perf_counter()
    compute = shown(config.out)
    cases = study.measured(config, compute, say)
    alone = study.standard(config, cases, compute, say) if config.disturb == "none" and config.sample == 1 else None
    few = study.fitted(config, cases, compute, say)
    words = shlex.join(["python", "studies/family.py", *options(config, _usual(config))])
    write_family(config, (cases, alone, few), words, time.perf_counter() - began)
    print_table("Hands that were never seen", HEADER, rows_of(study.by_hand(cases)))
    say(f"Report: {config.out / 'report.md'}")


def _usual(config: FamilyConfig) -> list[str]:
    """Return the settings that are as by default."""
    plain = vars(FamilyConfig())
    return [name for name, value in vars(config).items() if value == plain[name]]


if __name__ == "__main__":
    try:
        run_family(tyro.cli(FamilyConfig, description=FamilyConfig.__doc__))
    except InputError as error:
        sys.exit(f"family: {error}")
