"""The loop that trains: the agent acts while the networks learn, round after round, until its episodes are done.

A round's updates are launched first and run beside the simulation of the same round, which acts with the actor from
before them. An evaluation runs beside all that comes until the next one or a checkpoint, and is told then. What is
drawn and computed does not depend on which of them is faster, so a seed gives the same bytes.
"""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.loop import Told
from inhand.control.policy import Cost, Policy, load_policy, save_policy
from inhand.errors import InputError
from inhand.learning.ahead import CHUNK
from inhand.learning.beginning import begun, collectors_of, contract_for, policy_of, pool_name
from inhand.learning.checkpoint import load_checkpoint, save_checkpoint
from inhand.learning.collect import Finished
from inhand.learning.config import Training
from inhand.learning.ddpgfd import Learner, Report, imitate_many, update_many
from inhand.learning.demonstrations import recorded
from inhand.learning.journal import Counters, Evaluation, Journal, Trying
from inhand.learning.networks import Actor
from inhand.learning.progress import AGENT, BEST, CHECKPOINT, EXPERT, IMITATED, LAST
from inhand.learning.replay_buffer import Priorities, ReplayBuffer, Rows, rows_of
from inhand.learning.setup import Ready
from inhand.learning.trying import tried_all

LEARNING = "learning"
"""What progress is told while the agent's episodes run."""
PRIORITY = 0.3
"""Exponent of the priorities (DDPGfD paper)."""
CORRECTION = 0.5
"""Power of the importance weights, guessed between none (0) and whole (1)."""
SHOWN_BONUS, PRIORITY_FLOOR = 0.1, 1e-3
"""What the priority of a demonstrated row, and of every row, is raised by; guessed."""


def _quiet(what: str, done: int, total: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """What U updates learn from."""

    rows: Rows
    """Rows `(U, batch, width)`."""
    weights: Rows
    """Their importance weights `(U, batch)`."""
    whose: NDArray[np.bool_]
    """Whether each is the expert's `(U, batch)`."""
    numbers: tuple[NDArray[np.int64], NDArray[np.int64]]
    """Numbers of the rows in the expert's buffer and in the agent's."""


class Trainer:
    """A training run in a folder."""

    def __init__(
        self,
        config: Training,
        ready: Ready,
        folder: Path,
        told: Callable[[Evaluation], None],
        progress: Told = _quiet,
        *,
        spent: float = 0.0,
    ) -> None:
        """Set the run up; if the folder holds a checkpoint, go on from it.

        Args:
            config: what to train.
            ready: what it starts with.
            folder: the run's.
            told: told every evaluation.
            progress: told what is being done, how far it is, and how far it has to go.
            spent: time on a core that its preparations took [s].
        """
        self.config, self._ready, self._folder, self._told, self._progress = config, ready, folder, told, progress
        self._contract = contract_for(config, ready.held)
        self.counters = Counters()
        self._rng = np.random.default_rng((config.seed, 1))
        self._collectors = collectors_of(config, ready)
        self._learner = begun(config, ready.columns)
        self._go_on_from(folder / CHECKPOINT)
        self._began = time.perf_counter() - self.counters.seconds
        self._began_cpu = time.process_time() - spent - self.counters.cpu_s
        self._beside, self._trying = ThreadPoolExecutor(1), list[Trying]()

    def _go_on_from(self, checkpoint: Path) -> None:
        """Open what is written on and on; go on from a checkpoint, if it is there."""
        config, ready, folder = self.config, self._ready, checkpoint.parent
        rows = config.agent_episodes * config.interface.horizon
        spare = 2 * (config.evaluate_every + 3 * config.worlds) * config.interface.horizon
        arrays, written, shown, length = dict[str, Any](), 0, ready.expert_rows, 0
        self._new = not checkpoint.is_file()
        if not self._new:
            self._learner, arrays, head = load_checkpoint(checkpoint, self._learner)
            self.counters = Counters(**head["counters"])
            written, shown, length = (head[name] for name in ("written", "shown", "journal"))
            self._rng.bit_generator.state = arrays["rng.training"]
            for number, collector in enumerate(self._collectors):
                collector.load_state_dict({n.removeprefix(pool_name(number)): value for n, value in arrays.items()})
        self._journal = Journal(folder, length)
        most = ready.expert_rows + config.rounds * config.relabelled * config.interface.horizon
        self._expert = ReplayBuffer(folder / EXPERT, ready.columns, most, 0, shown)
        self._agent = ReplayBuffer(folder / AGENT, ready.columns, rows, spare, written)
        self._priorities = self._all_priorities(arrays)

    def run(self) -> Path:
        """Train to the end and return the folder of the best policy.

        Raises:
            InputError: a loss is not finite any more; the state is kept and the text says where and why.
        """
        if self._new:
            if self.config.start:
                self._evaluate()  # what few demonstrations make worse stays as it was
            self._imitate()
            self._sign({IMITATED: self.actor()})
            self._warm_up()
            self._tell()
            self._keep(CHECKPOINT)
        while self.counters.episodes < self.config.episodes:
            self._round()
            if self._due:
                self._tell()
                self._keep(CHECKPOINT)
        if self.counters.evaluated != self.counters.episodes:
            self._evaluate()
        self._tell()
        self._beside.shutdown()
        self._journal.close()
        self._sign({place: load_policy(self._folder / place) for place in (LAST, BEST)})
        return self._folder / BEST

    @property
    def _due(self) -> bool:
        """Whether the actor is to be tried out."""
        return self.counters.episodes - self.counters.evaluated >= self.config.evaluate_every

    @property
    def share(self) -> float:
        """Share of a batch that comes from the expert now."""
        decays = self.counters.episodes // self.config.share_every
        return float(self.config.expert_share * self.config.share_kept**decays)

    def actor(self) -> Policy:
        """Return the actor that acts best: of the default's, the target actor, which single updates move less."""
        return policy_of(
            self.config,
            self._contract,
            self._learner.target_actor if self.config.learning.imitation else self._learner.actor,
        )

    def _imitate(self) -> None:
        """Fit the actor to the demonstrations, then in rounds to what the expert says of the actor's own episodes."""
        actor, config = self._learner.actor, self.config
        for number in range(config.rounds + 1):
            if number:
                self._relabel(number, actor)
            actor = self._fitted(actor, config.refit if 0 < number < config.rounds else config.imitate)
        self._learner = self._learner._replace(actor=actor, target_actor=actor)

    def _fitted(self, actor: Actor, updates: int) -> Actor:
        many, columns, moments, rows = (CHUNK, 2 * self.config.learning.batch), self._ready.columns, None, None
        rate = self.config.learning.imitation_rate
        for done in range(0, updates, CHUNK):
            rows = self._shown(many) if rows is None else rows
            actor, moments, loss = imitate_many(actor, moments, rows, columns, updates, rate=rate)
            # While that runs, the next rows are drawn.
            rows = self._shown(many) if done + CHUNK < updates else None
            self._journal.scalars("imitation", done + CHUNK, {"loss": float(loss)})
            self._progress("imitating the demonstrations", done + CHUNK, updates)
        return actor

    def _shown(self, count: tuple[int, int]) -> Rows:
        return self._expert.shown(self._expert.draw(self._rng, count), self._ready.columns)

    def _relabel(self, number: int, actor: Actor) -> None:
        """Add a round of the actor's own episodes, as the expert labels them, to what the expert has shown."""
        config, ready = self.config, self._ready
        rng = np.random.default_rng((config.seed, 4, number))
        self._progress("relabelling the actor's episodes", number, config.rounds)
        total, looking = sum(map(len, ready.starts)), (config.learning.discount, config.learning.look_ahead)
        for pool in ready.starts:
            rows = rng.choice(len(pool), min(config.relabelled * len(pool) // total, len(pool)), replace=False)
            actor_now = policy_of(config, self._contract, actor)
            episodes = recorded(config.shows, pool.rows(rows), rng, actor_now)
            for shown in episodes.apart():
                episode = shown.observations, shown.actions, shown.wanted, shown.rewards
                self._expert.add(rows_of(ready.columns, episode, looking, terminated=shown.terminated))

    def _warm_up(self) -> None:
        """Fit the critic to the demonstrations; the actor stays as it is, and is tried out meanwhile."""
        chunk, actor = self.config.updates, self._learner.actor
        for done in range(0, self.config.warm_up, chunk):
            fitted, report = self._updated(self._draw(chunk, 1.0), 0.0)
            if done == 0:
                self._evaluate()
            self._learner = fitted._replace(actor=actor, target_actor=actor)
            self._journal.scalars("warm-up", done + chunk, {"critic loss": float(np.mean(report.critic_loss))})
            self._progress("learning their values", done + chunk, self.config.warm_up)
        if self.config.warm_up == 0:
            self._evaluate()

    def _round(self) -> None:
        """Launch the updates, try the actor out if that is due and act meanwhile, and take in what both have given."""
        config, counters = self.config, self.counters
        begun = len(self._agent) >= config.learning.batch or self.share == 1.0
        drawn = self._draw(config.updates, self.share) if begun else None
        acting = policy_of(self.config, self._contract, self._learner.actor)
        launched = None if drawn is None else self._updated(drawn, 1.0)
        if self._due:
            self._evaluate()
        rows, ends = list[Rows](), list[Finished]()
        for collector in self._collectors:
            more = collector.collect(acting, config.decisions, config.spread, self._rng)
            rows += more[0]
            ends += more[1]
        if launched is not None and drawn is not None:
            self._learner, report = launched
            self._take_in(report, drawn)
            counters.updates += config.updates
        for block in rows:
            self._agent.add(block)
        counters.episodes += len(ends)
        counters.decisions += config.decisions * config.worlds
        counters.rounds += 1
        counters.seconds = time.perf_counter() - self._began
        self._journal.episodes(counters.episodes - len(ends), ends)
        self._progress(LEARNING, counters.episodes, config.episodes)

    def _updated(self, drawn: Drawn, strength: float) -> tuple[Learner, Report]:
        found: tuple[Learner, Report] = update_many(
            self._learner, drawn.rows, drawn.weights, self.config.learning, self._ready.columns, strength=strength
        )
        return found

    def _draw(self, updates: int, share: float) -> Drawn:
        batch = self.config.learning.batch
        if len(self._agent) == 0:
            share = 1.0
        whose = self._rng.random((updates, batch)) < share
        rows = np.empty((updates, batch, self._ready.columns.width), dtype=np.float32)
        weights = np.ones((updates, batch), dtype=np.float32)
        numbers = []
        for number, (replay, chosen) in enumerate(((self._expert, whose), (self._agent, ~whose))):
            count = int(chosen.sum())
            if count and self._priorities:
                drawn, weights[chosen] = self._priorities[number].draw(self._rng, count)
            else:
                drawn = replay.draw(self._rng, count) if count else np.zeros(0, dtype=np.int64)
            rows[chosen] = replay.at(drawn)
            numbers.append(drawn)
        return Drawn(rows, weights, whose, (numbers[0], numbers[1]))

    def _take_in(self, report: Report, drawn: Drawn) -> None:
        """Write losses down, refuse those that are not finite, and tell the priorities."""
        losses = np.asarray(report.critic_loss), np.asarray(report.actor_loss)
        bad = ~np.isfinite(losses[0])
        if bad.any():
            first = self.counters.updates + int(bad.argmax())
            self._keep("stopped.npz")
            raise InputError(
                f"training stopped at update {first}: the critic's loss is {losses[0][bad][0]}. Its values have grown"
                f" beyond what float32 holds, or a reward was not finite: lower the learning rate"
                f" (now {self.config.learning.critic_rate:g}) or the discount ({self.config.learning.discount:g})."
                f" The state is kept in {self._folder / 'stopped.npz'}"
            )
        if self._priorities:
            priority = np.asarray(report.priority) + PRIORITY_FLOOR
            for which, chosen in enumerate((drawn.whose, ~drawn.whose)):
                if chosen.any():
                    bonus = SHOWN_BONUS if which == 0 else 0.0
                    self._priorities[which].learn(drawn.numbers[which], priority[chosen] + bonus)
        told = {
            "critic loss": losses[0].mean(),
            "actor loss": np.nanmean(losses[1]),
            "expert share": self.share,
            "updates": self.counters.updates + len(losses[0]),
        }
        self._journal.scalars("learning", self.counters.episodes, {name: float(value) for name, value in told.items()})

    def _evaluate(self) -> None:
        """Begin to try the actor out, beside what comes next."""
        self._tell()
        ready, policy, counters = self._ready, self.actor(), self.counters
        counters.evaluated = counters.episodes
        found = self._beside.submit(tried_all, ready.held, ready.tests, self.config.interface, policy)
        self._trying.append(Trying(policy, Counters(**vars(counters)), found))

    def _tell(self) -> None:
        """Wait for the evaluation under way, if there is one; tell what it found and keep the last and the best."""
        ready, counters = self._ready, self.counters
        while self._trying:
            trying = self._trying.pop()
            found = trying.found.result()
            fraction = found.distance / ready.limit
            score = float(found.total[ready.trained].mean())
            trying.counters.seconds = counters.seconds = time.perf_counter() - self._began
            trying.counters.cpu_s = counters.cpu_s = time.process_time() - self._began_cpu
            save_policy(trying.policy, self._folder / LAST)
            if score > counters.best:
                trying.counters.best = counters.best = score
                save_policy(trying.policy, self._folder / BEST)
            evaluation = Evaluation(trying.counters, found, fraction, score)
            self._journal.evaluation(evaluation, ready)
            self._told(evaluation)

    def _sign(self, policies: dict[str, Policy]) -> None:
        """Keep policies, by their folders, and write into their cards what all of it has taken so far."""
        config, counters = self.config, self.counters
        shown = config.recipe.episodes + config.rounds * config.relabelled
        fitted = config.imitate * (2 if config.rounds else 1) + config.refit * max(config.rounds - 1, 0)
        updates = fitted + counters.updates + (0 if IMITATED in policies else config.warm_up)
        decided, spent = self._expert.written + counters.decisions, time.process_time() - self._began_cpu
        cost = Cost(shown + counters.episodes, decided, updates, round(spent, 1))
        for place, policy in policies.items():
            save_policy(replace(policy, cost=cost), self._folder / place)

    def _keep(self, name: str) -> None:
        self._agent.flush()
        arrays = {"rng.training": self._rng.bit_generator.state}
        for number, collector in enumerate(self._collectors):
            arrays |= {f"{pool_name(number)}{n}": value for n, value in collector.state_dict().items()}
        for number, priorities in enumerate(self._priorities):
            arrays |= {f"priorities.{number}.{n}": v for n, v in priorities.state_dict().items()}
        told = {"counters": vars(self.counters), "journal": self._journal.length()}
        told |= {"written": self._agent.written, "shown": self._expert.written}
        save_checkpoint(self._folder / name, self._learner, arrays, told)

    def _all_priorities(self, arrays: dict[str, Any]) -> tuple[Priorities, ...]:
        """Return the priorities of both buffers, as a checkpoint left them; none where rows are drawn evenly."""
        if not self.config.learning.prioritised:
            return ()
        both = tuple(Priorities(replay, PRIORITY, CORRECTION) for replay in (self._expert, self._agent))
        for number, priorities in enumerate(both):
            mine = f"priorities.{number}."
            priorities.load_state_dict({n.removeprefix(mine): v for n, v in arrays.items() if n.startswith(mine)})
        return both
