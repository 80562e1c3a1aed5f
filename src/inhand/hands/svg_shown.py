"""Which elements of an SVG file are shown, and where: attributes, style sheets and styles, by CSS's rules.

`cssselect2` says which rules of a style sheet an element has, and `tinycss2` reads them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.polylines import UNITS

if TYPE_CHECKING:
    from cssselect2 import ElementWrapper, Matcher
    from tinycss2.ast import Node

SVG = "http://www.w3.org/2000/svg"
DEPTH = 100
"""Groups that may lie in each other."""
PROPERTIES = ("display", "visibility", "opacity", "transform", "transform-origin")
"""Properties that are attributes too."""
PHYSICAL = ("mm", "cm", "in", "pt", "pc")
"""Units of SVG that have a size on paper."""
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LENGTH = re.compile(rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>{'|'.join(PHYSICAL)}|px)?\s*")
"""A number with or without a unit."""
_ANGLES = {"deg": 1.0, "grad": 0.9, "rad": float(np.rad2deg(1.0)), "turn": 360.0}
_WITH_UNIT = re.compile(rf"(?P<number>{_NUMBER})(?P<unit>{'|'.join((*_ANGLES, *PHYSICAL, 'px'))})\b")
_ONE_WAY = re.compile(r"(?P<what>translate|scale)(?P<axis>[XY])\((?P<by>[^(),]*)\)")


def tag_of(element: Element) -> str:
    """Return the name of an SVG element, with or without SVG's namespace; empty if it has another one."""
    space, _, name = element.tag.rpartition("}") if isinstance(element.tag, str) else ("?", "", "")
    return name if space in {"", "{" + SVG} else ""


def length_in(unit: float, found: re.Match[str]) -> float:
    """Return a length with a unit in a file's units of so many metres; a px is one of them."""
    number = float(found["number"])
    return number * UNITS[found["unit"]] / unit if found["unit"] in PHYSICAL else number


def shown_elements(root: Element, unit: float) -> Iterator[tuple[Element, Array]]:
    """Give the elements that a drawing shows, in the file's order and through all groups, and their transforms.

    `unit` is metres in one of the file's units.

    Raises:
        InputError: a transform that cannot be read, or too many groups in each other.
    """
    from cssselect2 import ElementWrapper

    sheet = _sheet(root)
    waiting = [(ElementWrapper.from_xml_root(root), np.identity(3), True, 1)]
    while waiting:
        wrapped, matrix, visible, depth = waiting.pop()
        element = wrapped.etree_element
        found = _properties(sheet, wrapped)
        if found.get("display") == "none" or re.fullmatch(r"[-+]?0*\.?0*%?", found.get("opacity", "1")):
            continue
        visible = found["visibility"] == "visible" if _given(found, "visibility") else visible
        matrix = matrix @ _transform(element, found, unit)
        if element is root or tag_of(element) == "g":
            if depth > DEPTH:
                raise InputError(f"more than {DEPTH} groups lie in each other: ungroup them")
            waiting += [(child, matrix, visible, depth + 1) for child in wrapped.iter_children()][::-1]
        elif visible:
            yield element, matrix


def _given(found: dict[str, str], name: str) -> bool:
    return found.get(name, "inherit") not in {"inherit", "unset"}


def _sheet(root: Element) -> Matcher:
    from cssselect2 import Matcher, SelectorError, compile_selector_list
    from tinycss2 import parse_stylesheet

    matcher = Matcher()
    for style in (element for element in root.iter() if tag_of(element) == "style"):
        for rule in parse_stylesheet("".join(style.itertext()), skip_comments=True, skip_whitespace=True):
            if rule.type == "qualified-rule":
                try:
                    selectors = compile_selector_list(rule.prelude)
                except SelectorError:
                    continue  # as browsers do
                for selector in selectors:
                    matcher.add_selector(selector, _declarations(rule.content))
    return matcher


def _declarations(content: str | list[Node]) -> list[tuple[bool, str, str]]:
    """Return whether each declaration is important, its property, and its value."""
    from tinycss2 import parse_blocks_contents, serialize

    found = parse_blocks_contents(content, skip_comments=True, skip_whitespace=True)
    return [
        (each.important, each.lower_name, serialize(each.value).strip()) for each in found if each.type == "declaration"
    ]


def _properties(sheet: Matcher, wrapped: ElementWrapper) -> dict[str, str]:
    """Return the properties of an element: its attributes, then rules, then its style, the important ones last."""
    element = wrapped.etree_element
    said = [(False, name, element.get(name, "").strip()) for name in PROPERTIES if name in element.attrib]
    for *_, pseudo, declarations in sheet.match(wrapped):
        said += declarations if pseudo is None else []
    said += _declarations(element.get("style", ""))
    return {name: value for _, name, value in sorted(said, key=lambda each: each[0])}


def _transform(element: Element, found: dict[str, str], unit: float) -> Array:
    """Return the matrix `(3, 3)` of an element's own transform, in CSS's words or SVG's."""
    from svgpathtools import parse_transform

    text, origin = found.get("transform", ""), found.get("transform-origin", "")
    if text not in {"", "none"} and re.search(r"[1-9a-z%]", re.sub(r"px|left|top", "", origin)):
        raise InputError(
            f"<{tag_of(element)}> turns about a transform-origin of {origin!r}, which is not read: write the transform"
            " without it, or apply it to the path"
        )
    plain = _ONE_WAY.sub(_both_ways, _WITH_UNIT.sub(_plain(unit), text))
    try:
        return np.asarray(parse_transform(plain, strict=True))
    except ValueError as error:
        raise InputError(
            f"<{tag_of(element)}> has the transform {text!r}, which cannot be read ({error}); SVG has matrix,"
            " translate, scale, rotate, skewX and skewY of plain numbers: mend it"
        ) from error


def _plain(unit: float) -> Callable[[re.Match[str]], str]:
    """Return what writes a number without its unit: angles in degrees, lengths in the file's units."""
    return lambda found: repr(
        float(found["number"]) * _ANGLES[found["unit"]] if found["unit"] in _ANGLES else length_in(unit, found)
    )


def _both_ways(found: re.Match[str]) -> str:
    """Return a transform of CSS along one axis as one along both."""
    still = "0" if found["what"] == "translate" else "1"
    by = (found["by"], still) if found["axis"] == "X" else (still, found["by"])
    return f"{found['what']}({by[0]} {by[1]})"
