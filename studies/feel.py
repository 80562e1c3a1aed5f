"""Teaches the risk that `rl` stops by beyond its planned way, and tells what going on by feel is worth.

The policy is told to go farther than was planned, in worlds of its own, until it has lost the object or turned it by
more than 6 deg. A network learns from what it senses whether either comes within ten decisions (0.2 s). `--out`
writes it into the policy's folder. `--levels` tests who goes by it: the planned way and, from there on, farther until
the risk passes a threshold, beside the policy that ends where it was planned to, and where it is told ways so much
longer. Grasps are those that ship.
Run: python studies/feel.py --out src/inhand/policies/default
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
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
from inhand.cli.terminal import say
from inhand.control.catalogue import ControllerEntry, Planner, find_controller, learned
from inhand.control.controller import Task
from inhand.control.feeling import SOON, TOLD, FeelingController
from inhand.control.grades import GRADES
from inhand.control.phases import GradedGrasp, Grasp, graded_grasp
from inhand.control.policy import Policy, load_policy
from inhand.control.risk import Risk, save_risk
from inhand.control.sensed_policy import SensedPolicyController
from inhand.control.trial import LOST, Trial
from inhand.geometry import Array
from inhand.learning.networks import Network, forward, new_network
from inhand.sim.disturbance import name_of
from inhand.tasks.layouts import find_layout

BENT_DEG, BENT_MM = 6.0, 3.0
"""What is turned or off its line by more is spoilt."""
LETTING_GO = 5
"""Decisions by which contact is gone before an object counts as lost."""
LATE = 0.35
"""Share of the planned way from which on the network learns."""
HIDDEN, STEPS, BATCH, RATE = (96, 64), 2500, 512, 1e-3
TRAINED = 7001
"""Seed of the worlds that are learned in."""
WORLDS = {"well": 96, "field": 96, "hard": 48, "none": 16}
"""Trials of each direction that are learned from, in worlds of the grades of a camera and in undisturbed ones."""


@dataclass
class Felt:
    """What was felt at every decision of a batch."""

    rows: list[Array] = field(default_factory=list)
    late: list[NDArray[np.bool_]] = field(default_factory=list)
    """Whether each world had come far enough to learn from `(B,)`."""


class Keeping(FeelingController):
    """Goes as far as it may, and keeps what it feels."""

    def __init__(self, task: Task, policy: Policy, kept: list[Felt]) -> None:
        """Follow the task's paths with a policy."""
        super().__init__(replace(task, risk=np.ones(task.n_worlds)), policy)
        self._risk, self._kept = self._keep, Felt()
        kept.append(self._kept)

    def _keep(self, felt: Array) -> Array:
        self._kept.rows.append(felt.astype(np.float32))
        self._kept.late.append(~self._past.waiting & (self.progress > LATE * self._planned))
        return np.zeros(len(felt))


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


def shipped() -> Policy:
    """Return the policy that ships."""
    return load_policy(Path(inhand.policies.__file__).parent / "default")


def learned_from(entry: ControllerEntry) -> tuple[Array, Array]:
    """Return what is felt `(N, d)` in worlds to learn in, every fourth decision, and what comes soon `(N,)`."""
    rows, soon = list[Array](), list[Array]()
    for name, count in WORLDS.items():
        config = AsteriskConfig(controller="rl", trials=count, seed=TRAINED, disturb=disturb_of(name))
        kept = list[Felt]()
        made = partial(Keeping, policy=shipped(), kept=kept)
        setup = replace(prepare(config), controller=replace(entry, manipulate=made))
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
        say(f"{name}: {lost} of {len(trials)} lost beyond their ways, {len(taken)} decisions")
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
    return Risk(tuple(jax.device_get(network)), middle, half)


def telling(risk: Risk, felt: Array, soon: Array) -> dict[str, float]:
    """Return the cross-entropy of what comes soon, and with parts of what is felt shuffled between decisions."""
    size = felt.shape[1]
    waited = TOLD + find_layout(shipped().observation).size(prepare(AsteriskConfig()).hand)
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
    say("| level | controller | share | 95 % | lost | 95 % | turn [deg] | beyond 6 deg |\n" + "|---" * 8 + "|")
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
            say(f"| {level} | {entry.name} | {told} | {turn} |")


def main() -> None:
    """Learn the risks, and test who goes by them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, help="the policy's folder, in which the first network is written")
    parser.add_argument("--levels", nargs="*", default=[], help="what to test at: none, bench, well, field, hard")
    parser.add_argument("--trials", type=int, default=63, help="of each of 16 directions at each level")
    parser.add_argument("--seed", type=int, default=11, help="of the worlds that are tested in")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of the networks")
    parser.add_argument("--longer", type=float, default=1.05, help="what planned ways are made longer by")
    given = parser.parse_args()
    entry = replace(find_controller("rl"), manipulate=partial(SensedPolicyController, policy=shipped()))
    felt, soon = learned_from(entry)
    entries = [entry, replace(entry, name=f"told-{given.longer:g}", grasp=longer(entry.grasp, given.longer))]
    for seed in given.seeds:
        risk = fitted(felt, soon, seed)
        say(f"seed {seed}, shuffled: {telling(risk, felt, soon)}")
        if given.out is not None and seed == given.seeds[0]:
            save_risk(risk, shipped().digest, given.out)
        entries.append(learned(f"feel-{seed}", replace(shipped(), risk=risk)))
    tested(entries, given.levels, given.trials, given.seed)


if __name__ == "__main__":
    main()
