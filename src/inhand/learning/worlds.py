"""Many manipulation phases side by side, each restarted when it ends: what environments and training step."""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inhand.control import loop
from inhand.control.loop import control_step, dropped
from inhand.control.seen import PRIVILEGED, SENSED, Reads, View
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair
from inhand.learning.kinds import asked_of, drawn_rows, kinds_of, simulator_of
from inhand.learning.legs import due, next_aim, turned_by
from inhand.learning.memories import Memories, memory_of
from inhand.learning.starts import Starts
from inhand.learning.step import Step
from inhand.records import Config
from inhand.sim.drawn import Disturbed
from inhand.sim.scene import SUBSTEPS
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import State, put, put_rows, select
from inhand.tasks.decisions import (
    Actions,
    Decision,
    Limited,
    Made,
    actions_of,
    checked_actions,
    find_reward,
    reward,
    targets_of,
)
from inhand.tasks.hand_arrays import arrays_of, slots_of, slotted
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import AnyAim, AnyHand, Scene, observe

if TYPE_CHECKING:
    from inhand.control.between import Between
    from inhand.control.memory import Memory

_KEPT = ("observation", "steps", "lost", "last", "row", "come", "leg", "key", "seen_start", "believed")
"""What worlds go on from, beside their states and aims."""


@dataclass(frozen=True)
class Interface(Config):
    """What a learned controller sees, does and is rewarded for."""

    observation: str = "thesis"
    """Layout of observations: thesis (table 3.1) or another of `inhand.tasks.observations.LAYOUTS`."""
    actions: Actions = "angles"
    """angles (joint targets over their ranges, thesis 3.3.2), steps (how far the targets move on) or fine steps."""
    reward: str = "thesis"
    """Reward: thesis (3.3.3), progress or gain."""
    horizon: int = 250
    """Decisions after which an episode is cut off; one takes 20 ms."""
    truth: str = ""
    """Layout of what critics alone see, beside: truth, where the actor's is of what is sensed; none by default."""


class ManipulationWorlds:
    """B worlds of one hand and object in the manipulation phase, with auto-reset in the same step."""

    def __init__(
        self,
        held: AnyPair,
        starts: Starts,
        count: int,
        interface: Interface | None = None,
        rng: np.random.Generator | None = None,
        *,
        threads: int = 0,
    ) -> None:
        """Make B worlds in the engine of the starts; every episode starts from a row of those that `rng` draws.

        Raises:
            InputError: an unknown layout or reward, or a horizon or count below 1.
        """
        self.interface = interface or Interface()
        if count < 1 or self.interface.horizon < 1:
            raise InputError(f"{count} worlds, horizon {self.interface.horizon}: both must be at least 1")
        self.hand: AnyHand
        self.hand, spec = held if starts.pairs is None else starts.pairs.held[0]
        self.layout, self.rewards = find_layout(self.interface.observation), find_reward(self.interface.reward)
        self._truth = find_layout(self.interface.truth) if self.interface.truth else None
        self.simulator, self._drawn = simulator_of(held, starts, count, threads)
        self.scene = Scene(self.hand, (spec,) * count)
        self._arrays = None if starts.pairs is None else arrays_of(*zip(*starts.pairs.held, strict=True))
        self._slots = slots_of(self.hand) if self.layout.columns else None
        self.rng, self.count = rng or np.random.default_rng(), count
        self._starts, self._held = starts, held
        self._between: Between | None = None
        self._memory: Memory | Memories | None = None
        self._pool = asked_of(starts)
        self._state = select(starts.state, np.zeros(count, dtype=np.int64))
        self._aim = self._pool.take(np.zeros(count, dtype=np.int64))
        self._observation = np.empty((count, size_of(self.interface, self.hand)))
        self._steps, self._lost, self._row, self._come, self._leg, self._believed = np.zeros((6, count), dtype=np.int64)
        self._last, self._seen_start = np.zeros((count, self.hand.n_joints)), np.zeros_like(self._aim.start)
        self._key = np.zeros(count, dtype=np.int64)
        self._told = self._aim
        self._begin(np.arange(count), self.rng.integers(len(starts), size=count))

    @property
    def state(self) -> State:
        """The state as it is."""
        return self._state

    @property
    def between(self) -> "Between | None":
        """What stands between controllers and the worlds, where they are disturbed."""
        return self._between

    @property
    def reads(self) -> Reads:
        """What the controller reads whose observations these are."""
        return SENSED if self.layout.sensed else PRIVILEGED

    @property
    def seen(self) -> View:
        """What that controller sees of the state."""
        return loop.sense(self._state, self._between, self.reads)

    @property
    def limited(self) -> Limited:
        """What tells the joint limits of the worlds."""
        return self.scene.told or self.hand

    def actions_of(self, targets: Array) -> Array:
        """Return the actions that come nearest to commanding joint targets `(B, n)` [rad]."""
        return self.widened(actions_of(targets, self.interface.actions, self.limited, self.seen))

    def widened(self, joints: Array) -> Array:
        """Return numbers of the joints `(B, n)` as actions have them: in their slots where the layout has slots."""
        return joints if self._slots is None else slotted(joints, self._slots)

    @property
    def aim(self) -> AnyAim:
        """What is asked of each world."""
        return self._aim

    @property
    def asked(self) -> AnyAim:
        """The same at this decision: while a hand waits for frames, to stay."""
        if self._memory is None:
            return self._aim
        return replace(self._aim, distance=np.where(self._memory.waiting, 0.0, self._aim.distance))

    def reset(self, rows: NDArray[np.int64] | None = None) -> Array:
        """Start every world's episode anew, from rows `(B,)` of the pool if given; return the observations `(B, d)`."""
        self._begin(
            np.arange(self.count), self.rng.integers(len(self._starts), size=self.count) if rows is None else rows
        )
        return self._observation.copy()

    def stagger(self) -> None:
        """Cut the episodes under way short, each at a drawn decision, so that worlds do not all end theirs at once."""
        self._steps = self.rng.integers(self.interface.horizon, size=self.count)

    def step(self, given: object) -> Step:
        """Take a decision in every world; worlds whose episode ends start the next one.

        Actions are `(B, n)` or, where the layout has slots, `(B, SLOTS)`.

        Raises:
            InputError: actions of the wrong shape, or one that is not a number.
        """
        before = self._state
        actions = checked_actions(given, (self.count, self.layout.actions(self.hand)))
        actions = actions if self._slots is None else actions[:, self._slots]
        targets = targets_of(actions, self.interface.actions, self.limited, self.seen)
        after, self._lost = control_step(self.simulator, targets, self._lost, SUBSTEPS, between=self._between)
        self._steps += 1
        gone = dropped(after, self._lost)
        asked, made = self._aim, self._along(after)
        decision = Decision(before, after, np.clip(actions, -1.0, 1.0), self._last, gone, asked, made)
        value, terms = reward(self.rewards, decision)
        truncated = (self._steps >= self.interface.horizon) & ~gone
        self._state = after
        if self._memory is not None:
            self._memory.take(self.seen)
            self._believe(self._memory.past.pose)
        self._go_on()
        successor, shift = self._observed(), self._shift(decision)
        self._observation, self._last = successor, decision.action
        ended = np.flatnonzero(gone | truncated)
        if len(ended):
            keeps = isinstance(self._memory, Memories)
            self._begin(ended, drawn_rows(self._starts, self._row[ended], self.rng, keeps_pair=keeps))
        return Step(self._observation, successor, value, terms, gone, truncated, shift, after)

    def _believe(self, pose: Array) -> None:
        """Move the places on the routes on to which objects at poses are believed to have come."""
        if self._starts.routes is not None:
            self._believed = self._starts.routes.advance(self._row, self._believed, pose)

    def _along(self, after: State) -> Made | None:
        """Move the places on the routes on and aim anew; return what was made of the routes' ways, None without any."""
        routes = self._starts.routes
        if routes is None:
            return None
        before, self._come = self._come, routes.advance(self._row, self._come, after.pose)
        self._aim = routes.aim(self._row, self._come)
        way, row, come = routes.way, self._row, self._come
        gained, left = way[row, come] - way[row, before], way[row, -1] - way[row, come]
        return Made(gained, left, *routes.off(row, come, after.pose))

    def _go_on(self) -> None:
        """Ask the next primitive of objects that have come to the end of one, if their episode has more."""
        legs, aim, pose = self._starts.legs, self._aim, self._state.pose
        if legs is None:
            return
        over, leg = due(aim, pose, legs[self._row], self._leg)
        if self._memory is not None:
            over &= ~self._memory.waiting
            self._memory.go_on(np.flatnonzero(over), turned_by(aim)[over])
        self._aim, self._leg = next_aim(aim, pose, leg, over), self._leg + over

    def _shift(self, decision: Decision) -> Array:
        """Return the way along, the way to the left and the angle turned of what was asked `(B, 3)`."""
        made, routes = decision.route, self._starts.routes
        if made is None or routes is None:
            return decision.shift
        return np.stack([routes.way[self._row, self._come], made.across, made.turned], axis=-1)

    def _begin(self, worlds: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        self.simulator.restore(worlds, self._starts.snapshot, rows, kinds_of(self._starts, rows))
        self._state = put(self._state, worlds, self._starts.state, rows)
        self._row[worlds], self._come[worlds], self._leg[worlds], self._believed[worlds] = rows, 0, 0, 0
        self._show_worlds()
        if self._starts.routes is not None:
            self._aim = self._starts.routes.aim(self._row, self._come)
        else:
            asked, pool = self._aim, self._pool
            aims = {name: put_rows(getattr(asked, name), worlds, getattr(pool, name)[rows]) for name in asked.KEPT}
            self._aim = replace(asked, **aims)
        self._look(worlds)
        self._observation = put_rows(self._observation, worlds, self._observed()[worlds])
        self._last = put_rows(self._last, worlds, np.zeros((len(worlds), self.hand.n_joints)))
        self._steps[worlds] = 0
        self._lost[worlds] = 0

    def _show_worlds(self) -> None:
        """Tell the scene which hand and object is in each world, and which way gravity pulls, where they differ."""
        if self._starts.space is not None:
            self.scene = replace(self.scene, gravity=self._starts.space.gravity[self._row])
        if self._arrays is not None and self._starts.pairs is not None:
            self.scene = replace(self.scene, told=self._arrays.take(self._starts.pairs.of[self._row]))

    def _observed(self) -> Array:
        """Return what all worlds see, and beside it what critics do `(B, d + c)`."""
        if self._memory is None:
            found = observe(self.layout, self.seen, self._seen_aim(), self.scene)
        else:
            past, routes = self._memory.past, self._starts.routes
            if routes is None:
                asked = past.aimed(self._aim)
            else:
                past, asked = past.planned(routes.aim(self._row, self._believed))
            found = observe(self.layout, past, asked, self.scene)
        if self._truth is None:
            return found
        scene = self.scene if self._drawn is None else replace(self.scene, drawn=self._drawn[self._row])
        return np.concatenate([found, observe(self._truth, self._state, self.asked, scene)], axis=-1)

    def _look(self, worlds: NDArray[np.int64]) -> None:
        """Begin the senses and the memory of episodes that begin in some worlds."""
        if self._starts.disturbed is not None:
            self._key[worlds] = self.rng.integers(2**62, size=len(worlds))
            if self._between is None:
                disturbed = self._disturbed(worlds)
                self._between = loop.stand_between(disturbed, self._state, self.simulator.timestep, SUBSTEPS)
                self._between.pushing = True
            else:
                self._between.begin(worlds, self._disturbed(worlds), self._state)
        if not self.layout.sensed:
            self._seen_start = put_rows(self._seen_start, worlds, self._aim.where(self.seen)[worlds])
            self._told = replace(self._aim, start=self._seen_start)
        elif self._memory is None or len(worlds) == self.count:
            self._memory = memory_of(self._held, self._starts.pairs, self._row, self.seen)
        else:
            self._memory.begin(worlds, self.seen)

    def _disturbed(self, worlds: NDArray[np.int64]) -> list[Disturbed]:
        """Return how some worlds are disturbed, with the noise of their present episodes."""
        given = self._starts.disturbed or ()
        return [given[self._row[world]].again((int(self._key[world]),)) for world in worlds.tolist()]

    def _seen_aim(self) -> AnyAim:
        """Return what is asked as a privileged controller knows it: a direction starts where it then saw the object."""
        if self._between is None or self._starts.routes is not None:
            return self._aim
        return self._told

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs, arrays by name and the random generator's state as `rng`."""
        snapshot = self.simulator.snapshot()
        arrays = {f"world.{field.name}": getattr(snapshot, field.name) for field in fields(Snapshot)}
        return arrays | {
            **{f"aim.{name}": np.asarray(getattr(self._aim, name)) for name in self._aim.KEPT},
            **{name: getattr(self, f"_{name}").copy() for name in _KEPT},
            **({} if self._between is None else self._between.state_dict()),
            **({} if self._memory is None else self._memory.state_dict()),
            "rng": self.rng.bit_generator.state,
        }

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Go on from what `state_dict` returned, byte for byte."""
        snapshot = Snapshot(**{field.name: kept[f"world.{field.name}"] for field in fields(Snapshot)})
        every = np.arange(self.count)
        for name in _KEPT:
            setattr(self, f"_{name}", kept[name].copy())
        self._show_worlds()
        self.simulator.restore(every, snapshot, every, kinds_of(self._starts, self._row))
        self._state = self.simulator.measure()
        if self._between is not None:
            self._between.begin(every, self._disturbed(every), self._state)
            self._between.load_state_dict(kept, self._state)
        if self._memory is not None:
            self._memory = memory_of(self._held, self._starts.pairs, self._row, self.seen)
            self._memory.load_state_dict(kept)
        routes = self._starts.routes
        asked = {name: kept[f"aim.{name}"] for name in self._aim.KEPT}
        self._aim = replace(self._aim, **asked) if routes is None else routes.aim(self._row, self._come)
        self._told = replace(self._aim, start=self._seen_start)
        self.rng.bit_generator.state = kept["rng"]


def size_of(interface: Interface, hand: AnyHand) -> int:
    """Return how many numbers an actor sees with a hand, and critics beside."""
    names = [interface.observation, *([interface.truth] if interface.truth else [])]
    return sum(find_layout(name).size(hand) for name in names)
