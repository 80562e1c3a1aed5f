"""Phases: slices of an episode, each under one controller (thesis 3.4)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from inhand.control.checked import maker
from inhand.control.controller import AnyPath, AnyTask, Controller, SpatialTask
from inhand.control.episode import MANIPULATE, TWIST
from inhand.control.joint import JointPid, PidConfig
from inhand.control.looking import LOOKS, Choosing, Looking
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.registry import Registry
from inhand.rotations import SpatialPath

SPREAD = 0.2
"""How far the proximal joints start outside the opened grasp [rad]."""
PRESS, LIFT = "press", "lift"
"""Names of the phases in space in which fingers press on an object that still is held, and then hold it alone,"""
PRESSING, LIFTING = 0.2, 0.3
"""and how long they last [s]."""
STANDING, HELD = (0.5, 1.2), (0.1, 0.7)
"""How long fingers are placed and close on objects that stand, and on those that their worlds hold [s];"""
CHOSEN, SETTLING = 2.0, 0.5
"""how long they are placed at least where that is chosen by what is seen, and how long they may come to rest [s]."""


@dataclass(frozen=True)
class Grasp:
    """Joint angles that the place and grasp phases move to."""

    opened: Array
    """Fingers stand off the object `(B, n_joints)` [rad]."""
    closed: Array
    """Fingers press on the object `(B, n_joints)` [rad]."""
    way: Array | None = None
    """Way along each path up to which the grasp was planned to hold `(B,)` [m]; None where nothing was planned."""
    risk: Array | None = None
    """Risk that is not taken beyond that `(B,)`, by who feels one; None where nobody goes on."""
    planned: Array | None = None
    """Where objects were planned to stand `(B, 3)` [m, m, rad], or in space to be `(B, 7)`, if the grasp follows where
    they are seen to be,"""
    follows: Array | None = None
    """and how joints that press change with where they are seen beside that `(B, n_joints, 3)` [rad/m, rad/m, 1], in
    space `(B, n_joints, 6)`."""


@dataclass(frozen=True)
class GradedGrasp(Grasp):
    """A grasp where what is done follows how well objects are seen; of itself it is that of the usual grade."""

    graded: tuple[Grasp, ...] = ()
    """That of each grade of a camera, from the best (`control/grades.py`): another, or the same with another way."""


def graded_grasp(graded: Sequence[Grasp]) -> GradedGrasp:
    """Return the grasp of which each grade has its own."""
    return GradedGrasp(**vars(graded[len(graded) // 2]), graded=tuple(graded))


@dataclass(frozen=True)
class Phase:
    """One slice of an episode. It ends when its controller has finished in every world, or when time is up."""

    name: str
    """What recordings call it."""
    controller: Callable[[Any], Controller]
    """Makes the controller when the phase starts, of the task."""
    longest: float
    """Time after which the phase ends [s]."""
    must_hold: bool = False
    """Whether a world in which a finger does not touch the object at the end is out."""
    keep_contact: bool = False
    """Whether a contact that stays lost ends a world's episode, and running out of time as well."""
    lets_go: bool = False
    """Whether the world, where it has held the object in its place, lets it go when the phase starts."""


def placed_joints(hand: HandSpec, grasp: Grasp) -> Array:
    """Return joint angles `(B, n_joints)` [rad] that episodes start in: opened, the proximal joints farther out."""
    joints = grasp.opened.copy()
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        joints[:, place.start] -= finger.bend * SPREAD
    return np.clip(joints, hand.limits[:, 0], hand.limits[:, 1])


@runtime_checkable
class TakesOver(Protocol):
    """A controller that goes on where another one of its kind has held the objects."""

    def take_over(self, before: Controller) -> None:
        """Go on with what the controller before knows."""


def standard_phases(
    grasp: Grasp,
    manipulate: Callable[[Any], Controller] | None,
    twists: AnyPath | None = None,
    longest: float = 8.0,
    between: Sequence[Phase] = (),
    *,
    held: bool = False,
    holds: Callable[[Any], Controller] | None = None,
    keeps: bool = True,
) -> tuple[Phase, ...]:
    """Return the thesis's three phases, place, grasp, manipulate (thesis 3.4), with others before the last if asked.

    `manipulate` makes the controller of the last, and of the twist, which follows paths on the spot after the phases
    `between`; None ends with the object gripped. Where worlds have `held` their objects, as in space, it presses on
    them, and holds them alone, after the grasp, or what `holds` makes does. Manipulation ends after `longest` [s], and
    with the contact where that is to be kept (`keeps`).
    """
    looked, last = list[Looking](), list[Controller]()
    phases = _closed(grasp, looked, held=held)
    if (lifts := holds or manipulate) is None:
        return phases
    if held:
        hold = _taking_over(last, lifts)

        def stay(task: SpatialTask) -> Controller:
            here = SpatialPath.still(task.n_worlds)
            return hold(replace(task, path=here, distance=np.zeros(task.n_worlds), start=None))

        lift = Phase(LIFT, stay, longest=LIFTING, must_hold=True, lets_go=True)
        phases = (*phases, Phase(PRESS, stay, longest=PRESSING), lift)
    if manipulate is None:
        return phases
    go_on, phases = _taking_over(last, manipulate), (*phases, *between)
    twist = twists if twists is not None and twists.length.any() else None
    if twist is not None:
        phases = (*phases, Phase(TWIST, _along(go_on, twist), longest=3.0, keep_contact=True))
    carry = _as_far_as_seen(go_on, grasp, looked, twisted=twist is not None)
    return (*phases, Phase(MANIPULATE, carry, longest=longest, keep_contact=keeps))


def _along(make: Callable[[Any], Controller], path: AnyPath) -> Callable[[Any], Controller]:
    """Return what makes the same controllers for paths of the task's kind, as far as grips can follow them."""
    whose: Any = path  # of the task's kind
    return lambda task: make(replace(task, path=whose, distance=None))


def _taking_over(last: list[Controller], make: Callable[[Any], Controller]) -> Callable[[Any], Controller]:
    """Return what makes controllers of which each takes over from the `last` that was made before it, if it can."""

    def go_on(task: AnyTask) -> Controller:
        made = make(task)
        if last and isinstance(made, TakesOver):
            made.take_over(last[0])
        last[:] = [made]
        return made

    return go_on


def _as_far_as_seen(
    make: Callable[[Any], Controller], grasp: Grasp, looked: Sequence[Looking], *, twisted: bool
) -> Callable[[Any], Controller]:
    """Return what makes the same controllers for ways of the grade that each camera showed as fingers were placed.

    They are told the risk that is not taken beyond such a way, by how soon it sees as well, but of objects that are
    `twisted` before.
    """

    def made(task: AnyTask) -> Controller:
        graded = _graded(grasp)
        if not graded or grasp.way is None or task.distance is None:
            return make(task)
        ways, looking = [each.way for each in graded if each.way is not None], looked[0]
        distance = np.maximum(task.distance + looking.of_grade(ways) - grasp.way, 0.0)
        risks = [each.risk for each in graded if each.risk is not None and not twisted]
        return make(replace(task, distance=distance, risk=looking.of_grade(risks, soon=True) if risks else None))

    return made


def _closed(grasp: Grasp, looked: list[Looking], *, held: bool) -> tuple[Phase, ...]:
    """Return the phases that place the fingers of a grasp and close them; what follows what is seen looks first."""
    (place, close), (placing, closing) = _fingers(grasp, looked), HELD if held else STANDING
    if grasp.follows is not None:
        placing = _choosing(_graded(grasp)) if _differ(_graded(grasp)) else STANDING[0]
    return Phase("place", place, longest=placing), Phase("grasp", close, longest=closing, must_hold=True)


def _choosing(graded: Sequence[Grasp]) -> float:
    """Return how long fingers may look and then go to where the grasp of any grade begins [s].

    The same object may be held with an elbow bent the one way or the other, which is most of a turn of a joint away.
    """
    usual = graded[len(graded) // 2].opened
    farthest = max(float(np.abs(each.opened - usual).max()) for each in graded)
    return max(CHOSEN, LOOKS + (farthest + SPREAD) / PidConfig().speed + SETTLING)


def _fingers(grasp: Grasp, placing: list[Looking]) -> tuple[Callable[[Any], Controller], Callable[[Any], Controller]]:
    """Return what makes the controllers that place the fingers of a grasp, kept as `placing`, and close them."""
    planned, follows, graded = grasp.planned, grasp.follows, _graded(grasp)
    if planned is None or follows is None:
        return lambda task: JointPid(task, grasp.opened), lambda task: JointPid(task, grasp.closed)

    def place(task: AnyTask) -> Controller:
        if _differ(graded):
            hand: Any = task.hand  # in the plane, where alone grasps of grades differ
            stops = [np.stack([placed_joints(hand, each), each.opened]) for each in graded]
            placing[:] = [Choosing(task, np.stack(stops), planned)]
        else:
            placing[:] = [Looking(task, grasp.opened, planned)]
        return placing[0]

    def close(task: AnyTask) -> Controller:
        looked = placing[0]
        return JointPid(task, looked.of_grade([_pressing(each, looked.off) for each in graded or (grasp,)]))

    return place, close


def _pressing(grasp: Grasp, off: Array) -> Array:
    """Return joint angles that press on objects which stand so far beside where they were planned to."""
    return grasp.closed if grasp.follows is None else grasp.closed + (grasp.follows @ off[..., None])[..., 0]


def _graded(grasp: Grasp) -> tuple[Grasp, ...]:
    """Return the grasps of all grades; none where one serves whatever is seen."""
    return grasp.graded if isinstance(grasp, GradedGrasp) else ()


def _differ(graded: Sequence[Grasp]) -> bool:
    """Return whether fingers stand elsewhere at one grade than at another, and not only ways differ."""
    return any(each.opened is not graded[0].opened for each in graded)


LONGEST = 60.0
"""A phase of a user's ends within this time [s]."""


def _phase(name: str, given: object) -> Phase:
    """Return the phase of a user's controller; raise InputError where it is none."""
    phase = given if isinstance(given, Phase) else Phase(name, maker("phase", name, given), longest=1.0)
    if not 0 < phase.longest <= LONGEST:
        raise InputError(f"phase {name!r} lasts {phase.longest:g} s: give more than 0 and at most {LONGEST:g} s")
    return replace(phase, name=name)


PHASES: Registry[Phase] = Registry("phase", {}, _phase)
"""Phases that users add."""
OWN = ("place", "grasp", TWIST, MANIPULATE)
"""Names of the package's phases."""
