"""The Asterisk Test of a hand in space: what to run in, a finished run out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.spatial.run import SpatialSetup, simulate_asterisk_in_space
from inhand.control.spatial_catalogue import notes_in_space
from inhand.control.spatial_trial import SpatialTrial

if TYPE_CHECKING:
    from inhand.asterisk_test.spatial.report import SpatialRun

Simulate = Callable[[AsteriskConfig, SpatialSetup], tuple[SpatialTrial, ...]]
"""Runs a setup; the command line shows how far it is."""


def finish_in_space(
    config: AsteriskConfig, setup: SpatialSetup, run: Simulate = simulate_asterisk_in_space
) -> SpatialRun:
    """Simulate, measure, and return the finished run."""
    from inhand.asterisk_test.spatial.report import SpatialRun

    trials = run(config, setup)
    notes = notes_in_space(setup.controller, setup.hand, setup.object)
    return SpatialRun(config, trials, tuple(result_of_trial(trial) for trial in trials), notes)
