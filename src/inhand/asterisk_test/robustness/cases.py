"""The cells of a study of robustness: every controller under every disturbance."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from inhand.asterisk_test.asterisk import setup_of
from inhand.asterisk_test.cells import job_of
from inhand.asterisk_test.clusters import check_spread
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.spread import Plan, planned
from inhand.control.policy import Policy
from inhand.control.run_config import DrawConfig, GravityConfig, HeldConfig
from inhand.errors import InputError, near_matches
from inhand.hands.spatial.files import is_spatial_hand
from inhand.hands.spatial.pair import load_held
from inhand.records import checked, read_json
from inhand.sim.disturbance import LEVELS, SINGLES, Differences, told
from inhand.sim.disturbance_files import NONE, disturbance_name, load_disturbance, parted
from inhand.sim.drawn import check_drawn
from inhand.versions import versions

CASES = "cases"
"""Folder of the cells' files inside that of the study."""
GROUPS = {"levels": LEVELS, "singles": SINGLES}
"""Words for several disturbances."""
FLOORS = tuple(each for each in SINGLES if each.differs.floor != Differences.floor)
"""Those of the floor, which hands in space have not."""
FINISHED = "finished.json"
"""What the folder of a training that has come to its end says it took."""


@dataclass(frozen=True)
class Case:
    """A disturbance."""

    name: str
    """What runs call it."""
    word: str
    """What `--disturb` calls it."""
    told: str = "nothing is disturbed"
    """What it changes, in one line."""
    row: bool = True
    """Whether the tables tell it, or only a curve."""


@dataclass(frozen=True)
class Contender:
    """A controller of a study."""

    name: str
    word: str
    """What `--controller` calls it."""
    reads: str
    """What it reads: privileged or sensed."""
    cost: str
    """What making it took."""
    kin: dict[str, Any] | None = None
    """What it was trained with but for the seed; None where it was not trained, or not with a seed."""


def plan(config: RobustnessConfig) -> tuple[Plan, tuple[Contender, ...], tuple[Case, ...]]:
    """Return the cells of a study, its controllers and its disturbances, undisturbed first.

    Raises:
        InputError: a configuration that cannot be run, a folder that holds something else, or cells of other settings.
    """
    check_spread(config)
    if not config.controllers:
        raise InputError("--controllers names none: give at least one")
    for strength in config.strengths:
        if not strength >= 0:
            raise InputError(
                f"--strengths {strength:g}: a strength is 0, nothing, or more; 1 is the disturbance as it is"
            )
    cases = cases_of(config)
    base = AsteriskConfig(**_shared(config), directions=config.directions, trials=config.trials)
    contenders = tuple(_contender(replace(base, controller=word)) for word in config.controllers)
    held, found = load_held(config.hand, config.object), versions()
    for case in cases:
        spec = load_disturbance(case.word)
        if spec is not None:
            check_drawn(spec, *held)
    jobs = [
        job_of(
            replace(base, controller=contender.word, disturb=case.word),
            held,
            found,
            config.out / CASES,
            (contender.name, "under", case.name),
        )
        for case in cases
        for contender in contenders
    ]
    return planned(jobs, overwrite=config.overwrite), contenders, cases


def cases_of(config: RobustnessConfig) -> tuple[Case, ...]:
    """Return the disturbances of a study, each once: none, the rows of the tables, the points of the curves.

    Raises:
        InputError: an unknown name, a strength that cannot be, or two disturbances of one name.
    """
    found = {NONE: Case(NONE, NONE)}
    points = [word for curve in curves_of(config).values() for word in curve.values()]
    asked = [_case(word) for word in _words(config, config.disturbances)]
    for case in (*asked, *(replace(_case(word), row=False) for word in points)):
        if found.setdefault(case.name, case).told != case.told:
            raise InputError(f"two disturbances are called {case.name!r}: give each a name of its own")
    return tuple(found.values())


def curves_of(config: RobustnessConfig) -> dict[str, dict[float, str]]:
    """Return of each curve's disturbance, by name, the words of its points by their strength, undisturbed at 0.

    What disturbs nothing at any strength, as the word none, has no curve.

    Raises:
        InputError: an unknown name.
    """
    found: dict[str, dict[float, str]] = {}
    for word in _words(config, config.curves):
        if load_disturbance(word) is None:
            continue
        base, own = parted(word)
        points = {strength: f"{base}@{own * strength:g}" for strength in sorted({0.0, *config.strengths})}
        found[disturbance_name(word)] = points
    return found


def _case(word: str) -> Case:
    spec = load_disturbance(word)
    return Case(NONE, NONE) if spec is None else Case(spec.name, word, told(spec).removeprefix(f"{spec.name}: "))


def _words(config: RobustnessConfig, given: Sequence[str]) -> Iterator[str]:
    """Give what is known by name, groups one by one, each at the group's strength; of a floor nothing in space."""
    space = is_spatial_hand(config.hand)
    for text in given:
        base, strength = parted(text)
        if base in GROUPS:
            own = (each.name for each in GROUPS[base] if not (space and each in FLOORS))
            yield from (name if strength == 1 else f"{name}@{strength:g}" for name in own)
            continue
        near = near_matches(base, GROUPS)
        try:
            load_disturbance(text)
        except InputError as error:
            raise InputError(f"{error}; or {' and '.join(GROUPS)}, all of a kind{near}") from error
        yield text


def _shared(config: RobustnessConfig) -> dict[str, Any]:
    names = [each.name for kind in (DrawConfig, GravityConfig, HeldConfig) for each in fields(kind)]
    return {name: getattr(config, name) for name in names}


def _contender(config: AsteriskConfig) -> Contender:
    """Return the controller of a run, which could be run."""
    entry = setup_of(config).controller
    trained = None if entry.policy is None else entry.policy.trained
    kin = None if trained is None or "seed" not in trained else {k: v for k, v in trained.items() if k != "seed"}
    cost = "no training" if entry.policy is None else _cost(Path(config.controller), entry.policy)
    return Contender(entry.name, config.controller, entry.reads, cost, kin)


def _cost(folder: Path, policy: Policy) -> str:
    """Return what training a policy took, as its card or the folder of an earlier training says it."""
    if policy.cost is not None:
        return str(policy.cost)
    files = [place / FINISHED for place in (folder, folder.parent) if (place / FINISHED).is_file()]
    took = checked("content", read_json(files[0].read_bytes()), dict[str, Any]) if files else {}
    decisions, seconds = (checked(name, took.get(name), float | None) for name in ("decisions", "seconds"))
    told = [] if decisions is None else [f"{decisions:,.0f} decisions"]
    told += [] if seconds is None else [f"{seconds / 60:.1f} minutes"]
    return " in ".join(told) or "not told"
