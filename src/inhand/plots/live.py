"""Pictures of worlds that run: the hand, the object and the way it is asked to go, each drawn over the one before."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.plots.scenes import scene_of
from inhand.plots.shapes import CLEAR, draw_scene, move_scene
from inhand.plots.sheet import new_figure
from inhand.plots.style import INK, LABEL_POINTS

SIDE_IN = 4.0
"""Width and height of a picture [in]; at the 100 dpi of `new_figure` 400 pixels, which films can be made of."""
ABOVE = 1.25
"""How far from the palm a picture reaches, in lengths of a finger."""


class Live:
    """Draws worlds of one hand and one object."""

    def __init__(self, hand: HandSpec, spec: ObjectSpec) -> None:
        """Draw what will move, once, where the object starts."""
        self._held, self._origin = (hand, spec), np.array(hand.start_position)
        figure = new_figure(SIDE_IN, SIDE_IN)
        self._canvas: Any = figure.canvas  # Agg's own methods carry no annotations
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.set_axis_off()
        bottom, top = -hand.palm_depth, ABOVE * hand.finger_length
        middle, half = (bottom + top) / 2 - self._origin[1], (top - bottom) / 2
        ax.set_xlim(-1e3 * half, 1e3 * half)
        ax.set_ylim(1e3 * (middle - half), 1e3 * (middle + half))
        scene = scene_of(hand, spec, np.zeros(hand.n_joints), hand.start_pose, self._origin)
        self._scene = draw_scene(ax, scene, CLEAR)
        (self._way,) = ax.plot([], [], color=INK, linewidth=1.4, linestyle=(0, (4, 3)), marker="x", zorder=2.0)
        self._told = ax.text(0.97, 0.97, "", transform=ax.transAxes, ha="right", va="top", fontsize=LABEL_POINTS)

    def picture(self, joints: Array, pose: Array, way: Array) -> NDArray[np.uint8]:
        """Return the picture `(400, 400, 3)` of a world.

        Args:
            joints: joint angles `(n_joints,)` [rad].
            pose: of the object `(3,)` [m, m, rad].
            way: where it began and where it is asked to go `(2, 2)` [m]; what it has gone is told in millimetres.
        """
        move_scene(self._scene, scene_of(*self._held, joints, pose, self._origin))
        self._way.set_data(*1e3 * (way - self._origin).T)
        self._told.set_text(f"{1e3 * np.hypot(*(pose[:2] - way[0])):.0f} mm")
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()
