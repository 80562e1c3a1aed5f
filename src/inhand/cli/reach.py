"""`inhand reach`: how far a hand could carry an object."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from inhand.asterisk_test.config import ReachCommand
from inhand.asterisk_test.reach_figure import reach_figure
from inhand.asterisk_test.results import write_json
from inhand.cli.terminal import print_table, progress, say
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import check_fit
from inhand.hands.reach.limits import ReachConfig
from inhand.plots.save import save_figure
from inhand.tasks.primitives import parse_directions, with_twists
from inhand.tasks.reach import Limit, limits, start_grip
from inhand.versions import versions

FINEST_MM = 0.5
"""Finest step that ends in minutes [mm]; 2 mm takes seconds."""
MARK = "reach.json"
"""The file that marks a folder as one of this command."""


def run_reach(command: ReachCommand) -> None:
    """Check everything, compute the limits, and write table, JSON and figures."""
    hand, spec = load_hand(command.hand), load_object(command.object)
    config = ReachConfig(
        resolution=resolution_of(command), friction=command.friction, rotation=np.deg2rad(command.rotation_deg)
    )
    primitives = parse_directions(command.directions)
    if command.twist:
        primitives = with_twists(primitives, command.twist)
    check_fit(hand, spec)
    friction = hand.friction * spec.friction if command.friction is None else command.friction
    subtitle = f"{command.hand}, {command.object}, {_assumed(command, friction)}"
    with run_folder(command.out, overwrite=command.overwrite, mark=MARK) as folder:
        start = start_grip(hand, spec, config)
        with progress() as tell:
            done = itertools.count(1)
            found = limits(hand, spec, primitives, config, lambda name: tell(name, next(done), len(primitives)))
        for twist, shown in _by_twist(found).items():
            held = f", holding {twist:+g} deg" if twist else ""
            figure = reach_figure((hand, spec), start, shown, f"Reach{held} [mm]", subtitle)
            name = f"reach_{'p' if twist < 0 else 'm'}{abs(twist):g}.png" if twist else "reach.png"
            save_figure(figure, folder / name)
        content = {
            "limits": [_entry(limit) for limit in found],
            "config": asdict(command),
            "friction": friction,
            "versions": versions(),
        }
        write_json(content, folder / MARK)
    print_table("Reach", ("Direction", "Limit"), [(f.primitive.name, _shown(f)) for f in found])
    say(subtitle)
    say(f"Written to {command.out}: {MARK} and the figures")


def resolution_of(command: ReachCommand) -> float:
    """Return the step along path and outline [m].

    Raises:
        InputError: a step that cannot be, or one that would take hours.
    """
    if not (np.isfinite(command.resolution_mm) and command.resolution_mm >= FINEST_MM):
        hint = "half the step takes about four times as long"
        raise InputError(f"--resolution-mm {command.resolution_mm:g}: give {FINEST_MM:g} or more; {hint}")
    return command.resolution_mm / 1e3


def _by_twist(found: Iterable[Limit]) -> dict[float, list[Limit]]:
    """Return the limits of translations by the twist they hold [deg]."""
    by: dict[float, list[Limit]] = {}
    for each in found:
        if each.primitive.angle_deg is not None:
            by.setdefault(each.primitive.rotation_deg, []).append(each)
    return by


def _assumed(command: ReachCommand, friction: float) -> str:
    bound = f", rotation up to {command.rotation_deg:g} deg" if command.rotation_deg else ""
    return f"friction {friction:g}{bound}"


def _shown(limit: Limit) -> str:
    if limit.primitive.angle_deg is None:
        return f"{np.rad2deg(limit.distance):.1f} deg"
    return f"{1e3 * limit.distance:.1f} mm"


def _entry(limit: Limit) -> dict[str, Any]:
    """Return a limit as the JSON has it, with the last grip."""
    turns, end = limit.primitive.angle_deg is None, limit.end
    return {
        "direction": limit.primitive.name,
        "angle_deg": limit.primitive.angle_deg,
        "rotation_deg": limit.primitive.rotation_deg,
        "limit_mm": None if turns else 1e3 * limit.distance,
        "limit_deg": float(np.rad2deg(limit.distance)) if turns else None,
        "end_pose_mm_deg": [*(1e3 * end.pose[:2]).tolist(), float(np.rad2deg(end.pose[2]))],
        "end_contacts_mm": (1e3 * end.contacts).tolist(),
        "end_joints_deg": np.rad2deg(end.joints).tolist(),
    }
