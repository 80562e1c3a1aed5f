"""What users register from their own files runs as itself, or is refused with what was given and what is needed."""

import math
import re
from pathlib import Path
from typing import Any, NoReturn, cast

import numpy as np
import pytest

import inhand as front
from commands import Call
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.user_metrics import METRICS, UserMetric, measured
from inhand.control.catalogue import CONTROLLERS, find_controller
from inhand.control.phases import PHASES
from inhand.control.policy import PolicyController
from inhand.control.user_policy import user_policy
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.learning.starts import straight_task
from inhand.loading import LOADERS
from inhand.registry import Registry, load_file, load_packages
from inhand.tasks.decisions import find_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.paths import path_of
from inhand.tasks.primitives import PATHS, parse_directions
from inhand.tracing.tasks import TASKS, find_task

BACK = """
import numpy as np
import inhand

@inhand.register.primitive("hook")
def hook():
    along = np.linspace(0.0, 0.02, 41)
    return np.column_stack([along, 0.005 * np.sin(np.pi * along / 0.02), np.zeros(41)])

@inhand.register.metric("highest_mm")
def highest(trial):
    return float(trial.manipulated_path()[0][:, 1].max())

@inhand.register.metric("broken")
def broken(trial):
    return 1 / 0

@inhand.register.phase("hold", longest=0.2)
class Hold:
    def __init__(self, task):
        pass

    def begin(self, state):
        self.targets = state.targets

    def act(self, state):
        return self.targets

    def finished(self, state):
        return np.zeros(state.n_worlds, dtype=bool)

class NoController:
    pass
"""


@pytest.fixture(autouse=True)
def forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test registers is forgotten after it."""
    for each in (CONTROLLERS, PATHS, METRICS, PHASES, TASKS):
        monkeypatch.setattr(each, "_added", {})
    load_packages.cache_clear()
    load_file.cache_clear()


@pytest.fixture
def own(tmp_path: Path) -> Path:
    path = tmp_path / f"own_{abs(hash(tmp_path))}.py"
    path.write_text(BACK.replace("hook", path.stem))
    return path


def test_every_public_name_is_there_and_none_is_a_room() -> None:
    rooms = {path.name for path in Path(front.__file__).parent.iterdir() if path.is_dir()}
    for name in front.__all__:
        assert getattr(front, name) is not None
        assert name in dir(front)
        assert name not in rooms
    with pytest.raises(AttributeError, match="no attribute 'astersik'; it offers"):
        vars(front)["__getattr__"]("astersik")


def test_a_folder_that_holds_no_run_is_refused_with_what_it_holds(tmp_path: Path) -> None:
    marks = r"give a trial's .npz file, or a folder with one of sweep.json \(inhand sweep\), robustness.json"
    with pytest.raises(InputError, match=f"none is not there: {marks}"):
        front.load(tmp_path / "none")
    with pytest.raises(InputError, match="None is no place: give the folder of a run"):
        front.load(cast("str", None))
    with pytest.raises(InputError, match=f"is empty: {marks}"):
        front.load(tmp_path)

    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match=f"holds notes.txt: {marks}"):
        front.load(tmp_path)
    with pytest.raises(InputError, match=r"notes.txt is not a trial"):
        front.load(tmp_path / "notes.txt")
    (tmp_path / "trace.json").write_text("{}")
    with pytest.raises(InputError, match=r"trace.json: config is None; it must be a table"):
        front.load(tmp_path)


def test_a_run_that_cannot_be_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(folder: Path) -> NoReturn:
        raise InputError("unknown hand 'nonsense'" if folder == tmp_path else f"{folder / 'x.json'}: no")

    monkeypatch.setitem(LOADERS, "sweep.json", ("inhand sweep", refuse))
    (tmp_path / "deep").mkdir()
    for place, told in ((tmp_path, "sweep.json: unknown hand 'nonsense'"), (tmp_path / "deep", "x.json: no")):
        (place / "sweep.json").write_text("{}")
        with pytest.raises(InputError, match=f"^{re.escape(str(place / told))}$"):
            front.load(place)


def test_a_word_runs_along_its_own_path(own: Path) -> None:
    (primitive,) = parse_directions(f"{own}:{own.stem}")
    path = path_of(primitive)
    assert primitive.name == own.stem
    assert primitive.angle_deg == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(path.poses[20], [0.01, 0.005, 0.0], atol=1e-12)
    assert parse_directions(own.stem) == (primitive,)
    with pytest.raises(InputError, match="goes along a path of its own"):
        _ = primitive.angle  # whatever takes it for straight is refused


def test_the_command_line_runs_a_file_of_ones_own_and_a_notebook_shows_it(
    own: Path, inhand: Call, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Run, "pictures", lambda *_: [])
    words = ("--directions", f"{own}:{own.stem}", "--trials", 1, "--noise-mm", 0, "--out", tmp_path / "run")
    metrics = "--metrics", f"{own}:highest_mm", f"{own}:broken"
    code, out, err = inhand("asterisk", *words, *metrics, "--phases", f"{own}:hold")
    assert (code, err) == (0, ""), err
    assert own.stem in out
    run = front.load(tmp_path / "run")
    assert isinstance(run, Run)
    assert any(note.startswith("No limits are given for joints of 2v2") for note in run.notes)
    path, _, _ = run.trials[0].manipulated_path()
    assert path[:, 1].max() > 4.0  # a straight line would stay within a millimetre
    assert path[-1, 0] == pytest.approx(20.0, abs=1.5)
    assert run.table()["limit_mm"][0] == pytest.approx(20.0)
    assert run.table()["more.highest_mm"][0] == path[:, 1].max()
    told = f"Metric broken gave no number for 1 of 1 trials ({own.stem}, trial 1: ZeroDivisionError: division by zero)"
    assert told in (tmp_path / "run" / "report.md").read_text(encoding="utf-8")
    assert sum(record.message.startswith(told) for record in caplog.records) == 1  # kernels may be compiled meanwhile
    assert np.isnan(run.table()["more.broken"][0])
    held = run.trials[0].phase == run.trials[0].phases.index("hold")
    assert run.trials[0].phases == ("place", "grasp", "hold", "manipulate")
    assert held.sum() == 10
    assert ">more.highest_mm</th>" in run._repr_html_()
    assert run._repr_png_().startswith(b"\x89PNG")


def test_a_metric_that_gives_no_number_costs_no_trial_and_says_why() -> None:
    for name, metric in {"broken": lambda _: 1 / 0, "wordy": lambda _: "far", "two": lambda _: 2}.items():
        front.register.metric(name)(cast("UserMetric", metric))
    values, wrong = measured(cast("Any", None), ["broken", "wordy", "two"])
    assert np.isnan([values["broken"], values["wordy"]]).all()
    assert values["two"] == 2.0
    assert wrong["broken"] == "ZeroDivisionError: division by zero"
    assert wrong["wordy"].startswith("metric 'wordy' gives ")
    assert list(wrong) == ["broken", "wordy"]


def installed(folder: Path, module: str, text: str) -> None:
    """Put a package with an entry point into a folder, as pip leaves it."""
    about = folder / f"{module}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[inhand]\nmine = {module}\n")
    (folder / f"{module}.py").write_text(text)


def test_an_installed_package_registers_by_its_entry_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = f"package_{abs(hash(tmp_path))}"
    installed(tmp_path, module, BACK.replace("hook", module))
    with pytest.raises(InputError, match="unknown metric 'highest_mm'; there is none of yours yet"):
        METRICS.known("highest_mm")
    monkeypatch.syspath_prepend(tmp_path)
    load_packages.cache_clear()
    assert METRICS.known("highest_mm") is METRICS["highest_mm"]
    assert parse_directions(module)[0].name == module


def test_a_package_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = f"broken_{abs(hash(tmp_path))}"
    installed(tmp_path, module, "1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    text = f"the entry point mine = {module} of an installed package cannot be loaded: division by zero; mend or remove"
    with pytest.raises(InputError, match=text):
        find_controller("mine")


@pytest.mark.parametrize(
    ("controller", "text"),
    [
        ("NoController", "without begin, act, finished: it must be a class"),
        ("nothing", "has no 'nothing' and registers no controller of that name"),
    ],
)
def test_what_is_no_controller_is_refused(own: Path, controller: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        find_controller(f"{own}:{controller}")


def test_a_file_says_what_it_registers_instead(own: Path) -> None:
    with pytest.raises(InputError, match="registers no metric of that name; it registers highest_mm, broken"):
        METRICS.find(f"{own}:nothing")


def test_a_file_that_is_not_there_or_fails_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no file .*none.py: give FILE.py:NAME"):
        find_controller(f"{tmp_path}/none.py:Mine")
    (tmp_path / "bad.py").write_text("1 / 0")
    with pytest.raises(InputError, match=r"bad.py cannot be imported: ZeroDivisionError: division by zero"):
        load_hand(f"{tmp_path}/bad.py:mine")


def test_names_that_are_taken_are_refused_and_a_cell_run_again_is_not() -> None:
    with pytest.raises(InputError, match="'ik' is taken by another controller"):
        CONTROLLERS.add("ik", object())
    with pytest.raises(InputError, match="'Out' is taken by another primitive"):
        front.register.primitive("Out")(lambda: np.zeros((2, 3)))
    numbers: Registry[int] = Registry("number", {"one": 1}, lambda _, given: int(str(given)))
    numbers.add("two", 2)
    with pytest.raises(InputError, match="'two' is taken by another number"):
        numbers.add("two", 3)
    with pytest.raises(InputError, match="without commas or slashes"):
        numbers.add("a,b", 3)

    def cell() -> object:
        def mine() -> None: ...

        return mine

    texts: Registry[str] = Registry("text", {}, lambda name, _: name)
    texts.add("mine", cell())
    texts.add("mine", cell())


@pytest.mark.parametrize(
    ("poses", "text"),
    [
        (np.zeros((3, 2)), r"gives an array \(3, 2\): it needs poses \(N, 3\)"),
        ("words", "gives str 'words': it needs poses"),
        ([[0.1, 0, 0], [0.2, 0, 0]], "its first pose must be 0, the object's start"),
        ([[0, 0, 0], [20.0, 0, 0]], "goes 20 m far, which no hand does: poses are in metres"),
        ([[0, 0, 0], [0.01, 0, 0], [0, 0, 0]], "ends where it begins: give angle_deg"),
        ([[0, 0, 0], [math.nan, 0, 0]], "it needs poses"),
    ],
)
def test_what_is_no_path_is_refused(poses: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        PATHS.add("wrong", poses)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (3, "policy int 3: give a function of observations, or a model with `predict`"),
        (lambda seen: seen[:1], r"returned \(1, 31\) for observations \(2, 31\): it must return finite actions"),
    ],
)
def test_what_is_no_policy_is_refused(given: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        user_policy(given, name="mine")(np.zeros((2, 31)))


@pytest.mark.parametrize(
    ("kind", "words", "given", "text"),
    [
        ("metric", ("mine",), 3, "metric 'mine' is int 3: it must be a function that gives"),
        ("metric", ("distance_mm",), len, "the name 'distance_mm' is taken by another metric"),
        ("reward_term", ("mine",), 3, "'mine' is int 3 with weight 1.0: it must be a function"),
        ("reward_term", ("mine", math.nan), len, "with weight nan: it must"),
        ("observation_part", ("mine",), 3, "part 'mine' is int 3: it must be a function of state"),
        ("observation_part", ("mine",), len, "at least one number a world; tell how many by fixed"),
        ("phase", ("mine",), 3, "phase 'mine' is int 3: it must be a class, made with the task"),
        ("phase", ("mine",), Path, "the class Path without begin, act, finished: it must be a class"),
        ("phase", ("mine", 0.0), lambda task: task, "phase 'mine' lasts 0 s: give more than 0 and at most 60 s"),
        ("phase", ("manipulate",), lambda task: task, "the name 'manipulate' is taken by another phase"),
        ("task", ("mine",), 3, "task 'mine' is int 3: it must be a function of hand, object and random generator"),
        ("task", ("square",), len, "the name 'square' is taken by another task"),
        ("task", ("key",), len, "the name 'key' is taken by another task"),
        ("hand", ("mine",), lambda: 3, "hand 'mine' is int 3: it must be a HandSpec"),
        ("object", ("mine",), lambda: 3, "object 'mine' is int 3: it must be an ObjectSpec"),
        ("object", ("cube_39",), lambda: 3, "the name 'cube_39' is taken by another object"),
    ],
)
def test_what_is_registered_wrongly_is_refused(kind: str, words: tuple[object, ...], given: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        getattr(front.register, kind)(*words)(given)


MODEL = """
import numpy as np
import inhand

class Model:
    asked = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.asked.append((observation.dtype.name, observation.shape, state, episode_start, deterministic))
        return np.tile([-1.0, 0.0, 1.0, 0.0], (len(observation), 1)).astype(np.float32), None

def make():
    return inhand.policy(Model(), "grip", "fine", name="mine", grasp="rough")

model = Model()
"""
"""A model with the `predict` of Stable-Baselines3's, and what makes a controller of it."""


def test_a_model_that_predicts_is_a_controller(tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Run, "pictures", lambda *_: [])
    path = tmp_path / "with_model.py"
    path.write_text(MODEL)
    words = ("--controller", f"{path}:make", "--directions", "Out", "--trials", 2, "--out", tmp_path / "run")
    code, out, err = inhand("asterisk", *words)
    assert (code, err) == (0, ""), err
    assert "mine" in out
    asked = load_file(path).Model.asked
    assert set(asked) == {("float32", (2, 31), None, None, True)}
    run = front.load(tmp_path / "run")
    assert isinstance(run, Run)
    targets = run.trials[0].targets[run.trials[0].manipulation]
    np.testing.assert_allclose(np.diff(targets[:, [0, 2]], axis=0)[:5], np.tile([-0.01, 0.01], (5, 1)), atol=1e-12)


def test_a_model_itself_is_one_too_with_the_usual_interface(tmp_path: Path) -> None:
    (tmp_path / "alone.py").write_text(MODEL)
    entry = find_controller(f"{tmp_path}/alone.py:model")
    held = Held(front.hand("2v2_50.50_50.50_1.1_53"), front.object("cube_39"))
    controller = entry.manipulate(straight_task(held, np.zeros(1)))
    assert isinstance(controller, PolicyController)


def test_unknown_parts_and_terms_are_refused() -> None:
    with pytest.raises(InputError, match="unknown observation part 'speed'"):
        find_layout("grip,speed")
    with pytest.raises(InputError, match="unknown reward term 'speed'"):
        find_reward("progress,speed")


def test_targets_of_the_wrong_shape_are_refused() -> None:
    class Short:
        grasp = "rough"

        def __init__(self, task: object) -> None: ...

        def begin(self, state: object) -> None: ...

        def act(self, state: object) -> object:
            del state
            return np.zeros((1, 3))

        def finished(self, state: object) -> object:
            del state
            return np.zeros(1, dtype=bool)

    with pytest.raises(InputError, match=r"act of controller 'Short' returned \(1, 3\): it must return joint targets"):
        front.asterisk(controller=Short, directions="Out", trials=1)


def test_a_phase_or_task_that_is_not_known_or_gives_no_way_points_is_refused() -> None:
    with pytest.raises(InputError, match=r"unknown phase 'hold'; there is none of yours yet; give FILE.py:NAME"):
        front.asterisk(directions="Out", trials=1, phases=["hold"])
    front.register.task("flat")(lambda *_: np.zeros((3, 2)))
    front.register.task("there", stay=0.5)(lambda *_: np.array([[0.01, 0.0, 0.1], [0.02, 0.01, 0.1]]))
    held = Held(load_hand("2v2_50.50_50.50_1.1_53"), load_object("cube_39"))
    last = find_task("there").plan(held, np.random.default_rng(0)).legs[-1]
    np.testing.assert_allclose(last.end, held.start + np.array([0.02, 0.01, 0.1]))
    assert last.stay == 0.5
    with pytest.raises(InputError, match=r"task 'flat' gives \(3, 2\): it must give way-points \(N, 3\)"):
        front.trace("flat", trials=1)
