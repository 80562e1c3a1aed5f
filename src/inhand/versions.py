"""Versions of what a run ran on, for its passport."""

import hashlib
import platform
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGES = ("inhand", "mujoco-core", "numba", "pybullet", "numpy", "scipy", "similaritymeasures", "matplotlib")
REPOSITORY = Path(__file__).resolve().parents[2]
"""Where this package's checkout is, if it runs from one."""


def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of the packages whose numbers enter the results.

    `source` is git's name for the code as it lies on the disk, in a checkout, with changes that are not committed, or
    installed: a commit whose `git rev-parse COMMIT:src/inhand` is the same holds that code. In a checkout `commit`
    names the last one.
    """
    found = {"python": platform.python_version(), "source": source()}
    found |= {name: version_of(name) for name in PACKAGES}
    commit = commit_of(REPOSITORY)
    return found if commit is None else found | {"commit": commit}


@cache
def version_of(package: str) -> str:
    """Return the version of an installed package, or that it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


@cache
def source() -> str:
    """Return git's name for the tree of this package's files."""
    return _tree(Path(__file__).parent).hex()


def _tree(folder: Path) -> bytes:
    """Return git's digest of a folder: of the names and digests of its files, folders sorted as if `/` ended them."""
    inside = sorted(folder.iterdir(), key=lambda path: path.name + "/" * path.is_dir())
    entries = [
        b"40000 %b\0%b" % (path.name.encode(), _tree(path))
        if path.is_dir()
        else b"100644 %b\0%b" % (path.name.encode(), _digest(b"blob", path.read_bytes()))
        for path in inside
        if path.name != "__pycache__"
    ]
    return _digest(b"tree", b"".join(entries))


def _digest(kind: bytes, content: bytes) -> bytes:
    return hashlib.sha1(b"%b %d\0%b" % (kind, len(content), content), usedforsecurity=False).digest()


def commit_of(repository: Path) -> str | None:
    """Return the commit a git repository is at, or None where it is none or has none; reads git's files only."""
    git = repository / ".git"
    try:
        common = git
        if git.is_file():  # a further working tree: its own HEAD, the branches of the first
            git = repository / git.read_text(encoding="utf-8").removeprefix("gitdir:").strip()
            common = git / (git / "commondir").read_text(encoding="utf-8").strip()
        head = (git / "HEAD").read_text(encoding="ascii").strip()
        reference = head.removeprefix("ref: ")
        if reference == head:
            return head
        if (common / reference).is_file():
            return (common / reference).read_text(encoding="ascii").strip()
        packed = (common / "packed-refs").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((line.split()[0] for line in packed if line.endswith(f" {reference}")), None)
