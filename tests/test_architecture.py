"""The cut of the project: rooms, sizes, one home for each setting, and how few files a control step needs."""

import ast
import asyncio
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

import inhand
from inhand import geometry
from inhand.control.catalogue import CONTROLLERS, find_controller, rough_grasp
from inhand.control.controller import Task
from inhand.control.joint import JointPid
from inhand.control.loop import control_step, sense
from inhand.control.policy import Policy
from inhand.control.seen import reads_of
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.sides import rough_plan
from inhand.sim.engines import make_simulator
from inhand.sim.names import ENGINE
from inhand.sim.scene import SUBSTEPS
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN

SOURCE = Path(inhand.__file__).parent
ROOT = SOURCE.parents[1]
FILES = sorted(SOURCE.rglob("*.py"))
LONGEST_FILE, LONGEST_FUNCTION, MOST_ROOMS = 350, 40, 9
MOST_FILES, MOST_FILES_IN_TRAINING = {"planar": 10, "mujoco": 9, "bullet": 9}, 12
SENSING = {"ik-sensed": 5, "rl": 9}
"""Files more where an estimator stands in front: itself, what is seen, outlines and how they meet; and a memory."""
HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), OBJECTS["cube_39"]
Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all that a file is made of, itself first."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def test_each_room_imports_only_what_it_may() -> None:
    # In a process of its own: it forks, which JAX's threads, if another test has started them, forbid.
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))"

    async def run() -> tuple[int | None, bytes]:
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", code, cwd=ROOT, stdout=pipe)
        told, _ = await process.communicate()
        return process.returncode, told

    failed, told = asyncio.run(run())
    assert failed == 0, told.decode()


def test_every_file_and_room_stands_in_a_layer() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    layers = next(each["layers"] for each in contracts if each["type"] == "layers")
    standing = [name for layer in layers for name in layer.split(" | ")]
    parts = {path.relative_to(SOURCE).parts[0].removesuffix(".py") for path in FILES}
    parts -= {"__init__", "__main__", "policies"}  # the front door, and weights
    assert sorted(standing) == sorted(f"inhand.{part}" for part in parts)


def test_nine_rooms_and_no_circle() -> None:
    rooms = {path.relative_to(SOURCE).parts[0] for path in FILES if len(path.relative_to(SOURCE).parts) > 1}
    rooms.remove("policies")  # weights, no code
    assert len(rooms) <= MOST_ROOMS, sorted(rooms)
    try:
        list(TopologicalSorter(imports()).static_order())
    except CycleError as error:
        pytest.fail(f"files import each other in a circle: {' -> '.join(error.args[1])}")


def imports() -> dict[str, set[str]]:
    """Return the modules that each module of the package imports, also inside of functions."""
    modules = {".".join(("inhand", *path.relative_to(SOURCE).with_suffix("").parts)): path for path in FILES}
    modules = {name.removesuffix(".__init__"): path for name, path in modules.items()}
    found: dict[str, set[str]] = {}
    for name, path in modules.items():
        wanted = {alias.name for node in nodes(path) if isinstance(node, ast.Import) for alias in node.names}
        for node in nodes(path):
            if isinstance(node, ast.ImportFrom) and node.module is not None:
                inside = {f"{node.module}.{alias.name}" for alias in node.names}
                wanted |= {each if each in modules else node.module for each in inside}
        found[name] = wanted & set(modules) - {name}
    return found


def test_files_and_functions_are_short() -> None:
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert not {str(path): length for path, length in lines.items() if length > LONGEST_FILE}
    assert not {
        f"{path}: {node.name}": length
        for path in FILES
        for node in nodes(path)
        if isinstance(node, Function)
        if (length := (node.end_lineno or 0) - node.lineno + 1) > LONGEST_FUNCTION
    }


def called(decide: Callable[[], object]) -> list[tuple[str, str]]:
    """Return file and function of all that runs of the package, each once, in the order of the first calls."""
    seen: dict[tuple[str, str], None] = {}

    def note(frame: FrameType, event: str, argument: object) -> None:
        del argument
        if event == "call" and frame.f_code.co_filename.startswith(str(SOURCE)):
            seen[str(Path(frame.f_code.co_filename).relative_to(SOURCE)), frame.f_code.co_name] = None

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        decide()
    finally:
        sys.setprofile(before)
    return list(seen)


def control_step_of(name: str, engine: str) -> list[tuple[str, str]]:
    """Return what runs in the second control step of a controller."""
    path = straight_path(TRAIN[0])
    simulator = make_simulator(engine, HAND, [CUBE])
    task = Task(HAND, simulator.objects, geometry.Path(path.poses[None]), simulator.timestep)
    start = HAND.start_pose[None]
    entry = find_controller("thesis-ik" if name == "joint" else name)
    grasp = rough_grasp(HAND, CUBE, start[:, None])
    controller = JointPid(task, grasp.closed) if name == "joint" else entry.manipulate(task)
    states = [simulator.reset(start, grasp.closed)]
    reads = reads_of(controller)
    controller.begin(sense(states[0], None, reads))

    def decide() -> None:
        targets = controller.act(sense(states[-1], None, reads))
        states.append(control_step(simulator, targets, np.zeros(1, dtype=np.int64), SUBSTEPS)[0])
        controller.finished(sense(states[-1], None, reads))

    decide()
    return called(decide)


def training_decision(preset: str = "privileged") -> list[tuple[str, str]]:
    """Return what runs in the second decision of training, with what `inhand train` sees, does and pays."""
    from inhand.learning.collect import Collector
    from inhand.learning.presets import PRESETS
    from inhand.learning.replay_buffer import Columns
    from inhand.learning.starts import gripped
    from inhand.learning.worlds import ManipulationWorlds

    starts = gripped(HAND, CUBE, ([rough_plan(HAND, CUBE)], np.zeros(1)), np.random.default_rng(0))
    worlds = ManipulationWorlds(Held(HAND, CUBE), starts, 1, PRESETS[preset]().interface, np.random.default_rng(0))
    collector = Collector(worlds, Columns(worlds.layout.size(HAND), HAND.n_joints), (0.98, 5))
    sizes, rng = (worlds.layout.size(HAND), HAND.n_joints), np.random.default_rng(0)
    actor = Policy((np.zeros(sizes),), (np.zeros(sizes[1]),), "", "steps", "rough", {})
    collector.collect(actor, 1, 0.1, rng)
    return called(lambda: collector.collect(actor, 1, 0.1, rng))


@pytest.mark.parametrize("engine", MOST_FILES)
@pytest.mark.parametrize("name", [*CONTROLLERS, "rl-privileged", "rl", "joint"])
def test_few_files_take_part_in_one_control_step(name: str, engine: str) -> None:
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    files = {file for file, _ in control_step_of(name, engine)}
    assert {"control/loop.py", "sim/planar/engine.py" if engine == "planar" else f"sim/{engine}_engine.py"} <= files
    assert len(files) <= MOST_FILES[engine] + SENSING.get(name, 0), sorted(files)


@pytest.mark.parametrize("preset", ["privileged", "thesis"])
def test_few_files_take_part_in_a_decision_of_training(preset: str) -> None:
    pytest.importorskip("jax", reason="learning needs the extra `rl`")
    files = {file for file, _ in training_decision(preset)}
    assert {"learning/collect.py", "tasks/decisions.py", "control/loop.py"} <= files
    assert len(files) <= MOST_FILES_IN_TRAINING, sorted(files)


def test_the_page_of_one_decision_names_what_runs_in_its_order() -> None:
    pytest.importorskip("jax", reason="learning needs the extra `rl`")
    page = (ROOT / "docs" / "one-decision.md").read_text(encoding="utf-8")
    _, *parts = page.split("\n## ")
    for part, ran in zip(parts, (control_step_of("ik", ENGINE), training_decision()), strict=True):
        named = re.findall(r"^\| `([\w/]+\.py)` \| `(\w+)` \|", part, re.MULTILINE)
        assert len(named) > 10
        assert not set(named) - set(ran)
        assert named == sorted(named, key=ran.index)


def test_one_place_steps_simulators() -> None:
    """Loops of their own would grip, hold and judge in their own way; simulators take two arguments or three."""
    found = {
        (str(path.relative_to(SOURCE)), ast.unparse(node.func.value))
        for path in FILES
        if path.parent != SOURCE / "sim"  # which steps the engines' own
        for node in nodes(path)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "step"
        if len(node.args) + len(node.keywords) in {2, 3}
    }
    assert found == {("control/loop.py", "simulator")}


PLANAR = (
    "hands/",
    "control/ik.py",
    "control/teacher.py",
    "control/thesis_ik.py",
    "control/follow.py",
    "control/rehearsal.py",
    "tasks/hand_arrays.py",
    "tasks/joint_rows.py",
)
"""What may take a hand for two fingers in a plane."""
TWO_FINGERS = re.compile(
    r"(?-i:FINGER_NAMES)|\b(left|right|both|two)[- ]fingers?\b|\bfingers? (left|right)\b|\bhand\.(left|right)\b"
    r"|\.(fingers|slices|finger_names)\[-?\d|len\(\w*\.?(fingers|slices)\) (==|!=|<|>) \d"
    r"|\b(gaps|touching|forces|(finger|object)_(points|xy)|contact_links|normals)\[[^\]]*, -?[01]\]",
    re.IGNORECASE,
)
"""How files would name them, count on them, or take one of them by its number."""


@pytest.mark.parametrize(
    "line",
    [
        "hand.left.links",
        "hand.fingers[0]",
        "state.gaps[:, 1]",
        "the left finger",
        "both fingers",
        "len(hand.fingers) == 2",
    ],
)
def test_two_fingers_are_found_where_they_are_meant(line: str) -> None:
    assert TWO_FINGERS.search(line)


def test_only_hands_and_planar_controllers_know_of_two_fingers() -> None:
    found = [
        f"{path.relative_to(SOURCE)}:{number}: {line.strip()}"
        for path in FILES
        if not str(path.relative_to(SOURCE)).startswith(PLANAR)
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if TWO_FINGERS.search(line)
    ]
    assert not found, found


def configs() -> Iterator[tuple[str, str]]:
    """Give class and field of every setting in the project."""
    for path in FILES:
        for node in nodes(path):
            if isinstance(node, ast.ClassDef) and node.name.endswith("Config"):
                for item in node.body:
                    if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
                        yield node.name, item.target.id


def test_every_setting_is_used() -> None:
    used = {node.attr for path in FILES for node in nodes(path) if isinstance(node, ast.Attribute)}
    found = list(configs())
    assert len(found) > 30
    assert not [f"{name}.{field}" for name, field in found if field not in used]


def test_every_module_says_what_it_is() -> None:
    files = {path: nodes(path)[0] for path in FILES}
    assert not [
        str(path) for path, file in files.items() if isinstance(file, ast.Module) and not ast.get_docstring(file)
    ]


def test_no_linter_is_muted() -> None:
    words = tuple("# " + word for word in ("noqa", "type: ignore", "pragma"))
    folders = [folder for folder in (SOURCE, ROOT / "tests", ROOT / "benchmarks") if folder.is_dir()]
    muted = [
        f"{path.name}:{number}"
        for folder in folders
        for path in sorted(folder.rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if any(word in line for word in words)
    ]
    assert not muted
