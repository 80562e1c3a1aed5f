"""Golden digests: what a seed gives, byte for byte on the machine that recorded it and to a tolerance on any other.

Floating-point results differ in their last bits between processors (vector units, BLAS kernels) and library versions.
So `golden.json` holds digests under the name of the platform they were made on, and beside them numbers that a person
can read and that hold everywhere. `python tests/test_golden.py` records both anew; a change of either is a change of
results and is told in the CHANGELOG.
"""

from __future__ import annotations

import hashlib
import json
import platform
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import loop
from inhand.control.controller import SpatialTask
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.trial import AnyTrial
from inhand.hands.files import load_object
from inhand.hands.names import parse_hand_name
from inhand.hands.spatial.grasp_search import SpatialSearchConfig, search_grasps
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import parse_solid_name
from inhand.sim.names import Engine
from inhand.tasks.primitives import parse_directions
from inhand.tasks.reach import limits
from inhand.tasks.spatial.paths import hold_path, spatial_path_of, stacked_paths, whole_spatial_path
from inhand.tasks.spatial.primitives import parse_spatial_directions
from inhand.tracing.config import TraceConfig
from inhand.tracing.run import prepare_trace, simulate_trace

RECORDS = Path(__file__).with_name("golden.json")
HAND, OBJECT = "2v2_50.50_50.50_1.1_53", "cube_39"
Golden = tuple[str, list[float]]
"""A digest of all bytes, and numbers to read."""


def _digest(arrays: Iterable[np.ndarray]) -> str:
    found = hashlib.sha256()
    for array in arrays:
        found.update(f"{array.dtype.str}{array.shape}".encode())
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()


def _trial_arrays(trials: Iterable[AnyTrial]) -> list[np.ndarray]:
    """Return what a trial's motion is; of points the planar view."""
    plain = ("phase", "time", "object_pose", "joint_angles", "targets", "gaps", "contact_links")
    found = []
    for trial in trials:
        found += [np.asarray(getattr(trial, name)) for name in plain]
        found += [trial.finger_points[..., :2], trial.object_points[..., :2], trial.reference]
    return found


def _trials(engine: Engine) -> Golden:
    config = AsteriskConfig(hand=HAND, object=OBJECT, trials=1, engine=engine)
    trials = simulate(config, prepare(config))
    ends = [float(np.linalg.norm(trial.manipulated_path()[0][-1])) for trial in trials]
    return _digest(_trial_arrays(trials)), ends


def _trace(engine: Engine) -> Golden:
    config = TraceConfig(path="square", size=20.0, trials=1, engine=engine)
    found, traces = simulate_trace(config, prepare_trace(config))
    return _digest(_trial_arrays([each.trial for each in found])), [traces[0].rms_mm, traces[0].max_mm]


def _reach() -> Golden:
    found = limits(parse_hand_name(HAND), load_object(OBJECT), parse_directions("Out,In,Right',In-Left,cw"))
    return _digest([np.array([limit.distance for limit in found])]), [limit.distance for limit in found]


def _space() -> Golden:
    """Search, grip, carry and judge in space: one palm, one object, few contacts; a move, a turn, a held rotation."""
    hand, cube, gravity = parse_spatial_name(STANDARD), parse_solid_name("cube_50"), np.array([gravity_of("down")])
    paths = [spatial_path_of(each) for each in parse_spatial_directions("Up,turn+x,Right@+z@10")]
    config = SpatialSearchConfig(spacing=0.016, keep=1)
    found = search_grasps((hand, cube), hand.start_pose, list(map(whole_spatial_path, paths)), gravity, config=config)
    starts, path = np.tile(hand.start_pose, (3, 1)), stacked_paths(paths)
    task = SpatialTask(hand, (cube,) * 3, path, gravity=np.tile(gravity, (3, 1)), distance=np.full(3, 0.01))
    twists = stacked_paths([hold_path(each) for each in paths])
    grasp = closed_at(hand, [each[0] for each in found], starts)
    _, left = loop.simulate(task, grasp, starts, SpatialIkController, loop.Bench("mujoco", threads=1), twists=twists)
    arrays = [
        getattr(state, name) for state in left.states for name in ("object_pose", "joint_angles", "targets", "gaps")
    ]
    moved = left.states[-1].object_pose[:, :3] - starts[:, :3]
    return _digest(arrays), (1e3 * np.linalg.norm(moved, axis=-1)).tolist()


def _actor(engine: Engine) -> Golden:
    from inhand.control.policy_arrays import ACTOR
    from inhand.learning.presets import thesis
    from inhand.learning.setup import load_ready, make_ready, save_ready
    from inhand.learning.training import Trainer

    config = thesis()
    config = replace(
        config,
        engine=engine,
        interface=replace(config.interface, observation="grip", actions="steps", reward="progress", horizon=25),
        recipe=replace(config.recipe, episodes=24, push=0.01, midway=0.5),
        learning=replace(config.learning, hidden=(16, 16), batch=16, imitation=1.0),
        imitate=1000,
        warm_up=1000,
        episodes=60,
        worlds=10,
        decisions=8,
        updates=20,
        evaluate_every=30,
        trials=1,
    )
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        save_ready(make_ready(config, folder, lambda *_: None), folder / "ready.npz")
        totals: list[float] = []
        Trainer(config, load_ready(config, folder / "ready.npz"), folder, lambda e: totals.append(e.score)).run()
        return hashlib.sha256((folder / "last" / ACTOR).read_bytes()).hexdigest(), totals[:1]


MADE: dict[str, Callable[[], Golden]] = {
    "reach": _reach,
    "space": _space,
    "trials": partial(_trials, "planar"),
    "trace": partial(_trace, "planar"),
    "actor": partial(_actor, "planar"),
    "trials, mujoco": partial(_trials, "mujoco"),
    "trace, mujoco": partial(_trace, "mujoco"),
    "actor, mujoco": partial(_actor, "mujoco"),
}
TOLERANCE = {"trials": 1.5, "trace": 0.1, "reach": 1e-6, "space": 0.5, "actor": 2.0}
"""How far the numbers may be from the recorded ones on another machine, in their own units (mm, m, sum of rewards)."""


USED = ("numpy", "scipy", "mujoco-core", "numba", "llvmlite", "jax", "jaxlib")
"""Libraries that numbers come from."""


def _platform() -> str:
    """Return what the bytes depend on: processor features that NumPy dispatches on, and the libraries' versions."""
    used = ",".join(np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", []))
    packages = [f"{name} {metadata.version(name)}" for name in USED]
    return f"{platform.machine()} {used}; {', '.join(packages)}"


@pytest.mark.parametrize("name", MADE)
def test_a_seed_gives_what_it_gave(name: str) -> None:
    if name.startswith("actor"):
        pytest.importorskip("jax", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")
    records = json.loads(RECORDS.read_text(encoding="utf-8"))
    digest, values = MADE[name]()
    assert values == pytest.approx(records["values"][name], abs=TOLERANCE[name.partition(",")[0]])
    known = records["digests"].get(_platform())
    assert known is None or digest == known[name], f"the bytes of {name!r} changed on {_platform()}"


def record() -> None:
    """Write what this machine gives beside what others gave."""
    old = json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.is_file() else {"digests": {}}
    found = {name: make() for name, make in MADE.items()}
    values = {name: values for name, (_, values) in found.items()}
    same = old.get("values") == values
    digests = old["digests"] if same else {}
    digests[_platform()] = {name: digest for name, (digest, _) in found.items()}
    RECORDS.write_text(json.dumps({"values": values, "digests": digests}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    record()
