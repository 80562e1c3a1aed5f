"""`inhand view`: a trial in MuJoCo's own viewer, in a browser, or in Rerun's."""

import importlib.util
import os
import shlex
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
    """Play a trial until the viewer's window is closed, or write its page or recording and open that where it can be.

    Raises:
        InputError: no trial, a speed that is not positive, two ways to show it, or a file that is there already.
    """
    if not config.speed > 0:
        raise InputError(f"--speed {config.speed:g}: give a positive number; 1 is real time")
    trial = load_any(config.trial)
    if config.rerun and config.browser:
        raise InputError("--rerun and --browser are two ways to show a trial: give one of them")
    if config.rerun and config.out is not None and config.out.suffix != ".rrd":
        raise InputError(f"--out {config.out}: a recording for Rerun is a .rrd file")
    if config.out is not None and config.out.exists():
        raise InputError(f"--out {config.out} exists; give another name, or remove it first")
    if config.rerun:
        return _recorded(config, trial)
    why = _why_not(config)
    return _page(config, why) if why else _played(trial, config.speed)


def _why_not(config: ViewConfig) -> str:
    """Return why a trial is shown in a browser; empty where MuJoCo's viewer can show it."""
    if config.browser or config.out is not None:
        return "as asked for"
    if not _display():
        return "no display here"
    return "" if importlib.util.find_spec("glfw") else "MuJoCo's viewer needs the extra `viewer`"


def _display() -> bool:
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def _out(config: ViewConfig, suffix: str) -> Path:
    return config.out or Path(tempfile.mkdtemp(prefix="inhand-view-")) / f"{config.trial.stem}{suffix}"


def _recorded(config: ViewConfig, trial: AnyTrial) -> Answer:
    from inhand.control.rerun_log import write_recording

    out = _out(config, ".rrd")
    with writing(out):
        write_recording(trial, out, show=_display())
    hint = f"; look at it with: {shlex.join(['rerun', str(out)])}, or with --web-viewer in a browser"
    return Answer(sentences=(f"Recording: {out}{hint}",), out=out)


def _page(config: ViewConfig, why: str) -> Answer:
    from inhand.cli.report import page_of

    out = _out(config, ".html")
    with writing(out), in_place(out) as part:
        part.write_text(page_of((config.trial,)), encoding="utf-8")
    opened = webbrowser.open(out.resolve().as_uri())
    hint = "" if opened else "; open it in a browser, here or elsewhere"
    return Answer(sentences=(f"Page ({why}): {out}{hint}",), out=out)


def _played(trial: AnyTrial, speed: float) -> Answer:
    from inhand.sim.viewer import play

    play(trial.passport.hand, trial.passport.object, trial.joint_angles, trial.object_pose, trial.time / speed)
    return Answer()
