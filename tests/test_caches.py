"""Caches on disk: what a result is named by, and files that are damaged, strange, too many, or cannot be written."""

import json
import os
import zlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from inhand import caches, compiled
from inhand.aside import here
from inhand.caches import Arrays, cached, keep, key_of, look_up, sources
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.sim.engines import compile_aside, step_once

P = ParamSpec("P")
R = TypeVar("R")
MODULE = "inhand.hands.shapes"
RESULT: Arrays = {"way": np.array(0.1), "cells": np.arange(6).reshape(2, 3)}
HELD = parse_hand_name("2v2_50.50_50.50_1.1_53"), CATALOGUE["cube_39"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(caches.PLACE, str(tmp_path))
    return tmp_path / "results"


def same(found: Arrays | None, expected: Arrays = RESULT) -> bool:
    if found is None or found.keys() != expected.keys():
        return False
    return all(found[name].dtype == each.dtype and np.array_equal(found[name], each) for name, each in expected.items())


def test_what_is_known_is_not_computed_again(folder: Path) -> None:
    computed = []

    def compute() -> Arrays:
        computed.append(1)
        return RESULT

    for _ in range(3):
        assert same(cached("limit", HELD, MODULE, compute))
    assert len(computed) == 1
    assert [file.name for file in folder.iterdir()] == [key_of("limit", HELD, MODULE)]
    cached("limit", (HELD[0], CATALOGUE["triangle"]), MODULE, compute)
    assert len(computed) == 2
    keep("nothing", {})
    assert look_up("nothing") == {}


def test_a_name_depends_on_all_that_the_result_does(monkeypatch: pytest.MonkeyPatch) -> None:
    hand, cube = HELD
    inputs: list[object] = [
        HELD,
        (hand, replace(cube, mass=cube.mass * (1 + 1e-15))),
        (replace(hand, left=replace(hand.left, bend=1)), cube),
        (*HELD, None),
        (hand, (cube,)),
        ("12", "3"),
        ("1", "23"),
        (12, 3),
        (12.0, 3),
        np.arange(4),
        np.arange(4.0),
        np.arange(4).reshape(2, 2),
        {"a": 1},
        {"b": 1},
    ]
    keys = [key_of("limit", each, MODULE) for each in inputs]
    keys += [key_of("plan", HELD, MODULE), key_of("limit", HELD, "inhand.hands.fit")]
    monkeypatch.setattr(caches, "_versions", lambda: "another")
    keys.append(key_of("limit", HELD, MODULE))
    assert len(set(keys)) == len(keys)
    with pytest.raises(TypeError, match="function is nothing that a cache can name a result by"):
        key_of("limit", cached, MODULE)


def test_sources_are_those_of_the_module_and_of_all_that_it_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "room").mkdir()
    files = {
        "room/a.py": "from inhand.room import (\n    b,\n)\n",
        "room/b.py": "def f():\n    from inhand.c import X\n",
        "c.py": "import numpy\nX = 1\n",
        "room/other.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(caches, "PACKAGE", tmp_path)
    digests = []
    for changed in ("room/other.py", "room/a.py", "room/b.py", "c.py"):
        with (tmp_path / changed).open("a", encoding="utf-8") as file:
            file.write("# changed\n")
        sources.cache_clear()
        digests.append(sources("inhand.room.a"))
        if changed == "room/other.py":
            before = digests.pop()
    sources.cache_clear()
    assert len({before, *digests}) == 4
    (tmp_path / "room/other.py").write_text("# again\n", encoding="utf-8")
    assert sources("inhand.room.a") == digests[-1]
    sources.cache_clear()


@pytest.mark.parametrize("damage", [b"", b"no", "cut", "byte", "other"])
def test_a_file_that_is_not_what_was_written_is_made_anew(folder: Path, damage: bytes | str) -> None:
    key = key_of("limit", HELD, MODULE)
    keep(key, RESULT)
    assert same(look_up(key))
    file, other = folder / key, folder / "limit-other"
    content = file.read_bytes()
    if damage == "other":  # a whole file of another name
        keep(other.name, RESULT)
        other.replace(file)
    else:
        spoilt = {"cut": content[:-1], "byte": content[:-9] + b"?" + content[-8:]}
        file.write_bytes(damage if isinstance(damage, bytes) else spoilt[damage])
    assert look_up(key) is None
    assert same(cached("limit", HELD, MODULE, lambda: RESULT))
    assert same(look_up(key))


def test_without_a_place_to_write_every_run_computes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    for place in (tmp_path / "file", "off"):
        monkeypatch.setenv(caches.PLACE, str(place))
        assert same(cached("limit", HELD, MODULE, lambda: RESULT))
        assert look_up(key_of("limit", HELD, MODULE)) is None
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert caches.base().name == "inhand"


def test_what_was_not_used_for_longest_is_dropped(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"limit-{k}" for k in range(4)]
    for age, name in enumerate(names[:3]):
        keep(name, RESULT)
        os.utime(folder / name, (age, age))
    assert same(look_up(names[0]))  # now used last
    size = (folder / names[0]).stat().st_size
    monkeypatch.setattr(caches, "LARGEST", 3 * size)
    monkeypatch.setattr(caches, "ROUNDS", 1)
    keep(names[3], RESULT)
    assert {path.name for path in folder.iterdir()} == {names[0], names[2], names[3]}


def test_many_write_and_read_one_result_at_once(folder: Path) -> None:
    results = [{"many": np.full(50_000, k)} for k in range(4)]

    def work(k: int) -> Arrays | None:
        keep("limit-one", results[k % 4])
        return look_up("limit-one")

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(work, range(64)))
    for each in found:
        assert each is not None
        assert_array_equal(each["many"], each["many"][0])
    assert [path.name for path in folder.iterdir()] == ["limit-one"]


def test_damaged_code_is_compiled_anew_and_where_none_can_be_kept_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def double(value: float) -> float:
        return 2.0 * value

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert compiled.kernel(double)(2.0) == 4.0
    folder = next(tmp_path.iterdir())
    assert json.loads((folder / "double.json").read_text(encoding="utf-8"))
    assert compiled.kernel(double)(2.0) == 4.0
    assert caplog.text.count("(double), once for this machine: up to 15 s") == 1
    (kept,) = folder.rglob("*.nbc")
    kept.write_bytes(kept.read_bytes()[:-1] + b"?")
    assert compiled.kernel(double)(2.0) == 4.0
    assert caplog.text.count("(double), once for this machine") == 2
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert compiled.kernel(double)(2.0) == 4.0
    assert "(double), up to 15 s in every run, as the cache cannot be written: set NUMBA_CACHE_DIR" in caplog.text


def test_a_kernel_that_another_process_compiles_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl", reason="files cannot be locked here")

    def triple(value: float) -> float:
        return 3.0 * value

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    run = compiled.kernel(triple)
    folder = next(tmp_path.iterdir())
    assert not compiled.is_kept(triple.__module__, "triple")
    with (folder / "triple.lock").open("w") as file, ThreadPoolExecutor(1) as pool:
        fcntl.flock(file, fcntl.LOCK_EX)
        found = pool.submit(run, 2.0)
        with pytest.raises(TimeoutError):
            found.result(timeout=0.2)
        assert not list(folder.rglob("*.nbc"))
        fcntl.flock(file, fcntl.LOCK_UN)
        assert found.result() == 6.0
    assert compiled.is_kept(triple.__module__, "triple")


def test_a_constant_among_arguments_is_compiled_as_any_number_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lift(value: float, by: tuple[int, int]) -> float:
        return value + by[1]

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    lifted = compiled.leaf(lift)

    def both(value: float, by: int) -> float:
        return lifted(value, (0, 1)) + lifted(value, (by, by))

    assert compiled.kernel(both)(2.0, 3) == 8.0
    assert len(vars(lifted)["overloads"]) == 1


def test_the_planar_engine_is_compiled_aside_where_it_is_not_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[object] = []

    def aside(function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> Callable[[], R]:
        begun.append(function)
        return here(function, *args, **kwargs)

    for kept in (True, False):
        monkeypatch.setattr(compiled, "is_kept", lambda *_, kept=kept: kept)
        compile_aside(aside, "planar")
        compile_aside(aside, "mujoco")
    assert begun == [step_once]


def test_jax_keeps_its_programs_beside_the_kernels_unless_it_was_told_where_and_drops_damaged_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = pytest.importorskip("jax", reason="learning needs the extra `rl`").config
    from inhand.learning.ahead import ZSTD, keep_programs

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told, least = settings.jax_compilation_cache_dir, settings.jax_persistent_cache_min_compile_time_secs
    try:
        settings.update("jax_compilation_cache_dir", str(tmp_path / "mine"))
        keep_programs()
        assert settings.jax_compilation_cache_dir == str(tmp_path / "mine")
        settings.update("jax_compilation_cache_dir", None)
        keep_programs()
        folder = Path(settings.jax_compilation_cache_dir)
        assert folder.parent == tmp_path
        settings.update("jax_compilation_cache_dir", None)
        sound = zlib.compress(b"a program" * 100)
        for name, content in {"sound": sound, "half": sound[:9], "empty": b"", "zstd": ZSTD + b"another"}.items():
            (folder / f"{name}-cache").write_bytes(content)
        keep_programs()
        assert {file.name for file in folder.iterdir()} == {"sound-cache", "zstd-cache"}
    finally:
        settings.update("jax_compilation_cache_dir", told)
        settings.update("jax_persistent_cache_min_compile_time_secs", least)
