"""The folder of a study of robustness: `robustness.json`, its tables in CSV, the figures and the Markdown page."""

from collections.abc import Sequence
from dataclasses import asdict

import pandas as pd

from inhand.asterisk_test.cells import kept_lost
from inhand.asterisk_test.robustness import figures, tables
from inhand.asterisk_test.robustness.browser import robustness_page
from inhand.asterisk_test.robustness.cases import CASES, curves_of
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.robustness.sensitivity import sensitivity
from inhand.asterisk_test.robustness.summary import Robustness
from inhand.asterisk_test.study import command, place_told, write_texts
from inhand.control.trial import file_name, write_json
from inhand.pages import Part, Picture, again, counted, listed, page_of
from inhand.plots.save import save_picture
from inhand.shown import HTML
from inhand.versions import versions


def write_robustness(config: RobustnessConfig, found: Robustness, wall_s: float, notes: Sequence[str] = ()) -> None:
    """Write numbers, figures and page of a study, which took `wall_s` [s], into its folder, with notes on it."""
    told = sensitivities(config, found)
    pictures = draw_figures(config, found, told)
    content = {
        "rows": found.rows.to_dict("records"),
        "sensitivity": {name: table.to_dict("records") for name, table in told.items()},
        "controllers": [asdict(each) for each in found.contenders],
        "disturbances": [asdict(each) for each in found.cases],
        "stopped": found.stopped,
        "wall_s": wall_s,
        "notes": notes,
        "config": asdict(config),
        "versions": versions(),
    }
    write_json(content, config.out / "robustness.json")
    every = [*notes, f"This call took {wall_s / 60:.1f} minutes."]
    pages = {
        "report.md": page_of(*parts(config, found, told, pictures, every)),
        HTML: robustness_page(parts(config, found, told, [], every), config, found, told),
    }
    frames = {"robustness.csv": found.rows, "trials.csv": found.trials}
    write_texts({name: table.to_csv(index=False) for name, table in frames.items()} | pages, config.out)


def sensitivities(config: RobustnessConfig, found: Robustness) -> dict[str, pd.DataFrame]:
    """Return what goes with losses under each disturbance of the tables that differs between worlds."""
    told = {case.name: sensitivity(found, case.name, config.seed) for case in found.cases if case.row}
    return {name: table for name, table in told.items() if len(set(table.quantity)) > 1}


def parts(
    config: RobustnessConfig,
    found: Robustness,
    told: dict[str, pd.DataFrame],
    pictures: Sequence[Part],
    notes: Sequence[str] = (),
) -> list[Part]:
    """Return the parts of the page: what was asked, the answer, figures, tables, what was lost, how to run it again."""
    seeds = tables.seeds_table(found)
    goes = [tables.sensitivity_table(told)] if told else []
    return [
        f"# Robustness: {counted(len(found.contenders), 'controller')} x {counted(len(found.cases), 'disturbance')}",
        f"{config.object} with {config.hand}, {figures.told_trials(config)} ({config.directions}), start noise"
        f" {config.noise_mm:g} mm and {config.noise_deg:g} deg (standard deviations), seed {config.seed},"
        f" {place_told(config.hand, config.engine, config.gravity)}. Controllers are told none of what disturbs. A"
        " trial has the same start whatever disturbs it, and the same world whatever controls it.",
        listed([*tables.summary(found), *notes]),
        tables.contenders_table(found),
        "`Lost` counts objects that were let go or never held, with Wilson's 95 % interval. An object that was lost has"
        " gone no way. `Share` is the mean way as a share of the hand's limit, `Least` that of the worst direction;"
        " `Retention` is the mean way as a share of that of the same trials undisturbed, both with 95 % intervals by"
        " bootstrap over the trials. `Lateral` and `Turn` are median and 95 % quantile of the largest of each trial"
        " that kept its object, `Overlap` the mean over time and the largest overlap of a link and the object, `Deep`"
        " the share of the time with more than half a millimetre, `Force` and `Torque` the largest of a finger on the"
        " object.",
        *pictures,
        tables.kept_table(found),
        *(tables.controller_table(found, each) for each in found.contenders),
        *([] if seeds is None else [seeds]),
        *goes,
        listed(_lost_trials(config, found), "Trials that lost their object, to be shown with `inhand view`", "None."),
        listed(found.stopped, "What could not be run"),
        listed([f"{case.name}: {case.told}" for case in found.cases], "What each disturbance is"),
        again(command("robustness", config)),
    ]


def draw_figures(config: RobustnessConfig, found: Robustness, told: dict[str, pd.DataFrame]) -> list[Picture]:
    """Draw the figures, and return them as parts of the page."""
    out = config.out
    text = "Share of the undisturbed way that controllers keep under disturbances, and objects lost"
    pictures = [save_picture(figures.kept_figure(config, found), out, "kept.png", text)]
    for curve in curves_of(config):
        figure, text = figures.strength_figure(config, found, curve), f"What is kept and lost as {curve} grows stronger"
        pictures.append(save_picture(figure, out, f"strength_{file_name(curve)}.png", text))
    for name, table in told.items():
        figure, text = figures.sensitivity_figure(table, found, name), f"What goes with losing the object under {name}"
        pictures.append(save_picture(figure, out, f"sensitivity_{file_name(name)}.png", text))
    for contender in found.contenders:
        lost = figures.lost_figure(config, found, contender)
        if lost is not None:
            text = f"Objects that {contender.name} lost"
            pictures.append(save_picture(lost, out, f"lost_{file_name(contender.name)}.png", text))
    return pictures


def _lost_trials(config: RobustnessConfig, found: Robustness) -> list[str]:
    """Return the files of the trials that are kept, a line for each controller under each disturbance."""
    sentences = []
    for contender in found.contenders:
        for case in found.cases:
            files = kept_lost(config.out / CASES, contender.name, case.name)
            if files:
                place = files[0].parent.relative_to(config.out)
                sentences.append(f"`{place}`: {', '.join(each.name for each in files)}")
    return sentences
