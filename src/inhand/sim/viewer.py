"""Recorded motion in MuJoCo's viewer; the one place that needs a display."""

import time
from importlib import import_module

import mujoco
import numpy as np

from inhand.errors import InputError, needs_extra
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.engine import Body, Hand
from inhand.sim.model import build_model
from inhand.sim.scene import SceneSpec
from inhand.sim.spatial_model import build_spatial_model


def play(hand: Hand, spec: Body, joint_angles: Array, object_pose: Array, when: Array) -> None:
    """Show joint angles `(T, n)` and object poses `(T, 7)` at times `(T,)` [s], again and again until closed.

    Raises:
        InputError: the viewer is not installed.
    """
    try:
        viewer = import_module("mujoco.viewer")
    except ImportError as error:
        raise needs_extra("viewer", f"the viewer ({error})") from error
    model, middle, seen = _scene(hand, spec)
    _light(model)
    data = mujoco.MjData(model)
    with viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False) as window:
        window.cam.lookat[:] = middle
        window.cam.distance, window.cam.azimuth, window.cam.elevation = 0.55, *seen
        start = time.monotonic()
        while window.is_running():
            shown = (time.monotonic() - start) % (when[-1] - when[0] + 1.0)
            row = min(int(np.searchsorted(when - when[0], shown)), len(when) - 1)
            data.qpos[:] = np.concatenate([joint_angles[row], object_pose[row]])
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(0.01)


def _scene(hand: Hand, spec: Body) -> tuple[mujoco.MjModel, tuple[float, float, float], tuple[float, float]]:
    """Return the model, where the viewer looks [m], and from which side and how high [deg].

    Raises:
        InputError: a hand in the plane with an object in space, or the other way round.
    """
    if isinstance(hand, SpatialHand) and isinstance(spec, SolidSpec):
        return build_spatial_model(hand, spec, SceneSpec()), hand.start_position, (118.0, -24.0)
    if isinstance(hand, HandSpec) and isinstance(spec, ObjectSpec):
        return build_model(hand, spec, SceneSpec()), (0.0, hand.finger_length / 2, spec.height / 2), (90.0, -65.0)
    raise InputError(f"{hand.name} and {spec.name} are not both of the plane or both of space: give trials of a run")


def _light(model: mujoco.MjModel) -> None:
    """Give floor, hand and object colours, and the scene enough light to see them."""
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.5
    colours = {"floor": (0.93, 0.94, 0.95, 1), "palm": (0.45, 0.5, 0.56, 1), "object": (0.95, 0.6, 0.2, 1)}
    for geom in range(model.ngeom):
        model.geom_rgba[geom] = colours.get(model.geom(geom).name.split("_")[0], (0.6, 0.65, 0.7, 1))
