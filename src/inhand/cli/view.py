"""`inhand view`: a trial in MuJoCo's own viewer, or in a browser."""

import importlib.util
import os
import sys
import tempfile
import webbrowser
from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import ViewConfig
from inhand.control.trial import AnyTrial, load_any
from inhand.errors import InputError
from inhand.folders import in_place, writing


def run_view(config: ViewConfig) -> Answer:
    """Play a trial until the viewer's window is closed, or make its page and open it in a browser if there is one.

    Raises:
        InputError: no trial, a speed that is not positive, or a page that is there already.
    """
    if not config.speed > 0:
        raise InputError(f"--speed {config.speed:g}: give a positive number; 1 is real time")
    trial = load_any(config.trial)
    if config.out is not None and config.out.exists():
        raise InputError(f"--out {config.out} exists; give another name, or remove it first")
    why = _why_not(config)
    return _page(config, why) if why else _played(trial, config.speed)


def _why_not(config: ViewConfig) -> str:
    """Return why a trial is shown in a browser; empty where MuJoCo's viewer can show it."""
    if config.browser or config.out is not None:
        return "as asked for"
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "no display here"
    return "" if importlib.util.find_spec("glfw") else "MuJoCo's viewer needs the extra `viewer`"


def _page(config: ViewConfig, why: str) -> Answer:
    from inhand.cli.report import page_of

    out = config.out or Path(tempfile.mkdtemp(prefix="inhand-view-")) / f"{config.trial.stem}.html"
    with writing(out), in_place(out) as part:
        part.write_text(page_of((config.trial,)), encoding="utf-8")
    opened = webbrowser.open(out.resolve().as_uri())
    hint = "" if opened else "; open it in a browser, here or elsewhere"
    return Answer(sentences=(f"Page ({why}): {out}{hint}",), out=out)


def _played(trial: AnyTrial, speed: float) -> Answer:
    from inhand.sim.viewer import play

    play(trial.passport.hand, trial.passport.object, trial.joint_angles, trial.object_pose, trial.time / speed)
    return Answer()
