"""Layouts of observations by name, and the parts that users add to one."""

from dataclasses import replace

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.registry import Registry, describe
from inhand.sim.state import State
from inhand.tasks.joint_rows import JOINTS
from inhand.tasks.joint_senses import JOINT_SENSES
from inhand.tasks.observations import GRIP, OPEN, THESIS, TRUTH, WHOLE, Aim, Layout, Part, Scene
from inhand.tasks.past import SENSES
from inhand.tasks.spatial.rows import SPACE
from inhand.tasks.spatial.senses import SPACE_SENSES, SPACE_TRUTH
from inhand.tasks.spatial.thesis import SPACE_THESIS

LAYOUTS = {
    "thesis": THESIS,
    "grip": GRIP,
    "grip-open": OPEN,
    "whole": WHOLE,
    "truth": TRUTH,
    "senses": SENSES,
    "joints": JOINTS,
    "joint-senses": JOINT_SENSES,
    "space": SPACE,
    "space-senses": SPACE_SENSES,
    "space-truth": SPACE_TRUTH,
    "space-thesis": SPACE_THESIS,
}
"""Layouts by the name that configurations use."""


def find_layout(name: str) -> Layout:
    """Return a layout by name; `grip,tip_speed` adds a user's part to one.

    Raises:
        InputError: there is none of that name.
    """
    first, *more = name.split(",")
    if first not in LAYOUTS:
        near, known = near_matches(first, LAYOUTS), ", ".join(LAYOUTS)
        raise InputError(f"unknown observation {first!r}{near}; allowed are {known}")
    layout = LAYOUTS[first]
    return replace(
        layout,
        name=",".join([layout.name, *more]),
        parts=(*layout.parts, *(PARTS.known(word) for word in more)),
    )


def _user_part(name: str, given: object) -> Part:
    """Return a user's part, its values looked at; raise InputError where it is none."""
    if (
        not isinstance(given, Part)
        or not callable(given.values)
        or given.fixed + given.for_joint + given.for_finger < 1
    ):
        raise InputError(
            f"observation part {name!r} is {describe(getattr(given, 'values', given))}: it must be a function of state,"
            " aim and scene that gives at least one number a world; tell how many by fixed, for_joint or for_finger"
        )

    def values(state: State, aim: Aim, scene: Scene) -> Array:
        found, wanted = np.asarray(given.values(state, aim, scene), float), (state.n_worlds, given.size(scene.hand))
        if found.shape != wanted:
            raise InputError(f"observation part {name!r} gives {found.shape}: it must give {wanted}, worlds by numbers")
        return found

    return replace(given, name=name, values=values)


PARTS: Registry[Part] = Registry("observation part", {}, _user_part)
"""Parts that users add to an observation."""
