"""Names of the engines; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from typing import Literal

Engine = Literal["planar", "mujoco", "bullet"]
"""Physics engine: MuJoCo, or PyBullet as a witness (extra `bullet`; much slower)."""
MUJOCO: Engine = "mujoco"
"""The engine where none is asked for."""
