"""Episodes of hands in space: fingers close on an object that the world holds, take its weight, and carry it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Protocol, runtime_checkable

import numpy as np

from inhand.control.controller import Controller, SpatialTask
from inhand.control.joint import JointPid
from inhand.control.loop import Bench, Recording, run_episodes
from inhand.control.phases import Grasp, Phase
from inhand.control.trial import MANIPULATE, TWIST
from inhand.geometry import Array
from inhand.rotations import SpatialPath
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.scene import SceneSpec

PRESS, LIFT = "press", "lift"
"""Names of the phases in which the fingers press on an object that is still held, and then hold it alone."""
PLACING, GRASPING, PRESSING, LIFTING = 0.1, 0.7, 0.2, 0.3
"""How long fingers stand off the object, close on it, press, and hold it before it is carried [s]."""


@runtime_checkable
class TakesOver(Protocol):
    """A controller that goes on where another one of its kind has held the objects."""

    def take_over(self, before: Controller) -> None:
        """Go on with what the controller before knows."""


def spatial_phases(
    grasp: Grasp,
    manipulate: Callable[[SpatialTask], Controller] | None,
    twists: SpatialPath | None = None,
    longest: float = 8.0,
    holds: Callable[[SpatialTask], Controller] | None = None,
) -> tuple[Phase, ...]:
    """Return place, grasp, press, lift and manipulate, and before the last a twist on the spot if asked.

    `holds` makes the controller that presses and lifts, None for what `manipulate` makes, which does all after that.
    Without `manipulate` the last phase is the lift; without either the fingers are closed and the world still holds.
    """
    phases: tuple[Phase, ...] = (
        Phase("place", lambda task: JointPid(task, grasp.opened), longest=PLACING),
        Phase("grasp", lambda task: JointPid(task, grasp.closed), longest=GRASPING, must_hold=True),
    )
    lifts = holds or manipulate
    if lifts is None:
        return phases
    last: list[Controller] = []

    def go_on(task: SpatialTask, make: Callable[[SpatialTask], Controller]) -> Controller:
        made = make(task)
        if last and isinstance(made, TakesOver):
            made.take_over(last[0])
        last[:] = [made]
        return made

    def stay(task: SpatialTask) -> Controller:
        return go_on(replace(task, path=still(task.n_worlds), distance=np.zeros(task.n_worlds)), lifts)

    phases += (
        Phase(PRESS, stay, longest=PRESSING),
        Phase(LIFT, stay, longest=LIFTING, must_hold=True, lets_go=True),
    )
    if manipulate is None:
        return phases
    if twists is not None and twists.turns.any():

        def turn(task: SpatialTask) -> Controller:
            return go_on(replace(task, path=twists, distance=None), manipulate)

        phases = (*phases, Phase(TWIST, turn, longest=3.0, keep_contact=True))
    return (*phases, Phase(MANIPULATE, partial(go_on, make=manipulate), longest=longest, keep_contact=True))


def still(n_worlds: int) -> SpatialPath:
    """Return paths that stay on the spot."""
    return SpatialPath(np.zeros((n_worlds, 2, 3)), np.zeros((n_worlds, 2, 3)))


def simulate_in_space(
    task: SpatialTask,
    grasp: Grasp,
    starts: Array,
    manipulate: Callable[[SpatialTask], Controller] | None,
    bench: Bench,
    *,
    twists: SpatialPath | None = None,
    longest: float = 8.0,
    holds: Callable[[SpatialTask], Controller] | None = None,
) -> tuple[Simulator, Recording]:
    """Hold objects in worlds of their own, grip them, let them go and carry them; return the worlds and what they left.

    Objects are held at `starts` `(B, 7)`. Trials, rehearsals and the starts of training begin here.
    """
    scenes = [SceneSpec(pull=(float(x), float(y), float(z))) for x, y, z in task.gravity]
    simulator = make_simulator(bench.engine, task.hand, task.objects, scenes, bench.threads)
    start = simulator.reset(starts, grasp.opened)
    phases = spatial_phases(grasp, manipulate, twists, longest, holds)
    return simulator, run_episodes(simulator, task, phases, start, bench.progress)
