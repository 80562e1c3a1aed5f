"""A design study as a function: what is asked in, the hand that suits it out."""

from __future__ import annotations

import itertools
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from inhand.asterisk_test.cells import differences
from inhand.asterisk_test.clusters import spread
from inhand.asterisk_test.design.asked import Asked, ask
from inhand.asterisk_test.design.config import MARK, DesignConfig
from inhand.asterisk_test.design.finals import Final, finals, read_finals
from inhand.asterisk_test.design.found import Found
from inhand.asterisk_test.design.looked import Look, Looked, front_of, reached, read_looked, variants
from inhand.asterisk_test.design.search import check_optuna, looked_at, search
from inhand.asterisk_test.study import Study, told_in
from inhand.caches import sources
from inhand.control.trial import write_json
from inhand.errors import InputError
from inhand.folders import alone, check_folder, clear, place_of, writing
from inhand.hands.files import load_hand
from inhand.hands.hand import HandSpec
from inhand.hands.names import CATALOGUE, LAB_LIMITS_SUFFIX
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import object_name
from inhand.records import checked, configured, read_json, table_of
from inhand.repeats import write_repeat
from inhand.shown import frame, listed, path_of, several

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

CELLS, SETTINGS = "cells", "study.json"
"""Folder of what a study has computed, inside that of the study, and the file there that tells which one it is."""
DEFAULT = DesignConfig()
"""What is searched where nothing else is asked for."""
Told = Callable[[str, str, int, int], None]
"""Is told what is computed, the part that is done, how many are done and how many there are."""


@dataclass(frozen=True, eq=False)
class DesignRun(Study):
    """A finished study; what it has computed lies in its folder."""

    mark, cells = MARK, CELLS

    config: DesignConfig
    found: Found

    @property
    def winner(self) -> HandSpec:
        """The hand that suits best."""
        return self.found.winner.looked.hand

    def table(self) -> DataFrame:
        """Return a row for each hand: what it is like, what its aims come to, and how far controllers carry objects."""
        from inhand.asterisk_test.design.page import rows

        return frame(rows(self.found))

    def figure(self) -> Figure:
        """Return the front, the hands drawn to scale, and where the winner gains and loses against the catalogue."""
        from inhand.asterisk_test.design.figure import design_figure

        return design_figure(self.found)

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.design.browser import design_page
        from inhand.asterisk_test.design.page import parts

        return design_page(parts(self.config, self.found, [], (self.seconds, self.notes)), self.config, self.found)

    def write(self, folder: Path) -> None:
        """Write everything into a folder that is there."""
        from inhand.asterisk_test.design.page import write_design

        write_design(self.config, self.found, folder, (self.seconds, self.notes))
        write_repeat(folder, "design", self.config)

    def draw(self, folder: Path) -> None:
        """Draw the front, its hands and what they gain into `figures` of a folder."""
        from inhand.plots.save import save_picture

        save_picture(self.figure(), folder, "design.png", "")


def design(
    objects: Sequence[str | Path | ObjectSpec] = DEFAULT.objects,
    *,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    jobs: int = 1,
    out: str | Path | None = None,
    **settings: Any,
) -> DesignRun:
    """Search the hand that suits a job.

    Args:
        objects: names, TOML files, outlines or specs.
        directions: words of the command line, names, or degrees counter-clockwise from +x.
        jobs: hands computed at a time, 0 for one on each core; more than one in processes of their own.
        out: folder that keeps what was computed, so that a study that was stopped goes on; None for a temporary one.
        settings: other fields of `DesignConfig`, such as aims, hands, palm_mm and limits.

    Raises:
        InputError: anything that cannot be searched; the text says what, and what is allowed.
    """
    folder = Path(tempfile.mkdtemp(prefix="inhand-design-")) if out is None else Path(path_of("out", out))
    settings |= {"objects": [object_name(thing) for thing in several(objects)], "directions": listed(directions)}
    return run_design(configured(DesignConfig, settings | {"jobs": jobs, "out": folder}))


def run_design(
    config: DesignConfig, told: Told = lambda *_: None, ready: Callable[[], None] = lambda: None
) -> DesignRun:
    """Return the finished study of a configuration; what its folder holds is not computed again.

    `ready` is called once names and numbers are right, before anything is computed.

    Raises:
        InputError: anything in the configuration that cannot be searched, or a folder of another study.
    """
    began = time.perf_counter()
    asked = ask(config, ready)
    check_optuna()
    with _folder(config, asked) as folder:
        catalogue = _catalogue(config, asked, folder, _counted(told, "catalogue", _KNOWN * len(config.limits)))
        looked = search(config, asked, catalogue, folder, _counted(told, "hands", config.hands))
        best = front_of(asked, looked)[: config.finalists]
        total = (len(best) + 1) * len(config.controllers) * len(asked.objects)
        told_of = _counted(told, "simulations", total)
        *ours, known = finals(config, asked, [*best, catalogue[0]], folder, told_of)
        ours = list(_won(config, ours))
        off = _off(config, asked, ours[0].looked.hand, told)
    found = Found(asked, tuple(catalogue), tuple(looked), tuple(ours), known, off)
    return DesignRun(config, time.perf_counter() - began, _notes(config, found), found)


def read_design(config: DesignConfig, content: Mapping[str, Any]) -> DesignRun:
    """Return the finished study of a folder as it stands, whatever version computed it; nothing is computed.

    Raises:
        InputError: a file that is missing or cannot be read.
    """
    asked, folder = ask(config), config.out / CELLS
    catalogue, looked = (_there(folder, name) for name in ("catalogue_*.json", "hand_*.json"))
    catalogue = _ranked(asked, catalogue)
    best = front_of(asked, looked)[: config.finalists]
    *ours, known = read_finals(config, asked, [*best, catalogue[0]], folder)
    off = checked("tolerance_mm", content.get("tolerance_mm"), dict[str, float])
    return DesignRun(
        config, *told_in(content), Found(asked, tuple(catalogue), tuple(looked), _won(config, ours), known, off)
    )


def _there(folder: Path, pattern: str) -> list[Looked]:
    """Return the hands of the files of a pattern, by their numbers."""
    found = [each for path in folder.glob(pattern) if (each := read_looked(path)) is not None]
    if not found:
        raise InputError(f"{folder} holds no {pattern} of a design study: give the whole folder of one")
    return sorted(found, key=lambda each: each.number)


def _ranked(asked: Asked, hands: Iterable[Looked]) -> list[Looked]:
    """Return hands of the catalogue, the best by mean reach first."""
    return sorted(hands, key=lambda each: (-asked.mean(each.table), -each.number))


def _won(config: DesignConfig, ours: Sequence[Final]) -> tuple[Final, ...]:
    """Return hands in simulation, the farthest first."""
    return tuple(sorted(ours, key=lambda final: final.means.get(config.controllers[0], 0.0), reverse=True))


_KNOWN = len(CATALOGUE)


def _counted(told: Told, what: str, total: int) -> Callable[[str], None]:
    """Return what counts the parts that are done, and tells them."""
    done = itertools.count(1)
    return lambda part: told(what, part, next(done), total)


def _catalogue(config: DesignConfig, asked: Asked, folder: Path, tell: Callable[[str], None]) -> list[Looked]:
    """Return the hands of the catalogue, the best by mean reach first."""
    names = [name + ending for ending in (ENDINGS[limits] for limits in config.limits) for name in CATALOGUE]
    jobs = [Look(-k, load_hand(name), asked, (), folder / f"catalogue_{k}.json") for k, name in enumerate(names)]
    found = looked_at(jobs, config, tell)
    return _ranked(asked, found.values())


ENDINGS = {"free": "", "lab": LAB_LIMITS_SUFFIX}
"""What a hand's name has at its end for its joint limits."""


def _off(config: DesignConfig, asked: Asked, hand: HandSpec, told: Told) -> dict[str, float]:
    """Return the mean reach of a hand [mm], and of those a little off it."""
    hands = {"": hand} | variants(hand)
    tell = _counted(told, "tolerance", len(hands))
    found: dict[str, float] = {}
    for off, mean in spread(_mean_off, [(off, each, asked) for off, each in hands.items()], config):
        found[off] = mean
        tell(off or "as it is")
    return {off: found[off] for off in hands}


def _mean_off(job: tuple[str, HandSpec, Asked]) -> tuple[str, float]:
    off, hand, asked = job
    return off, asked.mean(reached(asked, hand)[0])


@contextmanager
def _folder(config: DesignConfig, asked: Asked) -> Iterator[Path]:
    """Give the folder of what the study computes, kept from other processes.

    Raises:
        InputError: it holds another study, or something else.
    """
    out, settings = (
        config.out,
        table_of(asked.settings() | {"sampler": config.sampler, "seed": config.seed} | _computed()),
    )
    folder = out / CELLS
    if not place_of(folder).is_dir():
        check_folder(out, overwrite=config.overwrite, mark=MARK)
    with alone(folder, out), writing(out):
        if (folder / SETTINGS).is_file():
            found = differences(_settings_of(folder), settings)
            if found and not config.overwrite:
                raise InputError(
                    f"--out {out} holds another study: {'; '.join(found)}. Give another folder, or --overwrite to"
                    " replace that study"
                )
            if found:
                clear(folder)
        write_json(settings, folder / SETTINGS)
        yield folder


def _settings_of(folder: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = checked("settings", read_json((folder / SETTINGS).read_bytes()), dict[str, Any])
    except InputError as error:
        raise InputError(
            f"{folder / SETTINGS} does not tell which study is there: {error}; give another folder"
        ) from error
    return found


def _computed() -> dict[str, str]:
    """Return what a hand's reach and the proposals come from: our sources, and optuna's version."""
    return {"source_of_reach": sources("inhand.tasks.reach")[:12], "optuna": version("optuna")}


def _notes(config: DesignConfig, found: Found) -> tuple[str, ...]:
    """Return what a reader should know, a sentence each."""
    notes = []
    for controller in config.controllers:
        reasons = {final.looked.hand.name: final.reason(controller) for final in (*found.finals, found.known)}
        told = {name: reason for name, reason in reasons.items() if reason is not None}
        if told:
            name, reason = next(iter(told.items()))
            notes.append(f"{controller} did not run on {', '.join(told)}. Of {name}: {reason}")
    given_up = sum(not each.whole for each in found.looked)
    return (*notes, f"Given up after the first directions: {given_up} of {len(found.looked)} hands.")
