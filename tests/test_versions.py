"""The versions a run is signed with."""

from pathlib import Path

import pytest

from inhand.versions import PACKAGES, commit_of, versions

HASH = "1f" * 20


def test_every_package_has_a_version() -> None:
    found = versions()
    assert set(found) - {"commit"} == {"python", *PACKAGES}
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
