"""The lines and curves of a DXF file, and its unit; `ezdxf` reads it (extra `dxf`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from inhand.errors import InputError, needs_extra
from inhand.geometry import Array
from inhand.hands.polylines import JOIN, LARGEST, MOST

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities import DXFGraphic

READ = ("LWPOLYLINE", "POLYLINE", "LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
"""Entities that are lines."""
PASSED_OVER = ("POINT", "VIEWPORT")
"""Entities that show no line and are no fault."""
LARGEST_FILE = 20_000_000
"""Bytes that a file may have (guessed)."""


def dxf_lines(path: Path, close: float) -> tuple[list[Array], float | None]:
    """Return the lines in a DXF file's model space, each `(N, 2)` in x and y, and the metres in one of its units.

    Lines and arcs may be in any order and direction; they are put one behind the other. Entities that are invisible,
    or on a layer that is off or frozen, are left out. The unit is that of the header, None if it says none.

    Raises:
        InputError: no DXF file, the extra `dxf` is missing, no line in it, another kind of entity, or lines that are
            not one.
    """
    try:
        from ezdxf import path as paths
        from ezdxf import units
    except ImportError as error:
        raise needs_extra("dxf", "a DXF file") from error
    document = _document(path)
    found = [paths.make_path(entity) for entity in _entities(document)]
    box = paths.bbox(found)
    size = max(box.size.x, box.size.y) if box.has_data else 0.0
    if not 1 / LARGEST < size < LARGEST:
        raise InputError("its lines have no length, or one too large to compute with: draw a line that goes somewhere")
    lines = [np.array([(p.x, p.y) for p in each.flattening(close * size)]) for each in found]
    number = document.header.get("$INSUNITS", 0)
    unit = units.conversion_factor(number, units.M) if number else None
    return _in_order(lines, JOIN * size), unit


def _document(path: Path) -> Drawing:
    """Return what `ezdxf` makes of a file."""
    import ezdxf

    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"it has more than {LARGEST_FILE / 1e6:g} MB; leave out what is not the line")
    try:
        return ezdxf.readfile(path)
    except Exception as error:  # whatever a broken file makes of its reader
        raise InputError(f"it is not a DXF file ({error}); export it as DXF") from error


def _entities(document: Drawing) -> list[DXFGraphic]:
    hidden = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    shown = [
        entity
        for entity in document.modelspace()
        if not entity.dxf.get("invisible", 0) and entity.dxf.layer.lower() not in hidden
    ]
    shown = [entity for entity in shown if entity.dxftype() not in PASSED_OVER]
    for kind in (entity.dxftype() for entity in shown):
        if kind not in READ:
            raise InputError(
                f"it holds {kind}, which is no line ({', '.join(READ)}): delete it, or put it on a layer that is off"
            )
    if not shown:
        raise InputError(f"it shows no line; draw one of {', '.join(READ)}")
    if len(shown) > MOST:
        raise InputError(f"it has {len(shown):,} lines and curves; a drawing may have {MOST:,}: simplify it")
    return shown


def _in_order(lines: list[Array], gap: float) -> list[Array]:
    """Return lines turned and put so that each begins where the one before ends."""
    from ezdxf import edgeminer

    if len(lines) == 1:
        return lines
    edges = [edgeminer.make_edge((*line[0], 0), (*line[-1], 0), payload=line) for line in lines]
    chains = edgeminer.find_all_simple_chains(edgeminer.Deposit(edges, gap_tol=gap))
    if len(chains) != 1 or len(chains[0]) != len(lines):
        raise InputError(
            f"its {len(lines)} lines are not one: they do not all meet end to end; draw one polyline, or leave the"
            " others out"
        )
    return [edge.payload[::-1] if edge.is_reverse else edge.payload for edge in chains[0]]
