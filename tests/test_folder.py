"""The folder of a run: nothing overwritten by accident, nothing left half written."""

import asyncio
import errno
import sys
from pathlib import Path

import pytest

from inhand.errors import InputError
from inhand.folders import MARK, check_folder, is_file, run_folder


def a_run(out: Path, text: str = "old") -> None:
    out.mkdir(parents=True)
    (out / MARK).write_text(text)
    (out / "figures").mkdir()
    (out / "figures" / "asterisk.png").write_text(text)


def written_to(out: Path, text: str, failure: BaseException | None = None) -> None:
    """Write a run and, if asked, fail before it is complete."""
    with run_folder(out, overwrite=True) as folder:
        (folder / MARK).write_text(text)
        if failure is not None:
            raise failure


def everything(folder: Path) -> dict[str, str]:
    return {str(each.relative_to(folder)): each.read_text() for each in folder.rglob("*") if each.is_file()}


def test_new_and_empty_folders_are_fine(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    check_folder(tmp_path / "new" / "deep", overwrite=False)
    check_folder(tmp_path / "empty", overwrite=False)


def test_another_run_is_kept_unless_told_otherwise(tmp_path: Path) -> None:
    a_run(tmp_path / "run")
    with pytest.raises(InputError, match=r"--out .*run holds the results of a run; give another folder, or --overwri"):
        check_folder(tmp_path / "run", overwrite=False)
    check_folder(tmp_path / "run", overwrite=True)


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_that_is_no_run_is_never_replaced(overwrite: bool, tmp_path: Path) -> None:
    (tmp_path / "letters.txt").write_text("dear")
    with pytest.raises(InputError, match=r"--out .* holds files that are no run of this kind; give another folder"):
        check_folder(tmp_path, overwrite=overwrite)


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("text")
    with pytest.raises(InputError, match=r"--out .*file is a file; give a folder that does not exist yet"):
        check_folder(tmp_path / "file", overwrite=True)


def test_a_folder_below_a_file_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("text")
    with pytest.raises(InputError, match=r"--out .*run: .*file is a file"):
        check_folder(tmp_path / "file" / "run", overwrite=False)


def test_the_current_folder_is_replaced_or_refused_but_never_a_crash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    message = ""
    try:
        check_folder(Path(), overwrite=False)
        written_to(Path(), "new")
    except InputError as error:
        message = str(error)
    assert message.startswith("--out") if message else (tmp_path / "here" / MARK).read_text() == "new"


def test_success_puts_the_new_run_in_place(tmp_path: Path) -> None:
    out = tmp_path / "results" / "run"
    with run_folder(out, overwrite=True) as folder:
        (folder / MARK).write_text("new")
        assert not out.exists()
    assert everything(out) == {MARK: "new"}
    assert [each.name for each in out.parent.iterdir()] == ["run"]


def test_success_replaces_all_of_the_old_run(tmp_path: Path) -> None:
    out = tmp_path / "run"
    a_run(out)
    with run_folder(out, overwrite=True) as folder:
        (folder / MARK).write_text("new")
        assert everything(out)[MARK] == "old"
    assert everything(out) == {MARK: "new"}


@pytest.mark.parametrize("failure", [RuntimeError("no"), KeyboardInterrupt(), InputError("no")])
def test_a_failure_leaves_the_old_run_untouched_and_nothing_else(tmp_path: Path, failure: BaseException) -> None:
    out = tmp_path / "run"
    a_run(out)
    before = everything(out)
    with pytest.raises(type(failure)):
        written_to(out, "half", failure)
    assert everything(out) == before
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


def test_what_a_killed_run_left_is_cleared(tmp_path: Path) -> None:
    (tmp_path / "run.part").mkdir()
    (tmp_path / "run.part" / "stale.txt").write_text("stale")
    with run_folder(tmp_path / "run", overwrite=True) as folder:
        (folder / MARK).write_text("new")
    assert everything(tmp_path) == {f"run/{MARK}": "new"}


def test_a_link_to_a_run_is_followed_or_refused_but_never_a_crash(tmp_path: Path) -> None:
    a_run(tmp_path / "real")
    (tmp_path / "link").symlink_to(tmp_path / "real", target_is_directory=True)
    message = ""
    try:
        check_folder(tmp_path / "link", overwrite=True)
        written_to(tmp_path / "link", "new")
    except InputError as error:
        message = str(error)
    assert message.startswith("--out") if message else (tmp_path / "link" / MARK).read_text() == "new"
    assert {each.name for each in tmp_path.iterdir()} == {"real", "link"}


def test_what_a_killed_run_left_does_not_stop_the_next(tmp_path: Path) -> None:
    out = tmp_path / "run"
    for name, text in (("run", "first"), ("run.old", "older"), ("run.part", "half")):
        (tmp_path / name).mkdir()
        (tmp_path / name / MARK).write_text(text)
    written_to(out, "second")
    assert (out / MARK).read_text() == "second"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_an_old_run_that_a_kill_left_aside_comes_back(tmp_path: Path) -> None:
    a_run(tmp_path / "run.old")
    with pytest.raises(InputError, match="holds the results of a run"), run_folder(tmp_path / "run", overwrite=False):
        pass
    assert everything(tmp_path / "run")[MARK] == "old"


def test_a_full_disk_is_told_and_what_was_there_stays(tmp_path: Path) -> None:
    a_run(tmp_path / "run")
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(InputError, match=r"--out .*run cannot be written: No space left on device; give another fold"):
        written_to(tmp_path / "run", "half", full)
    assert everything(tmp_path / "run")[MARK] == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x" * 300, "cannot be written: File name too long; give another folder"),
        ("x" * 252, "cannot be written: File name too long; give another folder"),
        ("loop", "cannot be written: Too many levels of symbolic links; give another folder"),
        ("loop/run", "cannot be written: Too many levels of symbolic links; give another folder"),
        ("a\0b", "holds a NUL, which no name of a folder can; give another folder"),
        ("/proc/no/run", "cannot be written: "),
    ],
)
def test_names_that_no_system_takes(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(InputError, match="--out") as told, run_folder(tmp_path / name, overwrite=True):
        pass
    assert text in str(told.value)
    assert [each.name for each in tmp_path.iterdir()] == ["loop"]


HOLDS = """
import sys, time
import asyncio
import errno
import sys
from pathlib import Path
from inhand.folders import run_folder
with run_folder(Path(sys.argv[1]), overwrite=True):
    print("ready", flush=True)
    time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such lock")
def test_a_second_run_is_refused_while_the_first_lives_and_not_after(tmp_path: Path) -> None:
    async def first() -> None:
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", HOLDS, tmp_path / "run", stdout=pipe)
        assert process.stdout is not None
        assert await asyncio.wait_for(process.stdout.readline(), 30) == b"ready\n"
        with pytest.raises(InputError, match="another run is writing there; wait until it has ended, or give another"):
            written_to(tmp_path / "run", "second")
        assert (tmp_path / "run.part").is_dir()
        process.kill()
        await process.wait()

    asyncio.run(first())
    written_to(tmp_path / "run", "second")
    assert everything(tmp_path) == {f"run/{MARK}": "second"}


def test_no_file_has_a_name_too_long_or_with_a_nul(tmp_path: Path) -> None:
    (tmp_path / "there").touch()
    assert is_file(tmp_path / "there")
    assert not any(is_file(tmp_path / name) for name in ("elsewhere", "x" * 300, "a\0b"))
