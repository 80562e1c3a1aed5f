"""Controllers by name: how each prepares a grasp, and what it manipulates with."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from inspect import signature
from pathlib import Path
from types import FunctionType
from typing import Generic, Protocol, TypeVar

import numpy as np

from inhand.control.checked import maker
from inhand.control.contract import Contract
from inhand.control.controller import Controller, SpatialTask, Task
from inhand.control.feeling import FeelingController, carrier_of
from inhand.control.ik import IkConfig, IkController
from inhand.control.ik_sensed import SENSED_PRIMITIVE, IkSensedController
from inhand.control.knowing import check_held
from inhand.control.names import FAMILY, LEARNED, SHIPPED, unknown_controller
from inhand.control.phases import Grasp
from inhand.control.policy import Policy, PolicyController, aims_of, load_policy, parts_of, straight_angles
from inhand.control.policy_arrays import ACTOR
from inhand.control.rehearsal import closing_joints, rehearsed
from inhand.control.route_policy import RouteController, SensedRouteController
from inhand.control.seen import PRIVILEGED, SENSED, Reads, reads_of
from inhand.control.sensed_plan import Carrier, graded, sensed_grasp
from inhand.control.sensed_policy import PolicyPrimitive, SensedPolicyController
from inhand.control.sliding import sliding_grasps
from inhand.control.thesis_ik import ThesisIkController
from inhand.control.user_policy import UserPolicy, user_policy
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.files import load_object
from inhand.hands.fit import Held
from inhand.hands.grasp_search import GraspPlan, SearchConfig
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.sides import rough_plan, side_joints
from inhand.registry import Registry
from inhand.sim.names import ENGINE
from inhand.tasks.layouts import find_layout


class Planner(Protocol):
    """Chooses a grasp for every path."""

    def __call__(
        self, hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None, *, engine: str = ENGINE
    ) -> Grasp:
        """Return a grasp, which is to hold in an engine, for every path of object poses `(P, S, 3)` in the palm frame.

        Objects stand at `starts` `(P, 3)`, or where their paths begin.
        """


P = TypeVar("P")
"""What chooses grasps."""
T = TypeVar("T", Task, SpatialTask)


@dataclass(frozen=True)
class Entry(Generic[P, T]):
    """One controller of the toolkit, of hands in the plane or in space."""

    name: str
    """What the command line calls it."""
    summary: str
    """One line for lists."""
    grasp: P
    """Chooses where the fingers hold the object."""
    manipulate: Callable[[T], Controller]
    """Makes the controller of the manipulation phase."""
    policy: Policy | None = None
    """The learned policy that it is, if it is one."""
    reads: Reads = PRIVILEGED
    """What it reads: all that is measured, or what a hand can know."""


@dataclass(frozen=True)
class ControllerEntry(Entry[Planner, Task]):
    """One of hands in the plane."""

    fixed_grasp: Planner | None = None
    """Chooses where they hold it for paths that stay where they are, as drawings do; None for `grasp`."""
    primitive: Callable[[Task], Controller] | None = None
    """Makes what carries out a primitive of a sequence on real senses, from states that are believed or, of a learned
    policy, from what is remembered; None for what `manipulate` makes, from what is sensed."""

    @property
    def contract(self) -> Contract | None:
        """What it was trained to drive and to sense, if it is a learned policy."""
        return None if self.policy is None else self.policy.contract


def planned_grasp(
    hand: HandSpec,
    spec: ObjectSpec,
    poses: Array,
    starts: Array | None = None,
    config: tuple[SearchConfig | None, IkConfig | None] = (None, None),
    *,
    engine: str = ENGINE,
    fixed: bool = False,
    slides: bool = False,
) -> Grasp:
    """Return the grasps of the contact search, tried out in simulation.

    Where an object stands elsewhere than its path starts, the fingers go to it from there. They are tried on paths that
    count from there, or, `fixed`, on paths that stay where they are. Where it `slides`, so may their contacts.
    """
    starts, held = poses[:, 0] if starts is None else starts, Held(hand, spec)
    best, ways = rehearsed(held, poses, starts, config, engine=engine, fixed=fixed)
    if not slides:
        return closing_joints(hand, spec, best, poses[:, 0], starts)
    best, told = sliding_grasps(held, poses, (best, ways), engine)
    return replace(closing_joints(hand, spec, best, poses[:, 0], starts), way=told)


def direction_plans(hand: HandSpec, spec: ObjectSpec, poses: Array, engine: str = ENGINE) -> list[GraspPlan]:
    """Return for every path `(P, S, 3)` the planned grasp that is best where the object stands exactly at its start.

    One plan serves every trial of a direction, which is what a learned controller trains and runs with.
    """
    distinct, index = np.unique(poses, axis=0, return_inverse=True)
    best, _ = rehearsed(Held(hand, spec), distinct, distinct[:, 0], engine=engine)
    return [best[k] for k in index]


def rough_grasp(
    hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None, *, engine: str = ENGINE
) -> Grasp:
    """Return the same grasp for every path and start, on the middle of the object's sides (thesis 3.2).

    Raises:
        InputError: a finger does not reach its side.
    """
    del starts, engine
    opened, closed = (side_joints(hand, spec, away) for away in (SearchConfig().opening, -ROUGH_SQUEEZE))
    return Grasp(np.tile(opened, (len(poses), 1)), np.tile(closed, (len(poses), 1)))


ROUGH_SQUEEZE = 0.001
"""How far inside the object the thesis's rough grasp aims [m], guessed: enough to touch."""

CAUTIOUS = (SearchConfig(cone=0.7, start_cone=0.65), IkConfig(friction_share=0.8, margin=(0.004, 0.16)))
"""What `ik-cautious` uses of the friction, and how far it stays from the end."""


def _entry(name: str, given: object) -> ControllerEntry:
    """Return the controller of a user's class, policy, model with `predict`, or function that makes one of these."""
    if isinstance(given, FunctionType) and not signature(given).parameters:
        made = given()
        return _entry(str(getattr(made, "name", name)), made)
    if isinstance(given, ControllerEntry):
        return given
    if not isinstance(given, type | UserPolicy) and callable(getattr(given, "predict", None)):
        return _entry(name, user_policy(given, name=name))
    if isinstance(given, UserPolicy):
        grip = partial(learned_grasp, policy=given)
        return ControllerEntry(name, "a user's policy", grip, partial(PolicyController, policy=given))
    made = maker("controller", name, given)
    grasp = getattr(given, "grasp", "planned")
    planner = GRASPS.get(grasp) if isinstance(grasp, str) else grasp
    if not callable(planner):
        raise InputError(f"grasp {grasp!r} of controller {name!r}: use planned, rough or a function")
    return ControllerEntry(name, "a user's", planner, made, reads=reads_of(given))


GRASPS: dict[str, Planner] = {"planned": planned_grasp, "rough": rough_grasp}
"""How a user's controller may ask to be given the object."""

OWN = (
    ControllerEntry(
        "ik",
        "the expert: searched contacts, commanded grip force, feedback on the object's pose",
        planned_grasp,
        IkController,
        fixed_grasp=partial(planned_grasp, fixed=True),
    ),
    ControllerEntry(
        "ik-cautious",
        "the expert with margins wide enough for another engine's contacts: shorter, harder to lose",
        partial(planned_grasp, config=CAUTIOUS),
        partial(IkController, config=CAUTIOUS[1]),
        fixed_grasp=partial(planned_grasp, config=CAUTIOUS, fixed=True),
    ),
    ControllerEntry(
        "thesis-ik",
        "inverse kinematics exactly as thesis 3.2: expected contacts, open loop, no grip force",
        rough_grasp,
        ThesisIkController,
    ),
    ControllerEntry(
        "ik-sliding",
        "the expert, with grips whose contacts slide where that goes farther",
        partial(planned_grasp, slides=True),
        IkController,
        fixed_grasp=partial(planned_grasp, fixed=True),
    ),
    ControllerEntry(
        "ik-sensed",
        "the expert's law on encoders and a camera, as far as was planned for a range of frictions and starts",
        partial(sensed_grasp, carrier=graded(Carrier())),
        IkSensedController,
        reads=SENSED,
        fixed_grasp=sensed_grasp,
        primitive=partial(IkController, config=SENSED_PRIMITIVE),
    ),
)
"""The toolkit's controllers of hands in the plane that are no policies."""

CONTROLLERS: Registry[ControllerEntry] = Registry("controller", {entry.name: entry for entry in OWN}, _entry)


def find_controller(name: str, held: Held | None = None) -> ControllerEntry:
    """Return a controller of the catalogue, a policy of the package, or that of a folder, of a training run its best.

    With a hand and an object that it is to run with, rl is the policy of the family unless it learned with these two.

    Raises:
        InputError: there is none of that name (the text offers near matches), or a folder without a policy.
    """
    if name in SHIPPED:
        entry = _shipped(name)
        if name != LEARNED or held is None or _learned_with(entry, held):
            return entry
        return replace(_shipped(FAMILY), name=name)
    found = CONTROLLERS.find(name)
    if found is not None:
        return found
    folder = Path(name)
    if folder.is_dir():
        return learned(*policy_of(folder))
    raise unknown_controller(name, (*CONTROLLERS, *SHIPPED))


def learned(name: str, policy: Policy) -> ControllerEntry:
    """Return the controller that a policy is; it holds objects as it did when it learned."""
    summary, grip = "a learned policy", partial(learned_grasp, policy=policy)
    if find_layout(policy.observation).sensed:
        summary = f"{summary} on encoders and a camera"
        if policy.task:
            whole = partial(SensedRouteController, policy=policy)
            return ControllerEntry(name, summary, sensed_grasp, whole, policy, SENSED)
        kind = SensedPolicyController if policy.risk is None else FeelingController
        made, primitive = partial(kind, policy=policy), partial(PolicyPrimitive, policy=policy)
        return ControllerEntry(name, summary, grip, made, policy, SENSED, sensed_grasp, primitive)
    controller = RouteController if policy.task else PolicyController
    return ControllerEntry(name, summary, grip, partial(controller, policy=policy), policy)


def policy_of(folder: Path) -> tuple[str, Policy]:
    """Return name and best policy of the folder of a training run, or of a policy's own folder.

    Raises:
        InputError: no policy there that this version can use.
    """
    own, place, which = (folder / ACTOR).is_file(), folder.resolve(), "best"
    if own and place.name in {"best", "last", "imitated"}:
        place, which = place.parent, place.name
    name = place.name if which == "best" else f"{place.name}-{which}"
    return _plain(name), load_policy(folder if own else folder / which)


def learned_grasp(
    hand: HandSpec,
    spec: ObjectSpec,
    poses: Array,
    starts: Array | None = None,
    *,
    policy: Policy | UserPolicy,
    engine: str = ENGINE,
) -> Grasp:
    """Return the grasps that a policy learned with: one for each direction, closed where each object stands."""
    starts = poses[:, 0] if starts is None else starts
    if isinstance(policy, Policy) and policy.grasp == "sensed":
        return sensed_grasp(hand, spec, poses, carrier=carrier_of(policy), engine=engine)
    rough = policy.grasp == "rough"
    plans = [rough_plan(hand, spec)] * len(poses) if rough else direction_plans(hand, spec, poses, engine)
    return closing_joints(hand, spec, plans, poses[:, 0], starts)


def check_known(entry: ControllerEntry, held: Held, paths: Array) -> None:
    """Refuse what a learned policy does not know, before anything is computed; other controllers know everything.

    The paths `(P, S, 3)` begin at the grasp, each at the origin.

    Raises:
        InputError: a hand or an object that it does not know, or a path that bends or turns.
    """
    if entry.policy is not None:
        check_held(entry.policy, held.hand, (held.object,))
        if entry.policy.task:
            return
        if entry.reads == SENSED:
            parts_of(paths)
        elif find_layout(entry.policy.observation).columns:
            aims_of(paths)
        else:
            straight_angles(paths)


def _learned_with(entry: ControllerEntry, held: Held) -> bool:
    """Return whether a policy was trained with just this hand and object."""
    if entry.policy is None or entry.contract is None:
        return False
    return held == (entry.contract.hand, load_object(entry.policy.trained["object"]))


def _shipped(name: str) -> ControllerEntry:
    with resources.as_file(resources.files("inhand") / "policies" / SHIPPED[name]) as folder:
        if not (folder / ACTOR).is_file():
            raise InputError(
                "this version comes without a trained policy: train one with `inhand train --out results/train` (extra"
                " `rl`) and use it with --controller results/train"
            )
        return learned(name, load_policy(folder))


def _plain(name: str) -> str:
    """Return a folder's name as a controller's: for file names, and never one of the catalogue."""
    plain = re.sub(r"[^\w.+-]+", "_", name) or "policy"
    return f"{plain}-policy" if plain in {*CONTROLLERS, *SHIPPED} else plain
