"""The one loop: decide, simulate, measure, judge; every episode of a batch runs through it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import AnyPath, AnyTask, Controller, SpatialTask, Task
from inhand.control.phases import Grasp, Phase, placed_joints, standard_phases
from inhand.control.seen import PRIVILEGED, Reads, View, exact, reads_of
from inhand.control.trial import DIVERGED, LOST_CONTACT, NO_GRASP, REACHED, TIME_OUT
from inhand.geometry import Array
from inhand.sim.drawn import Disturbed, true_starts, truths
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.names import ENGINE
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State

if TYPE_CHECKING:
    from inhand.control.between import Between

Told = Callable[[str, int, int], None]
"""Told what is being done, and two numbers that say how far it is."""
LOST_AFTER = 20
"""A contact lost for more simulation steps than this ends an episode (thesis 3.2)."""


@dataclass(frozen=True)
class Recording:
    """What a batch of B episodes left."""

    states: tuple[State, ...]
    """Every measured state, the first before the first phase."""
    phases: tuple[str, ...]
    phase: NDArray[np.int64]
    """Phase of each state `(T,)`, its number in `phases`."""
    last: NDArray[np.int64]
    """Index of each world's last state `(B,)`; of one that diverged, the last that was measured before."""
    outcomes: tuple[str, ...]
    """How each world's episode ended."""


@dataclass
class _Verdicts:
    """Which worlds have ended, when and how."""

    running: NDArray[np.bool_]
    last: NDArray[np.int64]
    outcomes: list[str]
    lost: NDArray[np.int64]

    def end(self, worlds: NDArray[np.bool_], index: int, outcome: str) -> None:
        """End the episodes of worlds that still run."""
        for world in np.flatnonzero(worlds & self.running):
            self.outcomes[world] = outcome
            self.last[world] = index
        self.running = self.running & ~worlds


def sense(state: State, between: Between | None = None, reads: Reads = PRIVILEGED) -> View:
    """Return what controllers see of the worlds: a `State`, or a `Seen` for one that reads what a hand can know.

    Every controller decides on what this returns, in trials, in training and in environments; verdicts, rewards and
    recordings read the state itself. Without anything `between` controllers and worlds all is seen as it is.
    """
    if between is not None:
        return between.seen(reads)
    return state if reads == PRIVILEGED else exact(state)


def stand_between(disturbed: Sequence[Disturbed], state: State, timestep: float, substeps: int) -> Between:
    """Return what stands between controllers and disturbed worlds, whose episodes begin in a state.

    It is made of compiled functions, which are imported where worlds are disturbed.
    """
    from inhand.control.between import Between

    return Between(disturbed, state, timestep, substeps)


def control_step(
    simulator: Simulator,
    targets: Array,
    lost: NDArray[np.int64],
    substeps: int,
    active: NDArray[np.bool_] | None = None,
    *,
    between: Between | None = None,
) -> tuple[State, NDArray[np.int64]]:
    """Simulate one decision, joint targets `(B, n_joints)` [rad] for some physics steps, and measure.

    Return the state after it, and for how many simulation steps each world has not been held by all fingers `(B,)`,
    which before it was `lost`. Worlds that are not `active` `(B,)` stand still. What stands `between` delays targets,
    pushes, and takes the state in.
    """
    arriving = targets if between is None else between.send(simulator, targets)
    state = simulator.step(arriving, substeps, active)
    if between is not None:
        between.take(state)
    return state, lost_steps(lost, state, substeps)


def dropped(state: State, lost: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which worlds have no object in the hand any more, or no simulation that could tell `(B,)`."""
    return np.asarray((lost > LOST_AFTER) | state.diverged)


def lost_steps(lost: NDArray[np.int64], state: State, substeps: int) -> NDArray[np.int64]:
    """Return for how many simulation steps each world has not been held by all fingers `(B,)`."""
    return np.where(state.touching.all(axis=-1), 0, lost + substeps)


@dataclass(frozen=True)
class Bench:
    """In what worlds are simulated, and who is told how far it is."""

    engine: str = ENGINE
    surroundings: SceneSpec | None = None
    """What stands around; None for the floor alone."""
    threads: int = 0
    """Threads of the simulation; 0 uses every core."""
    progress: Told | None = None
    """Told the phase, the worlds still running and the simulated step, after every step."""


def simulate(
    task: AnyTask,
    grasp: Grasp,
    starts: Array,
    manipulate: Callable[[Any], Controller] | None,
    bench: Bench,
    *,
    twists: AnyPath | None = None,
    longest: float = 8.0,
    between: Sequence[Phase] = (),
    disturbed: Sequence[Disturbed] | None = None,
    holds: Callable[[Any], Controller] | None = None,
    keeps: bool = True,
) -> tuple[Simulator, Recording]:
    """Place objects in worlds of their own, grip them and manipulate; return the worlds and what they left.

    Trials, traces, rehearsals and the starts of training and environments all begin here.
    Objects stand at `starts` `(B, 3)`, or in space are held at `(B, 7)` until fingers hold them. Once they are gripped
    the phases `between` follow, and `twists` turn them. What `manipulate` makes carries them for `longest` [s] at most,
    never without contact if it `keeps` it; None leaves them held. In space what `holds` makes lifts them, or else that.
    Where worlds are `disturbed`, also off `starts`, controllers are not told.
    """
    hand: Any
    objects: Any
    scenes: Any = bench.surroundings
    if isinstance(task, Task):
        joints = placed_joints(task.hand, grasp)
    else:
        joints, scenes = grasp.opened, [SceneSpec(pull=(float(x), float(y), float(z))) for x, y, z in task.gravity]
    hand, objects = task.hand, task.objects
    if disturbed is not None:
        hand, objects, scenes = truths(disturbed, hand, objects, scenes)
        starts = true_starts(disturbed, starts)
    simulator = make_simulator(bench.engine, hand, objects, scenes, bench.threads)
    start = simulator.reset(starts, joints)
    phases = standard_phases(
        grasp, manipulate, twists, longest, between, held=isinstance(task, SpatialTask), holds=holds, keeps=keeps
    )
    way = None if disturbed is None else stand_between(disturbed, start, task.timestep, task.substeps)
    return simulator, run_episodes(simulator, task, phases, start, bench.progress, between=way)


def run_episodes(
    simulator: Simulator,
    task: AnyTask,
    phases: Sequence[Phase],
    start: State,
    progress: Told | None = None,
    *,
    between: Between | None = None,
    worlds: NDArray[np.bool_] | None = None,
) -> Recording:
    """Run one episode in every world of a batch, or in some `worlds` `(B,)`, phase by phase, from the state it is in.

    A world that finishes the last phase has reached its end, unless that is a grip, which is judged when all worlds
    have closed. One whose episode has ended, or has none, stands still and costs nothing. After every step `progress`
    is told the phase, the worlds still running and the simulated step.
    """
    states, phase_of, count = [start], [0], task.n_worlds
    running = np.ones(count, dtype=bool) if worlds is None else worlds
    verdicts = _Verdicts(running, np.zeros(count, int), [TIME_OUT] * count, np.zeros(count, int))
    for number, phase in enumerate(phases):
        done = np.zeros(count, dtype=bool)
        for state, done in _run_phase(simulator, task, phase, states[-1], verdicts, between=between, last=phases[-1]):
            states.append(state)
            phase_of.append(number)
            index = len(states) - 1
            verdicts.end(state.diverged, index - 1, DIVERGED)
            verdicts.end(np.asarray(verdicts.lost > LOST_AFTER), index, LOST_CONTACT)
            if number == len(phases) - 1 and not phase.must_hold:
                verdicts.end(done, index, REACHED)
            if progress is not None:
                progress(phase.name, int(verdicts.running.sum()), index)
        if phase.must_hold:
            verdicts.end(np.asarray(~states[-1].touching.all(axis=-1)), len(states) - 1, NO_GRASP)
        if phase.keep_contact:
            verdicts.end(~done, len(states) - 1, TIME_OUT)
        if not verdicts.running.any():
            break
    verdicts.end(verdicts.running, len(states) - 1, REACHED if phases[-1].must_hold else TIME_OUT)
    names = tuple(phase.name for phase in phases)
    return Recording(tuple(states), names, np.array(phase_of), verdicts.last, tuple(verdicts.outcomes))


def _run_phase(
    simulator: Simulator,
    task: AnyTask,
    phase: Phase,
    state: State,
    verdicts: _Verdicts,
    *,
    between: Between | None,
    last: Phase,
) -> Iterator[tuple[State, NDArray[np.bool_]]]:
    """Give every state of a phase and which worlds are done, until all that run are done or time is up.

    Where something stands `between`, phases before the `last` and grips take their whole time: worlds with noisy senses
    are done at times of their own, and no world may wait for another's draw.
    """
    whole = between is not None and (phase is not last or phase.must_hold)
    controller = phase.controller(task)
    reads = reads_of(controller)
    if between is not None:
        between.pushing = phase.keep_contact
    if phase.lets_go:
        simulator.let_go(verdicts.running)
    seen = sense(state, between, reads)
    controller.begin(seen)
    for _ in range(round(phase.longest / task.control_period)):
        targets, lost = controller.act(seen), verdicts.lost
        state, lost = control_step(simulator, targets, lost, task.substeps, verdicts.running, between=between)
        seen = sense(state, between, reads)
        done = controller.finished(seen)
        if phase.keep_contact:
            verdicts.lost = lost
            done = done & (lost == 0)
        yield state, done
        if not (verdicts.running & (whole | ~done)).any():
            return
