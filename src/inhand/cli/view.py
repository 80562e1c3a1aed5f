"""`inhand view`: a trial in MuJoCo's own viewer."""

import os
import sys

from inhand.cli.answer import Answer
from inhand.cli.commands import ViewConfig
from inhand.control.spatial_trial import load_any
from inhand.errors import InputError


def run_view(config: ViewConfig) -> Answer:
    """Play a trial until the viewer's window is closed.

    Raises:
        InputError: no trial, a speed that is not positive, no display, or the extra `viewer` is not installed.
    """
    if not config.speed > 0:
        raise InputError(f"--speed {config.speed:g}: give a positive number; 1 is real time")
    trial = load_any(config.trial)
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("no display here: `inhand view` needs a screen; a run's figures/replay.gif needs none")
    from inhand.sim.viewer import play

    play(trial.passport.hand, trial.passport.object, trial.joint_angles, trial.object_pose, trial.time / config.speed)
    return Answer()
