"""The one place that makes the engines' simulators."""

from collections.abc import Sequence
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError, near_matches
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.bullet_model import load_pybullet
from inhand.sim.engine import Simulator
from inhand.sim.names import Engine
from inhand.sim.scene import SceneSpec


def make_simulator(
    engine: str,
    hand: HandSpec | Sequence[HandSpec],
    objects: Sequence[ObjectSpec],
    scenes: SceneSpec | Sequence[SceneSpec] | None = None,
    threads: int = 0,
    *,
    kinds: NDArray[np.int64] | None = None,
) -> Simulator:
    """Return B worlds in an engine, one for each object.

    Hand and scene are one for all or one for each world. Threads are to step on, 0 for every core; PyBullet has one.
    With `kinds` `(B,)` objects, hands and scenes are those of kinds of worlds, and a world can become another kind.

    Raises:
        InputError: an unknown engine, one that is not installed, or what its simulator refuses.
    """
    check_engine(engine)
    if engine == "bullet":
        from inhand.sim.bullet_engine import BulletSimulator

        return BulletSimulator(hand, objects, scenes, kinds=kinds)
    if engine == "planar":
        from inhand.sim.planar.engine import PlanarSimulator

        return PlanarSimulator(hand, objects, scenes, threads, kinds=kinds)
    from inhand.sim.mujoco_engine import MujocoSimulator

    return MujocoSimulator(hand, objects, scenes, threads, kinds=kinds)


def check_engine(engine: str) -> None:
    """Refuse an engine that there is not, or that is not installed.

    Raises:
        InputError: the text offers near matches, or names the extra.
    """
    known = get_args(Engine)
    if engine not in known:
        raise InputError(f"unknown engine {engine!r}{near_matches(engine, known)}; allowed are {', '.join(known)}")
    if engine == "bullet":
        load_pybullet()
