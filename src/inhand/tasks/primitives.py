"""Motion primitives: move the object along one direction, or turn it, and the words people name them by."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inhand import geometry
from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.registry import Registry, describe
from inhand.tasks.directions import DIRECTIONS, ROTATIONS, UNSEEN_NAMES

TURN_DEG = 150.0
"""How far the rotation-only primitives aim [deg], farther than any hand turns."""
SAME_ANGLE_DEG = 1e-9
"""Angles closer than this are one direction [deg]."""


@dataclass(frozen=True)
class Primitive:
    """One motion of the object in the hand."""

    name: str
    """Thesis name (`Out-Right`, `In'`), `30 deg` for another angle, `cw` or `ccw`; at its end a held twist (`p15`)."""
    angle_deg: float | None
    """Direction counter-clockwise from +x, palm at the bottom [deg], in (-180, 180]; None: only rotate."""
    rotation_deg: float = 0.0
    """Rotation counter-clockwise, turned first and then held, or to reach where there is no direction [deg]."""
    path: tuple[tuple[float, float, float], ...] | None = None
    """Poses on the way, from the start [m, m, rad], of one that does not go straight along its direction."""

    @property
    def angle(self) -> float:
        """Direction counter-clockwise from +x [rad].

        Raises:
            InputError: the primitive only rotates, or goes along a path of its own.
        """
        if self.path is not None:
            raise InputError(f"primitive {self.name} goes along a path of its own: give one that goes straight")
        if self.angle_deg is None:
            raise InputError(f"primitive {self.name} only rotates and has no direction: give one that translates")
        return math.radians(self.angle_deg)

    @property
    def unit(self) -> Array:
        """Unit vector `(2,)` of the direction, where there is an `angle`."""
        return geometry.unit(self.angle)


TRAIN = tuple(Primitive(each.name, each.angle_deg) for each in DIRECTIONS)
"""The eight directions to train on, clockwise from Out (thesis 3.1)."""

UNSEEN = tuple(Primitive(name, (67.5 - 45.0 * i + 180.0) % 360.0 - 180.0) for i, name in enumerate(UNSEEN_NAMES))
"""The eight directions between, which training never sees (thesis 3.3)."""

TURNS = (Primitive("cw", None, -TURN_DEG), Primitive("ccw", None, TURN_DEG))
"""The two primitives that only rotate."""

GROUPS = {"train": TRAIN, "unseen": UNSEEN, "all": TRAIN + UNSEEN, "twist": TURNS}
"""Words that stand for several primitives."""


def parse_directions(text: str | Sequence[str], twist_deg: float = 0.0) -> tuple[Primitive, ...]:
    """Return the primitives that words name, each once, in the order given, or `with_twists`.

    Args:
        text: Words separated by commas or spaces, or a sequence of such texts: `train`, `unseen`, `all`; thesis
            names in any case (`Out-Right`, `Out'-Right'`; one apostrophe is enough, and a shell takes `Out2` or
            `out-prime` for one); the labels of recordings
            (`a` to `h`, `no` to `nw`, `cw`, `ccw`); angles in degrees counter-clockwise from +x (`30`, `-12.5 deg`).
        twist_deg: twist to hold, each way [deg]; 0 for none.

    Raises:
        InputError: no word, an unknown word (the text offers the nearest), an angle that is not finite, or a twist
            as in `with_twists`.
    """
    pieces = [text] if isinstance(text, str) else list(text)
    # "30 deg" is one word, although spaces separate words.
    joined = re.sub(r"(?<=[\d.])\s*(?:deg|°)(?![a-z])", "", ",".join(pieces), flags=re.IGNORECASE)
    words = [word for word in re.split(r"[,;\s]+", joined) if word]
    if not words:
        raise InputError(f"no direction given. {_allowed()}")
    found = tuple(dict.fromkeys(primitive for word in words for primitive in _meant_by(word)))
    return with_twists(found, twist_deg) if twist_deg else found


def with_twists(primitives: Sequence[Primitive], twist_deg: float) -> tuple[Primitive, ...]:
    """Return every primitive twice: holding a twist clockwise (p) and counter-clockwise (m), as recordings label it.

    Raises:
        InputError: the twist is not between 0 and 90 deg, or a primitive only rotates.
    """
    if not 0 < twist_deg < 90:
        raise InputError(f"--twist {twist_deg:g}: give the size of the twist to hold, more than 0 and less than 90 deg")
    return tuple(
        Primitive(twisted_name(each.name, rotation), math.degrees(each.angle), rotation)
        for rotation in (-twist_deg, twist_deg)
        for each in primitives
    )


def twisted_name(name: str, rotation_deg: float) -> str:
    """Return a direction's name with the twist it holds, `In p15` clockwise and `In m15` counter-clockwise."""
    return name if rotation_deg == 0 else f"{name} {'p' if rotation_deg < 0 else 'm'}{abs(rotation_deg):g}"


def primitive_at(angle_deg: float) -> Primitive:
    """Return the primitive along an angle [deg]; an angle of a named direction gets that name.

    Raises:
        InputError: the angle is not finite.
    """
    if not math.isfinite(angle_deg):
        raise InputError(f"direction {angle_deg} is not a finite angle: give degrees counter-clockwise from +x")
    for primitive in TRAIN + UNSEEN:
        if abs(math.remainder(angle_deg - math.degrees(primitive.angle), 360.0)) < SAME_ANGLE_DEG:
            return primitive
    wrapped = math.remainder(angle_deg, 360.0)
    return Primitive(f"{wrapped:.10g} deg", wrapped)


def _meant_by(word: str) -> tuple[Primitive, ...]:
    if word.lower() in GROUPS:
        return GROUPS[word.lower()]
    found = _named().get(_key(word)) or PATHS.find(word)
    if found is not None:
        return (found,)
    try:
        angle_deg = float(word)
    except ValueError:
        names = [primitive.name for primitive in (*GROUPS["all"], *TURNS)]
        near = near_matches(_key(word), [*names, *GROUPS, *PATHS]) or "."
        raise InputError(f"unknown direction {word!r}{near} {_allowed()}") from None
    return (primitive_at(angle_deg),)


def _named() -> dict[str, Primitive]:
    words = {_key(primitive.name): primitive for primitive in (*GROUPS["all"], *TURNS)}
    for direction, primitive in zip(DIRECTIONS, TRAIN, strict=True):
        words[direction.letter] = words[direction.compass] = primitive
    for word, way in ROTATIONS.items():
        words[word] = words[way]
    return words


@dataclass(frozen=True)
class OwnPath:
    """A user's path, and along which direction its distance counts."""

    poses: Callable[[], Array]
    """Gives its poses `(N, 3)` from the object's start [m, m, rad]."""
    angle_deg: float | None
    """The direction [deg]; None for the one from the first pose to the last."""


def _path_primitive(name: str, given: object) -> Primitive:
    angle = given.angle_deg if isinstance(given, OwnPath) else None
    given = given.poses if isinstance(given, OwnPath) else given
    made = given() if callable(given) else given
    try:
        poses = np.array(made, dtype=float)
    except (TypeError, ValueError):
        poses = np.empty(0)
    if poses.ndim != 2 or poses.shape[1] != 3 or len(poses) < 2 or not np.isfinite(poses).all():
        what = describe(made) if poses.size == 0 else f"an array {poses.shape}"
        raise InputError(f"primitive {name!r} gives {what}: it needs poses (N, 3) [m, m, rad], finite, at least two")
    if np.abs(poses[0]).max() > AT_START:
        raise InputError(
            f"primitive {name!r} begins at {poses[0].tolist()}: its first pose must be 0, the object's start"
        )
    if np.abs(poses[:, :2]).max() > FARTHEST:
        raise InputError(
            f"primitive {name!r} goes {np.abs(poses[:, :2]).max():g} m far, which no hand does: poses are in metres"
        )
    if angle is None and np.hypot(*poses[-1, :2]) <= AT_START:
        raise InputError(f"primitive {name!r} ends where it begins: give angle_deg, along which its distance counts")
    angle = math.degrees(math.atan2(poses[-1, 1], poses[-1, 0])) if angle is None else float(angle)
    return Primitive(name, angle, 0.0, tuple((x, y, turn) for x, y, turn in poses.tolist()))


AT_START = 1e-6
"""A first pose farther than this from the start [m or rad] is none."""
FARTHEST = 0.5
"""A path farther than this leaves every hand [m]."""
PATHS: Registry[Primitive] = Registry("primitive", {}, _path_primitive)
"""Primitives that users add, each along a path of its own."""


def _key(word: str) -> str:
    """Return a name in lower case with its apostrophes, or what a shell takes for them, as one at the end."""
    plain = re.sub("['`\u2019\u2032]|(?<=[a-z])2(?![0-9])|-prime", "", word.lower())
    return plain if plain == word.lower() else plain + "'"


def _allowed() -> str:
    names = " ".join(primitive.name for primitive in TRAIN)
    primes = " ".join(primitive.name.replace("'", "2") for primitive in UNSEEN)
    return (
        f"Use train, unseen, all, twist, names ({names}; {primes}; cw ccw), labels (a to h, no to nw) or angles in"
        " degrees counter-clockwise from +x such as 30 or -12.5, separated by commas or spaces; Up, turn+x, 1:2:0 and"
        " the like are of a hand in space, such as 3f_60.60_40_10"
    )
