"""Fixtures shared by the tests."""

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings

from commands import Call, warm
from inhand import caches, cli, cores
from inhand.compiled import programs_folder

if folder := programs_folder():  # what one worker compiles with JAX, the other and the next run read
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")

settings.register_profile("fuzz", max_examples=2000)  # of all kinds together, see test_fuzz
settings.register_profile("few", max_examples=50)
settings.load_profile("few")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Let the second worker import the tests from the last on: what one of two has compiled the other reads."""
    everything = session.config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if everything and os.environ.get("PYTEST_XDIST_WORKER") == "gw1":
        for path in sorted(Path(__file__).parent.glob("test_*.py"), reverse=True):
            with suppress(Exception, pytest.skip.Exception):  # told where it is collected
                import_module(path.stem)


def pytest_collection_finish() -> None:
    """Leave what is imported out of what the garbage collector looks through, and let it look less often."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep results where no run before has left any, and both workers find them; compiled code stays where it is."""
    place = tmp_path_factory.getbasetemp()
    shared = (place.parent if "PYTEST_XDIST_WORKER" in os.environ else place) / "results"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", os.environ.get("NUMBA_CACHE_DIR") or str(caches.base() / "compiled"))
        patch.setenv(caches.PLACE, str(shared))
        yield


@pytest.fixture(scope="session", autouse=True)
def one_process() -> Iterator[None]:
    """Draw and plan in the tests' own process: others cost seconds for each command, and each worker has a core."""
    with cores.one_core():
        yield


@pytest.fixture(scope="session", autouse=True)
def short_films() -> Iterator[None]:
    """Show every eighth decision of a trial where a report has a film: each frame is drawn in the same way."""
    with pytest.MonkeyPatch.context() as patch:
        for place in ("asterisk_test.tested", "asterisk_test.report", "asterisk_test.spatial.report", "tracing.report"):
            patch.setattr(f"inhand.{place}.FRAME_STEPS", 8)
        yield


@pytest.fixture(scope="session")
def asterisk_data() -> Path:
    """Return the folder of recorded human trials, which lies beside the repository and is not part of it."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "asterisk-data"
    if not folder.is_dir():
        pytest.skip("the recorded human trials (shared/asterisk-data beside the repository) are not here")
    return folder


@pytest.fixture
def inhand(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Call:
    """Return the command."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["inhand", *(str(word) for word in words)])
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = int(stop.code or 0)
        out, err = capsys.readouterr()
        return code, out, warm(err)

    return call
