"""Starts as arrays of a file, and back."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.learning.pairs import Pairs
from inhand.learning.space import Space
from inhand.learning.starts import Starts
from inhand.records import read_json, read_record, text_of
from inhand.sim.disturbance import Disturbance
from inhand.sim.drawn import Disturbed, Drawn
from inhand.sim.names import Engine
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import SpatialState, State
from inhand.tasks.routes import Routes


@dataclass(frozen=True)
class _Worlds:
    """How the worlds of starts are disturbed."""

    spec: Disturbance
    drawn: tuple[Drawn, ...]


@dataclass(frozen=True)
class _Hands:
    """The hands and objects of starts that differ in them."""

    held: tuple[tuple[HandSpec, ObjectSpec], ...]


def arrays_of(starts: Starts, name: str) -> dict[str, NDArray[Any]]:
    """Return starts as arrays, whose names begin with theirs."""
    arrays: dict[str, NDArray[Any]] = {f"{name}.angle_deg": starts.angle_deg, f"{name}.distance": starts.distance}
    if starts.pairs is not None:
        held = tuple((each.hand, each.object) for each in starts.pairs.held)
        arrays |= {f"{name}.of": starts.pairs.of, f"{name}.pairs": np.array(text_of(_Hands(held)))}
    routes = None if starts.routes is None else starts.routes.poses
    asked = ("routes", routes), ("turn", starts.turn), ("legs", starts.legs)
    arrays |= {f"{name}.{part}": given for part, given in asked if given is not None}
    if starts.space is not None:
        arrays |= {f"{name}.Space.{f.name}": getattr(starts.space, f.name) for f in fields(Space)}
    if starts.disturbed is not None:
        drawn = tuple(each.drawn for each in starts.disturbed)
        arrays[f"{name}.disturbed"] = np.array(text_of(_Worlds(starts.disturbed[0].spec, drawn)))
    for part, kind in ((starts.snapshot, Snapshot), (starts.state, State)):
        arrays |= {f"{name}.{kind.__name__}.{f.name}": getattr(part, f.name) for f in fields(kind)}
    return arrays


def starts_from(data: Mapping[str, NDArray[Any]], name: str, engine: Engine) -> Starts:
    """Return the starts of a name, which an engine holds, from such arrays."""
    space = _space(data, name)
    snapshot = Snapshot(**{f.name: data[f"{name}.Snapshot.{f.name}"] for f in fields(Snapshot)})
    seen = State if space is None else SpatialState
    state = seen(**{f.name: data[f"{name}.State.{f.name}"] for f in fields(State)})
    routes, turn, legs = (data.get(f"{name}.{part}") for part in ("routes", "turn", "legs"))
    return Starts(
        snapshot,
        state,
        data[f"{name}.angle_deg"],
        data[f"{name}.distance"],
        None if routes is None else Routes(routes),
        engine,
        _worlds(data, f"{name}.disturbed"),
        turn,
        legs,
        _pairs(data, name),
        space,
    )


def _space(data: Mapping[str, NDArray[Any]], name: str) -> Space | None:
    if f"{name}.Space.along" not in data:
        return None
    return Space(**{f.name: data[f"{name}.Space.{f.name}"] for f in fields(Space)})


def _pairs(data: Mapping[str, NDArray[Any]], name: str) -> Pairs | None:
    if f"{name}.pairs" not in data:
        return None
    found = read_record(read_json(str(data[f"{name}.pairs"])), _Hands)
    return Pairs(tuple(Held(*each) for each in found.held), data[f"{name}.of"])


def _worlds(data: Mapping[str, NDArray[Any]], name: str) -> tuple[Disturbed, ...] | None:
    if name not in data:
        return None
    found = read_record(read_json(str(data[name])), _Worlds)
    return tuple(Disturbed(found.spec, drawn) for drawn in found.drawn)
