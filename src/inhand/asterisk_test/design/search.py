"""The search: optuna proposes hands, batch by batch, and is told what their aims come to.

A batch is looked at on all cores and told in its order, whatever ends first, so that the study depends neither on the
cores nor on where it was stopped: a study that goes on asks for the same hands again, and finds their files.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from inhand.asterisk_test.clusters import spread
from inhand.asterisk_test.design.asked import AIMS, Asked
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.looked import Look, Looked, bar_of, front_of, look, read_looked, signed
from inhand.control.run_config import SpreadConfig
from inhand.errors import needs_extra
from inhand.hands.family import Form, Limits
from inhand.hands.hand import HandSpec

if TYPE_CHECKING:
    import optuna

BATCH = 10
"""Hands that are proposed at a time: enough for several cores, few enough to learn from."""
FIRST = 20
"""Hands that are drawn before a sampler learns from them, of a study of 200 a tenth: guessed."""
Tell = Callable[[str], None]
"""Is told the name of each thing that is done."""


def search(config: DesignConfig, asked: Asked, catalogue: Sequence[Looked], folder: Path, tell: Tell) -> list[Looked]:
    """Return the hands of a study in the order in which they were proposed; their files lie in a folder.

    Hands of the catalogue that lie between the bounds are proposed first.
    """
    study, space = _study(config, asked), _space(asked)
    for each in catalogue:
        places = asked.family.places(each.hand)
        if places is not None:
            study.enqueue_trial({"form": places[0], "limits": places[1]} | places[2])
    looked: list[Looked] = []
    while len(looked) < config.hands:
        bar = bar_of(asked, front_of(asked, [*catalogue, *looked]))
        trials = [study.ask(space) for _ in range(min(BATCH, config.hands - len(looked)))]
        jobs = []
        for k, trial in enumerate(trials, start=len(looked) + 1):
            jobs.append(Look(k, _hand_of(asked, k, trial.params), asked, bar, folder / f"hand_{k:04d}.json"))
        found = looked_at(jobs, config, tell)
        for trial, job in zip(trials, jobs, strict=True):
            told = [abs(value) for value in signed(asked, found[job.number].aims)]
            study.tell(trial, told)
            looked.append(found[job.number])
    return looked


def looked_at(jobs: Sequence[Look], config: SpreadConfig, tell: Tell) -> dict[int, Looked]:
    """Return hands that were looked at, by their numbers; those whose files hold them are read."""
    found: dict[int, Looked] = {}
    for job in jobs:
        there = read_looked(job.path)
        if there is not None and there.hand == job.hand:
            found[job.number] = there
            tell(job.hand.name)
    waiting = [job for job in jobs if job.number not in found]
    # Those that take longest begin first, or all but one core would wait for one of them at the end.
    waiting.sort(key=lambda job: -sum(len(finger.links) for finger in job.hand.fingers))
    for each in spread(look, waiting, config):
        found[each.number] = each
        tell(each.hand.name)
    return found


def _hand_of(asked: Asked, number: int, params: Mapping[str, object]) -> HandSpec:
    places = {name: float(cast("float", params[name])) for name in asked.family.dimensions()}
    name = f"hand {number}"
    return asked.family.hand(name, cast("Form", params["form"]), cast("Limits", params["limits"]), places)


def check_optuna() -> None:
    """Refuse a study where optuna is not installed.

    Raises:
        InputError: it is not.
    """
    if find_spec("optuna") is None:
        raise needs_extra("design", "a design study")


def _study(config: DesignConfig, asked: Asked) -> optuna.Study:
    import optuna

    optuna.logging.disable_default_handler()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # optuna calls these options experimental
        if config.sampler == "tpe":
            sampler: optuna.samplers.BaseSampler = optuna.samplers.TPESampler(
                seed=config.seed, multivariate=True, constant_liar=True, n_startup_trials=FIRST
            )
        else:
            sampler = optuna.samplers.NSGAIISampler(seed=config.seed, population_size=2 * BATCH)
    ways: list[Literal["minimize", "maximize"]] = [
        "maximize" if AIMS[name].larger else "minimize" for name in asked.aims
    ]
    return optuna.create_study(directions=ways, sampler=sampler)


def _space(asked: Asked) -> dict[str, optuna.distributions.BaseDistribution]:
    from optuna.distributions import CategoricalDistribution, FloatDistribution

    family = asked.family
    found: dict[str, optuna.distributions.BaseDistribution] = {
        "form": CategoricalDistribution(family.forms),
        "limits": CategoricalDistribution(family.limits),
    }
    return found | {name: FloatDistribution(0.0, 1.0) for name in family.dimensions()}
