"""A sweep as a function: hands and objects in, every hand with every object out.

What counts and draws is imported once all cells are there.
"""

from __future__ import annotations

import itertools
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from inhand.asterisk_test.cells import cell_path, read_cell
from inhand.asterisk_test.spread import Compute, computed
from inhand.asterisk_test.study import Study, told_in
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.sweep import CELLS, directions_of, plan
from inhand.control.catalogue import CONTROLLERS, find_controller
from inhand.control.draws import disturbance_notes
from inhand.control.spatial_catalogue import find_spatial_controller, notes_over_pairs
from inhand.hands.files import assumed
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, is_spatial_hand, load_solid, load_spatial_hand, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.records import checked, configured
from inhand.repeats import write_repeat
from inhand.shown import listed, path_of, several
from inhand.sim.disturbance import disturbance_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from inhand.asterisk_test.sweep.summary import Sweep

MARK = "sweep.json"
"""The file that marks a folder as a finished sweep's."""
DEFAULT = SweepConfig()
"""What is run where nothing else is asked for."""


@dataclass(frozen=True, eq=False)
class SweepRun(Study):
    """A finished sweep; its cells lie in its folder."""

    config: SweepConfig
    """What was run; `out` is where its cells are."""
    sweep: Sweep
    mark: ClassVar[str] = MARK
    cells: ClassVar[str] = CELLS

    def table(self) -> DataFrame:
        """Return a row for each trial: hand, object, direction, what was reached, the limit, every metric."""
        return self.sweep.trials.copy()

    def figure(self) -> Figure:
        """Return the heat map of the distances of hands and objects."""
        from inhand.asterisk_test.sweep.page import figure_of

        return figure_of(self.config, self.sweep, "distance", "object")

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.sweep.page import page_for_browser

        return page_for_browser(self.config, self.sweep, self.seconds, self.notes)

    def write(self, folder: Path) -> None:
        """Write numbers, heat maps and report into the folder that holds the cells."""
        from inhand.asterisk_test.sweep.page import write_sweep

        write_sweep(replace(self.config, out=folder), self.sweep, self.seconds, self.notes)
        write_repeat(folder, "sweep", self.config)

    def draw(self, folder: Path) -> None:
        """Draw the heat maps into `figures` of a folder."""
        from inhand.asterisk_test.sweep.page import heat_maps

        heat_maps(replace(self.config, out=folder), self.sweep)


def sweep(
    hands: Sequence[str | Path | HandSpec | SpatialHand] = DEFAULT.hands,
    objects: Sequence[str | Path | ObjectSpec | SolidSpec] = DEFAULT.objects,
    controller: object = DEFAULT.controller,
    *,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    jobs: int = 1,
    out: str | Path | None = None,
    **settings: Any,
) -> SweepRun:
    """Run the Asterisk Test with every hand on every object.

    Args:
        hands: names, TOML files or specs.
        objects: names, TOML files, outlines or specs.
        controller: a name, the folder of a training, `FILE.py:NAME`, or a class of yours.
        directions: words of the command line, names, or degrees counter-clockwise from +x.
        jobs: cells computed at a time, 0 for one on each core. More than one runs in processes of their own, which know
            hands, objects and controllers by name, by file or from installed packages.
        out: folder that keeps the cells, so that a sweep that was stopped goes on; None for a temporary one.
        settings: other fields of `SweepConfig`, such as trials, seed and noise_mm.

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    folder = Path(tempfile.mkdtemp(prefix="inhand-sweep-")) if out is None else Path(path_of("out", out))
    settings |= {"hands": [hand_name(hand) for hand in several(hands)], "jobs": jobs, "out": folder}
    settings["objects"] = [object_name(thing) for thing in several(objects)]
    settings |= {"directions": listed(directions), "controller": CONTROLLERS.name_of(controller)}
    settings |= disturbance_of(settings)
    return run_sweep(configured(SweepConfig, settings))


def read_sweep(config: SweepConfig, content: Mapping[str, Any]) -> SweepRun:
    """Return the finished sweep of a folder as it stands, whatever version computed it; nothing is computed.

    Raises:
        InputError: a cell that is missing or cannot be read.
    """
    from inhand.asterisk_test.sweep.summary import sweep_of

    names = [checked(name, content.get(name), tuple[str, ...]) for name in ("hands", "objects")]
    cells = (read_cell(cell_path(config.out / CELLS, *pair)) for pair in itertools.product(*names))
    swept = sweep_of(cells, directions_of(config))
    return SweepRun(config, *told_in(content), swept)


def run_sweep(config: SweepConfig, compute: Compute = computed) -> SweepRun:
    """Return the finished sweep of a configuration; what its folder holds is not computed again.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    began = time.perf_counter()
    found = plan(config)
    notes = _notes(config)
    for _ in compute(found, config):
        pass
    from inhand.asterisk_test.sweep.summary import sweep_of

    cells = (read_cell(job.path) for job in found.jobs)
    swept = sweep_of(cells, directions_of(config))
    return SweepRun(config, time.perf_counter() - began, notes, swept)


def _notes(config: SweepConfig) -> tuple[str, ...]:
    """Return what a reader should know of hands and disturbance, a sentence each."""
    if not is_spatial_hand(config.hands[0]):
        known = find_controller(config.controller)
        return (*assumed(config.hands), *disturbance_notes(config, known.reads, known.contract))
    entry = find_spatial_controller(config.controller)
    hands, objects = map(load_spatial_hand, config.hands), map(load_solid, config.objects)
    told = disturbance_notes(config, entry.reads, entry.contract, space=True)
    return (*notes_over_pairs(entry, list(itertools.product(hands, objects))), *told)
