"""The one loop: decide, simulate, measure, judge; every episode of a batch runs through it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Controller, Task
from inhand.control.phases import Grasp, Phase, placed_joints, standard_phases
from inhand.control.trial import DIVERGED, LOST_CONTACT, NO_GRASP, REACHED, TIME_OUT
from inhand.geometry import Array
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.names import ENGINE
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State

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


def sense(state: State) -> State:
    """Return what controllers see of the worlds: all there is, as it is.

    Every controller decides on what this returns, in trials, in training and in environments; verdicts, rewards and
    recordings read the state itself.
    """
    return state


def control_step(
    simulator: Simulator,
    targets: Array,
    lost: NDArray[np.int64],
    substeps: int,
    active: NDArray[np.bool_] | None = None,
) -> tuple[State, NDArray[np.int64]]:
    """Simulate one decision, joint targets `(B, n_joints)` [rad] for some physics steps, and measure.

    Return the state after it, and for how many simulation steps each world has not been held by all fingers `(B,)`,
    which before it was `lost`. Worlds that are not `active` `(B,)` stand still.
    """
    state = simulator.step(targets, substeps, active)
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
    task: Task,
    grasp: Grasp,
    starts: Array,
    manipulate: Callable[[Task], Controller] | None,
    bench: Bench,
    *,
    twists: Array | None = None,
    longest: float = 8.0,
    between: Sequence[Phase] = (),
) -> tuple[Simulator, Recording]:
    """Place objects in worlds of their own, grip them and manipulate; return the worlds and what they left.

    Trials, traces, rehearsals and the starts of training and environments all begin here.

    Objects stand at `starts` `(B, 3)`. Once they are gripped the phases `between` follow, and `twists` `(B, S, 3)` turn
    them. What `manipulate` makes carries them, until `longest` [s] at most; None leaves them held.
    """
    simulator = make_simulator(bench.engine, task.hand, task.objects, bench.surroundings, bench.threads)
    start = simulator.reset(starts, placed_joints(task.hand, grasp))
    phases = standard_phases(grasp, manipulate, twists, longest, between)
    return simulator, run_episodes(simulator, task, phases, start, bench.progress)


def run_episodes(
    simulator: Simulator,
    task: Task,
    phases: Sequence[Phase],
    start: State,
    progress: Told | None = None,
    *,
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
        for state, done in _run_phase(simulator, task, phase, states[-1], verdicts):
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
    simulator: Simulator, task: Task, phase: Phase, state: State, verdicts: _Verdicts
) -> Iterator[tuple[State, NDArray[np.bool_]]]:
    """Give every state of a phase and which worlds are done, until all that run are done or time is up."""
    controller = phase.controller(task)
    seen = sense(state)
    controller.begin(seen)
    for _ in range(round(phase.longest / task.control_period)):
        targets = controller.act(seen)
        state, lost = control_step(simulator, targets, verdicts.lost, task.substeps, verdicts.running)
        seen = sense(state)
        done = controller.finished(seen)
        if phase.keep_contact:
            verdicts.lost = lost
            done = done & (lost == 0)
        yield state, done
        if bool((done | ~verdicts.running).all()):
            return
