"""Draws docs/phases.png, the phases of a trial, and docs/decision.png, what one decision passes through.

Run: make picture
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

import inhand
from inhand.control.scenes import scene_at
from inhand.control.trial import Trial
from inhand.plots.save import save_figure
from inhand.plots.shapes import CLEAR, draw_scene
from inhand.plots.sheet import sheet, write_above
from inhand.plots.style import INK, LABEL_POINTS, MUTED, SERIES_LOOKS, TICK_POINTS

HERE = Path(__file__).parent
WIDE, HIGH = 2.6, 2.4
"""Size of a phase's picture [in]."""
EXTENT = (-110.0, 125.0, -130.0, 87.0)
"""What it shows: left, right, bottom, top [mm] from the object's start."""
TOLD = {
    "place": "fingers move beside the object",
    "grasp": "they close on the planned contacts",
    "manipulate": "the object is carried; this is measured",
}
"""What the phases do."""
BOXES = {
    "world": (0.0, 0.0, "world", "hand and object: an engine,\n5 physics steps of 4 ms"),
    "state": (3.3, 0.0, "State", "all that is true,\nof one instant"),
    "seen": (6.6, 0.85, "senses", "all (privileged), or encoders\nand late frames (sensed)"),
    "act": (9.9, 0.0, "controller", "act: joint targets\nof all worlds at once"),
    "told": (6.6, -0.95, "judgement", "verdict, metrics and reward\nread what is true"),
}
"""Boxes of the decision: middle x and y, name, what it is."""
ARROWS = (("world", "state"), ("state", "seen"), ("seen", "act"), ("state", "told"))
"""What leads to what; the controller's targets lead back to the world."""
HALF = (1.32, 0.5)
"""Half width and height of a box."""


def draw_phases(trial: Trial) -> None:
    """Draw hand and object at the end of each phase of a trial, and halfway through the last."""
    origin = np.array(trial.passport.hand.start_position)
    with sheet([[(WIDE, HIGH)] * len(TOLD)], gap=(0.3, 0.0)) as (figure, axes):
        for number, (ax, name) in enumerate(zip(axes, TOLD, strict=True)):
            rows = np.flatnonzero(trial.phase == trial.phases.index(name))
            row = int(rows[len(rows) // 4] if name == "place" else rows[-1])
            draw_scene(ax, scene_at(trial, row, origin), CLEAR)
            ax.set(xlim=EXTENT[:2], ylim=EXTENT[2:], aspect="equal")
            ax.set_axis_off()
            write_above(ax, f"{number + 1}. {name}", TOLD[name])
    save_figure(figure, HERE / "phases.png")


def draw_box(ax: Axes, x: float, y: float, name: str, told: str) -> None:
    """Draw a box with its name and what it is."""
    look = {"boxstyle": "round,pad=0,rounding_size=0.12", "facecolor": "white", "edgecolor": MUTED, "linewidth": 1.2}
    ax.add_patch(FancyBboxPatch((x - HALF[0], y - HALF[1]), 2 * HALF[0], 2 * HALF[1], **look))
    ax.text(x, y + 0.24, name, ha="center", va="center", fontsize=LABEL_POINTS + 1, fontweight="bold", color=INK)
    ax.text(x, y - 0.15, told, ha="center", va="center", fontsize=TICK_POINTS, color=INK, linespacing=1.25)


def draw_decision() -> None:
    """Draw what one decision passes through."""
    arrow = {"arrowstyle": "-|>", "color": SERIES_LOOKS[0].colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    with sheet([[(9.4, 2.9)]]) as (figure, (ax,)):
        for x, y, name, told in BOXES.values():
            draw_box(ax, x, y, name, told)
        for first, second in ARROWS:
            start, end = BOXES[first], BOXES[second]
            ax.annotate("", (end[0] - HALF[0], end[1]), (start[0] + HALF[0], start[1]), arrowprops=arrow)
        last, world = BOXES["act"], BOXES["world"]
        down = -1.75
        ax.plot([last[0], last[0], world[0]], [last[1] - HALF[1], down, down], color=arrow["color"], lw=1.6)
        ax.annotate("", (world[0], world[1] - HALF[1]), (world[0], down - 0.012), arrowprops=arrow)
        ax.text(
            4.95, down + 0.07, "joint targets, every 0.02 s", ha="center", va="bottom", fontsize=TICK_POINTS, color=INK
        )
        ax.set(xlim=(-1.4, 11.3), ylim=(-1.85, 1.45))
        ax.set_axis_off()
    save_figure(figure, HERE / "decision.png")


def main() -> None:
    """Run a trial and write both pictures beside this file."""
    draw_phases(inhand.asterisk(directions="Out-Right", trials=1).trials[0])
    draw_decision()


if __name__ == "__main__":
    main()
