"""`inhand figures`: the figures of a run for a paper."""

from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import FiguresConfig
from inhand.pages import counted
from inhand.redrawn import redraw
from inhand.repeats import write_repeat


def run_figures(config: FiguresConfig) -> Answer:
    """Draw them and tell which there are."""
    out = config.out or Path("results/figures") / config.run.resolve().stem
    files = redraw(config.run, out, config.format, width_mm=config.width_mm, overwrite=config.overwrite)
    write_repeat(out, "figures", config)
    names = [file.relative_to(out).as_posix() for file in files]
    told = f"{counted(len(names), 'file')} in {out}: {', '.join(names)}"
    return Answer((), (told,), lambda: [{"file": name} for name in names], out)
