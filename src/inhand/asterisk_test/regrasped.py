"""Trials in which fingers may be placed anew: which are taken, and what is told of them apart from the standard test.

The standard test forbids to let go: its distance ends with the first loss of contact, here too. What was reached with
fingers that were placed anew stands in a table of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.metrics import progress
from inhand.asterisk_test.results import Result, by_direction
from inhand.control.catalogue import ControllerEntry
from inhand.control.controller import Controller, Task
from inhand.control.ik import IkController
from inhand.control.regrasping import RegraspingController
from inhand.control.trial import KEPT, LOST, Trial
from inhand.errors import InputError
from inhand.pages import spread
from inhand.sim.disturbance_files import NONE

MOST = 2
"""How often fingers are placed anew at most."""
AWAY = 0.5
"""Fingers that are off an object for longer were placed anew [s]: that takes two seconds."""
LONGEST = 40.0
"""Time that a trial has [s]."""
GAIN_MM, GAIN_DEG = 2.0, 2.0
"""What letting go has to gain, along a direction or where an object only turns."""
ACROSS_MM, TURNED_DEG = 3.0, 5.0
"""Farther off its line, or turned by more, no object is to end that was let go."""
PLAIN, NAME = "ik", "ik-regrasp"
"""The expert, and what it is called where it may let go."""
TITLE = "With fingers placed anew, apart from the test"
HEADER = ("Direction", "Distance [mm]", "Of limit", "Times", "Lateral", "Turn", "Outcome")
"""Columns of what is told apart; lateral and turn are the worst trial's at its end."""
Carry = Callable[..., tuple[Trial, ...]]
"""Runs every trial with what a controller's maker makes."""


def regrasping(entry: ControllerEntry, config: AsteriskConfig) -> ControllerEntry:
    """Return the expert that may let go.

    Raises:
        InputError: another controller, or a run in which letting go is not tried.
    """
    wrong = [
        (
            entry.manipulate is not IkController,
            f"--controller {config.controller}",
            "ik, which alone places fingers anew",
        ),
        (config.disturb != NONE, f"--disturb {config.disturb}", "none: it is tried out in the same world first"),
        (config.twist != 0, f"--twist {config.twist:g}", "0"),
    ]
    for is_wrong, given, allowed in wrong:
        if is_wrong:
            raise InputError(f"--regrasp with {given}: give {allowed}, or leave --regrasp out")
    return replace(entry, name=NAME)


def farthest(carry: Carry) -> tuple[Trial, ...]:
    """Return of each trial the one that comes farthest: as in the test, or with fingers placed anew once or twice.

    All begin alike, so that trying it out before tells what comes of it: the expert knows its world.
    """
    best, tries = carry(IkController), list[tuple[Trial, ...]]()
    for allowed in range(MOST, 0, -1):
        made: list[RegraspingController] = []

        def manipulate(task: Task, allowed: int = allowed, made: list[RegraspingController] = made) -> Controller:
            made.append(RegraspingController(task, allowed))
            return made[-1]

        tries.insert(0, carry(manipulate, longest=LONGEST, keeps=False))
        if all(controller.rounds < allowed for controller in made):
            break  # with fewer allowed it would be the same
    for tried in tries:
        best = tuple(_better(*pair) for pair in zip(best, tried, strict=True))
    return best


def _better(old: Trial, new: Trial) -> Trial:
    """Return the new one of two trials where it kept its object straight, and the old one did not or came less far."""
    if new.outcome not in KEPT:
        return old
    (before, _), (after, off) = _end(old), _end(new)
    gain = GAIN_DEG if new.passport.turns else GAIN_MM
    straight = off[0] <= ACROSS_MM and (new.passport.turns or off[1] <= TURNED_DEG)
    return new if straight and (old.outcome in LOST or after > before + gain) else old


def _end(trial: Trial) -> tuple[float, tuple[float, float]]:
    """Return how far a trial came [mm, or deg where it turns] up to where all fingers last held the object.

    And how far that is off its line [mm], and off the rotation to hold [deg].
    """
    path, rotation, touching = trial.manipulated_path()
    last = int(np.flatnonzero(touching.all(axis=-1)).max(initial=0))
    angle, turned = trial.passport.angle_deg, float(rotation[last])
    if angle is None:
        return abs(turned), (float(np.linalg.norm(path[last] - path[0])), 0.0)
    along, across = progress(path, angle)[last]
    return float(along), (float(abs(across)), abs(turned - trial.passport.rotation_deg))


def apart(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """Return what each trial reached with fingers placed anew, up to where all last held the object."""
    found = []
    for trial in trials:
        passport = trial.passport
        come, (across, turned) = _end(trial)
        found.append(
            {
                "direction": passport.primitive,
                "trial": passport.trial,
                "reached_deg" if passport.turns else "reached_mm": come,
                "placed_anew": _times(trial),
                "lateral_mm": across,
                "rotation_deg": turned,
                "lost": trial.outcome in LOST,
            }
        )
    return found


def beside(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """Return the same as columns beside those of the test."""
    kept = "placed_anew", "direction", "trial"
    names = {"reached_mm": "regrasped_mm", "reached_deg": "regrasped_deg"}
    return [
        {names.get(key, key if key in kept else f"regrasped_{key}"): value for key, value in each.items()}
        for each in apart(trials)
    ]


def _times(trial: Trial) -> int:
    """Return how often fingers were off for long and held the object again."""
    held = np.flatnonzero(trial.manipulated_path()[2].all(axis=-1))
    return int((np.diff(held) * trial.passport.period > AWAY).sum())


def rows_of(told: Sequence[dict[str, Any]], results: Sequence[Result]) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`, one for each direction; a trial that lost its object counts to where it held."""
    rows = list[tuple[str, ...]]()
    for name, group in by_direction(results).items():
        own = [each for each in told if each["direction"] == name]
        come = np.array([each.get("reached_mm", each.get("reached_deg")) for each in own])
        limit, lost = group[0].limit, sum(each["lost"] for each in own)
        rows.append(
            (
                name,
                spread(come.mean(), come.std(ddof=1) if len(own) > 1 else np.nan) + (" deg" if group[0].turns else ""),
                spread(come.mean() / limit if limit else np.nan, digits=2),
                spread(float(np.mean([each["placed_anew"] for each in own]))),
                spread(max(each["lateral_mm"] for each in own)),
                spread(max(each["rotation_deg"] for each in own)),
                f"{lost}/{len(own)} lost" if lost else f"{len(own)}/{len(own)} held",
            )
        )
    return rows
