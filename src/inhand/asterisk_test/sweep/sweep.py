"""The cells of a sweep: every hand with every object."""

from dataclasses import fields, replace
from pathlib import Path

from inhand.asterisk_test.cells import Job, job_of
from inhand.asterisk_test.clusters import check_spread
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare
from inhand.asterisk_test.spread import Plan, planned
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.control.run_config import TrialsConfig
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.versions import versions

CELLS = "cells"
"""Folder of the cells' files inside that of the sweep."""


def plan(config: SweepConfig) -> Plan:
    """Return the cells of a sweep, hand by hand, and which of them its folder does not hold yet.

    Raises:
        InputError: a configuration that cannot be run, a folder that holds something else, or cells of other settings.
    """
    check_spread(config)
    for option, names in (("--hands", config.hands), ("--objects", config.objects)):
        if not names:
            raise InputError(f"{option} names none: give at least one")
    prepare(_asterisk(config))  # refuses what no cell could run with
    return planned(_jobs(config, config.out / CELLS), overwrite=config.overwrite)


def _asterisk(config: SweepConfig) -> AsteriskConfig:
    shared = {field.name: getattr(config, field.name) for field in fields(TrialsConfig)}
    return AsteriskConfig(directions=config.directions, **shared)


def _jobs(config: SweepConfig, folder: Path) -> list[Job]:
    base, found = _asterisk(config), versions()
    hands = {text: load_hand(text) for text in config.hands}
    objects = {text: load_object(text) for text in config.objects}
    return [
        job_of(replace(base, hand=hand, object=thing), held, found, folder, (held[0].name, "with", held[1].name))
        for hand in config.hands
        for thing in config.objects
        for held in [(hands[hand], objects[thing])]
    ]
