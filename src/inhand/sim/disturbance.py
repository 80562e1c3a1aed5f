"""What disturbs worlds, as frozen specs: what differs between them, what is sensed, and what happens on the way.

Quantities have their unit in the name; factors have none. The levels follow published ranges (docs/disturbances.md).
What is left as it is by default disturbs nothing.
"""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from inhand.errors import InputError
from inhand.records import Config
from inhand.registry import Registry, describe

Range = tuple[float, float]
"""Lowest and highest of what is drawn; alike where nothing is."""
LONGEST_DELAY_MS = 500.0
"""What comes later than this comes after the shortest episode of training, 25 decisions [ms]."""
LONGEST_RUN = 1000
"""Frames that are missing in a row at most."""
SOON = 1e-6
"""Shares of a frame or of a decision that are nothing: what is due now has arrived."""
FASTEST_HZ = 1000.0
"""Rate of a camera at most: of so many frames several arrive in a physics step [Hz]."""


@dataclass(frozen=True)
class Differences(Config):
    """What differs between worlds. Factors are drawn evenly in their logarithm, from the first to the second."""

    friction: Range = (1.0, 1.0)
    """Factor of the fingers' friction."""
    mass: Range = (1.0, 1.0)
    """Factor of the object's mass."""
    size: Range = (1.0, 1.0)
    """Factor of the object's width and depth."""
    centre_mm: float = 0.0
    """Largest distance of the centre of mass from where the outline has it, along x and along y, drawn evenly [mm]."""
    floor: Range = (1.0, 1.0)
    """Factor of the floor's friction."""
    stiffness: Range = (1.0, 1.0)
    """Factor of the servos' stiffness."""
    damping: Range = (1.0, 1.0)
    """Factor of the servos' damping."""
    torque: Range = (1.0, 1.0)
    """Factor of the servos' largest torque."""
    zero_deg: float = 0.0
    """Standard deviation of each joint's zero from where the servo takes it to be [deg]."""
    start_mm: float = 0.0
    """Standard deviation of the object's start from where the grasp is planned for, in x and y [mm],"""
    start_deg: float = 0.0
    """and of its rotation there [deg]."""

    def __post_init__(self) -> None:
        """Refuse factors and spreads that nothing can have."""
        super().__post_init__()
        for name in FACTORS:
            _check_range(name, getattr(self, name), above=0.0)
        _check_not_negative(self, "centre_mm", "zero_deg", "start_mm", "start_deg")


FACTORS = ("friction", "mass", "size", "floor", "stiffness", "damping", "torque")
"""Fields of `Differences` that are factors, in the order in which they are drawn."""


@dataclass(frozen=True)
class Encoders(Config):
    """How joint angles are read; velocities are then differences of two readings."""

    resolution_deg: float = 0.0
    """Step of a reading [deg]; 0 for none."""
    noise_deg: float = 0.0
    """Standard deviation of the noise of each reading [deg]."""
    delay_ms: Range = (0.0, 0.0)
    """How late readings are, drawn for each world [ms]."""

    def __post_init__(self) -> None:
        """Refuse what no encoder has."""
        super().__post_init__()
        _check_not_negative(self, "resolution_deg", "noise_deg")
        _check_delay("encoders.delay_ms", self.delay_ms)


@dataclass(frozen=True)
class Camera(Config):
    """How the object's pose is seen: frame by frame."""

    rate_hz: float = 0.0
    """Frames in a second, counted from the episode's begin [Hz]; 0 for one at every decision."""
    noise_mm: float = 0.0
    """Standard deviation of the white noise of x and y in each frame [mm],"""
    noise_deg: float = 0.0
    """and of the rotation [deg]."""
    bias_mm: float = 0.0
    """How far the pose is seen beside where it is, all episode long, in a drawn direction [mm],"""
    bias_deg: float = 0.0
    """and by how much it is seen turned, to a drawn side [deg]."""
    delay_ms: Range = (0.0, 0.0)
    """How late frames arrive, drawn for each world [ms]."""
    missing: float = 0.0
    """Share of the frames that never arrive."""
    missing_run: tuple[int, int] = (1, 1)
    """Fewest and most frames that are then missing in a row."""

    def __post_init__(self) -> None:
        """Refuse what no camera has."""
        super().__post_init__()
        _check_not_negative(self, "rate_hz", "noise_mm", "noise_deg", "bias_mm", "bias_deg", "missing")
        _check_delay("camera.delay_ms", self.delay_ms)
        if self.rate_hz > FASTEST_HZ:
            raise InputError(f"rate_hz is {self.rate_hz:g}; a camera gives at most {FASTEST_HZ:g} frames a second")
        if self.missing >= 1.0:
            raise InputError(f"missing is {self.missing:g}; it must be a share below 1, or nothing would be seen")
        _check_range("missing_run", self.missing_run, above=0.0)
        if self.missing_run[1] > LONGEST_RUN:
            raise InputError(f"missing_run is {list(self.missing_run)}; at most {LONGEST_RUN} frames miss in a row")


@dataclass(frozen=True)
class Commands(Config):
    """What happens to commands on their way to the servos."""

    delay_ms: Range = (0.0, 0.0)
    """How late they arrive, drawn for each world and rounded to physics steps [ms]."""

    def __post_init__(self) -> None:
        """Refuse what no line has."""
        super().__post_init__()
        _check_delay("commands.delay_ms", self.delay_ms)


@dataclass(frozen=True)
class Pushes(Config):
    """What pushes the object while it is manipulated, in drawn directions at drawn times."""

    push_mns: float = 0.0
    """Impulse of a push at the centre of mass [mN s]; 10 give 30 g a speed of 0.33 m/s."""
    per_s: float = 0.0
    """Mean number of pushes in a second [1/s]; the times between two are drawn exponentially."""
    most: int = 0
    """Pushes in an episode at most; 0 for no end."""

    def __post_init__(self) -> None:
        """Refuse what no push is."""
        super().__post_init__()
        _check_not_negative(self, "push_mns", "per_s", "most")


@dataclass(frozen=True)
class Disturbance(Config):
    """What disturbs worlds."""

    name: str = "disturbance"
    """What runs call it."""
    differs: Differences = field(default_factory=Differences)
    """What differs between worlds, drawn for each and kept for the episode."""
    encoders: Encoders = field(default_factory=Encoders)
    camera: Camera = field(default_factory=Camera)
    commands: Commands = field(default_factory=Commands)
    pushes: Pushes = field(default_factory=Pushes)


PARTS = ("differs", "encoders", "camera", "commands", "pushes")
"""The parts of a disturbance, as its file has them."""


def told(spec: Disturbance) -> str:
    """Return what a disturbance changes, in one line."""
    words = []
    for part in PARTS:
        own = getattr(spec, part)
        changed = [each.name for each in fields(own) if getattr(own, each.name) != getattr(type(own)(), each.name)]
        words += [f"{part}.{name} {told_value(getattr(own, name))}" for name in changed]
    return f"{spec.name}: {', '.join(words) or 'nothing'}"


def disturbance_of(settings: dict[str, Any]) -> dict[str, str]:
    """Return a call's setting `disturb` by name, where it gives one: a name or a file as it is, a spec by its own."""
    if "disturb" not in settings:
        return {}
    given = settings["disturb"]
    return {"disturb": name_of(given)}


def name_of(given: object) -> str:
    """Return the name of a disturbance that was given as a spec; a name or a file as it is."""
    own = [each.name for each in (*LEVELS, *SINGLES) if each == given]
    return own[0] if own else DISTURBANCES.name_of(given)


def told_value(value: object) -> str:
    """Return a quantity of a disturbance as texts have it, a range as from its lowest to its highest."""
    if isinstance(value, tuple):
        return f"{value[0]:g}" if value[0] == value[1] else f"{value[0]:g} to {value[1]:g}"
    return f"{value:g}"


def _check_range(name: str, given: tuple[float, float], above: float | None = None) -> None:
    low, high = given
    least = "" if above is None else f", both above {above:g}"
    if not (np.isfinite(given).all() and low <= high and (above is None or low > above)):
        raise InputError(
            f"{name} is [{low:g}, {high:g}]; it must be [lowest, highest]{least}, finite and in that order"
        )


def _check_delay(name: str, given: Range) -> None:
    _check_range(name, given)
    if given[0] < 0 or given[1] > LONGEST_DELAY_MS:
        raise InputError(
            f"{name} is [{given[0]:g}, {given[1]:g}]; a delay is from 0 to {LONGEST_DELAY_MS:g} ms: what comes later"
            " comes after the episode"
        )


def _check_not_negative(part: Config, *names: str) -> None:
    for name in names:
        if getattr(part, name) < 0:
            raise InputError(f"{name} is {getattr(part, name):g}; it must be 0 or more")


def _made(name: str, given: object) -> Disturbance:
    made = given() if callable(given) else given
    if not isinstance(made, Disturbance):
        raise InputError(f"disturbance {name!r} is {describe(made)}: it must be a Disturbance")
    return made


BENCH = Disturbance(
    "bench",
    Differences(
        (0.8, 1.25), (0.7, 1.5), (0.98, 1.02), 2.0, (0.8, 1.25), (0.9, 1.1), (0.9, 1.1), (1.0, 1.0), 0.2, 1.0, 1.0
    ),
    Encoders(0.09, 0.1),
    Camera(50.0, 0.3, 0.3, 0.3, 0.5, (20.0, 20.0)),
    Commands(),
    Pushes(5.0, 1.0, 1),
)
"""A hand on a bench that was measured well."""
FIELD = Disturbance(
    "field",
    Differences(
        (0.6, 1.6), (0.33, 4.0), (0.95, 1.05), 5.0, (0.5, 2.0), (0.8, 1.2), (0.7, 1.4), (0.7, 1.0), 0.5, 2.0, 3.0
    ),
    Encoders(0.09, 0.3),
    Camera(30.0, 1.0, 1.0, 1.0, 1.5, (20.0, 60.0), 0.05),
    Commands((0.0, 20.0)),
    Pushes(10.0, 1.0),
)
"""A hand in the field, with objects that are known roughly."""
HARD = Disturbance(
    "hard",
    Differences(
        (0.4, 2.5), (0.2, 8.0), (0.9, 1.1), 10.0, (0.3, 3.0), (0.5, 2.0), (0.5, 2.0), (0.5, 1.0), 1.0, 4.0, 6.0
    ),
    Encoders(0.09, 1.0),
    Camera(25.0, 3.0, 3.0, 3.0, 4.0, (40.0, 120.0), 0.15, (2, 5)),
    Commands((0.0, 60.0)),
    Pushes(20.0, 2.0),
)
"""A cheap hand, seen badly, with objects that are hardly known."""
LEVELS = (BENCH, FIELD, HARD)
"""All that differs at once."""
SINGLES = (
    *(Disturbance(f"friction-{factor:g}", Differences(friction=(factor, factor))) for factor in (0.7, 0.6, 0.5)),
    *(Disturbance(f"mass-{factor:g}", Differences(mass=(factor, factor))) for factor in (2.0, 4.0)),
    *(Disturbance(f"size-{factor:g}", Differences(size=(factor, factor))) for factor in (0.95, 1.05)),
    Disturbance("centre-5mm", Differences(centre_mm=5.0)),
    *(Disturbance(f"floor-{factor:g}", Differences(floor=(factor, factor))) for factor in (0.5, 2.0)),
    *(Disturbance(f"stiffness-{factor:g}", Differences(stiffness=(factor, factor))) for factor in (0.7, 1.5)),
    *(Disturbance(f"damping-{factor:g}", Differences(damping=(factor, factor))) for factor in (0.5, 2.0)),
    Disturbance("torque-0.5", Differences(torque=(0.5, 0.5))),
    Disturbance("zero-0.5deg", Differences(zero_deg=0.5)),
    Disturbance("start-3mm-5deg", Differences(start_mm=3.0, start_deg=5.0)),
    Disturbance("encoder-noise-0.3deg", encoders=Encoders(0.09, 0.3)),
    *(Disturbance(f"pose-noise-{size:g}mm", camera=Camera(noise_mm=size)) for size in (0.5, 1.0, 2.0)),
    Disturbance("pose-bias-2mm", camera=Camera(bias_mm=2.0)),
    Disturbance("pose-bias-3deg", camera=Camera(bias_deg=3.0)),
    *(Disturbance(f"pose-late-{late:g}ms", camera=Camera(delay_ms=(late, late))) for late in (20.0, 40.0, 60.0)),
    Disturbance("frames-missing", camera=Camera(missing=0.15, missing_run=(2, 5))),
    *(Disturbance(f"commands-late-{late:g}ms", commands=Commands((late, late))) for late in (20.0, 40.0)),
    *(Disturbance(f"push-{push:g}mns", pushes=Pushes(push, 1.0, 1)) for push in (10.0, 20.0)),
)
"""One quantity at a time, the others undisturbed; of `start` and `frames` those that belong together."""
DISTURBANCES: Registry[Disturbance] = Registry("disturbance", {each.name: each for each in (*LEVELS, *SINGLES)}, _made)
"""Disturbances by name."""
