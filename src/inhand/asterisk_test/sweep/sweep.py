"""The cells of a sweep: every hand with every object."""

from dataclasses import fields
from itertools import product
from pathlib import Path

import numpy as np

from inhand.asterisk_test.asterisk import setup_of
from inhand.asterisk_test.cells import Job, job_of
from inhand.asterisk_test.clusters import check_spread
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.spread import Plan, planned
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.control.run_config import GravityConfig, TrialsConfig
from inhand.errors import InputError
from inhand.hands.spatial.files import is_spatial_hand
from inhand.hands.spatial.names import STANDARD
from inhand.hands.spatial.pair import load_held
from inhand.tasks.primitives import parse_directions
from inhand.tasks.spatial.primitives import parse_spatial_directions
from inhand.versions import versions

CELLS = "cells"
"""Folder of the cells' files inside that of the sweep."""
SPATIAL = (STANDARD, "cube_50")
"""A hand and an object in space that go together."""


def plan(config: SweepConfig) -> Plan:
    """Return the cells of a sweep, hand by hand, and which of them its folder does not hold yet.

    Raises:
        InputError: a configuration that cannot be run, a folder that holds something else, or cells of other settings.
    """
    check_spread(config)
    for option, names in (("--hands", config.hands), ("--objects", config.objects)):
        if not names:
            raise InputError(f"{option} names none: give at least one")
    space = {name: is_spatial_hand(name) for name in config.hands}
    if len(set(space.values())) > 1:
        one, other = (next(name for name in space if space[name] == kind) for kind in (False, True))
        raise InputError(f"--hands {one} is in the plane and {other} in space: give hands of one kind")
    setup_of(_asterisk(config, *(SPATIAL if any(space.values()) else ())))  # refuses what no cell could run with
    return planned(_jobs(config, config.out / CELLS), overwrite=config.overwrite)


def directions_of(config: SweepConfig) -> list[str]:
    """Return the names of a sweep's directions: clockwise from Out, turns last, or in space as they were given."""
    if is_spatial_hand(config.hands[0]):
        return [each.name for each in parse_spatial_directions(config.directions)]
    found = parse_directions(config.directions)
    order = [360.0 if each.angle_deg is None else (90.0 - each.angle_deg) % 360.0 for each in found]
    return [found[k].name for k in np.argsort(order, kind="stable")]


def _asterisk(config: SweepConfig, *held: str) -> AsteriskConfig:
    """Return the run of a cell, of a hand and an object or of those that are usual."""
    names = [field.name for kind in (TrialsConfig, GravityConfig) for field in fields(kind)]
    shared = {name: getattr(config, name) for name in names} | dict(zip(("hand", "object"), held, strict=False))
    return AsteriskConfig(directions=config.directions, regrasp=config.regrasp, **shared)


def _jobs(config: SweepConfig, folder: Path) -> list[Job]:
    found = versions()
    return [
        job_of(_asterisk(config, *names), held, found, folder, (held.hand.name, "with", held.object.name))
        for names in product(config.hands, config.objects)
        for held in [load_held(*names)]
    ]
