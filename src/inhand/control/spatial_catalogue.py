"""Controllers of hands in space by name: how each prepares a grasp, and what it manipulates with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Protocol

from inhand.control.catalogue import ControllerEntry, Entry, find_controller, policy_of
from inhand.control.contract import SpatialContract
from inhand.control.controller import Controller, SpatialTask
from inhand.control.knowing import check_held
from inhand.control.loop import Bench
from inhand.control.phases import Grasp
from inhand.control.policy import Policy, load_policy
from inhand.control.run_config import HeldConfig
from inhand.control.seen import PRIVILEGED, SENSED
from inhand.control.spatial_ik import EXPERT, SpatialIkController
from inhand.control.spatial_ik_sensed import SpatialIkSensedController
from inhand.control.spatial_policy import SpatialPolicyController, shorter
from inhand.control.spatial_rehearsal import planned_in_space
from inhand.control.spatial_sensed_plan import carrier_in_space, sensed_in_space
from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import AnyPair, SpatialPair, load_held
from inhand.tasks.layouts import find_layout
from inhand.tasks.spatial.paths import SpatialReference


class SpatialPlanner(Protocol):
    """Chooses a grasp for every path."""

    def __call__(
        self,
        hand: SpatialHand,
        spec: SolidSpec,
        paths: Sequence[SpatialReference],
        gravity: Array,
        starts: Array,
        *,
        bench: Bench,
        fixed: bool = False,
        shared: bool = False,
    ) -> Grasp:
        """Return a grasp for every path, of objects that start at `starts` `(B, 7)` under gravities `(B, 3)`.

        Paths count from where their objects stand, or, if they are `fixed`, from where the hand starts them. One grasp
        may be `shared` by all.
        """


@dataclass(frozen=True)
class SpatialEntry(Entry[SpatialPlanner, SpatialTask]):
    """One controller of hands in space; for a learned policy the expert lifts the object."""

    whole: "SpatialEntry | None" = None
    """What takes its place where one grasp is to carry many paths or a whole sequence; None where nothing does."""

    @property
    def contract(self) -> SpatialContract | None:
        """What it was trained to drive and to sense, if it is a policy that reads what is sensed."""
        return None if self.policy is None or self.reads != SENSED else self.policy.space

    @property
    def holds(self) -> Callable[[SpatialTask], Controller]:
        """What holds and lifts the object before it manipulates."""
        if self.reads == SENSED:
            return SpatialIkSensedController
        return self.manipulate if self.policy is None else SpatialIkController


CONTROLLERS = {
    "ik": SpatialEntry(
        "ik",
        "the expert: searched contacts, forces that hold the weight, feedback on the object's pose",
        partial(planned_in_space, config=EXPERT),
        partial(SpatialIkController, config=EXPERT),
        whole=SpatialEntry("ik", "the expert, of one grasp for all", planned_in_space, SpatialIkController),
    ),
    "ik-sensed": SpatialEntry(
        "ik-sensed",
        "the expert's law on encoders and a camera, as far as was planned for worlds that differ",
        sensed_in_space,
        SpatialIkSensedController,
        reads=SENSED,
    ),
}
"""Controllers of hands in space."""


SHIPPED = {"rl": "spatial", "rl-privileged": "spatial-privileged"}
"""Policies of the package for a hand in space by name, each with the preset that trained it, which is its folder."""


def find_spatial_controller(name: str) -> SpatialEntry:
    """Return a controller of hands in space, the package's policy for them, or that of a training run's folder.

    Raises:
        InputError: there is none of that name, or a policy of hands in the plane.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    if name in SHIPPED:
        with resources.as_file(resources.files("inhand") / "policies" / SHIPPED[name]) as folder:
            return learned_in_space(name, load_policy(folder))
    if Path(name).is_dir():
        return learned_in_space(*policy_of(Path(name)))
    known = (*CONTROLLERS, *SHIPPED)
    raise InputError(
        f"controller {name!r} with a hand in space{near_matches(name, known)}; allowed are {', '.join(known)} and the"
        " folder of a run of `inhand train` with such a hand: the others are of hands in the plane"
    )


def entry_for(name: str, held: AnyPair) -> ControllerEntry | SpatialEntry:
    """Return the controller of a name for a hand and an object, in the plane or in space.

    Raises:
        InputError: there is none.
    """
    return find_spatial_controller(name) if isinstance(held, SpatialPair) else find_controller(name, held)


def learned_entry(
    name: str, hand: str | Path | None = None, thing: str | Path | None = None
) -> tuple[ControllerEntry | SpatialEntry, Policy]:
    """Return a learned controller and its policy; with a hand or an object, of a name the one that is for them.

    Raises:
        InputError: no such hand or object, no learned policy, or one that does not know them.
    """
    if hand is None and thing is None:
        entry: ControllerEntry | SpatialEntry = find_controller(name)
    else:
        usual = HeldConfig()
        held = load_held(usual.hand if hand is None else hand, usual.object if thing is None else thing)
        entry = entry_for(name, held)
        if isinstance(held, SpatialPair) and isinstance(entry, SpatialEntry):
            check_known_in_space(entry, held.hand)
        elif isinstance(held, Held) and entry.policy is not None:
            check_held(entry.policy, held.hand, (held.object,))
    if entry.policy is None:
        raise InputError(f"{name} is no learned policy: give the folder of a run of `inhand train`, or rl")
    return entry, entry.policy


def learned_in_space(name: str, policy: Policy) -> SpatialEntry:
    """Return the controller that a policy is; grasps are the expert's, or planned by carrying it where it has senses.

    Raises:
        InputError: a policy of hands in the plane.
    """
    if policy.space is None:
        raise InputError(
            f"policy {name!r} was trained with {policy.trained.get('hand', 'a hand')} in the plane: train one with a"
            " hand in space (inhand train --preset spatial)"
        )
    if find_layout(policy.observation).sensed:
        carrier, summary = carrier_in_space(policy), "a learned policy on encoders and a camera"
        plan = partial(sensed_in_space, carrier=carrier)
        return SpatialEntry(name, summary, plan, carrier.make, policy=policy, reads=SENSED)
    made, planned = partial(SpatialPolicyController, policy=policy), partial(planned_in_space, told=shorter)
    return SpatialEntry(name, "a learned policy", planned, made, policy=policy)


def refuse_of_plane(hand: str, asked: Mapping[str, bool]) -> None:
    """Refuse options that a hand in space has no meaning for yet, by their names, where they are asked for.

    Raises:
        InputError: the text names them and the hand.
    """
    wrong = [option for option, given in asked.items() if given]
    if wrong:
        raise InputError(
            f"{' and '.join(wrong)} with {hand}, a hand in space: these are for hands in the plane; leave them out, or"
            " use such a hand (2v2_50.50_50.50_1.1_53)"
        )


def refuse_of_space(hand: str, gravity: str | None) -> None:
    """Refuse gravity with a hand in the plane.

    Raises:
        InputError: the text names it and the hand.
    """
    if gravity is not None:
        raise InputError(
            f"--gravity {gravity} with {hand}, a hand in the plane, whose object stands on a floor: leave it out, or"
            " use a hand in space (3f_60.60_40_10)"
        )


def check_known_in_space(entry: SpatialEntry, hand: SpatialHand) -> None:
    """Refuse a hand that a learned policy has no inputs for.

    Raises:
        InputError: fingers of other numbers of joints.
    """
    if entry.policy is None or entry.policy.space is None:
        return
    there = entry.policy.space.hand
    if [len(finger.links) for finger in there.fingers] != [len(finger.links) for finger in hand.fingers]:
        raise InputError(
            f"the policy {entry.name} was trained with {there.name}, {_joints_of(there)}; hand {hand.name!r} has"
            f" {_joints_of(hand)}: use a hand with as many, --controller ik, or train one for it with `inhand train"
            " --preset spatial --hand`"
        )


def notes_in_space(entry: SpatialEntry, hand: SpatialHand, spec: SolidSpec) -> tuple[str, ...]:
    """Return what a reader should know of a learned policy's run with a hand and an object, a sentence each."""
    if entry.policy is None or entry.policy.space is None:
        return ()
    there = entry.policy.space
    who = "The expert" if entry.reads == PRIVILEGED else "ik-sensed"
    notes = (f"{who} closes the fingers and lifts the object; from there on the policy carries it.",)
    if (there.hand, there.object) == (hand, spec):
        return notes
    return (
        *notes,
        f"The policy {entry.name} was trained with {there.object.name} and {there.hand.name}; here it moves {spec.name}"
        f" with {hand.name}.",
    )


def notes_over_pairs(entry: SpatialEntry, pairs: Sequence[tuple[SpatialHand, SolidSpec]]) -> tuple[str, ...]:
    """Return the same of a run with many hands and objects, and whether a policy knows but one of them."""
    if entry.policy is None or entry.policy.space is None:
        return ()
    there = entry.policy.space
    told = notes_in_space(entry, there.hand, there.object)
    if all(pair == (there.hand, there.object) for pair in pairs):
        return told
    alone = f"The policy {entry.name} was trained with {there.object.name} and {there.hand.name} alone: "
    return (
        *told,
        alone + "with others its skill tells how far that carries over, not what a policy of their own does.",
    )


def _joints_of(hand: SpatialHand) -> str:
    return f"fingers of {', '.join(str(len(finger.links)) for finger in hand.fingers)} joints"
