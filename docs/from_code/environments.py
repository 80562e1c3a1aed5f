"""The reference of the environments: ids, spaces, what an observation holds, actions, rewards, keywords."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from inhand.cli.texts import texts_of
from inhand.environment_ids import IDS
from inhand.hands.names import parse_hand_name
from inhand.hands.spatial.names import parse_spatial_name
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig
from inhand.learning.make import WORDS
from inhand.learning.spatial_environment import SpatialEnvironmentConfig
from inhand.tasks.decisions import REWARDS, largest_step
from inhand.tasks.layouts import LAYOUTS
from inhand.tasks.observations import AnyHand, Layout, OfHand, numbers_for

from . import fields

KINDS: dict[str, type[Any]] = {
    "Asterisk": EnvironmentConfig,
    "AsteriskGoal": GoalConfig,
    "SpatialAsterisk": SpatialEnvironmentConfig,
}
"""What reads the keywords of each of the environments' classes."""
FINAL = 4
"""Significant digits of a scale."""


def page() -> str:
    """Return everything about the environments."""
    parts = [_ids(), _layouts(), _actions(), _rewards(), _keywords()]
    return "\n\n".join(parts)


def _hand(*, space: bool) -> AnyHand:
    """Return the hand of environments in the plane or in space where none is asked for."""
    if space:
        return parse_spatial_name(SpatialEnvironmentConfig.hand)
    return parse_hand_name(EnvironmentConfig.hand)


def _ids() -> str:
    rows = []
    for name, (kind, keywords) in IDS.items():
        config = KINDS[kind](**keywords)
        hand = _hand(space=kind == "SpatialAsterisk")
        word = next(word for word, id_ in WORDS.items() if id_ == name)
        size, reward = LAYOUTS[config.observation].size(hand), config.reward
        seen = f"Box(-1, 1, ({size},))"
        if kind == "AsteriskGoal":
            seen = f"Dict(observation: {seen}, achieved_goal and desired_goal: Box((3,)))"
        does = f"Box(-1, 1, ({hand.n_joints},))"
        layout = f"`{config.observation}`: {seen}"
        rows.append((f"`{name}`", f'`"{word}"`', layout, f"`{config.actions}`: {does}", f"`{reward}`", config.horizon))
    head = ("Id", "`inhand.make`", "Observation space", "Action space", "Reward", "Horizon")
    return "## Ids and spaces\n\n" + _table(head, rows)


def _layouts() -> str:
    plane, space = _hand(space=False), _hand(space=True)
    texts = [
        "## What an observation holds",
        f"Rows and scales with the hand `{plane.name}`, of `space` with `{space.name}`. A number of the layout is"
        " (what is measured - middle) / half, cut to [-1, 1].",
    ]
    for name, layout in LAYOUTS.items():
        hand = space if layout.space else plane
        texts += [
            f"### `{name}`",
            f"{layout.size(hand)} numbers, of what is {_source(layout)}; its version is `{layout.name}`.",
        ]
        texts.append(_table(("Rows", "What", "Middle", "Half"), _rows(layout, hand)))
    return "\n\n".join(texts)


def _source(layout: Layout) -> str:
    return "sensed" if layout.sensed else "true (privileged)"


def _rows(layout: Layout, hand: AnyHand) -> Iterable[Sequence[object]]:
    first = 0
    for part in layout.parts:
        last = first + part.size(hand) - 1
        yield (
            f"{first}" if first == last else f"{first} to {last}",
            part.name,
            _number(part.middle, hand),
            _number(part.half, hand),
        )
        first = last + 1


def _number(given: OfHand, hand: AnyHand) -> str:
    values = list(dict.fromkeys(f"{value:.{FINAL}g}" for value in np.ravel(numbers_for(given, hand))))
    return ", ".join(values)


def _actions() -> str:
    step, fine = largest_step("steps"), largest_step("fine")
    rows = (
        ("`angles`", "joint targets: -1 and 1 are the ends of each joint's range"),
        ("`steps`", f"an action of 1 moves a joint's last target on by {step} rad"),
        ("`fine`", f"the same by {fine} rad"),
    )
    return "## Actions\n\nA number within [-1, 1] for each joint, left finger first.\n\n" + _table(
        ("Word", "What it does"), rows
    )


def _rewards() -> str:
    rows = [
        (f"`{name}`" if not number else "", f"`{term.name}`", f"{term.weight:g}", fields.first_paragraph(term.value))
        for name, terms in REWARDS.items()
        for number, term in enumerate(terms)
    ]
    return '## Rewards\n\nA reward is the weighted sum of its terms; `info["terms"]` tells each.\n\n' + _table(
        ("Reward", "Term", "Weight", "What it is"), rows
    )


def _keywords() -> str:
    own, space = texts_of(EnvironmentConfig), texts_of(SpatialEnvironmentConfig)
    more = {name: told for name, told in texts_of(GoalConfig).items() if told != own.get(name)}
    head = ("Keyword", "Default", "What it is")
    return "\n\n".join(
        [
            "## Keywords",
            _table(head, _told(own)),
            "Those of `inhand/AsteriskGoal-v0` that differ, or are its own:",
            _table(head, _told(more)),
            "Those of `inhand/SpatialAsterisk-v0`:",
            _table(head, _told(space)),
        ]
    )


def _told(found: dict[str, tuple[Any, str]]) -> Iterable[Sequence[object]]:
    return ((f"`{name}`", f"`{default!r}`", said) for name, (default, said) in found.items())


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
