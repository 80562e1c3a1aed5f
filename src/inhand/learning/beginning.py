"""What a training run begins with: its learner, and its agent's worlds; and how its actor becomes a policy."""

import jax
import jax.numpy as jnp
import numpy as np

from inhand.control.contract import AnyContract, Contract, SpatialContract, contract_in_space, contract_of
from inhand.control.policy import Policy
from inhand.errors import InputError
from inhand.hands.pair_family import PairFamily
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.learning.collect import Collector
from inhand.learning.config import Training
from inhand.learning.ddpgfd import Learner, new_learner
from inhand.learning.networks import Actor, Layer, actor_of, layers_of
from inhand.learning.replay_buffer import Columns
from inhand.learning.run_cards import policy_to_start
from inhand.learning.setup import Ready
from inhand.learning.worlds import ManipulationWorlds
from inhand.sim.disturbance_files import NONE, load_disturbance


def begun(config: Training, columns: Columns) -> Learner:
    """Return a learner to begin with: fresh networks, or the actor of the policy that training is to start from.

    Raises:
        InputError: a policy of another form than is to be trained.
    """
    learner = new_learner(config.learning, columns, config.seed)
    if not config.start:
        return learner
    policy = policy_to_start(config.start)
    both = zip(policy.weights, policy.biases, strict=True)
    layers = tuple(Layer(*(jnp.asarray(array, jnp.float32) for array in pair)) for pair in both)
    actor = actor_of(policy.network, layers)
    same = [a.shape for a in jax.tree.leaves(actor)] == [a.shape for a in jax.tree.leaves(learner.actor)]
    if not same or policy.network != config.learning.network or policy.observation != config.interface.observation:
        raise InputError(
            f"start {config.start} sees {policy.observation} by a {policy.network} network, and what is to be trained"
            f" sees {config.interface.observation} by one of other layers: give it its observation, network and hidden"
        )
    return learner._replace(actor=actor, target_actor=actor)


def collectors_of(config: Training, ready: Ready) -> tuple[Collector, ...]:
    """Return what collects in the worlds of each pool of starts; each has its share of the worlds."""
    looking, total = (config.learning.discount, config.learning.look_ahead), sum(map(len, ready.starts))
    found = []
    for number, pool in enumerate(ready.starts):
        rng = np.random.default_rng((config.seed, 2, *([number] if number else [])))
        count = max(round(config.worlds * len(pool) / total), 1)
        worlds = ManipulationWorlds(ready.held, pool, count, config.interface, rng)
        found.append(Collector(worlds, ready.columns, looking))
    return tuple(found)


def pool_name(number: int) -> str:
    """Return what the names of a pool's arrays begin with in a checkpoint."""
    return f"pool {number}." if number else ""


def contract_for(config: Training, held: AnyPair) -> AnyContract:
    """Return what the policies of a run ask of a hand."""
    disturb = load_disturbance(config.disturb)
    return contract_in_space(held, disturb) if isinstance(held, SpatialPair) else contract_of(held.hand, disturb)


def policy_of(config: Training, contract: AnyContract, actor: Actor) -> Policy:
    """Return an actor as the policy that a training run writes."""
    layers = layers_of(actor)
    return Policy(
        tuple(np.asarray(layer.weight, dtype=float) for layer in layers),
        tuple(np.asarray(layer.bias, dtype=float) for layer in layers),
        config.interface.observation,
        config.interface.actions,
        config.recipe.grasp,
        {"preset": config.preset, "hand": config.hand, "object": config.object, "seed": config.seed}
        | ({"task": config.task} if config.task else {})
        | ({"disturb": config.disturb} if config.disturb != NONE else {})
        | ({"pairs": config.pairs} if config.pairs else {})
        | ({"start": config.start} if config.start else {}),
        contract if isinstance(contract, Contract) else None,
        network=config.learning.network,
        family=PairFamily() if config.pairs else None,
        space=contract if isinstance(contract, SpatialContract) else None,
    )
