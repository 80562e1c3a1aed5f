"""Names of the engines; imports nothing heavy, so that `--help` stays fast."""

from typing import Literal

Engine = Literal["planar", "mujoco", "bullet"]
"""Physics engine: MuJoCo's law in the plane, MuJoCo in three dimensions (several times as slow), or PyBullet as a
witness (extra `bullet`; much slower)."""
ENGINE: Engine = "planar"
"""The engine where none is asked for."""
SPATIAL: Engine = "mujoco"
"""The engine of hands in space."""
UNTOLD: Engine = "mujoco"
"""The engine of files that name none."""
