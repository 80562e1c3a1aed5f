"""`inhand view`: a trial in MuJoCo's own viewer."""

import os
import sys
from pathlib import Path

from inhand.control.trial import load_trial
from inhand.errors import InputError


def run_view(path: Path, speed: float) -> None:
    """Play a trial until the viewer's window is closed.

    Raises:
        InputError: no trial, a speed that is not positive, no display, or the extra `viewer` is not installed.
    """
    if not speed > 0:
        raise InputError(f"--speed {speed:g}: give a positive number; 1 is real time")
    trial = load_trial(path)
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("no display here: `inhand view` needs a screen; a run's figures/replay.gif needs none")
    from inhand.sim.viewer import play

    play(trial.passport.hand, trial.passport.object, trial.joint_angles, trial.object_pose, trial.time / speed)
