"""Trying a policy out: every direction from the same held starts, without exploration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair
from inhand.learning.starts import Starts
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.tasks.layouts import find_layout


@dataclass(frozen=True, eq=False)
class Tried:
    """What a policy reached from N starts."""

    angle_deg: Array
    """Direction `(N,)` [deg]."""
    total: Array
    """Sum of the rewards `(N,)`."""
    distance: Array
    """Way along at the end, or where the object was last held `(N,)` [m]."""
    across: Array
    """Largest way across while it was held `(N,)` [m]."""
    turned: Array
    """Largest angle turned while it was held `(N,)` [rad]."""
    dropped: NDArray[np.bool_]
    """Whether the object was lost `(N,)`."""


def tried_all(held: AnyPair, pools: Sequence[Starts], interface: Interface, actor: Callable[[Array], Array]) -> Tried:
    """Return what an actor reaches from every start of several pools."""
    found = [tried(held, starts, interface, actor) for starts in pools]
    return Tried(**{each.name: np.concatenate([getattr(one, each.name) for one in found]) for each in fields(Tried)})


def tried(held: AnyPair, starts: Starts, interface: Interface, actor: Callable[[Array], Array]) -> Tried:
    """Return what an actor reaches from every start."""
    size = find_layout(interface.observation).size(held.hand)
    worlds = ManipulationWorlds(held, starts, len(starts), interface, np.random.default_rng(0))
    observation = worlds.reset(np.arange(len(starts)))
    running, total = np.ones(len(starts), dtype=bool), np.zeros(len(starts))
    shift, worst = np.zeros((2, len(starts), 3))
    for _ in range(interface.horizon):
        step = worlds.step(actor(observation[:, :size]))
        total += np.where(running, step.reward, 0.0)
        running = running & ~step.terminated
        shift = np.where(running[:, None], step.shift, shift)
        worst = np.maximum(worst, np.abs(shift))
        observation = step.observation
    return Tried(starts.angle_deg, total, shift[:, 0], worst[:, 1], worst[:, 2], ~running)
