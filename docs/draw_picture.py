"""Draws docs/inhand.gif: the expert carries the cube in eight directions, one after another; each leaves its way.

Run: make picture
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import inhand
from inhand.control.scenes import scene_at
from inhand.control.trial import Trial
from inhand.geometry import Array, unit
from inhand.plots.replay import write_replay
from inhand.plots.shapes import SceneOutline

PICTURE = Path(__file__).with_name("inhand.gif")
STEP = 7
"""Decisions from one frame to the next."""
FPS = 20
STAY = 6
"""Frames for which the end of a trial stays."""


def rows_of(trial: Trial) -> list[int]:
    """Return the rows of a trial that are shown."""
    rows = list(range(trial.manipulation.start, trial.manipulation.stop, STEP))
    return [*rows, *[trial.manipulation.stop - 1] * STAY]


def shown(trial: Trial, rows: list[int], origin: Array) -> tuple[list[SceneOutline], Array]:
    """Return the scenes at rows and the object's ways `(N, 2)` [mm], the last one no number: there the line ends."""
    trail = 1e3 * (trial.object_pose[rows, :2] - origin)
    trail[-1] = np.nan
    return [scene_at(trial, row, origin) for row in rows], trail


def main() -> None:
    """Run the trials and write the picture beside this file."""
    run = inhand.asterisk(directions="train", trials=1)
    table, origin = run.table(), np.array(run.trials[0].passport.hand.start_position)
    scenes: list[SceneOutline] = []
    trails, texts = [], []
    for trial in run.trials:
        rows = rows_of(trial)
        frames, trail = shown(trial, rows, origin)
        scenes += frames
        trails.append(trail)
        along = unit(np.deg2rad(trial.passport.angle_deg or 0.0))
        for row in rows:
            way = 1e3 * (trial.object_pose[row, :2] - trial.object_pose[rows[0], :2]) @ along
            texts.append(f"{trial.passport.primitive} {way:.0f} mm")
    ends = [unit(np.deg2rad(angle)) * limit for angle, limit in zip(table["angle_deg"], table["limit_mm"], strict=True)]
    star = np.concatenate([np.stack([np.zeros(2), end, np.full(2, np.nan)]) for end in ends])
    write_replay(
        scenes,
        np.concatenate(trails),
        PICTURE,
        fps=FPS,
        title="dashed: the hand's own limit",
        target_path_mm=star,
        texts=texts,
    )


if __name__ == "__main__":
    main()
