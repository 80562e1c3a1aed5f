"""A learned policy in plain NumPy: its file, the function it is, and the controller it makes."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from inhand.control.contract import Contract, SpatialContract
from inhand.control.controller import Task
from inhand.control.follow import follow_limit
from inhand.control.ik import IkConfig
from inhand.control.joint_network import NetworkKind, actions_of_joints
from inhand.control.knowing import check_task
from inhand.control.policy_arrays import ACTOR, PARTS, layers_of
from inhand.control.risk import RISK, Risk, load_risk
from inhand.control.user_policy import UserPolicy
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array
from inhand.hands.pair_family import PairFamily
from inhand.records import read_json, read_record, text_of
from inhand.sim.state import State
from inhand.tasks.cards import NEW, InterfaceCard, check_same, interface_card
from inhand.tasks.decisions import Actions, targets_of
from inhand.tasks.hand_arrays import slots_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Aim, Scene, observe

FORMAT = 2
"""Version of the files; see `inhand.tasks.cards.NEW`."""
CARD = "actor.json"
"""Name of what says how to use the weights."""
STILL_WAY = 3e-4
"""A policy that has gained less along the primitive [m] during"""
STILL_TIME = 0.5
"""this time [s] holds, and its episode is over."""
MARGIN = (0.004, 0.16)
"""What a policy keeps from where its grip is predicted to end: distance [m], and angle [rad] where the path turns. Two
millimetres more than the expert keeps: a finger stretched straight buckles unless its place is held exactly."""
BENT = 1e-6
"""Paths that turn or leave their line by more are not straight [m or rad]."""


@dataclass(frozen=True)
class Cost:
    """What training took."""

    episodes: int
    """Simulated episodes: shown, relabelled and the actor's own."""
    decisions: int
    """Decisions of these."""
    updates: int
    """Updates of the networks."""
    cpu_s: float
    """Time on a core, all cores together [s]."""

    def __str__(self) -> str:
        """Return it in one line."""
        count = f"{self.episodes:,} episodes, {self.decisions:,} decisions, {self.updates:,} updates"
        return f"{count}, {self.cpu_s / 60:.1f} minutes of a core"


@dataclass(frozen=True, eq=False)
class Policy:
    """A trained actor: layers, and how it sees and acts."""

    weights: tuple[Array, ...]
    """Weights of each layer `(inputs, outputs)`."""
    biases: tuple[Array, ...]
    """Biases of each layer `(outputs,)`."""
    observation: str
    """Layout of its observations."""
    actions: Actions
    """What its actions mean."""
    grasp: Literal["planned", "rough", "sensed"]
    """How it is given the object: planned, rough, or sensed, planned for worlds that are not known."""
    trained: dict[str, Any]
    """What it was trained with and by: hand, object, seed, versions; for people."""
    contract: Contract | None = None
    """Hand, joints, rate and senses that it learned with; None of one that no training made."""
    cost: Cost | None = None
    """What training it took; None where nobody wrote that down."""
    network: NetworkKind = "plain"
    """Form of the network that its layers are of."""
    family: PairFamily | None = None
    """Hands and objects that it is for; None of one that learned with one pair."""
    space: SpatialContract | None = None
    """Hand in space, object, joints and rate that it learned with, in the place of `contract`."""
    risk: Risk | None = None
    """What stops it where it goes on beyond a planned way; None of one that ends there."""

    @property
    def task(self) -> str:
        """The whole task that it was trained on; empty where it was trained on primitives."""
        return str(self.trained.get("task") or "")

    @property
    def digest(self) -> str:
        """What tells policies of one name apart: 16 digits of the SHA-256 of its numbers and its layouts."""
        found = hashlib.sha256(f"{self.observation} {self.actions} {self.grasp}".encode())
        for array in (*self.weights, *self.biases):
            found.update(np.ascontiguousarray(array).tobytes())
        return found.hexdigest()[:16]

    def __call__(self, observation: Array) -> Array:
        """Return actions `(..., n)` within [-1, 1] for observations `(..., d)`."""
        if self.network == "joints":
            return np.asarray(actions_of_joints(tuple(zip(self.weights, self.biases, strict=True)), observation, np))
        found = observation
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            found = np.maximum(found @ weight + bias, 0.0)
        return np.tanh(found @ self.weights[-1] + self.biases[-1])


@dataclass(frozen=True)
class _Card:
    format: int
    layers: int
    observation: str
    interface: InterfaceCard
    actions: Actions
    grasp: Literal["planned", "rough", "sensed"]
    trained: dict[str, Any]
    contract: Contract | None = None
    cost: Cost | None = None
    network: NetworkKind = "plain"
    family: PairFamily | None = None
    space: SpatialContract | None = None


def save_policy(policy: Policy, folder: Path) -> None:
    """Write a policy's two files to a folder, each under a temporary name that is then moved into place."""
    arrays = {}
    for number, layer in enumerate(zip(policy.weights, policy.biases, strict=True)):
        for name, array in zip(PARTS, layer, strict=True):
            arrays[f"{number}.{name}"] = np.ascontiguousarray(array, dtype=np.float32)
    interface, count = interface_card(find_layout(policy.observation), policy.actions), len(policy.weights)
    named = policy.observation, interface, policy.actions, policy.grasp, policy.trained
    card = _Card(FORMAT, count, *named, policy.contract, policy.cost, policy.network, policy.family, policy.space)
    folder.mkdir(parents=True, exist_ok=True)
    for file, content in ((ACTOR, save(arrays)), (CARD, text_of(card).encode())):
        with in_place(folder / file) as temporary:
            temporary.write_bytes(content)


def load_policy(folder: Path) -> Policy:
    """Return the policy of a folder.

    Raises:
        InputError: no policy there, one that cannot be used, or one of another format or observation layout; the text
            names the field, the array or the part that differs.
    """
    try:
        card = read_record(read_json((folder / CARD).read_bytes()), _Card, FORMAT, NEW)
        check_same(card.interface, card.observation, card.actions)
        known = card.contract or card.space
        seen, arrays = (card.observation, card.interface), load_file(folder / ACTOR)
        weights, biases = layers_of(arrays, card.layers, seen, card.network, None if known is None else known.hand)
    except FileNotFoundError as error:
        raise InputError(
            f"no trained policy in {folder}: it needs {ACTOR} and {CARD}; give the folder of a run of `inhand train`"
        ) from error
    except (KeyError, TypeError, ValueError, OSError, SafetensorError) as error:
        raise InputError(f"the policy in {folder} cannot be used: {error}; train it again") from error
    how = card.observation, card.actions, card.grasp, card.trained, card.contract
    found = Policy(weights, biases, *how, card.cost, card.network, card.family, card.space)
    return replace(found, risk=load_risk(found.digest, folder)) if (folder / RISK).is_file() else found


class PolicyController:
    """Moves the object of every world along its direction as a policy says, and ends where the policy holds."""

    def __init__(self, task: Task, policy: Policy | UserPolicy) -> None:
        """Move objects along the task's directions.

        Raises:
            InputError: paths that bend or turn, but for turns on the spot where the layout has slots; a hand or an
                object that the policy does not know, or another rate than its contract's.
        """
        self._task, self._policy, self._period = task, policy, task.control_period
        self._layout = find_layout(policy.observation)
        self._turn: Array | float = 0.0
        if self._layout.columns:
            self._angle, self._turn = aims_of(task.path.poses)
        else:
            self._angle = straight_angles(task.path.poses)
        if isinstance(policy, Policy):
            check_task(policy, task)
        self._scene = Scene(task.hand, task.objects)

    def begin(self, state: State) -> None:
        """Start a primitive where the object is now."""
        start = self._task.origin(state)
        self._aim = Aim(self._angle, start, self._distance(state), turn=self._turn)
        self._best = np.zeros(state.n_worlds)
        self._still = np.zeros(state.n_worlds)

    def _distance(self, state: State) -> Array | float:
        """Return the way to go `(B,)` [m]: as the task says, or as far as the grip held now is predicted to reach."""
        if self._task.distance is not None:
            return self._task.distance
        if isinstance(self._policy, UserPolicy) and not self._policy.stop:
            return np.inf
        return carried_by(self._task, state)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        action = self._policy(observe(self._layout, state, self._aim, self._scene))
        if self._layout.columns:
            action = action[:, slots_of(self._task.hand)]
        return targets_of(action, self._policy.actions, self._task.hand, state)

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have gained nothing of what is asked for a while `(B,)`."""
        along = self._aim.come(self._aim.shift(state.pose))
        gained = along > self._best + STILL_WAY
        self._best = np.where(gained, along, self._best)
        self._still = np.where(gained, 0.0, self._still + self._period)
        return np.asarray(self._still >= STILL_TIME)


def carried_by(task: Task, state: State) -> Array:
    """Return how far the grips held now carry their objects along the task's paths, for a policy `(B,)` [m]."""
    return follow_limit(task, state, IkConfig().friction_share, MARGIN)


def straight_angles(paths: Array) -> Array:
    """Return the direction `(B,)` [rad] of paths `(B, S, 3)` that start at the origin, if all of them are straight.

    Raises:
        InputError: a path that turns the object or leaves its line.
    """
    end = paths[:, -1]
    angle = np.arctan2(end[:, 1], end[:, 0])
    across = paths[..., 1] * np.cos(angle)[:, None] - paths[..., 0] * np.sin(angle)[:, None]
    if max(np.abs(across).max(), np.abs(paths[..., 2]).max()) > BENT:
        raise InputError(
            "a learned policy knows straight primitives that hold the object's rotation; for paths that bend or turn"
            " use the controller 'ik'"
        )
    return np.asarray(angle)


def parts_of(paths: Array) -> tuple[Array, Array]:
    """Return directions and turns, each `(B,)` [rad], of paths `(B, S, 3)` that turn on the spot, then go straight on.

    Raises:
        InputError: a path that bends, or turns while it moves.
    """
    turned, moving = paths[:, -1, 2], np.abs(paths[..., :2]).max(axis=-1) > BENT
    held = np.where(moving, paths[..., 2] - turned[:, None], 0.0)
    return straight_angles(np.concatenate([paths[..., :2], held[..., None]], axis=-1)), turned


def aims_of(paths: Array) -> tuple[Array, Array]:
    """Return directions [rad] and sides of turns, each `(B,)`, of paths `(B, S, 3)`: straight, or turns on the spot.

    Raises:
        InputError: a path that bends, or turns and moves.
    """
    turning = np.abs(paths[..., :2]).max(axis=(1, 2)) <= BENT
    side = np.where(turning, np.sign(paths[:, -1, 2]), 0.0)
    return straight_angles(np.where(turning[:, None, None], 0.0, paths)), side
