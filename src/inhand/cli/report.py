"""`inhand report`: the page of a run for a browser, made of any saved folder; or of several runs side by side."""

import webbrowser
from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import ReportConfig
from inhand.errors import InputError
from inhand.folders import in_place, place_of, writing

COMPARED = Path("comparison.html")
"""Where the page of several runs is written where nothing else is said."""


def run_report(config: ReportConfig) -> Answer:
    """Write the page, and open it where asked for; nothing is simulated or computed again.

    Raises:
        InputError: no run, one that cannot be read, runs that cannot be compared, or a file that is there already.
    """
    if not config.runs:
        raise InputError("no run given: give the folder of one, or of several to compare")
    out, own = _place(config)
    place_of(out)
    if out.is_dir():
        raise InputError(f"--out {out} is a folder; give the name of a file, such as {out / COMPARED}")
    if out.exists() and not (own or config.overwrite):
        raise InputError(f"--out {out} exists; give another name, or --overwrite to replace it")
    page = page_of(config.runs)
    with writing(out), in_place(out) as part:
        part.write_text(page, encoding="utf-8")
    if config.open:
        webbrowser.open(out.resolve().as_uri())
    return Answer(sentences=(f"Page: {out}",), out=out)


def _place(config: ReportConfig) -> tuple[Path, bool]:
    """Return where the page goes, and whether that is a run's own page, which is only made anew."""
    from inhand.shown import HTML

    first = config.runs[0]
    if config.out is not None or len(config.runs) > 1:
        return config.out or COMPARED, False
    return (first.with_suffix(".html"), False) if first.is_file() else (first / HTML, True)


def page_of(runs: tuple[Path, ...]) -> str:
    """Return the page of a run, or of several side by side.

    Raises:
        InputError: one that cannot be read, or runs that cannot be compared.
    """
    for run in runs:
        if not (run.exists() or run.with_name(f"{run.name}.part").is_dir()):
            raise InputError(f"{run} is not there: give the folder of a run, or a trial's .npz file")
    from inhand.loading import load

    found = [(folder, load(folder)) for folder in runs]
    if len(found) == 1:
        return found[0][1].html()
    from inhand.comparing import compared

    return compared(found)
