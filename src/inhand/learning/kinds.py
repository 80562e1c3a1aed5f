"""Which worlds starts are held in, alike, disturbed or of hands that differ, and what is asked of them."""

import math

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.spatial.pair import AnyPair
from inhand.learning.starts import Starts
from inhand.sim.disturbance import FACTORS
from inhand.sim.drawn import Drawn, truths
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.scene import DECISION_S
from inhand.tasks.observations import Aim, AnyAim
from inhand.tasks.spatial.aims import SpatialAim


def simulator_of(held: AnyPair, starts: Starts, count: int, threads: int) -> tuple[Simulator, Array | None]:
    """Return a simulator of worlds and, where they are disturbed, what is drawn of those of the starts `(N, DRAWN)`."""
    first = np.zeros(count, dtype=np.int64)
    if starts.pairs is not None:
        hands, objects = zip(*starts.pairs.held, strict=True)
        return make_simulator(starts.engine, hands, objects, threads=threads, kinds=first), None
    if starts.space is not None:
        things = [held.object] * len(starts)
        return make_simulator(starts.engine, held.hand, things, starts.space.scenes, threads, kinds=first), None
    if starts.disturbed is None or not isinstance(held, Held):
        return make_simulator(starts.engine, held.hand, [held.object] * count, threads=threads), None
    kinds = truths(starts.disturbed, held.hand, [held.object] * len(starts), None)
    simulator = make_simulator(starts.engine, *kinds, threads, kinds=first)
    return simulator, np.array([_numbers(each.drawn) for each in starts.disturbed])


def kinds_of(starts: Starts, rows: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Return of which kinds of that simulator's worlds rows of the starts are; None where all are alike."""
    if starts.disturbed is not None or starts.space is not None:
        return rows
    return None if starts.pairs is None else starts.pairs.of[rows]


def asked_of(starts: Starts) -> AnyAim:
    """Return what starts are asked to do."""
    if starts.space is not None:
        return SpatialAim(starts.space.along, starts.space.about, starts.state.object_pose, starts.distance)
    if starts.routes is None:
        turn = np.zeros(len(starts)) if starts.turn is None else starts.turn
        return Aim(np.deg2rad(starts.angle_deg), starts.state.pose, starts.distance, turn=turn)
    return starts.routes.aim(np.arange(len(starts)), np.zeros(len(starts), dtype=np.int64))


def _numbers(drawn: Drawn) -> Array:
    """Return what holding depends on of what was drawn for a world `(DRAWN,)`."""
    late = drawn.command_s, drawn.camera_s
    factors = [math.log(getattr(drawn, name)) for name in FACTORS]
    return np.array([*factors, *(each / DECISION_S for each in late)])
