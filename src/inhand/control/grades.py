"""How far a hand trusts its worlds, by how well it sees: a way is planned for each of three grades of a camera.

Who sees exactly has mostly measured hand and start well, too. What no frame shows is taken to differ as in `field`
even then: friction, mass and size of the object, and what pushes it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.estimator import EstimatorConfig
from inhand.geometry import SAME, Array
from inhand.sim.disturbance import BENCH, FIELD, HARD, Disturbance
from inhand.sim.strengths import scaled

STRAIGHT = 0.004
"""Objects farther than this from their path are not straight [m], where nothing else is said; 9 deg at `TURN_ARM`."""


@dataclass(frozen=True)
class Grade:
    """What a way is planned for where frames scatter so much."""

    scatter: float
    """Up to so many times a fiducial's noise; of 0, where a grasp is chosen the grade counts, but no camera has it."""
    worlds: Disturbance
    """Worlds that grasps are tried in,"""
    share: float = 1.0
    """so large a share of those of `field`."""
    weight: float = 1.0
    """What the way counts where a grasp is chosen for all grades."""
    price: float = 4.0
    """What an object lost is worth, in ways of a path: a way of which 1 % more is lost must be so much longer [%],"""
    crooked: float = 0.75
    """and what one that is not carried straight:"""
    straight: float = STRAIGHT
    """it is farther from its path than this [m]; an angle counts as an arc at `TURN_ARM`."""
    least: float = 0.0
    """A loss costs as much as on a way so much longer [m]: what goes nowhere is to be held, too."""


def _seen_well() -> Disturbance:
    """Return worlds of `bench` in which objects and what pushes them differ as in `field`."""
    hidden = {name: getattr(FIELD.differs, name) for name in ("friction", "mass", "size", "centre_mm", "floor")}
    return replace(BENCH, differs=replace(BENCH.differs, **hidden), pushes=FIELD.pushes)


def _slippery(spec: Disturbance) -> Disturbance:
    """Return worlds of `field`'s kind in which fingers slip more than is told, and objects are not far heavier.

    They are a third of those of `field`, and 0.86 to 0.93 of the objects that are lost there are lost in these: so what
    is found in few worlds counts for three times as many.
    """
    return replace(spec, differs=replace(spec.differs, friction=SLIPPERY, mass=LIGHT))


def _farther_off(spec: Disturbance) -> Disturbance:
    """Return worlds whose objects stand a little farther off: by the start noise of a run as well."""
    far = {name: getattr(spec.differs, name) + more for name, more in (("start_mm", 0.3), ("start_deg", 0.2))}
    return replace(spec, differs=replace(spec.differs, **far))


SLIPPERY, LIGHT = (FIELD.differs.friction[0], 0.98), (FIELD.differs.mass[0], 1.6)
"""Factors of friction and mass of the worlds of `field` in which most objects are lost."""
USUAL = Grade(np.inf, _farther_off(FIELD))
"""What is planned for where nobody looks how well it sees."""
GRADES = (
    Grade(0.55, _farther_off(_seen_well()), 0.5, 2.0, price=6.0),
    replace(USUAL, scatter=1.75, weight=2.5, price=5.5, crooked=1.0, straight=0.00267),
    Grade(np.inf, _farther_off(HARD), 0.25, 1.0, price=1.0, crooked=0.2),
)
"""Grades of cameras from the best; the borders are the geometric means of the levels' noise. At `hard` pushes throw a
third of all objects from the best of grips, and shorter ways save few: there the mean way counts."""
TRUSTING = (
    Grade(GRADES[0].scatter, _farther_off(BENCH), price=2.0),
    Grade(np.inf, _farther_off(_slippery(FIELD)), price=4.0, crooked=0.15, least=0.06),
)
"""Two grades of who sees well and is trusted to have measured friction, mass and size, too, as in `bench`, and of who
does not: in the worlds of `field` in which most are lost."""
DRAWN = (Grade(0.0, scaled(FIELD, 1.5), weight=3.0), USUAL)
"""What whole drawings are planned for: the way of the usual worlds, with a grasp that keeps most objects in rougher
ones too, where grasps that come to the end alike differ."""
FIDUCIAL = np.array(EstimatorConfig().frame)
"""Noise of a fiducial's frames [m, m, rad],"""
FIDUCIAL_IN_SPACE = np.repeat(FIDUCIAL[[0, 2]], 3)
"""and in space, along three axes and about them [m, rad]."""
ENOUGH = 0.85
"""A path is gone whole where so many worlds come to its end, since a drawing that stops short is none."""
MARGIN = 0.001
"""Distance kept from where the first would be lost [m]."""


def grade_of(scatter: Array, count: int = len(GRADES)) -> NDArray[np.int64]:
    """Return which of so many grades each camera has whose frames scatter so much `(B,)`, in a fiducial's noise."""
    return np.searchsorted([each.scatter for each in GRADES[: count - 1]], scatter)


def worth_of(ways: Array, spoilt: tuple[Array, Array], count: int, grade: Grade) -> Array:
    """Return what ways [m] are worth to a grade, of which so many of `count` worlds were lost, and so many crooked."""
    lost, bent = grade.price * (spoilt[0] + 0.5), grade.crooked * spoilt[1]
    return np.asarray(ways * (1 - (lost + bent) / (count + 1)) - grade.least * lost / (count + 1))


def told_way(ways: Array, whole: float = np.inf, grade: Grade = USUAL) -> tuple[float, float]:
    """Return how far to go [m], and what that is worth, where worlds were lost and went crooked after `(N, 2)` [m].

    A way is worth itself less the grade's price times itself for the share of worlds that are lost before its end, and
    less what crooked ones cost for that of those that are not carried straight. Of a `whole` path [m] nothing is kept,
    and its end is worth more than any way before it where `ENOUGH` of the worlds come there.
    """
    ends = np.unique(np.maximum(ways, 0.0))
    lost, bent = (ways[None] < ends[:, None, None]).sum(axis=1).T
    worth = worth_of(ends, (lost, bent - lost), len(ways), grade)
    come, done = 1 - lost / len(ways), ends >= whole - SAME
    worth = np.where(done & (come >= ENOUGH), ends * (1 + come), worth)
    best = int(worth.argmax())
    kept = 0.0 if done[best] else MARGIN
    return max(float(ends[best]) - kept, 0.0), float(worth[best])
