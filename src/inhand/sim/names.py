"""Names of the engines; imports nothing heavy, so that `--help` stays fast."""

from typing import Literal

Engine = Literal["mujoco", "planar", "bullet"]
"""Physics engine: MuJoCo in three dimensions, the same law in the plane (several times as fast), or PyBullet as a
witness (extra `bullet`; much slower)."""
MUJOCO: Engine = "mujoco"
"""The engine where none is asked for."""
