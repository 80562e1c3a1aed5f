"""Recorded motion in MuJoCo's viewer; the one place that needs a display."""

import time
from importlib import import_module

import mujoco
import numpy as np

from inhand.errors import needs_extra
from inhand.geometry import Array
from inhand.sim.engine import Body, Hand
from inhand.sim.rendered import scene_of


def play(hand: Hand, spec: Body, joint_angles: Array, object_pose: Array, when: Array) -> None:
    """Show joint angles `(T, n)` and object poses `(T, 7)` at times `(T,)` [s], again and again until closed.

    Raises:
        InputError: the viewer is not installed.
    """
    try:
        viewer = import_module("mujoco.viewer")
    except ImportError as error:
        raise needs_extra("viewer", f"the viewer ({error})") from error
    model, camera = scene_of(hand, spec)
    data = mujoco.MjData(model)
    with viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False) as window:
        for name in ("lookat", "distance", "azimuth", "elevation"):
            setattr(window.cam, name, getattr(camera, name))
        start = time.monotonic()
        while window.is_running():
            shown = (time.monotonic() - start) % (when[-1] - when[0] + 1.0)
            row = min(int(np.searchsorted(when - when[0], shown)), len(when) - 1)
            data.qpos[:] = np.concatenate([joint_angles[row], object_pose[row]])
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(0.01)
