"""From trials and results to what the figures draw: outlines in mm, curves, series."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from inhand.asterisk_test import metrics
from inhand.asterisk_test.averages import average_path, compat_average
from inhand.asterisk_test.people.hand_sizes import hand_size_mm, normalise
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, averaged, result_of_human
from inhand.control.trial import Trial
from inhand.geometry import Array
from inhand.plots.curves import PathCurve
from inhand.plots.donut import DonutSeries
from inhand.plots.path import TrialPath
from inhand.plots.radar import RadarSeries
from inhand.tasks.primitives import twisted_name


def counted_rows(trial: Trial) -> int:
    """Return how many rows of manipulation, from its start, come before the first loss of contact."""
    return metrics.counted_rows(trial.manipulated_path()[2])


def mean_distance(results: Sequence[Result]) -> float:
    """Return the mean distance of trials [mm]: the number at a line, where the line ends, and what the table says."""
    return float(np.mean([result.metrics.distance_mm for result in results]))


def average_curve(trials: Sequence[Trial], results: Sequence[Result]) -> PathCurve:
    """Return the mean path of one direction's trials, up to their first loss of contact."""
    passport = trials[0].passport
    angle = passport.angle_deg or 0.0
    distance = mean_distance(results)
    mean = average_path([t.manipulated_path()[0][: counted_rows(t)] for t in trials], angle, distance)
    return PathCurve(
        angle_deg=angle,
        name=passport.primitive,
        points_mm=mean.points_mm,
        label_mm=distance,
        band_mm=mean.lateral_sd_mm if len(trials) > 1 else None,
        failed=any(result.lost for result in results),
        **_target(trials[0], results[0]),
    )


def direction_curves(
    trials: Sequence[Trial],
    results: Sequence[Result],
    average: Callable[[Sequence[Trial], Sequence[Result]], PathCurve] = average_curve,
) -> list[PathCurve]:
    """Return the mean path of every direction that translates, by a rule for averages."""
    groups: dict[str, list[int]] = {}
    for i, trial in enumerate(trials):
        if trial.passport.angle_deg is not None:
            groups.setdefault(trial.passport.primitive, []).append(i)
    return [average([trials[i] for i in rows], [results[i] for i in rows]) for rows in groups.values()]


def compatible_curve(trials: Sequence[Trial], results: Sequence[Result]) -> PathCurve:
    """Return the mean path of one direction's trials by the rule of the Asterisk Test software, in mm again."""
    passport = trials[0].passport
    angle, hand = passport.angle_deg or 0.0, passport.hand.name.partition("_")[0]
    paths = [normalise(trial.manipulated_path()[0], hand) for trial in trials]
    points = compat_average(paths, angle) * np.array(hand_size_mm(hand))
    distance = mean_distance(results)
    failed, target = any(result.lost for result in results), _target(trials[0], results[0])
    return PathCurve(angle, passport.primitive, points, distance, failed=failed, **target)


def _target(trial: Trial, result: Result) -> dict[str, Any]:
    """Return what a curve's target is: the hand's limit along a straight line, or a reference that is bent."""
    return {"target_mm": target_of(trial, result)} if result.bent else {"limit_mm": result.limit}


def human_curves(people: Sequence[HumanTrial], names: Sequence[str]) -> list[PathCurve]:
    """Return the mean paths of people's trials, for the named directions they have.

    Trials that deviated by the labels of the Asterisk Test are left out.
    """
    used = [t for t in people if t.angle_deg is not None and averaged(result_of_human(t))]
    curves = []
    for name in names:
        trials = [t for t in used if twisted_name(t.primitive, t.twist_deg) == name]
        if not trials:
            continue
        paths = [t.filtered_mm[slice(*t.moving)] - t.filtered_mm[t.moving[0]] for t in trials]
        angle = trials[0].angle_deg or 0.0
        distance = mean_distance([result_of_human(t) for t in trials])
        mean = average_path(paths, angle, distance)
        band = mean.lateral_sd_mm if len(trials) > 1 else None
        curves.append(PathCurve(angle, name, mean.points_mm, distance, band))
    return curves


def target_of(trial: Trial, result: Result) -> Array:
    """Return the reference that a figure draws `(M, 2)` [mm]: a bent one whole, a straight one as far as it came."""
    target: Array = 1e3 * trial.reference[:, :2]
    if result.bent:
        return target
    shown: Array = target[np.linalg.norm(target, axis=-1) <= max(result.metrics.max_distance_mm, 10.0)]
    return shown


def trial_path(trial: Trial, result: Result) -> TrialPath:
    """Return one trial as its path figure takes it."""
    path, rotation, touching = trial.manipulated_path()
    angle = trial.passport.angle_deg or 0.0
    return TrialPath(
        name=trial.passport.primitive,
        angle_deg=angle,
        points_mm=path,
        rotation_deg=rotation,
        contact=touching,
        step_s=trial.passport.period,
        fingers=trial.passport.hand.finger_names,
        target_mm=target_of(trial, result),
        target_rotation_deg=trial.passport.rotation_deg,
        failed=result.lost,
    )


def radar_series(name: str, groups: dict[str, list[Result]], directions: Sequence[str]) -> RadarSeries:
    """Return distance and efficiency of every direction, NaN where a direction has no trial."""

    def mean(direction: str, key: str) -> float:
        values = [getattr(result.metrics, key) for result in groups.get(direction, [])]
        return float(np.mean(values)) if values else np.nan

    return RadarSeries(
        name,
        np.array([mean(direction, "distance_mm") for direction in directions]),
        np.array([mean(direction, "efficiency") for direction in directions]),
    )


def turn_series(name: str, results: Sequence[Result]) -> DonutSeries:
    """Return the mean angle turned each way [deg] and its range; NaN where a way has no trial."""
    turned = {
        way: [result.metrics.rotation_final_deg for result in results if result.direction == way]
        for way in ("cw", "ccw")
    }
    mean = {way: float(np.mean(values)) if values else np.nan for way, values in turned.items()}
    spread = {way: (min(values), max(values)) if len(values) > 1 else None for way, values in turned.items()}
    known = {result.direction: result.limit for result in results if result.limit is not None}
    limits = (known["cw"], known["ccw"]) if {"cw", "ccw"} <= set(known) else None
    return DonutSeries(name, mean["cw"], mean["ccw"], spread["cw"], spread["ccw"], limits)
