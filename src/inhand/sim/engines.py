"""The one place that makes the engines' simulators."""

from collections.abc import Sequence
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from inhand.aside import Aside
from inhand.errors import InputError, near_matches
from inhand.hands.hand import HandSpec
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE, ObjectSpec
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


def compile_aside(aside: Aside, engine: str) -> None:
    """Have the planar engine compiled aside where it is not yet: half of all that a first run has to compile.

    Who needs it before it is done waits for it.
    """
    if engine == "planar":
        from inhand.compiled import is_kept

        if not is_kept("inhand.sim.planar.kernels", "step_worlds"):
            aside(step_once)


def step_once() -> None:
    """Step and measure a world of the planar engine, which compiles it."""
    hand, cube = parse_hand_name("2v2_50.50_50.50_1.1_53"), CATALOGUE["cube_39"]
    simulator = make_simulator("planar", hand, [cube], threads=1)
    start = simulator.reset(hand.start_pose[None], np.zeros((1, hand.n_joints)))
    simulator.step(start.targets, 1)


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
