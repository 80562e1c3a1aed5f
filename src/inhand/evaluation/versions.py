"""Versions of what a run ran on, for its passport."""

from __future__ import annotations

import platform
from importlib import metadata

PACKAGES = ("inhand", "mujoco-core", "pybullet", "numpy", "scipy", "similaritymeasures", "matplotlib")


def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of the packages whose numbers enter the results."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found
