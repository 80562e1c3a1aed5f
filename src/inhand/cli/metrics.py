"""`inhand metrics`: measure recorded trials and human files alone."""

from pathlib import Path

from inhand.asterisk_test.people.human import read_human_file, read_human_folder
from inhand.asterisk_test.people.human_rows import Gaps
from inhand.asterisk_test.results import Result, as_entry, result_of_human, result_of_trial
from inhand.cli.answer import Answer, Listing
from inhand.cli.commands import MetricsConfig
from inhand.cli.terminal import say
from inhand.control.spatial_trial import SpatialPassport
from inhand.control.trial import AnyTrial, load_any, write_json
from inhand.errors import InputError
from inhand.versions import versions

HEADER = (
    "File", "Direction", "Distance [mm]", "Lateral max [mm]", "Rotation max [deg]", "Efficiency", "Frechet [mm]",
    "Labels", "Not seen [frames]",
)  # fmt: skip


def run_metrics(config: MetricsConfig) -> Answer:
    """Return a table of the files' metrics and, if asked, write them to a JSON file that is not there yet.

    Raises:
        InputError: no files, a file that is neither a trial nor a human file, or a JSON file that exists.
    """
    out = config.out
    if not config.files:
        raise InputError("no files given: give .npz trials, .csv human files, or folders of human files")
    if out is not None and out.exists():
        raise InputError(f"--out {out} exists; give another name, or remove it first")
    measured: list[tuple[str, Result]] = []
    for path in config.files:
        measured += _measured(path, config.gaps)
    rows = [(*_row(name, result), str(result.unseen) or "-") for name, result in measured]
    shown = len(HEADER) if any(result.unseen.frames for _, result in measured) else len(HEADER) - 1
    entries = [as_entry(result) for _, result in measured]
    if out is not None:
        write_json({"trials": entries, "versions": versions()}, out)
    table = Listing("Metrics", HEADER[:shown], [row[:shown] for row in rows], numbers=2)
    return Answer((table,), () if out is None else (f"Written to {out}",), lambda: entries, out)


def _measured(path: Path, gaps: Gaps) -> list[tuple[str, Result]]:
    path = path / "trials" if (path / "trials").is_dir() else path
    trials = sorted(path.glob("*.npz")) if path.is_dir() else []
    if trials:
        return [found for trial in trials for found in _measured(trial, gaps)]
    if path.is_dir():
        folder = read_human_folder(path, gaps)
        for note in folder.notes:
            say(note)
        return [(trial.source, result_of_human(trial, compatible=True)) for trial in folder.trials]
    if path.suffix == ".npz":
        return [(path.name, result_of_trial(_of_primitive(path), compatible=True))]
    if path.suffix == ".csv":
        return [(path.name, result_of_human(read_human_file(path, gaps), compatible=True))]
    raise InputError(
        f"{path} is neither a .npz trial, nor a .csv human file, nor a folder; give one of these (a file to write the"
        " numbers to is --out)"
    )


def _of_primitive(path: Path) -> AnyTrial:
    trial = load_any(path)
    passport = trial.passport
    if isinstance(passport, SpatialPassport):
        name, sequence = passport.primitive, passport.along is None and passport.about is None
    else:
        name, sequence = passport.path, passport.angle_deg is None and passport.rotation_deg == 0
    if sequence:
        raise InputError(
            f"{path} followed {name}, which is no primitive: its errors are in the trace.json of its run; give trials"
            " of `inhand asterisk`"
        )
    return trial


def _row(name: str, result: Result) -> tuple[str, ...]:
    m = result.metrics
    rotation = f"{m.rotation_max_deg:.1f}" if m.rotation_max_deg == m.rotation_max_deg else "unknown"
    labels = "-" if result.labels is None else ", ".join(result.labels) or "none"
    values = (f"{m.distance_mm:.1f}", f"{m.lateral_max_mm:.1f}", rotation, f"{m.efficiency:.2f}", f"{m.frechet_mm:.1f}")
    return (name, result.direction, *values, labels)
