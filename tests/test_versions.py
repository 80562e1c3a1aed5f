"""The versions a run is signed with."""

from pathlib import Path

import pytest

from inhand.versions import PACKAGES, REPOSITORY, _tree, commit_of, versions

HASH = "1f" * 20


def test_a_checkout_is_where_it_is_looked_for() -> None:
    assert Path(__file__).resolve().parents[1] == REPOSITORY
    if (REPOSITORY / ".git").exists():
        assert len(versions()["commit"]) == len(HASH)


def test_every_package_has_a_version() -> None:
    found = versions()
    assert set(found) - {"commit"} == {"python", "source", *PACKAGES}
    assert found["inhand"].count(".") == 2
    assert found["mujoco-core"].startswith("4.")


@pytest.mark.parametrize(
    ("files", "commit"),
    [
        ({"HEAD": f"{HASH}\n"}, HASH),
        ({"HEAD": "ref: refs/heads/main\n", "refs/heads/main": f"{HASH}\n"}, HASH),
        ({"HEAD": "ref: refs/heads/main\n", "packed-refs": f"# pack\n{HASH} refs/heads/main\n"}, HASH),
        ({"HEAD": "ref: refs/heads/main\n", "packed-refs": f"{HASH} refs/heads/other-main\n"}, None),
        ({"HEAD": "ref: refs/heads/main\n"}, None),
        ({}, None),
    ],
    ids=["detached", "branch", "packed", "other branch", "no commit", "no repository"],
)
def test_the_commit_is_read_from_gits_files(files: dict[str, str], commit: str | None, tmp_path: Path) -> None:
    for name, text in files.items():
        (tmp_path / ".git" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / ".git" / name).write_text(text)
    assert commit_of(tmp_path) == commit


def test_the_commit_of_a_further_working_tree_is_read_from_the_first(tmp_path: Path) -> None:
    own = tmp_path / "first" / ".git" / "worktrees" / "second"
    own.mkdir(parents=True)
    (own / "HEAD").write_text("ref: refs/heads/side\n")
    (own / "commondir").write_text("../..\n")
    (tmp_path / "second").mkdir()
    (tmp_path / "second" / ".git").write_text(f"gitdir: {own}\n")
    heads = tmp_path / "first" / ".git" / "refs" / "heads"
    heads.mkdir(parents=True)
    (heads / "side").write_text(f"{HASH}\n")
    assert commit_of(tmp_path / "second") == HASH


def test_the_source_is_what_git_calls_it(tmp_path: Path) -> None:
    (tmp_path / "a.d").mkdir()
    (tmp_path / "a.d" / "one.py").write_text("1\n")
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "two.py").write_text("2\n")
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "one.pyc").write_text("no source")
    assert _tree(tmp_path).hex() == "a59099bfb3a379960693cc3a9222e87584b9fcd3"
