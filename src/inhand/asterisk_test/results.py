"""Results of trials, simulated or recorded, as rows of numbers, and the JSON they are kept in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inhand.asterisk_test.averages import summarise
from inhand.asterisk_test.compatible import AsteriskMetrics, measure_asterisk
from inhand.asterisk_test.labels import is_averaged, labels_of
from inhand.asterisk_test.metrics import Metrics, measure, measure_human, progress
from inhand.asterisk_test.people.hand_sizes import HAND_SIZES_MM, normalise
from inhand.asterisk_test.people.human_rows import ALL_SEEN, Unseen
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.spatial.metrics import measure_in_space
from inhand.asterisk_test.user_metrics import measured
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.trial import DIVERGED, KEPT, LOST, NO_GRASP, AnyTrial, Passport, Trial
from inhand.geometry import Array
from inhand.shown import frame
from inhand.tasks.primitives import twisted_name

if TYPE_CHECKING:
    from pandas import DataFrame, Series

BENT_MM = 0.1
"""A reference path that leaves the line along its direction by more is not straight [mm]: guessed."""
REACHED, LIMIT = ("distance_mm", "rotation_final_deg"), ("limit_mm", "limit_deg")
"""How an entry calls what was reached and what could be, along a direction and where it only turns."""
MAY_LACK = (
    "fraction_of_limit", "contact_fraction", "longest_gap_s", "path_max_mm", "force_max_n", "torque_max_nmm",
    "penetration_max_mm", "penetration_mean_mm", "penetration_share",
)  # fmt: skip
"""Numbers of an entry that people's trials, or runs without a limit, do not have."""
RECORDED = "recorded"
"""Outcome of a human trial, whose end is not recorded."""


@dataclass(frozen=True)
class Result:
    """What one trial reached."""

    direction: str
    angle_deg: float | None
    """Its direction [deg], None where it only rotates."""
    trial: int
    """Number of the trial in its direction."""
    outcome: str
    """How it ended."""
    metrics: Metrics
    carried_mm: float
    """Farthest progress before the end with lost and regained contacts allowed, as in the thesis [mm]."""
    first_lost: str | None
    """The finger that let go first, None where none did: all held, the grasp failed, or the simulation diverged."""
    labels: tuple[str, ...] | None
    """Labels of the Asterisk Test, None where the hand has no span to normalise with."""
    compatible: AsteriskMetrics | None
    """Metrics of the Asterisk Test software, None where not asked for or without a span."""
    source: str
    """File or controller."""
    limit: float | None = None
    """How far the hand could carry the object [mm], or turn it [deg] where there is no direction; None for people."""
    force_max_n: float | None = None
    """Largest force of a finger on the object in any row of the trial [N]; None for people."""
    penetration_max_mm: float | None = None
    """Deepest overlap of a link and the object in any row of the trial [mm]; None for people."""
    torque_max_nmm: float | None = None
    """Largest torque of a finger about the object's middle in any row of the trial [N mm],"""
    penetration_mean_mm: float | None = None
    """mean of the deepest overlap over the time of manipulation [mm],"""
    penetration_share: float | None = None
    """and share of that time in which it is more than half a millimetre; None for people."""
    unseen: Unseen = ALL_SEEN
    """Frames of a recording in which the camera did not see the object."""
    more: dict[str, float] = field(default_factory=dict)
    """Values of users' metrics by name, NaN where one gave none,"""
    wrong: dict[str, str] = field(default_factory=dict)
    """and why it gave none."""
    bent: bool = False
    """Whether its reference path is not the straight line along the direction."""
    along: tuple[float, float, float] | None = None
    """Unit vector of its direction in space; None in the plane, and where it only turns."""

    @property
    def turns(self) -> bool:
        """Whether it only turns the object."""
        return self.angle_deg is None and self.along is None

    @property
    def reached(self) -> float:
        """Counted distance [mm], or the angle turned at the end where there is no direction [deg]."""
        return self.metrics.rotation_final_deg if self.turns else self.metrics.distance_mm

    @property
    def fraction(self) -> float | None:
        """What was reached as a share of the limit; None where there is none to reach."""
        return self.reached / self.limit if self.limit else None

    @property
    def kept(self) -> bool:
        """Whether it carried the object and had it in the hand at the end; it says nothing of how far."""
        return self.outcome in {*KEPT, RECORDED}

    @property
    def lost(self) -> bool:
        """Whether the object was lost, or never held; one that did not move, or whose time ran out, is neither."""
        return self.outcome in LOST


def result_of_trial(trial: AnyTrial, *, compatible: bool = False, metrics: Sequence[str] = ()) -> Result:
    """Return the result of a simulated trial, in the plane with the users' metrics of some names."""
    passport = trial.passport
    told, touching = _in_space(trial) if isinstance(trial, SpatialTrial) else _in_plane(trial, compatible, metrics)
    lost = np.flatnonzero(~touching.all(axis=-1) & (trial.outcome not in (DIVERGED, NO_GRASP)))
    first = " and ".join(np.array(passport.hand.finger_names)[~touching[lost[0]]]) if len(lost) else None
    return Result(
        direction=passport.primitive,
        trial=passport.trial,
        outcome=trial.outcome,
        first_lost=first,
        source=passport.controller,
        limit=_limit(passport),
        force_max_n=trial.force_max_n,
        penetration_max_mm=trial.penetration_max_mm,
        torque_max_nmm=trial.torque_max_nmm,
        penetration_mean_mm=trial.penetration_mean_mm,
        penetration_share=trial.penetration_share,
        **told,
    )


def _in_plane(trial: Trial, compatible: bool, metrics: Sequence[str]) -> tuple[dict[str, Any], NDArray[np.bool_]]:
    """Return what a `Result` says of a trial in the plane alone, and whether each finger touches `(T, F)`."""
    passport = trial.passport
    path, rotation, touching = trial.manipulated_path()
    target, angle, row_s = passport.rotation_deg, passport.angle_deg, passport.period
    reference = 1e3 * trial.reference[:, :2]
    primary = measure(
        path, rotation, angle, target_rotation_deg=target, contact=touching, row_s=row_s, reference_mm=reference
    )
    more, wrong = measured(trial, metrics)
    labels, original = _normalised(
        (path, path), rotation, (angle, target), passport.hand.name.partition("_")[0], compatible
    )
    return {
        "angle_deg": angle,
        "metrics": primary,
        "carried_mm": 0.0 if angle is None else float(progress(path, angle)[:, 0].max()),
        "labels": labels,
        "compatible": original,
        "more": more,
        "wrong": wrong,
        "bent": angle is not None and np.abs(progress(reference, angle)[:, 1]).max() > BENT_MM,
    }, touching


def _in_space(trial: SpatialTrial) -> tuple[dict[str, Any], NDArray[np.bool_]]:
    """Return the same of a trial in space."""
    passport = trial.passport
    path, rotation, touching = trial.manipulated()
    reference, goal = 1e3 * trial.reference[:, :3], (passport.along, passport.about)
    metrics = measure_in_space(path, rotation, goal, contact=touching, row_s=passport.period, reference_mm=reference)
    carried = 0.0 if passport.along is None else float((path @ np.array(passport.along)).max())
    told = {"angle_deg": None, "along": passport.along, "metrics": metrics, "carried_mm": carried}
    return told | {"labels": None, "compatible": None}, touching


def _limit(passport: Passport | SpatialPassport) -> float | None:
    if passport.limit is None:
        return None
    return math.degrees(passport.limit) if passport.turns else 1e3 * passport.limit


def result_of_human(trial: HumanTrial, *, compatible: bool = False) -> Result:
    """Return the result of a recorded trial."""
    metrics = measure_human(trial)
    rotation = trial.filtered_rotation_deg if trial.rotation_usable else None
    paths = (trial.start_mm + trial.path_mm, trial.filtered_mm)
    labels, original = _normalised(paths, rotation, (trial.angle_deg, trial.twist_deg), trial.hand, compatible)
    return Result(
        twisted_name(trial.primitive, trial.twist_deg),
        trial.angle_deg,
        trial.trial,
        RECORDED,
        metrics,
        metrics.max_distance_mm,
        None,
        labels,
        original,
        trial.source,
        unseen=trial.unseen,
    )


def _normalised(
    paths: tuple[Array, Array], rotation: Array | None, target: tuple[float | None, float], hand: str, compatible: bool
) -> tuple[tuple[str, ...] | None, AsteriskMetrics | None]:
    """Return labels and compatible metrics of a raw and a filtered path [mm] in the units of a hand's span."""
    if hand not in HAND_SIZES_MM:
        return None, None
    raw, filtered = (normalise(path, hand) for path in paths)
    angle, twist = target
    labels = tuple(sorted(labels_of(raw, rotation, angle)))
    if not compatible or rotation is None:
        return labels, None
    return labels, measure_asterisk(filtered, rotation, angle, target_rotation_deg=twist, raw_path=raw)


def averaged(result: Result) -> bool:
    """Return whether averages use a result: they leave out the deviated kinds of the Asterisk Test's labels."""
    return result.labels is None or is_averaged(frozenset(result.labels))


def by_direction(results: Sequence[Result]) -> dict[str, list[Result]]:
    """Return results grouped by the name of their direction, in order of appearance."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.direction, []).append(result)
    return groups


def as_entry(result: Result) -> dict[str, Any]:
    """Return a result as one entry of the JSON's `trials` list; numbers that are not known are null."""
    entry: dict[str, Any] = {
        "direction": result.direction,
        "angle_deg": result.angle_deg,
        "trial": result.trial,
        **asdict(result.metrics),
        "outcome": result.outcome,
        "carried_mm": result.carried_mm,
        **_limit_entry(result),
        "fraction_of_limit": result.fraction,
        "force_max_n": result.force_max_n,
        "torque_max_nmm": result.torque_max_nmm,
        "penetration_max_mm": result.penetration_max_mm,
        "penetration_mean_mm": result.penetration_mean_mm,
        "penetration_share": result.penetration_share,
        "first_lost": result.first_lost,
        "labels": None if result.labels is None else list(result.labels),
        "source": result.source,
    }
    if result.along is not None:
        entry["along"] = list(result.along)
    if result.more:
        entry["more"] = result.more
    if result.unseen.frames:
        entry["unseen"] = asdict(result.unseen)
    if result.compatible is not None:
        entry["asterisk_test"] = asdict(result.compatible)
    return entry


def tidy(entries: Iterable[dict[str, Any]], also: Sequence[str] = ()) -> DataFrame:
    """Return entries, and what else stands in them, as a frame with a row each, though there be none.

    `reached` and `limit` are in mm, and in deg where a trial only turns.
    """
    table = frame(list(entries))
    known = [*also, "direction", "angle_deg", "trial", "outcome", "first_lost", *REACHED, *LIMIT]
    table = table.reindex(columns=[*dict.fromkeys([*table.columns, *known, *MAY_LACK])])
    table = table.astype(dict.fromkeys(MAY_LACK, float))
    turns = turning(table)
    for name, (along, turned) in {"reached": REACHED, "limit": LIMIT}.items():
        table[name] = table[along].where(~turns, table[turned]).astype(float)
    return table


def turning(table: DataFrame) -> Series[bool]:
    """Return which entries only turn the object; directions in space have no angle."""
    turns = table["angle_deg"].isna()
    return turns & table["along"].isna() if "along" in table else turns


def summary_of(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Return for every direction the mean and SD of every metric, the number of trials and how they ended."""
    rows = []
    for name, group in by_direction(results).items():
        outcomes = [result.outcome for result in group]
        rows.append(
            {
                "direction": name,
                "angle_deg": group[0].angle_deg,
                "trials": len(group),
                "outcomes": {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))},
                **_limit_entry(group[0]),
                "fraction_of_limit": mean_fraction(group),
                "force_max_n": largest(result.force_max_n for result in group),
                "penetration_max_mm": largest(result.penetration_max_mm for result in group),
                **{key: value._asdict() for key, value in summarise([r.metrics for r in group]).items()},
            }
        )
    return rows


def mean_fraction(group: Sequence[Result]) -> float | None:
    """Return the mean share of the limit that trials reached; None where no limit is known."""
    known = [result.fraction for result in group if result.fraction is not None]
    return float(np.mean(known)) if known else None


def largest(values: Iterable[float | None]) -> float | None:
    """Return the largest of the values that are known; None where none is."""
    return max((value for value in values if value is not None), default=None)


def _limit_entry(result: Result) -> dict[str, float | None]:
    return {("limit_deg" if result.turns else "limit_mm"): result.limit}
