"""The best hands in simulation: how far controllers carry what reach says that hands could carry."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from inhand.aside import Aside
from inhand.asterisk_test.cells import differences
from inhand.asterisk_test.clusters import spread
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.design.asked import Asked
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.looked import Looked
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import Assignment, Setup, prepare, simulate
from inhand.control.catalogue import check_known, find_controller
from inhand.control.trial import write_json
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.records import read_json, read_record, table_of
from inhand.sim.names import Engine
from inhand.tasks.paths import path_of, stacked, whole_path
from inhand.versions import versions


@dataclass(frozen=True, eq=False)
class Bout:
    """A hand, an object and a controller, to be simulated."""

    hand: HandSpec
    object: ObjectSpec
    asked: Asked
    config: AsteriskConfig
    """Controller, engine and the first seed."""
    seeds: int
    path: Path
    """Its file."""

    @property
    def settings(self) -> dict[str, Any]:
        """Everything that its numbers depend on, as JSON holds it."""
        config, held = self.config, Held(self.hand, self.object)
        policy = find_controller(config.controller, held).policy
        numbers = {"seed": config.seed, "seeds": self.seeds, "engine": config.engine, "controller": config.controller}
        known = {"policy": None if policy is None else policy.digest, "versions": versions()}
        return table_of(
            {"hand": self.hand, "object": self.object, "directions": self.asked.primitives} | numbers | known
        )


@dataclass(frozen=True)
class Fought:
    """What a simulation came to; the content of its file."""

    hand: str
    object: str
    controller: str
    reason: str | None
    """Why it could not be run, None where it ran."""
    distances: tuple[tuple[float, ...], ...]
    """How far each seed carried the object in each direction [mm]; a turn counts as an arc."""
    kept: int
    """Trials that had the object in the hand at their end."""
    settings: dict[str, Any]

    @property
    def label(self) -> str:
        """What is told of it."""
        return f"{self.controller}, {self.hand} with {self.object}"


@dataclass(frozen=True, eq=False)
class Final:
    """A hand in simulation, with every object."""

    looked: Looked
    fought: dict[str, tuple[Fought, ...]]
    """By controller, one for each object."""
    means: dict[str, float]
    """Weighted mean distance by controller [mm]; of those that ran."""

    def distances(self, controller: str) -> Array:
        """Return distances `(O, D)` [mm], means over the seeds."""
        return np.array([np.mean(each.distances, axis=0) for each in self.fought[controller]])

    def reason(self, controller: str) -> str | None:
        """Return why a controller could not run, None where it did."""
        return next((each.reason for each in self.fought[controller] if each.reason is not None), None)


def finals(
    config: DesignConfig, asked: Asked, hands: Sequence[Looked], folder: Path, tell: Callable[[str], None]
) -> list[Final]:
    """Return hands in simulation; what the folder holds of the same settings is not computed again."""
    bouts = [
        _bout(config, asked, (hand.hand, thing), controller, folder)
        for hand in hands
        for controller in config.controllers
        for thing in asked.objects
    ]
    found = {bout.path: there for bout in bouts if (there := _read(bout)) is not None}
    waiting = [bout for bout in bouts if bout.path not in found]
    for there in found.values():
        tell(there.label)
    for fought in spread(fight, waiting, config):
        tell(fought.label)
        found[_path(folder, fought.hand, fought.object, fought.controller)] = fought
    return [_final(config, asked, hand, found, folder) for hand in hands]


def read_finals(config: DesignConfig, asked: Asked, hands: Sequence[Looked], folder: Path) -> list[Final]:
    """Return hands in simulation as the files of a folder have them, whatever version computed them.

    Raises:
        InputError: a file that is missing or cannot be read.
    """
    pairs = [(hand.hand.name, thing.name) for hand in hands for thing in asked.objects]
    paths = [_path(folder, *pair, controller) for pair in pairs for controller in config.controllers]
    found = {}
    for path in paths:
        try:
            found[path] = read_record(read_json(path.read_bytes()), Fought)
        except (OSError, InputError) as error:
            raise InputError(f"{path} is no simulation of a design study: {error}") from error
    return [_final(config, asked, hand, found, folder) for hand in hands]


def _final(config: DesignConfig, asked: Asked, hand: Looked, found: dict[Path, Fought], folder: Path) -> Final:
    fought = {
        controller: tuple(found[_path(folder, hand.hand.name, thing.name, controller)] for thing in asked.objects)
        for controller in config.controllers
    }
    final = Final(hand, fought, {})
    ran = [controller for controller in config.controllers if final.reason(controller) is None]
    return Final(hand, fought, {controller: asked.mean(final.distances(controller)) for controller in ran})


def fight(bout: Bout) -> Fought:
    """Simulate, on one thread, and write the file; what cannot be run leaves the reason in it."""
    config, reason, rows, kept = bout.config, None, [], 0
    try:
        setup = _setup(bout)
        for seed in range(config.seed, config.seed + bout.seeds):
            trials = simulate(
                AsteriskConfig(controller=config.controller, engine=config.engine, seed=seed), setup, threads=1
            )
            results = [result_of_trial(trial) for trial in trials]
            rows.append(tuple(each.reached * (1.0 if each.angle_deg is not None else ARC) for each in results))
            kept += sum(each.kept for each in results)
    except (InputError, RuntimeError) as error:  # RuntimeError: the engine itself gave up
        reason = str(error)
    names = bout.hand.name, bout.object.name, config.controller
    found = Fought(*names, reason, tuple(rows), kept, bout.settings)
    write_json(found, bout.path)
    return found


def compile_aside(aside: Aside, engine: Engine) -> None:
    """Have what simulations need compiled aside where it is not yet: at their start all cores would wait for one."""
    from inhand.compiled import is_kept

    if not is_kept("inhand.hands.pair_kernels", "common_reach"):
        aside(carry_once, engine)


def carry_once(engine: Engine) -> None:
    """Carry the usual object in one direction, which compiles what simulations need."""
    config = AsteriskConfig(directions="Out", trials=1, engine=engine)
    simulate(config, prepare(config), threads=1)


ARC = 1e3 * TURN_ARM * np.pi / 180
"""What a degree counts that a hand turns an object on the spot [mm]."""


def _setup(bout: Bout) -> Setup:
    check_fit(bout.hand, bout.object)
    held, primitives = Held(bout.hand, bout.object), bout.asked.primitives
    entry = find_controller(bout.config.controller, held)
    assignments = tuple(Assignment(each, path_of(each), 1) for each in primitives)
    check_known(entry, held, stacked([whole_path(each.path) for each in assignments]))
    return Setup(bout.hand, bout.object, entry, assignments)


def _bout(config: DesignConfig, asked: Asked, held: tuple[HandSpec, ObjectSpec], controller: str, folder: Path) -> Bout:
    hand, thing = held
    run = AsteriskConfig(controller=controller, engine=config.engine, seed=config.seed)
    return Bout(hand, thing, asked, run, config.seeds, _path(folder, hand.name, thing.name, controller))


def _path(folder: Path, hand: str, thing: str, controller: str) -> Path:
    names = (re.sub(r"[^\w.+-]", "-", name) for name in (hand, thing, controller))
    return folder / f"final_{'__'.join(names)}.json"


def _read(bout: Bout) -> Fought | None:
    """Return what a file holds of the same settings; None where there is none."""
    try:
        found = read_record(read_json(bout.path.read_bytes()), Fought)
    except (OSError, InputError):
        return None
    return None if differences(found.settings, bout.settings) else found
