"""Hand names of the laboratory's form, such as `2v2_50.50_50.50_1.1_53`, and the hands kept in the catalogue."""

import re
from dataclasses import replace

from inhand.errors import InputError, near_matches
from inhand.hands.hand import HandSpec, build_hand, lab_limits

FORM = "AvB_split_split_ratio_width, for example 2v2_50.50_50.50_1.1_53"
FINGER_LENGTH = 0.144
"""Length of a finger of ratio 1 [m] (the laboratory's hand models)."""
LAB_LIMITS_SUFFIX = ":lab-limits"

CATALOGUE = (
    "2v2_50.50_50.50_1.1_53",
    "2v2_65.35_65.35_1.1_53",
    "2v2_35.65_35.65_1.1_53",
    "2v2_35.65_50.50_1.1_63",
    "2v2_70.30_50.50_0.9.1_53",
    "2v3_25.75_25.35.40_1.1_53",
    "3v3_25.40.35_40.35.25_1.1_63",
)
"""Hands that `inhand hands` lists; any other name of the form is a hand too."""

_RATIO = re.compile(r"(1|0\.[0-9]+)\.(1|0\.[0-9]+)")
_FINGERS = re.compile(r"([23])v([23])")
_WIDTH = re.compile(r"[0-9]+(\.[0-9]+)?")


def parse_hand_name(name: str) -> HandSpec:
    """Return the hand a name describes.

    The parts are the number of links of the left and right finger, the split of each finger into per cent
    joined by dots, the ratio of the finger lengths (`1.1` = 1 to 1, `0.9.1` = 0.9 to 1) and the palm width in
    mm. A trailing `:lab-limits` gives the laboratory's joint limits.

    Raises:
        InputError: the name has not this form; the text says which part is wrong.
    """
    stem = name.removesuffix(LAB_LIMITS_SUFFIX)
    parts = stem.split("_")
    if len(parts) != 5:
        raise InputError(
            f"unknown hand {name!r}: a hand name has five parts joined by underscores, {FORM}, and this one has"
            f" {len(parts)}{near_matches(stem, CATALOGUE)}; `inhand hands` lists examples, and a TOML file"
            " describes any other hand"
        )
    fingers = _FINGERS.fullmatch(parts[0])
    if fingers is None:
        raise _wrong(name, parts[0], "is not a number of links of each finger, 2v2, 2v3, 3v2 or 3v3")
    splits = [_split(name, part, int(n)) for part, n in zip(parts[1:3], fingers.groups(), strict=True)]
    ratio = _RATIO.fullmatch(parts[3])
    if ratio is None:
        raise _wrong(name, parts[3], "is not a ratio of finger lengths such as 1.1, 0.9.1 or 1.0.9 (each 1 or 0.…)")
    lengths = [FINGER_LENGTH * float(part) for part in ratio.groups()]
    links = [tuple(length * s for s in split) for length, split in zip(lengths, splits, strict=True)]
    hand = build_hand(stem, links[0], links[1], _palm_width(name, parts[4]))
    return replace(lab_limits(hand), name=name) if name.endswith(LAB_LIMITS_SUFFIX) else hand


def _split(name: str, part: str, n_links: int) -> tuple[float, ...]:
    if not re.fullmatch(r"[0-9]{1,3}(\.[0-9]{1,3})*", part):
        raise _wrong(name, part, "is not a split in per cent joined by dots, such as 50.50 or 25.35.40")
    percent = [int(p) for p in part.split(".")]
    if len(percent) != n_links:
        raise _wrong(name, part, f"has {len(percent)} segments, and {name.partition('_')[0]!r} asks for {n_links}")
    if min(percent) <= 0 or sum(percent) != 100:
        raise _wrong(name, part, f"must have positive segments that sum to 100, not {sum(percent)}")
    return tuple(p / 100 for p in percent)


def _palm_width(name: str, part: str) -> float:
    """Return the palm width [m]; the laboratory's palm called 53 measures 53.5 mm."""
    if not _WIDTH.fullmatch(part) or float(part) <= 0:
        raise _wrong(name, part, "is not a palm width in mm, such as 53")
    return 0.0535 if float(part) == 53 else float(part) / 1e3


def _wrong(name: str, part: str, why: str) -> InputError:
    return InputError(f"malformed hand name {name!r}: {part!r} {why}; the form is {FORM}")
