"""The Asterisk Test as a function: what to run in, a finished run out; what reports is imported once all is run."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from inhand.asterisk_test.beside import Beside, load_beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import HumanFolder, read_human_folder
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import Setup, prepare, simulate
from inhand.asterisk_test.spatial.run import SpatialSetup, prepare_in_space, simulate_asterisk_in_space
from inhand.asterisk_test.table import metric_faults
from inhand.asterisk_test.user_metrics import METRICS, UserMetric
from inhand.control.catalogue import CONTROLLERS, ControllerEntry
from inhand.control.draws import disturbance_notes
from inhand.control.loop import Told
from inhand.control.notes import notes_of
from inhand.control.run_config import HeldConfig
from inhand.control.spatial_catalogue import SpatialEntry, notes_in_space, refuse_of_space
from inhand.control.trial import AnyTrial
from inhand.errors import InputError
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, is_spatial_hand, object_name
from inhand.hands.spatial.gravity import gravity_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.records import configured
from inhand.shown import listed, several
from inhand.sim.disturbance import disturbance_of
from inhand.sim.disturbance_files import disturbance_name
from inhand.sim.engines import engine_in_space
from inhand.sim.names import Engine

if TYPE_CHECKING:
    from inhand.asterisk_test.report import Run
    from inhand.asterisk_test.spatial.report import SpatialRun

ONE = "One grasp, the same in every trial, for all directions and turns."
"""What a reader is told of a run with one grasp."""
DEFAULT = AsteriskConfig()
"""What is run where nothing else is asked for."""
AnySetup: TypeAlias = Setup | SpatialSetup
"""What is simulated, in the plane or in space."""
Simulate = Callable[[AsteriskConfig, Any], tuple[Any, ...]]
"""Runs a setup and returns its trials; the command line shows how far it is."""


@dataclass(frozen=True, eq=False)
class Ready:
    """What a run needs, checked."""

    setup: AnySetup
    """What is simulated."""
    people: HumanFolder
    """Human trials to follow or to set beside."""
    beside: tuple[Beside, ...]
    """Earlier runs to set beside."""
    name: str
    """What tells the run from them."""


def asterisk(
    hand: str | Path | HandSpec | SpatialHand = DEFAULT.hand,
    object: str | Path | ObjectSpec | SolidSpec = DEFAULT.object,
    controller: object = DEFAULT.controller,
    *,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    trials: int = DEFAULT.trials,
    seed: int = DEFAULT.seed,
    engine: Engine = DEFAULT.engine,
    metrics: Sequence[str | UserMetric] = (),
    beside: str | Path | Sequence[str | Path] = (),
    label: str | Sequence[str] = (),
    **settings: Any,
) -> Run | SpatialRun:
    """Run the Asterisk Test and return its trials, results, table and figure; nothing is written before `save`.

    Args:
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file, an outline (`part.dxf:unit=mm:mass_kg=0.05`) or a spec.
        controller: a name, the folder of a training, `FILE.py:NAME`, a class of yours, or `inhand.policy(...)`.
        directions: words of the command line, names, or degrees counter-clockwise from +x.
        trials: for each direction.
        seed: of the start noise.
        engine: planar, mujoco or bullet.
        metrics: names of registered metrics, or functions of a trial.
        beside: folders of at most two earlier runs, to set beside this one.
        label: names of this run and of those, instead of what differs between them.
        settings: other fields of `AsteriskConfig`, such as twist, noise_mm and human.

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    settings |= {"directions": listed(directions), "trials": trials, "seed": seed, "engine": engine}
    settings |= {"hand": hand_name(hand), "object": object_name(object)}
    settings["controller"] = CONTROLLERS.name_of(controller)
    settings["metrics"] = [METRICS.name_of(metric) for metric in several(metrics)]
    settings |= disturbance_of(settings)
    settings |= {"label": several(label), "beside": several(beside)}
    config = configured(AsteriskConfig, settings)
    return finish(config, ready(config))


def ready(config: AsteriskConfig) -> Ready:
    """Return everything that a run needs, looked at before anything is simulated or written.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    people = HumanFolder((), ()) if is_spatial_hand(config.hand) else people_of(config)
    setup = setup_of(config, people.trials)
    space = isinstance(setup, SpatialSetup)
    engine = engine_in_space(config.engine) if space else config.engine
    own = [setup.hand.name, setup.object.name, setup.controller.name, engine, disturbance_name(config.disturb)]
    own += [gravity_name(setup.gravity)] if isinstance(setup, SpatialSetup) else []
    name, beside = load_beside(config.beside, own, config.label, space=space)
    return Ready(setup, people, beside, name)


def setup_of(config: AsteriskConfig, people: Sequence[HumanTrial] = ()) -> AnySetup:
    """Return what a run simulates, in the plane, where it may follow people's paths, or in space.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    if is_spatial_hand(config.hand):
        if config.regrasp:
            raise InputError(
                f"--regrasp with {config.hand}, a hand in space, which has no floor on which an object rests meanwhile:"
                " leave it out, or use a hand in the plane (2v2_50.50_50.50_1.1_53)"
            )
        return prepare_in_space(config)
    refuse_of_space(config.hand, config.gravity)
    if config.one_grasp:
        raise InputError(
            f"--one-grasp with {config.hand}, a hand in the plane, which takes a grasp for each direction: leave it"
            " out, or use a hand in space (3f_60.60_40_10)"
        )
    for metric in config.metrics:
        METRICS.known(metric)
    return prepare(config, people)


def run_setup(
    config: AsteriskConfig, setup: AnySetup, progress: Told | None = None, threads: int = 0
) -> tuple[AnyTrial, ...]:
    """Run every trial of a setup, in the plane or in space, on some threads, 0 for every core."""
    if isinstance(setup, SpatialSetup):
        return simulate_asterisk_in_space(config, setup, progress, threads)
    return simulate(config, setup, progress, threads)


def notes_for(entry: ControllerEntry | SpatialEntry, held: AnyPair, config: HeldConfig) -> tuple[str, ...]:
    """Return what a reader should know of a controller with a hand and an object, a sentence each."""
    if isinstance(entry, SpatialEntry):
        return notes_in_space(entry, *held) if isinstance(held, SpatialPair) else ()
    return notes_of(entry, config.hand, config.object)


def finish(config: AsteriskConfig, known: Ready, run: Simulate = run_setup) -> Run | SpatialRun:
    """Simulate, measure, and return the finished run."""
    setup = known.setup
    trials = run(config, setup)
    results = tuple(result_of_trial(trial, compatible=config.compatible, metrics=config.metrics) for trial in trials)
    if isinstance(setup, SpatialSetup):
        from inhand.asterisk_test.spatial.report import SpatialRun

        notes = notes_in_space(setup.controller, setup.hand, setup.object) + ((ONE,) if config.one_grasp else ())
        notes += disturbance_notes(config, setup.controller.reads, setup.controller.contract, space=True)
        return SpatialRun(config, trials, results, notes=notes, beside=known.beside, label=known.name)
    from inhand.asterisk_test.report import Run

    entry = setup.controller
    notes = (
        *known.people.notes,
        *notes_of(entry, config.hand, config.object),
        *disturbance_notes(config, entry.reads, entry.contract),
    )
    for sentence in metric_faults(results):
        logging.getLogger("inhand").warning(sentence)
    return Run(config, trials, results, known.people.trials, notes, known.beside, known.name)


def people_of(config: AsteriskConfig) -> HumanFolder:
    """Return the recorded human trials that a run asks for."""
    if config.human is not None:
        return read_human_folder(config.human)
    if config.paths == "human":
        raise InputError("--paths human needs the recorded trials to follow: give their folder with --human DIR")
    return HumanFolder((), ())
