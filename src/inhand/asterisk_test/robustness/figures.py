"""The figures of a study of robustness: what is kept, against the strength, what goes with a loss, and how it ended."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from inhand.asterisk_test.cells import kept_lost
from inhand.asterisk_test.failures import MOST_FAILURES, failure_of, failures_figure
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.robustness.cases import CASES, Contender, curves_of
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.robustness.sensitivity import FEWEST
from inhand.asterisk_test.robustness.summary import Robustness
from inhand.control.trial import Trial, load_any
from inhand.geometry import Array
from inhand.pages import counted
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.intervals import Estimates, Panel, curves_figure, list_figure
from inhand.sim.disturbance_files import disturbance_name


def kept_figure(config: RobustnessConfig, found: Robustness) -> Figure:
    """Return the heat map of retention: disturbances and controllers, with how many objects were lost."""
    subtitle = f"{told_trials(config)} each; an object that is lost has gone no way"
    return heatmap_figure(
        kept_map(found), "Share of the undisturbed way", "What controllers keep of their way", subtitle
    )


def kept_map(found: Robustness) -> HeatMap:
    """Return the numbers of that heat map."""
    cases = [case.name for case in found.cases if case.row]
    names = [each.name for each in found.contenders]
    rows = [[found.row(name, case) for name in names] for case in cases]
    values = np.array([[np.nan if row is None else row["retention"] for row in line] for line in rows], dtype=float)
    notes = [["cannot run" if row is None else _lost(row) for row in line] for line in rows]
    return HeatMap(tuple(cases), tuple(names), values, notes)


def strength_figure(config: RobustnessConfig, found: Robustness, curve: str) -> Figure:
    """Return what is kept and lost against the strength of a disturbance, one curve for each controller."""
    at, panels = strengths(config, found, curve)
    subtitle = f"{told_trials(config)} at each strength; bands: 95 % intervals (bootstrap; Wilson)"
    axis = f"Strength (0: undisturbed, 1: {curve})"
    return curves_figure(at, panels, axis, f"Against the strength of {curve}", subtitle)


def strengths(config: RobustnessConfig, found: Robustness, curve: str) -> tuple[Array, list[Panel]]:
    """Return the strengths of a disturbance `(N,)`, and what is kept and lost at each."""
    points = {strength: disturbance_name(word) for strength, word in curves_of(config)[curve].items()}
    kept, lost = ([_along(found, each, points, name) for each in found.contenders] for name in ("retention", "lost"))
    panels = [Panel("Share of the undisturbed way", kept, 1.0), Panel("Share of objects lost", lost, 0.1)]
    return np.array(list(points)), panels


def sensitivity_figure(table: pd.DataFrame, found: Robustness, disturb: str) -> Figure:
    """Return the figure of what `sensitivity` gives of a disturbance, a panel for each controller."""
    names, panels = sensitivity_panels(table, found, disturb)
    subtitle = (
        "rank correlation with losing the object, 95 % intervals by bootstrap; filled: clear of 0; not told of fewer"
        f" than {FEWEST} lost or kept"
    )
    return list_figure(names, panels, "correlation", f"What goes with a loss under {disturb}", subtitle)


def sensitivity_panels(table: pd.DataFrame, found: Robustness, disturb: str) -> tuple[list[str], list[Estimates]]:
    """Return the quantities, the most telling first, and their correlations for each controller."""
    size = table.assign(size=table.correlation.abs()).groupby("quantity")["size"].max()
    names = size.sort_values(ascending=False).index.to_list()
    panels = []
    for contender in found.contenders:
        row, own = found.row(contender.name, disturb), table[table.controller == contender.name]
        ordered = own.set_index("quantity").reindex(names)
        middle, low, high = (ordered[name].to_numpy(dtype=float) for name in ("correlation", "low", "high"))
        note = "cannot run" if row is None else f"{row['lost']} of {row['trials']} lost"
        panels.append(Estimates(contender.name, middle, low, high, note))
    return names, panels


def lost_figure(config: RobustnessConfig, found: Robustness, contender: Contender) -> Figure | None:
    """Return the figure of some trials in which a controller lost the object, of as many disturbances as there are.

    In space nothing is drawn of them; the page for a browser replays them.
    """
    files = [kept_lost(config.out / CASES, contender.name, case.name) for case in found.cases if case.row]
    longest = max((len(each) for each in files), default=0)
    chosen = [each[k] for k in range(longest) for each in files if k < len(each)][:MOST_FAILURES]
    trials = [trial for trial in map(load_any, chosen) if isinstance(trial, Trial)]
    if not trials:
        return None
    told = [failure_of(trial, result_of_trial(trial)) for trial in trials]
    subtitle = "one trial each, hand and object as the controller was told that they are"
    return failures_figure(told, f"{contender.name}: objects lost", subtitle, [t.passport.disturb for t in trials])


def told_trials(config: RobustnessConfig) -> str:
    """Return how many trials there are in each direction."""
    return f"{counted(config.trials, 'trial')} in each direction"


def _along(found: Robustness, contender: Contender, points: dict[float, str], name: str) -> Estimates:
    """Return an estimate along a curve; lost objects as a share of the trials."""
    rows = [found.row(contender.name, disturb) or {} for disturb in points.values()]
    out_of = np.array([row.get("trials", np.nan) if name == "lost" else 1.0 for row in rows])
    middle, low, high = (_numbers(rows, f"{name}{end}") for end in ("", "_low", "_high"))
    return Estimates(contender.name, middle / out_of, low, high)


def _numbers(rows: list[dict[str, float]], name: str) -> Array:
    return np.array([row.get(name, np.nan) for row in rows], dtype=float)


def _lost(row: dict[str, float]) -> str:
    """Return what stands below a cell's number: how many objects were lost."""
    return f"{100 * row['lost'] / row['trials']:.1f} % lost" if row["lost"] else ""
