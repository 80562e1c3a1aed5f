"""Metrics that users add: functions of a trial, measured beside the package's own."""

import math
from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np

from inhand.asterisk_test.metrics import Metrics
from inhand.control.trial import Trial
from inhand.errors import InputError
from inhand.registry import Registry, describe

UserMetric = Callable[[Trial], float]
"""Gives the number of a trial."""


def measured(trial: Trial, names: Sequence[str]) -> tuple[dict[str, float], dict[str, str]]:
    """Return the values of users' metrics by name, and what went wrong in those that gave none, whose value is NaN.

    A trial takes long to simulate: no mistake in a metric may cost it.

    Raises:
        InputError: there is no metric of a name.
    """
    values: dict[str, float] = {}
    wrong: dict[str, str] = {}
    for metric, name in [(METRICS.known(name), name.rpartition(":")[2]) for name in names]:
        try:
            values[name] = metric(trial)
        except Exception as error:
            told = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            values[name], wrong[name] = math.nan, told
    return values, wrong


def _metric(name: str, given: object) -> UserMetric:
    """Return a user's metric, its values looked at; raise InputError where it is none."""
    if not callable(given) or isinstance(given, type):
        raise InputError(f"metric {name!r} is {describe(given)}: it must be a function that gives a trial's number")
    if name in {field.name for field in fields(Metrics)}:
        raise InputError(f"the name {name!r} is taken by another metric: give yours another name")

    def value(trial: Trial) -> float:
        found = given(trial)
        if not np.isscalar(found) or not isinstance(found, int | float | np.number):
            raise InputError(f"metric {name!r} gives {describe(found)} for a trial: it must give one number")
        return float(found)

    return value


METRICS: Registry[UserMetric] = Registry("metric", {}, _metric)
"""Metrics that users add."""
