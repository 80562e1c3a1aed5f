"""What a learned policy knows: hands with as many joints as its own, or all hands and objects of its family."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

from inhand.control.contract import check_rate
from inhand.errors import InputError
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.tasks.layouts import find_layout

if TYPE_CHECKING:
    from inhand.control.contract import Contract
    from inhand.control.controller import Task
    from inhand.geometry import Array
    from inhand.hands.pair_family import PairFamily


class Knows(Protocol):
    """What a policy says of itself."""

    @property
    def observation(self) -> str:
        """Layout of its observations."""

    @property
    def weights(self) -> tuple[Array, ...]:
        """Weights of each layer `(inputs, outputs)`."""

    @property
    def trained(self) -> dict[str, Any]:
        """What it was trained with."""

    @property
    def contract(self) -> Contract | None:
        """Hand, joints, rate and senses that it learned with."""

    @property
    def family(self) -> PairFamily | None:
        """Hands and objects that it is for; None of one that learned with one pair."""


def check_task(policy: Knows, task: Task) -> None:
    """Refuse a hand or an object that a policy does not know, and another rate than its contract's.

    Raises:
        InputError: as `check_held`; or another rate.
    """
    check_held(policy, task.hand, task.objects)
    if policy.contract is not None:
        check_rate(policy.contract, task.control_period)


def check_held(policy: Knows, hand: HandSpec, objects: Sequence[ObjectSpec] = ()) -> None:
    """Refuse a hand that a policy has no inputs for, and a hand and objects outside of its family.

    Raises:
        InputError: another number of joints, or the number that lies outside and the family's bounds.
    """
    if find_layout(policy.observation).space:
        raise InputError(
            f"the policy was trained with {policy.trained.get('hand', 'another hand')}, a hand in space, and hand"
            f" {hand.name!r} is in the plane: use such a hand (inhand asterisk --hand 3f_60.60_40_10 --object cube_50)"
        )
    if find_layout(policy.observation).columns:
        _check_family(policy, hand, objects)
        return
    size, given = find_layout(policy.observation).size(hand), policy.weights[0].shape[0]
    if size != given or policy.weights[-1].shape[1] != hand.n_joints:
        raise InputError(
            f"the policy was trained with {policy.trained.get('hand', 'another hand')} and takes {given} numbers; hand"
            f" {hand.name!r} gives {size}: use a hand with as many joints, --controller rl, which knows hands that"
            " differ, or train one for it with `inhand train`"
        )


def _check_family(policy: Knows, hand: HandSpec, objects: Sequence[ObjectSpec]) -> None:
    if policy.family is None:
        return
    why = policy.family.hand_outside(hand)
    if why is not None:
        raise InputError(
            f"hand {hand.name!r} is outside of the policy's family: {why}; use a hand within, or train a policy for it"
            " with `inhand train`"
        )
    for spec in dict.fromkeys(objects):
        why = policy.family.outside(Held(hand, spec))
        if why is not None:
            raise InputError(f"{why}; use an object within, or train a policy for it with `inhand train`")
