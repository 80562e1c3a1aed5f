"""Cells of a study over cores: which its folder holds, which are to compute, and their computation."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from inhand.asterisk_test.cells import Job, compute, differences, read_cell
from inhand.asterisk_test.clusters import spread
from inhand.control.run_config import SpreadConfig
from inhand.errors import InputError
from inhand.folders import alone, check_folder, place_of, writing
from inhand.hands.spatial.files import is_spatial_hand
from inhand.sim.engines import step_once


@dataclass(frozen=True, eq=False)
class Plan:
    """A study's cells."""

    jobs: tuple[Job, ...]
    """All cells, in the order in which they are computed."""
    waiting: tuple[Job, ...]
    """Those to compute."""


Compute = Callable[[Plan, SpreadConfig], Iterable[Job]]
"""Computes the waiting cells, so many at a time and where that says; the command line shows how far it is."""


def planned(jobs: Sequence[Job], *, overwrite: bool) -> Plan:
    """Return the cells of a study and which of them its folder does not hold yet; the folder is made.

    Raises:
        InputError: two cells of one name, a folder that holds something else, or cells of other settings where
            `overwrite` is off.
    """
    labels: dict[Path, str] = {}
    for job in jobs:
        if job.path in labels:
            raise InputError(f"{job.label} is asked for twice: give each a name of its own")
        labels[job.path] = job.label
    cells = jobs[0].path.parent
    out = cells.parent
    _make_folder(cells)
    there = [job for job in jobs if job.path.is_file()]
    other = {job: found for job in there if (found := differences(read_cell(job.path).settings, job.settings))}
    if other and not overwrite:
        job, found = next(iter(other.items()))
        raise InputError(
            f"--out {out} holds {len(other)} cells of other settings; of {job.label} {'; '.join(found)}: give another"
            " folder, or --overwrite to compute them again"
        )
    kept = set(there) - set(other)
    return Plan(tuple(jobs), tuple(job for job in jobs if job not in kept))


def computed(found: Plan, config: SpreadConfig) -> Iterator[Job]:
    """Compute the cells of a plan that wait and give each once its file is written, in the order in which they end.

    Raises:
        InputError: workers died too often, no such cluster, or another study computes into the same folder.
    """
    if not found.waiting:
        return
    cells = found.waiting[0].path.parent
    first = found.waiting[0].config
    if first.engine == "planar" and not is_spatial_hand(first.hand):
        step_once()  # what that compiles is compiled and told here, not in every process
    with alone(cells, cells.parent):
        yield from spread(compute, found.waiting, config)


def _make_folder(cells: Path) -> None:
    """Make the folder of a study's cells; a folder that holds anything but such a study is refused."""
    if not place_of(cells).is_dir():
        check_folder(cells.parent, overwrite=False, mark=cells.name)
    with writing(cells.parent):
        cells.mkdir(parents=True, exist_ok=True)
