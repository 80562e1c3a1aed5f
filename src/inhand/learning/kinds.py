"""Which worlds starts are held in, alike, disturbed or of hands that differ, and what is asked of them."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.learning.starts import Starts
from inhand.sim.disturbance import FACTORS
from inhand.sim.drawn import Disturbed, Drawn, truths
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.scene import DECISION_S
from inhand.tasks.observations import Aim, AnyAim
from inhand.tasks.spatial.aims import SpatialAim


def simulator_of(held: AnyPair, starts: Starts, count: int, threads: int) -> tuple[Simulator, Array | None]:
    """Return a simulator of worlds and, where they are disturbed, what is drawn of those of the starts `(N, DRAWN)`."""
    first = np.zeros(count, dtype=np.int64)
    if starts.space is not None and isinstance(held, SpatialPair):
        hand, things, scenes = held.hand, [held.object] * len(starts), starts.space.scenes
        if starts.disturbed is None:
            return make_simulator(starts.engine, hand, things, scenes, threads, kinds=first), None
        true = truths(starts.disturbed, hand, things, scenes)
        return make_simulator(starts.engine, *true, threads, kinds=first), _drawn(starts.disturbed)
    if (starts.disturbed is None and starts.pairs is None) or not isinstance(held, Held):
        return make_simulator(starts.engine, held.hand, [held.object] * count, threads=threads), None
    pairs = (held,) * len(starts) if starts.pairs is None else starts.pairs.held
    hands, objects = zip(*pairs, strict=True)
    if starts.disturbed is None:
        return make_simulator(starts.engine, hands, objects, threads=threads, kinds=first), None
    each = range(len(starts)) if starts.pairs is None else starts.pairs.of.tolist()
    own: list[HandSpec] = [hands[k] for k in each]
    kinds = truths(starts.disturbed, own, [objects[k] for k in each], None)
    simulator = make_simulator(starts.engine, *kinds, threads, kinds=first)
    return simulator, _drawn(starts.disturbed)


def kinds_of(starts: Starts, rows: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Return of which kinds of that simulator's worlds rows of the starts are; None where all are alike."""
    if starts.disturbed is not None or starts.space is not None:
        return rows
    return None if starts.pairs is None else starts.pairs.of[rows]


def drawn_rows(
    starts: Starts, rows: NDArray[np.int64], rng: np.random.Generator, *, keeps_pair: bool
) -> NDArray[np.int64]:
    """Return rows of the starts drawn for worlds that come from some `(K,)`, which may keep their hand and object."""
    if keeps_pair and starts.pairs is not None:
        return starts.pairs.again(rows, rng)
    return rng.integers(len(starts), size=len(rows))


def asked_of(starts: Starts) -> AnyAim:
    """Return what starts are asked to do."""
    if starts.space is not None:
        return SpatialAim(starts.space.along, starts.space.about, starts.state.object_pose, starts.distance)
    if starts.routes is None:
        turn = np.zeros(len(starts)) if starts.turn is None else starts.turn
        return Aim(np.deg2rad(starts.angle_deg), starts.state.pose, starts.distance, turn=turn)
    return starts.routes.aim(np.arange(len(starts)), np.zeros(len(starts), dtype=np.int64))


def _drawn(disturbed: Sequence[Disturbed]) -> Array:
    """Return what holding depends on of what was drawn for worlds `(N, DRAWN)`."""
    return np.array([_numbers(each.drawn) for each in disturbed])


def _numbers(drawn: Drawn) -> Array:
    """Return what holding depends on of what was drawn for a world `(DRAWN,)`."""
    late = drawn.command_s, drawn.camera_s
    factors = [math.log(getattr(drawn, name)) for name in FACTORS]
    return np.array([*factors, *(each / DECISION_S for each in late)])
