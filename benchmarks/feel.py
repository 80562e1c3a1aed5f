"""Stopping by feel: how far the policy that ships goes where a learned risk stops it, not its told way alone.

It is told to go farther than was planned, in worlds of its own, until it has lost the object or turned it by more than
6 deg. A network learns from what it senses whether either comes within ten decisions (0.2 s). Then it goes the planned
way and, from there on, farther until the risk passes a threshold, where commands stay as they are; beside it one whose
network knows direction and way alone, and one that is told ways so much longer. Grasps are those that ship.
Run: python benchmarks/feel.py --trials 63 --seed 11
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

import inhand.policies
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.robustness.summary import retention, wilson
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.catalogue import ControllerEntry, Planner, find_controller
from inhand.control.controller import Task
from inhand.control.grades import GRADES
from inhand.control.phases import GradedGrasp, Grasp, graded_grasp
from inhand.control.policy import Policy, load_policy
from inhand.control.seen import Seen
from inhand.control.sensed_policy import SensedPolicyController
from inhand.control.trial import LOST, Trial
from inhand.control.underway import ARRIVED
from inhand.geometry import Array
from inhand.learning.networks import Network, forward, new_network
from inhand.sim.disturbance import name_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Scene, observe
from timing import environment

SHIPPED = Path(inhand.policies.__file__).parent / "default"
SOON = 10
"""Decisions within which a loss or a turn is told."""
FARTHER = 1.3
"""What is told in the place of a planned way, in planned ways."""
BENT_DEG, BENT_MM = 6.0, 3.0
"""What is turned or off its line by more is spoilt."""
LETTING_GO = 5
"""Decisions by which contact is gone before an object counts as lost."""
LATE = 0.35
"""Share of the planned way from which on the network learns."""
BACK = (12, 30)
"""Decisions back with which what is sensed now is compared; and with when the hand had waited for frames."""
TOLD = 5
"""Numbers of direction and way, which come first."""
HIDDEN, STEPS, BATCH, RATE = (96, 64), 2500, 512, 1e-3
TRAINED = 7001
"""Seed of the worlds that are learned in."""
WORLDS = {"well": 96, "field": 96, "hard": 48, "none": 16}
"""Trials of each direction that are learned from, in worlds of the grades of a camera and in undisturbed ones."""


@dataclass(frozen=True)
class Risk:
    """The chance that an object is soon lost or turned."""

    network: Network
    middle: Array
    half: Array

    def __call__(self, felt: Array) -> Array:
        """Return it for what is felt `(B, d)`."""
        found = (felt[:, : len(self.middle)] - self.middle) / self.half
        for number, (weight, bias) in enumerate(self.network):
            found = np.maximum(found, 0.0) if number else found
            found = found @ np.asarray(weight) + np.asarray(bias)
        return np.asarray(1 / (1 + np.exp(-found[:, 0])))


@dataclass
class Felt:
    """What was felt at every decision of a batch."""

    rows: list[Array] = field(default_factory=list)
    late: list[NDArray[np.bool_]] = field(default_factory=list)
    """Whether each world had come far enough to learn from `(B,)`."""


class Feeling(SensedPolicyController):
    """Goes the planned way, then on until the risk passes a threshold, or while it only keeps what it feels."""

    def __init__(self, task: Task, policy: Policy, threshold: float, risk: Risk | None, kept: Felt | None) -> None:
        """Follow the task's paths with a policy; `kept` takes what is felt."""
        super().__init__(task, policy)
        self._view = find_layout(policy.observation), Scene(task.hand, task.objects)
        self._threshold, self._risk, self._kept = threshold, risk, kept

    def begin(self, seen: Seen) -> None:
        """Start a primitive where the object is now."""
        super().begin(seen)
        self._history = list[Array]()
        self._first: Array | None = None

    def _way(self, seen: Seen) -> Array:
        self._planned = super()._way(seen)
        return np.asarray(np.minimum(FARTHER * self._planned, self._task.path.length))

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        targets, felt = super().act(seen), self._feel()
        if self._risk is not None:
            beyond = ~self._past.waiting & (self.progress >= self._planned - ARRIVED)
            self._arrived |= beyond & (self._risk(felt) >= self._threshold)
        if self._kept is not None:
            self._kept.rows.append(felt.astype(np.float32))
            self._kept.late.append(~self._past.waiting & (self.progress > LATE * self._planned))
        return np.where(self._arrived[:, None], seen.targets, targets)

    def _feel(self) -> Array:
        """Return what is told of direction and way, what the policy sees, and how that has changed of late."""
        past, aim, (layout, scene) = self._past, self._aim, self._view
        now = np.concatenate(
            [
                10 * past.joint_angles,
                15 * (past.targets - past.joint_angles),
                aim.shift(past.frames[0]) * (10, 100, 5),
                past.shift(aim) * (10, 100, 5),
                125 * past.points.reshape(past.n_worlds, -1),
                6 * past.askew,
            ],
            axis=-1,
        )
        if self._first is None:
            self._first = now
        self._first = np.where(past.waiting[:, None], now, self._first)
        self._history.append(now)
        lagged = [3 * (now - self._history[max(len(self._history) - 1 - lag, 0)]) for lag in BACK]
        come, planned = self.progress[:, None], self._planned[:, None]
        told = np.concatenate([aim.heading, 50 * (come - planned), come / planned, 10 * planned], axis=-1)
        changed = [np.clip(each, -3, 3) for each in (now - self._first, *lagged)]
        return np.concatenate([told, observe(layout, past, aim, scene), *changed], axis=-1)


def feeling(entry: ControllerEntry, threshold: float, risk: Risk | None, kept: list[Felt] | None) -> ControllerEntry:
    """Return the controller of a policy that goes beyond its way; `kept` takes what each batch feels."""

    def made(task: Task) -> Feeling:
        mine = None
        if kept is not None:
            kept.append(mine := Felt())
        return Feeling(task, load_policy(SHIPPED), threshold, risk, mine)

    return replace(entry, manipulate=made)


def spoilt_at(trial: Trial) -> int:
    """Return the decision at which an object was lost, turned or off its line; beyond the last where it never was."""
    places, turned, _ = trial.manipulated_path()
    angle = np.deg2rad(trial.passport.angle_deg or 0.0)
    off = np.abs(places[:, 1] * np.cos(angle) - places[:, 0] * np.sin(angle))
    bent = np.flatnonzero((np.abs(turned) > BENT_DEG) | (off > BENT_MM))
    whole = len(trial.time[trial.manipulation])
    lost = whole - LETTING_GO if trial.outcome in LOST else whole + SOON + 1
    return int(min(lost, bent[0] if len(bent) else lost))


def disturb_of(name: str) -> str:
    """Return what `--disturb` calls worlds; `well` are those that the best grade of a camera is planned for."""
    return name_of(replace(GRADES[0].worlds, name="well")) if name == "well" else name


def learned_from(entry: ControllerEntry) -> tuple[Array, Array]:
    """Return what is felt `(N, d)` in worlds to learn in, every fourth decision, and what comes soon `(N,)`."""
    rows, soon = list[Array](), list[Array]()
    for name, count in WORLDS.items():
        config = AsteriskConfig(controller="rl", trials=count, seed=TRAINED, disturb=disturb_of(name))
        kept = list[Felt]()
        setup = replace(prepare(config), controller=feeling(entry, 1.0, None, kept))
        trials = simulate(config, setup)
        felt, late = np.stack(kept[-1].rows), np.stack(kept[-1].late)
        ends = np.array([spoilt_at(trial) for trial in trials])
        last = np.array([len(trial.time[trial.manipulation]) for trial in trials])
        number = np.arange(len(felt))[:, None]
        near = ends <= number + SOON
        known = late & (number <= np.minimum(ends, last - 1)) & (near | (number + SOON < last))
        taken = np.flatnonzero(known)[::4]
        rows.append(felt.reshape(-1, felt.shape[-1])[taken])
        soon.append(near.ravel()[taken].astype(np.float32))
        lost = sum(trial.outcome in LOST for trial in trials)
        print(f"{name}: {lost} of {len(trials)} lost beyond their ways, {len(taken)} decisions", flush=True)
    return np.concatenate(rows), np.concatenate(soon)


def fitted(felt: Array, soon: Array, seed: int) -> Risk:
    """Return the network that tells what comes soon."""
    middle, half = felt.mean(axis=0), felt.std(axis=0) + 1e-3
    network = new_network(jax.random.key(seed), (felt.shape[1], *HIDDEN, 1), last=1.0)
    optimiser = optax.adamw(optax.cosine_decay_schedule(RATE, STEPS))
    moments = optimiser.init(network)

    def loss(network: Network, rows: jax.Array, wanted: jax.Array) -> jax.Array:
        return jnp.asarray(optax.sigmoid_binary_cross_entropy(forward(network, rows)[:, 0], wanted).mean())

    @jax.jit
    def step(
        network: Network, moments: optax.OptState, rows: jax.Array, wanted: jax.Array
    ) -> tuple[Network, optax.OptState]:
        change, moments = optimiser.update(jax.grad(loss)(network, rows, wanted), moments, network)
        return optax.apply_updates(network, change), moments

    rng = np.random.default_rng(seed)
    for _ in range(STEPS):
        drawn = rng.integers(len(felt), size=BATCH)
        network, moments = step(network, moments, jnp.asarray((felt[drawn] - middle) / half), jnp.asarray(soon[drawn]))
    return Risk(jax.device_get(network), middle, half)


def telling(risk: Risk, felt: Array, soon: Array) -> dict[str, float]:
    """Return the cross-entropy of what comes soon, and with parts of what is felt shuffled between decisions."""
    waited, size = (
        TOLD + find_layout(load_policy(SHIPPED).observation).size(prepare(AsteriskConfig()).hand),
        felt.shape[1],
    )
    lagged = (size - waited) // 3
    parts = {
        "nothing": (0, 0),
        "direction and way": (0, TOLD),
        "what the policy sees": (TOLD, waited),
        "change since the wait": (waited, waited + lagged),
        "change of late": (waited + lagged, size),
    }
    drawn, found = np.random.default_rng(0).permutation(len(felt)), {}
    for name, (first, last) in parts.items():
        shuffled = felt.copy()
        shuffled[:, first:last] = felt[drawn, first:last]
        told = np.clip(np.where(soon > 0, risk(shuffled), 1 - risk(shuffled)), 1e-6, None)
        found[name] = round(float(-np.log(told).mean()), 3)
    return found


def longer(planner: Planner, share: float) -> Callable[..., Grasp]:
    """Return what gives the same grasps with ways so many times as long."""

    def planned(*given: Any, **named: Any) -> Grasp:
        grasp = planner(*given, **named)
        each = grasp.graded if isinstance(grasp, GradedGrasp) else (grasp,)
        return graded_grasp([replace(one, way=None if one.way is None else share * one.way) for one in each])

    return planned


def tested(entries: Sequence[ControllerEntry], levels: Sequence[str], trials: int, seed: int) -> None:
    """Run controllers at levels, and print share, objects lost and turn of each with 95 % intervals."""
    print("| level | controller | share | 95 % | lost | 95 % | turn [deg] | beyond 6 deg |\n" + "|---" * 8 + "|")
    for level in levels:
        for entry in entries:
            config = AsteriskConfig(controller="rl", trials=trials, seed=seed, disturb=disturb_of(level))
            found = [result_of_trial(each) for each in simulate(config, replace(prepare(config), controller=entry))]
            gone = np.array([each.outcome in LOST for each in found])
            way = np.where(gone, 0.0, [each.fraction or 0.0 for each in found])
            turned = np.array([each.metrics.rotation_max_deg for each in found])[~gone]
            share, low, high = retention(way, np.ones(len(found)), seed)
            ends = " to ".join(f"{100 * end:.1f}" for end in wilson(int(gone.sum()), len(found)))
            told = f"{share:.3f} | {low:.3f} to {high:.3f} | {gone.sum()} of {len(found)} | {ends} %"
            turn = f"{np.quantile(turned, 0.95):.1f} | {100 * (turned > BENT_DEG).mean():.1f} %"
            print(f"| {level} | {entry.name} | {told} | {turn} |", flush=True)


def main() -> None:
    """Learn the risks, and test who goes by them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--levels", nargs="+", default=["none", "bench", "field", "hard"])
    parser.add_argument("--trials", type=int, default=63, help="of each of 16 directions at each level")
    parser.add_argument("--seed", type=int, default=11, help="of the worlds that are tested in")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of the networks")
    parser.add_argument("--threshold", type=float, default=0.03, help="risk that is not taken")
    parser.add_argument("--longer", type=float, default=1.05, help="what planned ways are made longer by")
    given = parser.parse_args()
    print(environment())
    entry = find_controller("rl")
    felt, soon = learned_from(entry)
    entries = [entry, replace(entry, name=f"told-{given.longer:g}", grasp=longer(entry.grasp, given.longer))]
    for seed in given.seeds:
        feels, blind = fitted(felt, soon, seed), fitted(felt[:, :TOLD], soon, seed)
        print(f"seed {seed}, shuffled: {telling(feels, felt, soon)}", flush=True)
        entries += [
            replace(feeling(entry, given.threshold, risk, None), name=f"{name}-{seed}")
            for name, risk in (("feel", feels), ("way-alone", blind))
        ]
    tested(entries, given.levels, given.trials, given.seed)


if __name__ == "__main__":
    main()
