"""The one place that makes the engines' simulators."""

from collections.abc import Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from inhand.aside import Aside
from inhand.errors import InputError, near_matches
from inhand.hands.hand import HandSpec
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.bullet_model import load_pybullet
from inhand.sim.engine import Body, Hand, Simulator
from inhand.sim.names import ENGINE, SPATIAL, Engine
from inhand.sim.scene import SceneSpec


def make_simulator(
    engine: str,
    hand: Hand | Sequence[Hand],
    objects: Sequence[Body],
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
    made: dict[str, Any] = {"hand": hand, "objects": objects, "scenes": scenes, "kinds": kinds}
    if _in_space(hand, objects):
        from inhand.sim.spatial_engine import SpatialSimulator

        engine_in_space(engine)
        return SpatialSimulator(**made, threads=threads)
    if engine == "bullet":
        from inhand.sim.bullet_engine import BulletSimulator

        return BulletSimulator(**made)
    if engine == "planar":
        from inhand.sim.planar.engine import PlanarSimulator

        return PlanarSimulator(**made, threads=threads)
    from inhand.sim.mujoco_engine import MujocoSimulator

    return MujocoSimulator(**made, threads=threads)


def _in_space(hand: Hand | Sequence[Hand], objects: Sequence[Body]) -> bool:
    """Return whether worlds are of hands in space.

    Raises:
        InputError: hands or objects of both kinds.
    """
    hands = [hand] if isinstance(hand, HandSpec | SpatialHand) else list(hand)
    kinds = {isinstance(each, SpatialHand) for each in hands} | {isinstance(each, SolidSpec) for each in objects}
    if len(kinds) > 1:
        raise InputError(
            "hands or objects of the plane and of space in one simulator; a hand in space (3f_60.60_40_10) holds an"
            " object in space, as load_held of the two names gives"
        )
    return kinds == {True}


def engine_in_space(engine: str) -> Engine:
    """Return the engine of a hand in space: MuJoCo, also where the engine of hands in the plane is asked for.

    Raises:
        InputError: an engine that has no third dimension for it.
    """
    check_engine(engine)
    if engine not in {SPATIAL, ENGINE}:
        raise InputError(
            f"engine {engine!r} with a hand in space, which runs in {SPATIAL} alone: leave it out or give {SPATIAL}"
        )
    return SPATIAL


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
