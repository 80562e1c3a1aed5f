"""Which lengths and masses a hand or an object can have; others are most often a mistaken unit."""

from collections.abc import Iterable
from math import isfinite

from inhand.errors import InputError

LENGTHS = (1e-3, 1.0)
"""Shortest and longest side of an object, link or palm [m]."""
MASSES = (1e-4, 100.0)
"""Lightest and heaviest object or link [kg]."""
SMALLEST_OUTLINE = 2e-3
"""Shortest larger side of an object seen from above [m] (guessed); most smaller ones are in inches or centimetres."""
ROUNDING = 1e-9
"""Share by which a computed number may pass its limit."""
UNITS = "files and names give mm (1 m is 1000, 1 inch is 25.4), Python gives metres"
"""What to look at where a length cannot be."""


def check_length(what: str, length: float, cure: str = UNITS, shortest: float = LENGTHS[0]) -> None:
    """Refuse a length [m] that no hand or object has; `what` starts the sentence, `cure` says what to look at."""
    if not shortest * (1 - ROUNDING) <= length <= LENGTHS[1] * (1 + ROUNDING):
        size = "small" if length < shortest else "large"
        raise InputError(
            f"{what} is {1e3 * length:.6g} mm, too {size}: it may be {1e3 * shortest:g} to {1e3 * LENGTHS[1]:,.0f} mm;"
            f" check the unit: {cure}"
        )


def check_outline_size(name: str, sides: Iterable[float]) -> None:
    """Refuse an object whose sides seen from above [m] are too small or too large to be meant."""
    check_length(f"object {name!r}: the larger side of its outline", float(max(sides)), shortest=SMALLEST_OUTLINE)


def check_body(what: str, mass: float, friction: float) -> None:
    """Refuse a mass [kg] or a coefficient of friction that no object has; `what` starts the sentence."""
    if not (isfinite(mass) and mass > 0):
        raise InputError(f"{what}: mass {mass:g} kg; the mass must be positive")
    check_mass(f"{what}: its mass", mass)
    if not (isfinite(friction) and friction >= 0):
        raise InputError(f"{what}: friction {friction:g}; friction must be 0 or more")


def check_mass(what: str, mass: float) -> None:
    """Refuse a mass [kg] that no hand or object has; `what` starts the sentence."""
    if not MASSES[0] * (1 - ROUNDING) <= mass <= MASSES[1] * (1 + ROUNDING):
        raise InputError(
            f"{what} is {mass:.6g} kg: masses are {MASSES[0]:g} to {MASSES[1]:g} kg, 0.1 g to 100 kg; check the unit:"
            " masses are in kg"
        )
