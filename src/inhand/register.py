"""Things of your own by name, registered from your own file or package, never by editing this one.

Each decorator takes the name that command line and functions then know. The command line finds a file as
`FILE.py:NAME`; a package names its module in the group `inhand` of its entry points.
What is no such thing, or has a name that is taken, is refused with an `InputError`.
"""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from numpy.random import Generator

from inhand.asterisk_test.user_metrics import METRICS, UserMetric
from inhand.control.catalogue import CONTROLLERS
from inhand.control.checked import maker
from inhand.control.names import SHIPPED
from inhand.control.phases import OWN, PHASES, Phase
from inhand.geometry import Array
from inhand.hands.files import HANDS, OBJECTS
from inhand.hands.hand import HandSpec
from inhand.hands.names import CATALOGUE as HAND_NAMES
from inhand.hands.objects import CATALOGUE as OBJECT_NAMES
from inhand.hands.objects import ObjectSpec
from inhand.registry import Registry
from inhand.sim.state import State
from inhand.tasks.decisions import TERMS, Decision, Term
from inhand.tasks.layouts import PARTS
from inhand.tasks.observations import Aim, OfHand, Part, Scene
from inhand.tasks.primitives import GROUPS, PATHS, TRAIN, TURNS, UNSEEN, OwnPath
from inhand.tracing.drawings import SHAPES
from inhand.tracing.tasks import TASKS, OwnTask

T = TypeVar("T")
PoseGiver = TypeVar("PoseGiver", bound=Callable[[], Array])
PointsGiver = TypeVar("PointsGiver", bound=Callable[[HandSpec, ObjectSpec, Generator], Array])
TermGiver = TypeVar("TermGiver", bound=Callable[[Decision], Array])
PartGiver = TypeVar("PartGiver", bound=Callable[[State, Aim, Scene], Array])
MetricGiver = TypeVar("MetricGiver", bound=UserMetric)
HandGiver = TypeVar("HandGiver", bound=Callable[[], HandSpec])
ObjectGiver = TypeVar("ObjectGiver", bound=Callable[[], ObjectSpec])


def controller(name: str) -> Callable[[T], T]:
    """Register a class with `begin`, `act` and `finished`, made with the task; its `grasp` is planned or rough."""
    return _adding(CONTROLLERS, name, tuple(SHIPPED))


def primitive(name: str, angle_deg: float | None = None) -> Callable[[PoseGiver], PoseGiver]:
    """Register a function that gives the poses `(N, 3)` [m, m, rad] of a path from the object's start.

    Args:
        name: the word for `--directions`.
        angle_deg: direction along which its distance counts [deg]; without it from the first pose to the last.
    """
    taken = (*(each.name for each in (*TRAIN, *UNSEEN, *TURNS)), *GROUPS)
    return _adding(PATHS, name, taken, lambda given: OwnPath(given, angle_deg))


def phase(name: str, longest: float = 1.0, *, must_hold: bool = False, keep_contact: bool = False) -> Callable[[T], T]:
    """Register a class, as of a controller, that has the hand between grip and manipulation: `phases=["NAME"]`.

    Args:
        name: what recordings call it.
        longest: time after which it ends [s].
        must_hold: whether a world in which a finger does not touch at its end is out.
        keep_contact: whether a contact that stays lost, or running out of time, ends a world's episode.
    """

    def made(given: T) -> Phase:
        return Phase(name, maker("phase", name, given), longest, must_hold, keep_contact)

    return _adding(PHASES, name, OWN, made)


def task(name: str, stay: float = 0.0) -> Callable[[PointsGiver], PointsGiver]:
    """Register a function of hand, object and random generator that gives way-points `(N, 3)` from the object's start.

    Args:
        name: the word for `--path`.
        stay: how long the object is held at the last of them [s].
    """
    taken = (*SHAPES, *(chr(letter) for letter in range(ord("A"), ord("Z") + 1)))
    return _adding(TASKS, name, taken, lambda given: OwnTask(given, stay))


def metric(name: str) -> Callable[[MetricGiver], MetricGiver]:
    """Register a function that gives the number of a `Trial`; runs that name it in `metrics` measure it."""
    return _adding(METRICS, name)


def reward_term(name: str, weight: float = 1.0) -> Callable[[TermGiver], TermGiver]:
    """Register a function that gives `(B,)` numbers of a `Decision`; `reward="progress,NAME"` adds it, weighted."""
    return _adding(TERMS, name, made=lambda given: Term(name, weight, given))


def observation_part(
    name: str, *, half: OfHand = 1.0, middle: OfHand = 0.0, fixed: int = 0, for_joint: int = 0, for_finger: int = 0
) -> Callable[[PartGiver], PartGiver]:
    """Register a function of state, aim and scene that gives `(B, size)` numbers; `observation="grip,NAME"` adds it.

    Args:
        name: what the part is called.
        half: how far from the middle becomes 1.
        middle: what becomes 0.
        fixed: how many numbers it has with every hand,
        for_joint: how many more for each joint,
        for_finger: and for each finger.
    """

    def made(given: PartGiver) -> Part:
        return Part(name, given, half, middle, fixed, for_joint, for_finger)

    return _adding(PARTS, name, made=made)


def hand(name: str) -> Callable[[HandGiver], HandGiver]:
    """Register a function that returns a `HandSpec`."""
    return _adding(HANDS, name, HAND_NAMES)


def object(name: str) -> Callable[[ObjectGiver], ObjectGiver]:
    """Register a function that returns an `ObjectSpec`."""
    return _adding(OBJECTS, name, OBJECT_NAMES)


def _adding(
    registry: Registry[Any], name: str, taken: Iterable[str] = (), made: Callable[[Any], Any] = lambda given: given
) -> Callable[[T], T]:
    def add(given: T) -> T:
        registry.add(name, made(given), taken, given)
        return given

    return add
