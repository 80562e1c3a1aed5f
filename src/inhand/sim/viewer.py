"""Recorded motion in MuJoCo's viewer; the one place that needs a display."""

from __future__ import annotations

import time

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.sim.hands import HandSpec
from inhand.sim.model import SceneSpec, build_model
from inhand.sim.objects import ObjectSpec


def play(hand: HandSpec, spec: ObjectSpec, joint_angles: Array, object_pose: Array, when: Array) -> None:
    """Show joint angles `(T, n)` and object poses `(T, 7)` at times `(T,)` [s], again and again until closed.

    Raises:
        InputError: the viewer is not installed.
    """
    try:
        import mujoco.viewer
    except ImportError as error:
        raise InputError(f'the viewer is not installed ({error}): pip install "inhand[viewer]"') from error
    model = build_model(hand, spec, SceneSpec())
    data = mujoco.MjData(model)
    with mujoco.viewer.launch_passive(model, data) as window:
        start = time.monotonic()
        while window.is_running():
            shown = (time.monotonic() - start) % (when[-1] - when[0] + 1.0)
            row = min(int(np.searchsorted(when - when[0], shown)), len(when) - 1)
            data.qpos[:] = np.concatenate([joint_angles[row], object_pose[row]])
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(0.01)
