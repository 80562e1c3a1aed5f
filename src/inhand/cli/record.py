"""`inhand record`: an expert's demonstrations, recorded and written as a Minari dataset."""

import numpy as np

from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import progress, say
from inhand.learning.commands import RecordConfig
from inhand.learning.dataset import Dataset
from inhand.learning.datasets import DATA
from inhand.learning.record import run_record as recorded
from inhand.pages import counted

HEADER = ("Direction", "Episodes", "Lost", "Distance [mm]", "Of the plan")
"""Columns of the table."""


def run_record(config: RecordConfig) -> Answer:
    """Check everything, record and write, and put the finished dataset in its place."""
    done = 0
    try:
        with progress(spoken=True) as tell:

            def told(what: str, now: int, total: int) -> None:
                nonlocal done
                done = now if what.startswith("recording") else 0
                tell(what, now, total)

            found = recorded(config, told)
    except KeyboardInterrupt:
        kept = "the same command goes on from there" if done else "nothing is kept"
        say(f"Stopped after {counted(done, 'episode')}; {kept}")
        raise
    table = Listing(f"{found.title}: {counted(len(found.lost), 'episode')}", HEADER, rows_of(found))
    place = found.folder.as_posix()
    read = f'Read it: minari.MinariDataset("{place}/{DATA}"), or inhand.load("{place}")'
    return of_run(found, found.folder, [table], (f"Dataset {found.config.dataset_id}: {found.folder}", read))


def rows_of(found: Dataset) -> list[tuple[str, ...]]:
    """Return the table's rows, one for each direction or sector, and one for all."""
    table = found.summary()
    shares = ["-" if np.isnan(share) else f"{share:.3f}" for share in table["share"]]
    ways = table["distance_mm"].map("{:.1f}".format)
    if "distance_deg" in table:
        ways = ways.where(table["distance_mm"].notna(), table["distance_deg"].map("{:.1f} deg".format))
    columns = table["episodes"], table["lost"], ways, shares
    return [(str(name), *map(str, cells)) for name, *cells in zip(table.index, *columns, strict=True)]
