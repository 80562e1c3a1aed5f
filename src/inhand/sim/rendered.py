"""Hand and object as MuJoCo draws them: the scene of its viewer and its renderer, and pictures without a window."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError, needs_extra
from inhand.geometry import Array, spatial
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.engine import Body, Hand
from inhand.sim.model import build_model
from inhand.sim.scene import SceneSpec
from inhand.sim.spatial_model import build_spatial_model

SIDE = 400
"""Width and height of a picture [pixels]."""
FAR, NEAR = 0.55, 0.36
"""From where a window and a picture look at the middle [m]."""
COLOURS = {"floor": (0.93, 0.94, 0.95, 1), "palm": (0.45, 0.5, 0.56, 1), "object": (0.95, 0.6, 0.2, 1)}
"""Of bodies by the first word of their names; links have another."""
WAY_RGBA = np.array([0.1, 0.12, 0.14, 1.0], dtype=np.float32)
WAY_RADIUS = 0.0008
"""Of the rod that shows the way to go [m]."""


def scene_of(hand: Hand, spec: Body) -> tuple[mujoco.MjModel, mujoco.MjvCamera]:
    """Return a model in colours and light, and a camera that looks at it.

    Raises:
        InputError: a hand in the plane with an object in space, or the other way round.
    """
    camera = mujoco.MjvCamera()
    camera.distance = FAR
    if isinstance(hand, SpatialHand) and isinstance(spec, SolidSpec):
        model = build_spatial_model(hand, spec, SceneSpec())
        camera.lookat[:], camera.azimuth, camera.elevation = hand.start_position, 118.0, -24.0
    elif isinstance(hand, HandSpec) and isinstance(spec, ObjectSpec):
        model = build_model(hand, spec, SceneSpec())
        camera.lookat[:] = (0.0, hand.finger_length / 2, spec.height / 2)
        camera.azimuth, camera.elevation = 90.0, -65.0
    else:
        raise InputError(
            f"{hand.name} and {spec.name} are not both of the plane or both of space: give trials of a run"
        )
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.5
    for geom in range(model.ngeom):
        model.geom_rgba[geom] = COLOURS.get(model.geom(geom).name.split("_")[0], (0.6, 0.65, 0.7, 1))
    return model, camera


class Rendered:
    """Pictures of worlds of one hand and one object by MuJoCo's renderer, with its light, shadows and depth."""

    def __init__(self, hand: HandSpec, spec: ObjectSpec) -> None:
        """Make the scene and what draws it.

        Raises:
            InputError: MuJoCo's renderer is not installed, or finds nothing to draw with.
        """
        self._model, self._camera = scene_of(hand, spec)
        self._camera.distance = NEAR
        self._data, self._height = mujoco.MjData(self._model), spec.height / 2
        try:
            self._renderer: Any = mujoco.Renderer(self._model, SIDE, SIDE)
        except ImportError as error:
            raise needs_extra("viewer", f'pictures="mujoco" ({error})') from error
        except (RuntimeError, AttributeError, mujoco.FatalError) as error:
            raise InputError(
                f'pictures="mujoco" finds no GL to draw with ({error}): set MUJOCO_GL to egl, osmesa or glfw, or take'
                ' pictures="drawn", which needs none'
            ) from error

    def picture(self, joints: Array, pose: Array, way: Array) -> NDArray[np.uint8]:
        """Return the picture `(400, 400, 3)` of a world, as `inhand.plots.live.Live` does."""
        self._data.qpos[:] = np.concatenate([joints, spatial(pose, self._height)])
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        scene = self._renderer.scene
        rod = scene.geoms[scene.ngeom]
        start, end = np.column_stack([way, np.full(2, 2 * self._height)])
        mujoco.mjv_initGeom(rod, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.eye(3).ravel(), WAY_RGBA)
        mujoco.mjv_connector(rod, mujoco.mjtGeom.mjGEOM_CAPSULE, WAY_RADIUS, start, end)
        scene.ngeom += 1
        found: NDArray[np.uint8] = self._renderer.render()
        return found
