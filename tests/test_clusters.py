"""Work past one machine: a worker that dies costs its piece's second try and nothing else; no cluster there."""

import importlib.util
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import pytest

from commands import Call
from inhand.asterisk_test import clusters
from inhand.asterisk_test.clusters import on_dask, on_ray, on_slurm
from inhand.control.run_config import SpreadConfig
from inhand.errors import InputError

Work = Callable[[tuple[Path, int]], int]
Backend = Literal["loky", "ray", "dask", "slurm"]
Spread = Callable[[Work, list[tuple[Path, int]], SpreadConfig], Iterator[int]]


@pytest.fixture(autouse=True)
def workers_find_this_module(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let processes that begin anew import what this one can."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))


def needs(package: str) -> pytest.MarkDecorator:
    """Leave out a test where a package is missing."""
    return pytest.mark.skipif(importlib.util.find_spec(package) is None, reason=f"{package} is not installed")


def piece(job: tuple[Path, int]) -> int:
    """Note that a piece was begun; the first time that piece 1 is, its worker dies."""
    folder, number = job
    with (folder / str(number)).open("a") as file:
        file.write(f"{os.getpid()}\n")
    if number == 1 and len((folder / "1").read_text().split()) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def doomed(job: tuple[Path, int]) -> int:
    """Die whenever it is begun."""
    os.kill(os.getpid(), signal.SIGKILL)
    return job[1]


def on_local_slurm(work: Work, jobs: list[tuple[Path, int]], config: SpreadConfig) -> Iterator[int]:
    """Do jobs by submitit's own processes, in the place of SLURM's."""
    return on_slurm(work, jobs, config, cluster="local")


BACKENDS = [
    pytest.param("loky", clusters.spread, id="loky"),
    pytest.param("ray", on_ray, id="ray", marks=needs("ray")),
    pytest.param("dask", on_dask, id="dask", marks=needs("distributed")),
    pytest.param("slurm", on_local_slurm, id="slurm", marks=needs("submitit")),
]


@pytest.mark.parametrize(("backend", "spread"), BACKENDS)
def test_a_worker_that_dies_costs_its_piece_a_second_try(backend: Backend, spread: Spread, tmp_path: Path) -> None:
    config = SpreadConfig(jobs=2, backend=backend, out=tmp_path)
    found = sorted(spread(piece, [(tmp_path, number) for number in range(5)], config))
    assert found == [0, 1, 4, 9, 16]
    tries = {number: len((tmp_path / str(number)).read_text().split()) for number in range(5)}
    assert tries[1] == 2
    if backend != "loky":  # whose other process goes with the one that dies
        assert tries == {0: 1, 1: 2, 2: 1, 3: 1, 4: 1}


@pytest.mark.parametrize(("backend", "spread"), BACKENDS)
def test_a_piece_that_always_kills_its_worker_ends_the_study(backend: Backend, spread: Spread, tmp_path: Path) -> None:
    config = SpreadConfig(jobs=2, backend=backend, out=tmp_path)
    with pytest.raises(InputError, match=r"3 times.*the same command goes on where this one stopped"):
        list(spread(doomed, [(tmp_path, 1)], config))


@needs("ray")
def test_a_ray_cluster_that_is_not_there_is_told_with_the_time_waited(tmp_path: Path, inhand: Call) -> None:
    words = ("--hands", "2v2_50.50_50.50_1.1_53", "--objects", "cube_39", "--directions", "Right")
    cluster = ("--backend", "ray", "--address", "127.0.0.1:1")
    code, _, err = inhand("sweep", *words, *cluster, "--out", tmp_path / "sweep")
    assert code == 2
    assert "--address 127.0.0.1:1: no ray cluster answered within " in err
    assert "start one with `ray start --head`" in err


@needs("distributed")
def test_a_dask_cluster_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("inhand.asterisk_test.clusters.WAIT_S", 1.0)
    config = SpreadConfig(backend="dask", address="tcp://127.0.0.1:1", out=tmp_path)
    with pytest.raises(InputError, match=r"no dask cluster answered within \d+ s; start one with `dask scheduler`"):
        list(on_dask(piece, [(tmp_path, 0)], config))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--jobs=-1",), "--jobs -1: give how many to compute at a time"),
        (("--address", "auto"), "--address is of a cluster: give it with --backend ray or dask, not loky"),
        (("--backend", "spark"), "invalid choice 'spark'"),
    ],
)
@pytest.mark.parametrize(
    "command", ["sweep", "robustness", "design", pytest.param("train --seeds 0 1", marks=needs("jax"))]
)
def test_what_cannot_be_spread_is_refused(
    command: str, words: tuple[str, ...], told: str, inhand: Call, tmp_path: Path
) -> None:
    code, _, err = inhand(*command.split(), *words, "--out", tmp_path / "out")
    assert code == 2
    assert told in " ".join(err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("backend", "package"), [("ray", "ray"), ("dask", "distributed"), ("slurm", "submitit")])
def test_a_missing_extra_is_named(
    backend: str, package: str, inhand: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("inhand.asterisk_test.clusters.find_spec", lambda name: None if name == package else object())
    code, _, err = inhand("sweep", "--backend", backend)
    assert code == 2
    assert f"--backend {backend} needs the extra `{backend}`: pip install 'inhand[{backend}]'" in err
    assert not list(tmp_path.iterdir())
