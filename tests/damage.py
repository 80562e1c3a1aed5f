"""Inputs that nobody meant: texts, tables, arrays and files with damage, as hypothesis draws them."""

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Draw = Callable[[st.SearchStrategy[Any]], Any]

NUMBERS = ("0", "-1", "-0.0", "1e-300", "1e308", "1e400", "nan", "-inf", "9" * 400, "1e9", "0.5", "1000000", "3")
WORDS = (
    *NUMBERS,
    "",
    "0x1F",
    "1_000",
    "1,5",
    "true",
    "None",
    "ä",
    "\U0001f600",
    "../..",
    "x" * 300,
    "a b",
    "%",
    "10mm",
)
MARKS = ("'", '"', '"""', "[", "]", "{}", "<", ">", "&", "\0", "=", ",", ";", "#", "\n", "\t", "\ufeff", "\u2028", "-")
ODD: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    7,
    10**30,
    1e308,
    0.5,
    "",
    "x",
    "é" * 300,
    [],
    [[]],
    [1, "a"],
    {},
    {"a": {"b": [None]}},
)
"""Values of a table that most fields cannot have."""


@st.composite
def texts(draw: Draw, given: Sequence[str]) -> bytes:
    """Give one of some texts with up to four damages, as bytes."""
    text = draw(st.sampled_from(given))
    for _ in range(draw(st.sampled_from((1, 1, 2, 4)))):
        text = draw(st.sampled_from((_word, _word, _line, _slice, _insert)))(draw, text)
    coding = draw(st.sampled_from(("utf-8",) * 8 + ("utf-16", "latin-1")))
    return bytes(text.encode(coding, "replace"))


def _word(draw: Draw, text: str) -> str:
    """Put another word in the place of one."""
    found = list(re.finditer(r"[\w.+-]+", text))
    if not found:
        return text
    place = draw(st.sampled_from(found))
    other = draw(st.sampled_from(WORDS) | st.sampled_from([each.group() for each in found]))
    return f"{text[: place.start()]}{other}{text[place.end() :]}"


def _line(draw: Draw, text: str) -> str:
    """Leave out a line, repeat it, or move it to the end."""
    lines = text.splitlines(keepends=True) or [""]
    place = draw(st.integers(0, len(lines) - 1))
    times, moved = draw(st.sampled_from(((0, 0), (2, 0), (300, 0), (0, 1))))
    return "".join([*lines[:place], *[lines[place]] * times, *lines[place + 1 :], *[lines[place]] * moved])


def _slice(draw: Draw, text: str) -> str:
    """Leave out a piece, or repeat it."""
    start, end = sorted((draw(st.integers(0, len(text))), draw(st.integers(0, len(text)))))
    times: int = draw(st.sampled_from((0, 2, 30)))
    return text[:start] + text[start:end] * times + text[end:]


def _insert(draw: Draw, text: str) -> str:
    """Put a mark or a word somewhere."""
    place = draw(st.integers(0, len(text)))
    put: str = draw(st.sampled_from(MARKS + WORDS))
    times: int = draw(st.sampled_from((1, 1, 2, 200)))
    return text[:place] + put * times + text[place:]


@st.composite
def tables(draw: Draw, given: Mapping[str, Any]) -> dict[str, Any]:
    """Give a table with up to three fields left out, added, or holding something else, at any depth."""
    found: dict[str, Any] = copy.deepcopy(dict(given))
    for _ in range(draw(st.sampled_from((1, 1, 1, 3)))):
        inner, key = draw(st.sampled_from(_places(found) or [(found, "x")]))
        done = draw(st.sampled_from(("other", "other", "other", "without", "more")))
        if done == "other":
            inner[key] = copy.deepcopy(draw(st.sampled_from(ODD)))
        elif done == "without":
            del inner[key]
        elif isinstance(inner, dict):
            inner[draw(st.sampled_from(("format", "x", "")))] = draw(st.sampled_from(("", 1)))
        else:
            inner.append(inner[key])
    return found


def _places(table: object) -> list[tuple[Any, Any]]:
    """Return every field of tables and lists in each other, as what holds it and its key."""
    if not isinstance(table, dict | list):
        return []
    pairs = table.items() if isinstance(table, dict) else enumerate(table)
    return [place for key, value in pairs for place in ((table, key), *_places(value))]


@st.composite
def arrays(draw: Draw, given: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Give arrays by name, one or two of which are missing, of another type or shape, or hold what no number is."""
    found = dict(given)
    for _ in range(draw(st.integers(1, 2))):
        name = draw(st.sampled_from(sorted(found)))
        array = found[name]
        other = draw(st.sampled_from(("gone", "type", "shape", "value", "value")))
        if other == "gone" or array.dtype.kind not in "fi":
            del found[name]
        elif other == "type":
            with np.errstate(all="ignore"):
                found[name] = array.astype(draw(st.sampled_from(("U5", "i1", "f2", "f4", "c16", "?", "S3"))))
        elif other == "shape":
            whole = (array[None], array.ravel(), np.array(array, ndmin=3))
            found[name] = draw(st.sampled_from((*whole, array[:0], array[:1]) if array.ndim else whole))
        elif array.size:
            value = draw(st.sampled_from((np.nan, np.inf, 1e300, -1.0, 0.0, 1e9)))
            with np.errstate(all="ignore"):
                found[name] = np.array(array, copy=True)
                found[name].flat[draw(st.integers(0, array.size - 1))] = value if array.dtype.kind == "f" else -5
        if not found:
            break
    return found


@st.composite
def files(draw: Draw, content: bytes) -> bytes:
    """Give a file's bytes, mostly as they are; else cut off, or some of them others."""
    if draw(st.integers(0, 3)):
        return content
    place = draw(st.integers(0, max(len(content) - 1, 0)))
    other: bytes = draw(st.binary(max_size=8))
    return content[:place] + (other + content[place + 4 :] if draw(st.booleans()) else b"")
