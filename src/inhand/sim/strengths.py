"""How strong a disturbance is: from nothing at 0 over what it says at 1 to more than that."""

import math
from dataclasses import fields, replace

from inhand.errors import InputError
from inhand.sim.disturbance import FACTORS, PARTS, Disturbance
from inhand.sim.scene import DECISION_S

STRONGEST = 10.0
"""Strengths above this are taken for a slip of the pen: a friction x 0.6 would be x 0.006."""
KEPT = ("missing_run", "per_s", "most")
"""What says of which kind a disturbance is, and not how large: it stays."""


def scaled(spec: Disturbance, strength: float) -> Disturbance:
    """Return a disturbance at a strength, called `NAME@STRENGTH`; at 1 it is the disturbance itself.

    Factors are raised to the power of the strength, so that 0.5 at strength 2 is 0.25. The time between two frames is
    longer than a decision by the strength times what it was longer. All other quantities, noise, delays and pushes
    among them, are multiplied by it.

    Raises:
        InputError: a strength below 0 or above `STRONGEST`, or one at which nothing can be drawn.
    """
    if not (math.isfinite(strength) and 0 <= strength <= STRONGEST):
        raise InputError(
            f"strength {strength:g} of disturbance {spec.name!r}: give a number from 0, nothing, to {STRONGEST:g}; 1 is"
            " the disturbance as it is"
        )
    if strength == 1:
        return spec
    name = f"{spec.name}@{strength:g}"
    try:
        own = {part: getattr(spec, part) for part in PARTS}
        parts = {part: replace(held, **_changed(spec, part, strength)) for part, held in own.items()}
    except InputError as error:
        raise InputError(f"disturbance {name!r} cannot be drawn: {error}; give a smaller strength") from error
    return replace(spec, **{"name": name, **parts})


def _changed(spec: Disturbance, part: str, strength: float) -> dict[str, object]:
    """Return the quantities of a part of a disturbance at a strength."""
    own = getattr(spec, part)
    changed: dict[str, object] = {}
    for each in fields(own):
        value = getattr(own, each.name)
        if each.name == "rate_hz":
            changed[each.name] = _rate(value, strength)
        elif each.name in FACTORS:
            changed[each.name] = (value[0] ** strength, value[1] ** strength)
        elif each.name not in KEPT:
            both = isinstance(value, tuple)
            changed[each.name] = (value[0] * strength, value[1] * strength) if both else value * strength
    return changed


def _rate(rate: float, strength: float) -> float:
    """Return a camera's rate at a strength [Hz]; one that is as fast as decisions, or 0 for that, stays."""
    longer = 1 / rate - DECISION_S if rate else 0.0
    return 1 / (DECISION_S + strength * longer) if longer > 0 else rate
