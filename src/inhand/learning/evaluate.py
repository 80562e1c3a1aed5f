"""Evaluation as a function: a policy in, its trials beside the expert's from the same starts out."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from inhand.asterisk_test.asterisk import Simulate, notes_for, people_of, run_setup, setup_of
from inhand.asterisk_test.comparison import ControllerTrials, with_more
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import HumanFolder
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import Setup
from inhand.asterisk_test.spatial.run import SpatialSetup
from inhand.control.catalogue import find_controller
from inhand.control.draws import disturbance_notes
from inhand.control.names import SHIPPED
from inhand.control.policy import Policy
from inhand.control.spatial_catalogue import SHIPPED as SHIPPED_IN_SPACE
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.trial import AnyTrial, load_all
from inhand.errors import InputError
from inhand.folders import MARK
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, is_spatial_hand, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import load_held
from inhand.learning.commands import EXPERT, EvaluateConfig
from inhand.learning.progress import JOURNAL, Learned, read_learning
from inhand.learning.recipe import SEEN
from inhand.learning.space_pools import TESTED
from inhand.records import checked, configured
from inhand.shown import path_of, saved
from inhand.sim.disturbance import disturbance_of
from inhand.sim.names import UNTOLD, Engine

if TYPE_CHECKING:
    from inhand.learning.report import Compared

DEFAULT = EvaluateConfig()
"""What is evaluated where nothing else is asked for."""


@dataclass(frozen=True, eq=False)
class Ready:
    """What an evaluation needs, checked."""

    test: AsteriskConfig
    """The policy's run of the Asterisk Test."""
    setup: Setup | SpatialSetup
    """What the policy does,"""
    expert: Setup | SpatialSetup
    """and the expert."""
    people: HumanFolder
    """Human trials to set beside both."""


def evaluate(
    run: str | os.PathLike[str] = DEFAULT.run,
    *,
    hand: str | Path | HandSpec | SpatialHand | None = None,
    object: str | Path | ObjectSpec | SolidSpec | None = None,
    trials: int = DEFAULT.trials,
    episodes: int = DEFAULT.episodes,
    seed: int = DEFAULT.seed,
    engine: Engine = DEFAULT.engine,
    human: str | Path | None = None,
    **settings: Any,
) -> Compared:
    """Run a learned policy and the expert from the same starts; nothing is written before `save`.

    Args:
        run: a training run or its folder, that of a policy, or rl, the policy of the package.
        hand: a name, a TOML file or a spec; None for the one that the policy was trained with.
        object: the same.
        trials: for each of the 16 directions, in space of 56 primitives, for table and figures; the first of the
            episodes.
        episodes: episodes in which lost objects are counted, spread evenly over the directions.
        seed: of the start noise.
        engine: planar, mujoco or bullet.
        human: folder of recorded human trials to set beside both.
        settings: other fields of `EvaluateConfig`, such as last and noise_mm.

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    settings |= {"run": path_of("run", run), "trials": trials, "episodes": episodes, "seed": seed, "engine": engine}
    settings |= {"hand": hand and hand_name(hand), "object": object and object_name(object)}
    settings["human"] = None if human is None else Path(path_of("human", human))
    settings |= disturbance_of(settings)
    config = configured(EvaluateConfig, settings)
    return finish_evaluation(config, ready_evaluation(config))


def ready_evaluation(config: EvaluateConfig) -> Ready:
    """Return everything that an evaluation needs, looked at before anything is simulated or written.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    name = name_of(config)
    space = config.hand is not None and is_spatial_hand(config.hand)
    policy = (find_spatial_controller(name) if space else find_controller(name)).policy
    if policy is None:
        raise InputError(
            f"{name!r} is no learned policy: give the folder of a run of `inhand train`; for other controllers there is"
            " `inhand asterisk --controller`"
        )
    test = _test(config, name, policy.trained)
    people = HumanFolder((), ()) if is_spatial_hand(test.hand) else people_of(test)
    setup, expert = (with_more(setup_of(replace(test, controller=by)), config.episodes) for by in (name, EXPERT))
    return Ready(test, setup, expert, people)


def finish_evaluation(config: EvaluateConfig, known: Ready, run: Simulate = run_setup) -> Compared:
    """Run both, measure, and return the finished evaluation."""
    test, entry = known.test, known.setup.controller
    both = [
        _evaluation(run(replace(test, controller=setup.controller.name), setup), config.trials)
        for setup in (known.setup, known.expert)
    ]
    notes = (
        *known.people.notes,
        *notes_for(entry, load_held(test.hand, test.object), test),
        *disturbance_notes(config, entry.reads, entry.contract, space=isinstance(known.setup, SpatialSetup)),
    )
    trained = entry.policy.trained if isinstance(entry.policy, Policy) else {}
    return _compared(config, test, (both[0], both[1]), trained, people=known.people.trials, notes=notes)


def _compared(
    config: EvaluateConfig,
    test: AsteriskConfig,
    both: tuple[ControllerTrials, ControllerTrials],
    trained: dict[str, Any],
    **told: Any,
) -> Compared:
    """Return an evaluation in the plane or in space, with the record of the policy's training."""
    from inhand.learning.report import Compared
    from inhand.learning.spatial_report import SpatialCompared

    made = SpatialCompared if is_spatial_hand(test.hand) else Compared
    return made(config, test, *both, trained, learned=_learned(config.run), **told)


def load_evaluation(folder: Path) -> Compared:
    """Return the evaluation of a folder, measured again from its trials; the policy itself need not be there.

    Raises:
        InputError: there is none that can be read.
    """
    config, content = saved(folder, MARK, EvaluateConfig, engine=UNTOLD)
    entries = checked("trials", content.get("trials"), list[dict[str, Any]])
    order = {(entry.get("direction"), entry.get("trial")): place for place, entry in enumerate(entries)}

    def place(trial: AnyTrial) -> int:
        return order.get((trial.passport.primitive, trial.passport.trial), len(order))

    policy, expert = (
        _evaluation(tuple(sorted(load_all(each), key=place)), config.trials) for each in (folder, folder / EXPERT)
    )
    trained = checked("policy", content.get("policy"), dict[str, Any])
    passport = policy.trials[0].passport
    known = {"hand": passport.hand.name, "object": passport.object.name} | trained
    test = _test(config, policy.name, known)
    notes: tuple[str, ...] = checked("notes", content.get("notes", ()), tuple[str, ...])
    people = () if is_spatial_hand(test.hand) else people_of(test).trials
    return _compared(config, test, (policy, expert), trained, people=people, notes=notes)


def name_of(config: EvaluateConfig) -> str:
    """Return what the policy to evaluate is called as a controller.

    Raises:
        InputError: --last of something that has none.
    """
    if not config.last:
        return config.run
    if config.run in {*SHIPPED, *SHIPPED_IN_SPACE} or not (Path(config.run) / "last").is_dir():
        raise InputError(f"--last: {config.run} holds no last policy; give the folder of a run of `inhand train`")
    return str(Path(config.run) / "last")


def _test(config: EvaluateConfig, name: str, trained: dict[str, Any]) -> AsteriskConfig:
    """Return the run of the Asterisk Test that evaluates a policy, by default with what it was trained with."""
    same = ("engine", "human", "trials", "seed", "noise_mm", "noise_deg", "disturb", "gravity", "out")
    hand = config.hand or trained["hand"]
    return AsteriskConfig(
        hand=hand,
        object=config.object or trained["object"],
        controller=name,
        directions=",".join(each.name for each in (*SEEN, *TESTED)) if is_spatial_hand(hand) else "all",
        **{field: getattr(config, field) for field in same},
    )


def _evaluation(trials: tuple[AnyTrial, ...], shown: int) -> ControllerTrials:
    return ControllerTrials(trials[0].passport.controller, trials, tuple(map(result_of_trial, trials)), shown)


def _learned(run: str) -> Learned | None:
    """Return the record of a policy's training, where its folder has one."""
    return read_learning(Path(run)) if (Path(run) / JOURNAL).is_file() else None
