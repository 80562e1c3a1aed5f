"""What a design study is asked, looked at before anything is computed, and what hands are compared by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from inhand.asterisk_test.clusters import check_spread
from inhand.asterisk_test.design.config import BoundsConfig, DesignConfig
from inhand.control.catalogue import find_controller
from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.family import HandFamily
from inhand.hands.files import load_object
from inhand.hands.fit import check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.engines import check_engine
from inhand.tasks.primitives import Primitive, parse_directions
from inhand.tasks.reach import start_grip

BOUNDS = {
    "finger_mm": "finger",
    "share": "share",
    "palm_mm": "palm_width",
    "link_width_mm": "link_width",
    "tip_mm": "tip_length",
}
"""Options that give bounds, and what a family calls them."""
COARSE = 4
"""Of so many directions one is looked at first."""
TRIED = 24
"""Hands that are drawn to find one that holds an object."""


@dataclass(frozen=True)
class Aim:
    """Something that is wanted of a hand."""

    label: str
    """What figures and tables call it, with its unit."""
    larger: bool
    """Whether more of it is better."""


AIMS = {
    "mean": Aim("Mean reach [mm]", larger=True),
    "least": Aim("Least reach [mm]", larger=True),
    "length": Aim("Total finger length [mm]", larger=False),
    "tolerance": Aim("Mean reach, a little off [mm]", larger=True),
}
"""What a study can aim at."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What a study is asked."""

    family: HandFamily
    """The hands to choose from."""
    objects: tuple[ObjectSpec, ...]
    """O objects."""
    primitives: tuple[Primitive, ...]
    """D directions."""
    weights: Array
    """What each object in each direction counts `(O, D)`; their sum is 1."""
    aims: tuple[str, ...]
    """Of `AIMS`."""

    @property
    def coarse(self) -> list[int]:
        """Directions that are looked at first: every fourth of those that go round; all where there are few."""
        around = [k for k, each in enumerate(self.primitives) if each.angle_deg is not None]
        around.sort(key=lambda k: (self.primitives[k].angle_deg or 0.0) % 360.0)
        chosen = sorted(around[::COARSE]) if len(around) >= 2 * COARSE else []
        return chosen if self.weights[:, chosen].sum() > 0 else list(range(len(self.primitives)))

    def mean(self, reach: Array, columns: Sequence[int] | None = None) -> float:
        """Return the weighted mean of a reach `(O, D)` over all or some directions."""
        chosen = slice(None) if columns is None else list(columns)
        return float((self.weights[:, chosen] * reach[:, chosen]).sum() / self.weights[:, chosen].sum())

    def least(self, reach: Array, columns: Sequence[int] | None = None) -> float:
        """Return the least of a reach `(O, D)` over all or some directions that count."""
        chosen = slice(None) if columns is None else list(columns)
        return float(reach[:, chosen][self.weights[:, chosen] > 0].min())

    def settings(self) -> dict[str, Any]:
        """Return everything that tells the study from others."""
        names = [spec.name for spec in self.objects], [each.name for each in self.primitives]
        return {
            "aims": ", ".join(self.aims),
            "objects": self.objects,
            "directions": self.primitives,
            "object_weights": dict(zip(names[0], self.weights.sum(axis=1).round(9).tolist(), strict=True)),
            "direction_weights": dict(zip(names[1], self.weights.sum(axis=0).round(9).tolist(), strict=True)),
            "bounds": asdict(self.family),
        }


def ask(config: DesignConfig, ready: Callable[[], None] = lambda: None) -> Asked:
    """Return what a study is asked; `ready` is called once names and numbers are right, before grips are looked for.

    Raises:
        InputError: a name, an aim, weights or numbers that cannot be, or bounds without a hand that holds an object.
    """
    for option, count in (("hands", config.hands), ("finalists", config.finalists), ("seeds", config.seeds)):
        if count < 1:
            raise InputError(f"--{option} {count}: give at least 1")
    if config.seed < 0:
        raise InputError(f"--seed {config.seed}: a seed is 0 or more")
    check_spread(config)
    check_engine(config.engine)
    for option, given in (
        ("--objects", config.objects),
        ("--aims", config.aims),
        ("--controllers", config.controllers),
    ):
        if not given or len(set(given)) < len(given):
            raise InputError(f"{option} {' '.join(given)}: name at least one, each once")
    for aim in config.aims:
        if aim not in AIMS:
            raise InputError(f"--aims: unknown aim {aim!r}{near_matches(aim, AIMS)}; allowed are {', '.join(AIMS)}")
    for name in config.controllers:
        find_controller(name)
    objects = tuple(load_object(name) for name in config.objects)
    primitives = parse_directions(config.directions)
    weights = np.outer(
        _weights("--object-weights", config.object_weights, [spec.name for spec in objects]),
        _weights("--direction-weights", config.direction_weights, [each.name for each in primitives]),
    )
    asked = Asked(family_of(config), objects, primitives, weights, config.aims)
    ready()
    for spec in objects:
        _check_held(asked.family, spec)
    return asked


def family_of(config: BoundsConfig) -> HandFamily:
    """Return the family of hands between bounds.

    Raises:
        InputError: there is none between them; the text names the option.
    """
    given = {
        "finger_mm": config.finger_mm,
        "share": config.share,
        "palm_mm": config.palm_mm,
        "link_width_mm": config.link_width_mm,
        "tip_mm": config.tip_mm,
    }
    spans = {}
    for option, (low, high) in given.items():
        if not 0 < low <= high:
            raise InputError(
                f"--{option.replace('_', '-')} {low:g} {high:g}: give the lowest value, above 0, and one no lower"
            )
        unit = 1e3 if option.endswith("_mm") else 1.0
        spans[BOUNDS[option]] = (low / unit, high / unit)
    return HandFamily(config.forms, limits=config.limits, alike=config.alike, **spans)


def _weights(option: str, given: Sequence[float], names: Sequence[str]) -> Array:
    """Return a weight for each of some names; their sum is 1."""
    weights = np.array(given or [1.0] * len(names), dtype=float)
    told = f"{option} {' '.join(f'{weight:g}' for weight in weights)}"
    if len(weights) != len(names):
        raise InputError(f"{told}: give one weight for each of {', '.join(names)}, in this order, or none")
    if weights.min() < 0:
        raise InputError(f"{told}: a weight is 0 or more")
    if weights.sum() == 0:
        raise InputError(f"{told}: they sum to nothing; give at least one of {', '.join(names)} a weight above 0")
    return np.asarray(weights / weights.sum())


def _check_held(family: HandFamily, spec: ObjectSpec) -> None:
    """Refuse bounds between which no hand holds an object; name the bounds that keep it from being held."""
    why = _why_not_held(family, spec)
    if why is None:
        return
    wide, told = HandFamily(), {field: "--" + option.replace("_", "-") for option, field in BOUNDS.items()}
    narrow = [field for field in told if getattr(family, field) != getattr(wide, field)]

    def helps(chosen: Sequence[str]) -> bool:
        try:
            wider = replace(family, **{field: getattr(wide, field) for field in chosen})
        except InputError:
            return False
        return _why_not_held(wider, spec) is None

    to_blame = [field for field in narrow if helps([field])]
    if to_blame:
        cure = f"between the default bounds of {' or of '.join(told[field] for field in to_blame)} there are some"
    elif narrow and helps(narrow):
        cure = f"between the default bounds of {' and '.join(told[field] for field in narrow)} together there are some"
    else:
        cure = "nor is there one between the default bounds: use a smaller object, or wider bounds"
    raise InputError(f"no hand between these bounds can hold object {spec.name!r}: {cure}. Of one of them: {why}")


def _why_not_held(family: HandFamily, spec: ObjectSpec) -> str | None:
    """Return why a hand of a family does not hold an object, None where one does."""
    why = ""
    for hand in _tried(family):
        try:
            check_fit(hand, spec)
            start_grip(hand, spec)
        except InputError as error:
            why = str(error)
        else:
            return None
    return why


def _tried(family: HandFamily) -> Iterator[HandSpec]:
    """Give hands from all over a family."""
    middle = dict.fromkeys(family.dimensions(), 0.5)
    for form in family.forms:
        for limits in family.limits:
            yield family.hand("a middle one", form, limits, middle)
            for end, word in ((0.0, "lowest"), (1.0, "highest")):
                for name in family.dimensions():
                    label = f"one of the {word} {name.replace('_', ' ')}"
                    yield family.hand(label, form, limits, middle | {name: end})
    rng = np.random.default_rng(0)
    for k in range(TRIED):
        yield family.drawn(f"drawn number {k + 1}", rng)
