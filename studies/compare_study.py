"""Structured against end to end: what is trained, on what, and what every controller reaches on every task.

Structured: one policy trained on the 8 directions, sequenced (`inhand.tracing`); `structured` on real senses in worlds
that differ, `structured-privileged` on perfect knowledge. End to end: their algorithms and networks and as many
environment steps, trained on one whole task. It comes in three kinds. `guided-sensed` and `guided` see what the policy
of primitives on senses and the privileged one see, their aim moved along the task's path at every decision. `unguided`
is privileged, too; it sees how far it has come and where the task ends, and must know the path itself.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from compare_config import CompareConfig
from inhand.asterisk_test.clusters import check_spread, spread
from inhand.control.catalogue import find_controller, learned, policy_of
from inhand.control.ik import IkConfig
from inhand.control.loop import Bench
from inhand.control.run_config import SpreadConfig
from inhand.control.trial import write_json
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.learning.config import Training
from inhand.learning.presets import default, privileged
from inhand.learning.progress import CHECKPOINT, JOURNAL
from inhand.learning.runs import finished, resume, train
from inhand.learning.train import SILENT
from inhand.records import table_of
from inhand.sim.disturbance_files import disturbance_name, load_disturbance
from inhand.sim.drawn import draw
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.tracing.follow import follow
from inhand.tracing.plan import Plan
from inhand.tracing.tasks import find_task, fitting_plan
from inhand.tracing.trace import trace_of

J = TypeVar("J")
Kind = Literal["structured", "structured-privileged", "guided-sensed", "guided", "unguided"]
"""How a controller was trained."""
LAYOUTS = {"guided-sensed": "senses", "guided": "grip", "unguided": "whole"}
"""What a controller that is trained end to end sees."""
NOISE = np.array([0.001, 0.001, np.deg2rad(1.0)])
"""Standard deviations of the object's start [m, m, rad]."""
TEST_SEED = 500
"""Added to an episode's number for what its task draws."""
PERIOD = SUBSTEPS * SceneSpec.timestep
"""Time between two decisions [s]."""
ENOUGH = 0.9
"""Mean completion at which a controller has adapted to a task."""
IMITATE = 4000
"""Updates that fit an actor to the demonstrations of an adaptation."""
Told = Callable[[str, int, int], None]
"""Told what is being done, how far it is, and how far it has to go."""


@dataclass(frozen=True)
class Contestant:
    """One training, or the expert."""

    kind: Kind | Literal["expert"]
    """How it was trained."""
    task: str
    """The task it was trained on; empty for primitives and for the expert."""
    seed: int
    """Seed of its training."""

    @property
    def name(self) -> str:
        """Name without the seed."""
        return self.kind if not self.task else f"{self.kind}, {self.task}"

    @property
    def folder(self) -> str:
        """Name of its folder."""
        return f"{self.kind}{'_' if self.task else ''}{self.task.replace(':', '_')}-{self.seed}"


def contestants(config: CompareConfig) -> list[Contestant]:
    """Return every training of a study, and the expert."""
    staged: tuple[Kind, ...] = ("structured", "structured-privileged")
    kinds: tuple[Kind, ...] = ("guided-sensed", "guided", "unguided")
    trained = [Contestant(kind, "", seed) for kind in staged for seed in config.seeds]
    trained += [Contestant(kind, task, seed) for kind in kinds for task in config.tasks for seed in config.seeds]
    return [Contestant("expert", "", 0), *trained]


def check_compare(config: CompareConfig) -> None:
    """Refuse what cannot be compared, before anything is trained.

    Raises:
        InputError: the text names the setting.
    """
    held = Held(load_hand(config.hand), load_object(config.object))
    if not config.tasks or not config.seeds or not config.disturb:
        raise InputError("give at least one of --tasks, one of --seeds and one of --disturb")
    for level in config.disturb:
        load_disturbance(level)
    for task in (*config.tasks, *config.others):
        if find_task(task).wall is not None:
            raise InputError(f"task {task!r} needs a wall, and training worlds have none: compare on other tasks")
        find_task(task).plan(held, np.random.default_rng(0))
    if config.episodes < 1 or min(config.adaptation, default=1) < 1:
        raise InputError("--episodes and every number of --adaptation must be at least 1")
    if not 0 < config.budget <= 10:
        raise InputError(f"--budget {config.budget:g}: give a share of the default's steps, more than 0, at most 10")
    check_spread(config)
    path = config.out / "study.json"
    if config.out.is_dir() and any(config.out.iterdir()) and not path.is_file():
        raise InputError(f"--out {config.out} holds files that are no study of inhand; give another folder")
    config.out.mkdir(parents=True, exist_ok=True)
    spread_by = {field.name for field in fields(SpreadConfig)}
    settings = {name: value for name, value in table_of(asdict(config)).items() if name not in spread_by}
    if path.is_file() and (there := json.loads(path.read_text())) != settings:
        differing = [name for name in settings if settings[name] != there.get(name)]
        raise InputError(
            f"--out {config.out} holds a study of other settings ({', '.join(differing)}); give another folder"
        )
    path.write_text(json.dumps(settings, indent=1) + "\n")


def training_of(config: CompareConfig, who: Contestant, demonstrations: int | None = None) -> Training:
    """Return what a contestant trains: the default on the 8 directions, or the same steps on a whole task.

    Args:
        config: the study's.
        who: the contestant.
        demonstrations: of a trial of adaptation, which imitates so many and learns nothing after them; None trains.
    """
    sensed = who.kind in {"structured", "guided-sensed"}
    made = default() if sensed else privileged()
    base = replace(made, preset=who.kind, directions="train", seed=who.seed, hand=config.hand, object=config.object)
    horizon = horizon_of(config, who.task) if who.task else base.interface.horizon
    share = config.budget * base.interface.horizon / horizon
    recipe = replace(base.recipe, episodes=max(round(share * base.recipe.episodes), 1))
    made = replace(base, recipe=recipe, episodes=max(round(share * base.episodes), 1))
    if sensed:
        made = replace(made, relabelled=_relabelled(made, config.budget, base.interface.horizon / horizon))
    else:
        made = replace(made, evaluate_every=max(round(share * base.evaluate_every), 1))
    return _end_to_end(made, who, horizon, demonstrations) if who.task else made


def _end_to_end(made: Training, who: Contestant, horizon: int, demonstrations: int | None) -> Training:
    """Return the same training on a whole task, with what a contestant sees."""
    recipe = replace(made.recipe, midway=0.0, whole=1.0, grip_spread=0.0, turns=0.0, legs=0.0)
    interface = replace(made.interface, observation=LAYOUTS[who.kind], horizon=horizon)
    made = replace(made, task=who.task, interface=interface, recipe=recipe)
    if demonstrations is None:
        return made
    few = replace(recipe, episodes=demonstrations)
    return replace(made, recipe=few, imitate=IMITATE, rounds=0, warm_up=0, episodes=1, updates=100)


def _relabelled(made: Training, budget: float, shorter: float) -> int:
    """Return the episodes that a round of a training on senses relabels: it has the steps of one on perfect knowledge.

    Its own episodes are so much `shorter` than those that it trains with, of which it then has fewer.
    """
    other = privileged()
    steps = budget * (other.recipe.episodes + other.episodes) * other.interface.horizon
    left = steps * shorter / made.interface.horizon - made.recipe.episodes - made.episodes
    return max(round(left / made.rounds), 1)


def horizon_of(config: CompareConfig, task: str) -> int:
    """Return the decisions that an episode of a task may take: a fifth more than the expert needs, and time to hold."""
    held = Held(load_hand(config.hand), load_object(config.object))
    plans = [find_task(task).plan(held, np.random.default_rng(seed)) for seed in range(8)]
    longest = max(plan.way[-1] / IkConfig().speed + sum(leg.stay for leg in plan.legs) for plan in plans)
    return 10 * math.ceil((1.2 * float(longest) / PERIOD + 60) / 10)


def trained(config: CompareConfig, told: Told) -> None:
    """Train every contestant whose folder is not finished; one that was stopped goes on."""
    everybody = [who for who in contestants(config) if who.kind != "expert"]
    waiting = [who for who in everybody if not finished(config.out / "runs" / who.folder)]
    _each(partial(_trained, config), waiting, config, told)


def _each(work: Callable[[J], str], jobs: Sequence[J], config: CompareConfig, told: Told) -> None:
    """Do pieces of the study where it says, and tell each, by what it is called, as it ends."""
    for number, name in enumerate(spread(work, jobs, config)):
        told(name, number, len(jobs))


def _trained(config: CompareConfig, who: Contestant) -> str:
    _train(training_of(config, who), config.out / "runs" / who.folder)
    return f"{who.name}, seed {who.seed}"


def _train(training: Training, folder: Path) -> None:
    if finished(folder):
        return
    if (folder / CHECKPOINT).is_file():
        resume(folder, SILENT)
    else:
        train(training, folder, SILENT, overwrite=True)


def evaluated(config: CompareConfig, told: Told) -> list[dict[str, Any]]:
    """Return what every contestant reached in every episode of every task and disturbance; kept files are read."""
    tasks = (*config.tasks, *config.others)
    every = [(who, task, level) for level in config.disturb for who in contestants(config) for task in tasks]
    _each(partial(_tried, config), [each for each in every if not _result(config, *each).is_file()], config, told)
    return [json.loads(_result(config, *each).read_text()) for each in every]


def _result(config: CompareConfig, who: Contestant, task: str, level: str) -> Path:
    return config.out / "results" / f"{who.folder}_on_{task.replace(':', '_')}_at_{disturbance_name(level)}.json"


def _tried(config: CompareConfig, case: tuple[Contestant, str, str]) -> str:
    who, task, level = case
    episodes = _episodes(config, *case)
    content = {"contestant": asdict(who), "task": task, "disturb": disturbance_name(level), "episodes": episodes}
    write_json(content, _result(config, *case))
    return f"{who.name} on {task}, {disturbance_name(level)}"


def _episodes(config: CompareConfig, who: Contestant, task: str, level: str) -> list[dict[str, Any]]:
    """Return what one contestant reached in each episode of a task; draws, starts and worlds are the same for all."""
    held = Held(load_hand(config.hand), load_object(config.object))
    entry = find_controller("ik")
    if who.kind != "expert":
        entry = learned(*policy_of(config.out / "runs" / who.folder))
    plans = _plans(held, task, config.episodes)
    noise = [np.random.default_rng((TEST_SEED, k)).standard_normal(3) for k in range(config.episodes)]
    starts = held.start + NOISE * np.stack(noise)
    spec = load_disturbance(level)
    worlds = [draw(spec, (TEST_SEED, k), held.hand.n_joints) for k in range(config.episodes)] if spec else None
    found = follow(held, entry, plans, starts, Bench(), seed=who.seed, disturbed=worlds)
    return [asdict(trace_of(each)) for each in found]


@lru_cache(maxsize=16)
def _plans(held: Held, task: str, count: int) -> tuple[Plan, ...]:
    """Return the plan of each episode: drawn until one grip can carry the object through it."""
    draws = [np.random.default_rng(TEST_SEED + k) for k in range(count)]
    return tuple(fitting_plan(find_task(task), held, rng, f"task {task}, episode {k}") for k, rng in enumerate(draws))


def adapted(config: CompareConfig, told: Told) -> list[dict[str, Any]]:
    """Return, of every task and kind of training end to end, how complete a few demonstrations alone make it.

    Numbers of demonstrations are tried in their order until the mean completion is `ENOUGH`.
    """
    if not config.adaptation:
        return []
    every = [who for who in contestants(config) if who.task]
    _each(partial(_adapted, config), every, config, told)
    return [entry for who in every for entry in _adaptation(config, who)]


def _adapted(config: CompareConfig, who: Contestant) -> str:
    list(_adaptation(config, who))
    return f"adapting {who.name}, seed {who.seed}"


def _adaptation(config: CompareConfig, who: Contestant) -> Iterator[dict[str, Any]]:
    for count in sorted(config.adaptation):
        path = config.out / "results" / f"{who.folder}_from_{count}.json"
        if not path.is_file():
            folder = config.out / "adaptation" / f"{who.folder}_{count}"
            training = training_of(config, who, count)
            _train(training, folder)
            lines = [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()]
            first = next(line for line in lines if line["kind"] == "evaluation")
            steps = count * training.interface.horizon
            told = {"demonstrations": count, "steps": steps, "completion": first["fraction"]}
            write_json({"contestant": asdict(who), **told, "dropped": first["dropped"] / first["trials"]}, path)
        entry = json.loads(path.read_text())
        yield entry
        if entry["completion"] >= ENOUGH:
            return
