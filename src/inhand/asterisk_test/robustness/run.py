"""A study of robustness as a function: controllers and disturbances in, what they keep of their way out.

What counts and draws is imported once all cells are there.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from inhand.asterisk_test.asterisk import notes_for
from inhand.asterisk_test.cells import cell_path, read_cell
from inhand.asterisk_test.robustness.cases import CASES, Case, Contender, plan
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.spread import Compute, computed
from inhand.asterisk_test.study import Study, told_in
from inhand.control.catalogue import CONTROLLERS
from inhand.control.spatial_catalogue import entry_for
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import load_held
from inhand.records import checked, configured, read_record
from inhand.repeats import write_repeat
from inhand.shown import listed, path_of, several
from inhand.sim.disturbance import Disturbance, name_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from inhand.asterisk_test.robustness.summary import Robustness

R = TypeVar("R")
MARK = "robustness.json"
"""The file that marks a folder as a finished study's."""
DEFAULT = RobustnessConfig()
"""What is run where nothing else is asked for."""


@dataclass(frozen=True, eq=False)
class RobustnessRun(Study):
    """A finished study of robustness; its cells lie in its folder."""

    config: RobustnessConfig
    """What was run; `out` is where its cells are."""
    found: Robustness
    mark: ClassVar[str] = MARK
    cells: ClassVar[str] = CASES

    def table(self) -> DataFrame:
        """Return a row for each controller under each disturbance: trials, drops, shares, retention, contacts."""
        return self.found.rows.copy()

    def trials(self) -> DataFrame:
        """Return a row for each trial: controller, disturbance, outcome, every metric, and what was drawn."""
        return self.found.trials.copy()

    def figure(self) -> Figure:
        """Return the heat map of what controllers keep of their way under disturbances."""
        from inhand.asterisk_test.robustness.figures import kept_figure

        return kept_figure(self.config, self.found)

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.robustness.browser import robustness_page
        from inhand.asterisk_test.robustness.page import parts, sensitivities

        told = sensitivities(self.config, self.found)
        return robustness_page(parts(self.config, self.found, told, [], self.notes), self.config, self.found, told)

    def write(self, folder: Path) -> None:
        """Write numbers, figures and report into the folder that holds the cells."""
        from inhand.asterisk_test.robustness.page import write_robustness

        write_robustness(replace(self.config, out=folder), self.found, self.seconds, self.notes)
        write_repeat(folder, "robustness", self.config)

    def draw(self, folder: Path) -> None:
        """Draw the figures into `figures` of a folder."""
        from inhand.asterisk_test.robustness import page

        page.draw_figures(replace(self.config, out=folder), self.found, page.sensitivities(self.config, self.found))


def robustness(
    controllers: object = DEFAULT.controllers,
    disturbances: str | Path | Disturbance | Sequence[str | Path | Disturbance] = DEFAULT.disturbances,
    *,
    curves: str | Path | Disturbance | Sequence[str | Path | Disturbance] = DEFAULT.curves,
    hand: str | Path | HandSpec | SpatialHand = DEFAULT.hand,
    object: str | Path | ObjectSpec | SolidSpec = DEFAULT.object,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    jobs: int = 1,
    out: str | Path | None = None,
    **settings: Any,
) -> RobustnessRun:
    """Run the Asterisk Test with every controller under every disturbance.

    Args:
        controllers: names, folders of trainings, `FILE.py:NAME`, or classes of yours.
        disturbances: levels, singles, names, TOML files or specs; a name@0.5 is half as strong.
        curves: the same, each to be run at all strengths.
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file, an outline or a spec.
        directions: words of the command line, names, or degrees counter-clockwise from +x.
        jobs: cells computed at a time, 0 for one on each core. More than one runs in processes of their own, which know
            what is yours by file or from installed packages.
        out: folder that keeps the cells, so that a study that was stopped goes on; None for a temporary one.
        settings: other fields of `RobustnessConfig`, such as strengths, trials, seed and noise_mm.

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    folder = Path(tempfile.mkdtemp(prefix="inhand-robustness-")) if out is None else Path(path_of("out", out))
    settings |= {"controllers": [CONTROLLERS.name_of(each) for each in several(controllers)]}
    settings |= {"disturbances": [name_of(each) for each in _each(disturbances)]}
    settings |= {"curves": [name_of(each) for each in _each(curves)], "directions": listed(directions)}
    settings |= {"hand": hand_name(hand), "object": object_name(object), "jobs": jobs, "out": folder}
    return run_robustness(configured(RobustnessConfig, settings))


def read_robustness(config: RobustnessConfig, content: Mapping[str, Any]) -> RobustnessRun:
    """Return the finished study of a folder as it stands, whatever version computed it; nothing is computed.

    Raises:
        InputError: a cell that is missing or cannot be read.
    """
    from inhand.asterisk_test.robustness.summary import robustness_of

    contenders = _records(content, "controllers", Contender)
    cases = _records(content, "disturbances", Case)
    folder = config.out / CASES
    cells = (read_cell(cell_path(folder, who.name, case.name)) for case in cases for who in contenders)
    return RobustnessRun(config, *told_in(content), robustness_of(cells, contenders, cases, config.seed))


def _records(content: Mapping[str, Any], name: str, kind: type[R]) -> list[R]:
    return [read_record(entry, kind) for entry in checked(name, content.get(name), list[dict[str, Any]])]


def run_robustness(config: RobustnessConfig, compute: Compute = computed) -> RobustnessRun:
    """Return the finished study of a configuration; what its folder holds is not computed again.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    began = time.perf_counter()
    found, contenders, cases = plan(config)
    held = load_held(config.hand, config.object)
    entries = [entry_for(each.word, held) for each in contenders]
    notes = dict.fromkeys(note for entry in entries for note in notes_for(entry, held, config))
    for _ in compute(found, config):
        pass
    from inhand.asterisk_test.robustness.summary import robustness_of

    cells = (read_cell(job.path) for job in found.jobs)
    study = robustness_of(cells, contenders, cases, config.seed)
    return RobustnessRun(config, time.perf_counter() - began, tuple(notes), study)


def _each(given: object) -> list[Any]:
    """Return disturbances, of which a path is one, as a list."""
    return [given] if isinstance(given, Path) else several(given)
