"""Versions of what a run ran on, for its passport."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path

PACKAGES = ("inhand", "mujoco-core", "pybullet", "numpy", "scipy", "similaritymeasures", "matplotlib")
REPOSITORY = Path(__file__).resolve().parents[3]
"""Where this package's checkout is, if it runs from one."""


def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of the packages whose numbers enter the results.

    In a checkout `commit` names the last one; changes that are not committed do not show.
    """
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    commit = commit_of(REPOSITORY)
    return found if commit is None else found | {"commit": commit}


def commit_of(repository: Path) -> str | None:
    """Return the commit a git repository is at, or None where it is none or has none; reads git's files only."""
    git = repository / ".git"
    try:
        head = (git / "HEAD").read_text(encoding="ascii").strip()
        reference = head.removeprefix("ref: ")
        if reference == head:
            return head
        if (git / reference).is_file():
            return (git / reference).read_text(encoding="ascii").strip()
        packed = (git / "packed-refs").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((line.split()[0] for line in packed if line.endswith(f" {reference}")), None)
