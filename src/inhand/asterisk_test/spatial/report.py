"""A finished run in space and its report: figures, a replay and a Markdown page, from its trials and results."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from inhand.aside import Aside, here
from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.report import beside_told, command
from inhand.asterisk_test.results import Result
from inhand.asterisk_test.spatial.scenes import drawn
from inhand.asterisk_test.table import endings, failures, shown_columns, with_beside
from inhand.asterisk_test.tested import FRAME_STEPS, Tested, farthest_trial
from inhand.control.spatial_scenes import solid_frames
from inhand.control.spatial_trial import SpatialTrial
from inhand.geometry import Array
from inhand.hands.spatial.gravity import USUAL_PALM
from inhand.pages import Part, Picture, again, counted, listed, table_of
from inhand.plots.save import save_picture
from inhand.plots.spatial_asterisk import MANY, solid_figure, spatial_figure
from inhand.plots.spatial_replay import write_spatial_replay


@dataclass(frozen=True, eq=False)
class SpatialRun(Tested):
    """A finished run of a hand in space, where nobody has done the test."""

    trials: tuple[SpatialTrial, ...]

    @property
    def settings(self) -> dict[str, object]:
        """Hand, object, controller, engine, disturbance and gravity."""
        return super().settings | {"gravity": gravity_told(self)}

    def figure(self) -> Figure:
        """Return planes, maps of directions and turns."""
        return spatial_figure(*drawn(self.trials, self.results), self.subject, _subtitle(self))

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.spatial.browser import spatial_page

        own = Beside(self.name, self.trials, self.results, "")
        return spatial_page(self.parts(), [*self.beside, own], self.config)

    def pictures(self, folder: Path, aside: Aside = here) -> list[Part]:
        """Draw figures and a replay into `figures` of a folder, that aside, and return their parts of the page."""
        waited = aside(draw_replay, self, folder)
        return [*_pictures(self, folder), waited()]

    def parts(self, pictures: Sequence[Part] = ()) -> list[Part]:
        """Return the parts of its page, the figures before the last."""
        return _parts(self, pictures)


def gravity_told(run: SpatialRun) -> str:
    """Return how gravity pulls: by the word or the vector that was asked for."""
    return run.config.gravity or USUAL_PALM


def _subtitle(run: SpatialRun) -> str:
    count = len({result.trial for result in run.results})
    told = gravity_told(run)
    held = f"palm {told}" if told.isalpha() else f"gravity along {told}"
    return f"{held}; mean of {counted(count, 'trial')} a direction"


def _pictures(run: SpatialRun, folder: Path) -> list[Picture]:
    curves, _ = drawn(run.trials, run.results)
    text = "Distances in three planes and on maps of all directions, colours by the share of the hand's limit; turns"
    pictures = [save_picture(run.figure(), folder, "asterisk.png", text)]
    if curves and len(curves) < MANY:
        solid = solid_figure(curves, run.subject, _subtitle(run))
        pictures.append(save_picture(solid, folder, "solid.png", "Mean object paths, with shadows on three walls [mm]"))
    return pictures


def draw_replay(run: SpatialRun, folder: Path) -> Picture:
    """Draw the trial that went farthest and return its part of the page."""
    trial, result, rows, first = farthest_trial(run)
    origin = trial.object_pose[first, :3]
    trail = 1e3 * (trial.object_pose[rows, :3] - origin)
    title = f"{result.direction}, trial {result.trial}"
    write_spatial_replay(
        solid_frames(trial, rows, origin),
        trail,
        folder / "figures" / "replay.gif",
        title=title,
        target_mm=_target(trial, result),
        texts=_told(trail, result),
        contact=trial.touching[rows],
        frame_s=FRAME_STEPS * trial.passport.period,
        fingers=trial.passport.hand.finger_names,
    )
    return Picture(f"Replay of {title}", "figures/replay.gif")


def _target(trial: SpatialTrial, result: Result) -> Array:
    """Return the reference `(M, 3)` [mm] as far as it was followed."""
    line = 1e3 * trial.reference[:, :3]
    return np.asarray(line[np.linalg.norm(line, axis=-1) <= max(result.metrics.max_distance_mm, 10.0)])


def _told(trail: Array, result: Result) -> Sequence[str]:
    """Return how far along its direction, or from its start, the object is at each instant."""
    way = np.linalg.norm(trail, axis=-1) if result.along is None else trail @ np.array(result.along)
    return [f"{each:z.0f} mm" for each in way]


def _parts(run: SpatialRun, pictures: Sequence[Part]) -> list[Part]:
    config, passport = run.config, run.trials[0].passport
    x, y, z = passport.gravity
    return [
        f"# Asterisk Test in space: {run.subject}",
        f"{counted(config.trials, 'trial')} for each direction; gravity {gravity_told(run)} ({x:.2f}, {y:.2f}, {z:.2f}"
        f" m/s² in the palm frame); start noise {config.noise_mm:g} mm and {config.noise_deg:g} deg along and about"
        f" each axis (standard deviations), seed {config.seed}. The controller reads what is {passport.reads}.",
        "Right is +x, Out +y (up the palm) and Up +z (out of the palm). Distance is the progress along the direction,"
        " of a turn the angle about its axis, up to the first loss of contact, mean ± SD over the trials. Lateral"
        " (largest distance from the line, of a turn from the start, mm), Turn (largest rotation, angle of a turn,"
        " deg), Contact (share of steps with every finger touching), Gap (longest time without), Force"
        " (largest of a finger on the object, N) and Overlap (deepest of a link and the object, mm) are the worst"
        " trial's; Eff. is the mean efficiency. Outcome is the worst, and how many trials had it.",
        table_of(*with_beside(*shown_columns(run.rows), run.name, run.beside)),
        beside_told(run.beside),
        endings(run.results),
        errors_told(run.results),
        listed(failures(run.results), "What failed"),
        listed(run.notes),
        *pictures,
        again(command(config)),
    ]


def errors_told(results: Sequence[Result]) -> str:
    """Return how far objects were off their lines and turned, over all trials."""
    moves = [result.metrics for result in results if not result.turns]
    turns = [result.metrics for result in results if result.turns]
    told = []
    if moves:
        lateral, angle = ([getattr(m, name) for m in moves] for name in ("lateral_max_mm", "rotation_max_deg"))
        told.append(f"Moves were off their line by {_spread(lateral, 'mm')}, and turned by {_spread(angle, 'deg')}.")
    if turns:
        lateral, swing = [m.lateral_max_mm for m in turns], [getattr(m, "swing_max_deg", 0.0) or 0.0 for m in turns]
        told.append(f"Turns drifted by {_spread(lateral, 'mm')}, and left their axis by {_spread(swing, 'deg')}.")
    return " ".join(told)


def _spread(values: Sequence[float], unit: str) -> str:
    median, high, most = np.median(values), np.percentile(values, 95), max(values)
    return f"{median:.2f} {unit} (median), {high:.2f} (95 %), {most:.2f} (largest)"
