"""Which contacts of all fingers go together: bodies that stay apart and forces that balance, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import kernel, leaf
from inhand.geometry import Array
from inhand.hands.spatial.balancing import Problem, balance_world


class Stack(NamedTuple):
    """Tracks of N fingers, each of K starts along S poses; fingers of fewer starts leave the rest empty."""

    points: Array
    """Contacts in the object frame `(N, K, S, 3)` [m]."""
    normals: Array
    """Outward normals there `(N, K, S, 3)`."""
    bodies: Array
    """Capsules in the palm frame `(N, K, S, M, 7)` [m]; those of no radius are none."""
    gaps: Array
    """How far bodies of two fingers must be apart `(N, N, M, M)` [m]."""


class Asked(NamedTuple):
    """T tuples of tracks."""

    numbers: NDArray[np.int64]
    """The track of each finger `(T, N)`."""
    lengths: NDArray[np.int64]
    """How many poses to look at `(T,)`; then how many hold."""
    weights: Array
    """Wanted forces on the object at each pose, in its frame, for one path of all or each `(T, S, G, 3)` [N]."""
    used: Array
    """The largest share of a friction cone that is used `(T,)`."""
    every: int
    """Every so many poses are looked at, and the last."""
    missed: float
    """Forces that miss their balance by more do not hold [N]."""


class Balancing(NamedTuple):
    """How forces are looked for."""

    problem: Problem
    """Room for one world."""
    rules: tuple[float, float, float]
    """Least normal force [N], most rounds, and what may be missed [N]."""


@kernel
def pairs_apart(stack: Stack, one: int, two: int, apart: NDArray[np.bool_]) -> None:
    """Write whether the first bodies of two fingers are apart, start by start `(K, K)`."""
    for i in range(apart.shape[0]):
        for j in range(apart.shape[1]):
            apart[i, j] = _apart(stack, (one, two), (i, j), 0)


@kernel
def hold_starts(stack: Stack, asked: Asked, how: Balancing) -> None:
    """Write of tuples whether their first contacts balance (a length of 1, else 0) and what they use."""
    for t in range(len(asked.numbers)):
        miss = _balance(stack, asked, (t, 0, 0), how, cold=True)
        asked.lengths[t] = 1 if miss < asked.missed else 0
        asked.used[t] = _share(how.problem)


@kernel
def hold_tuples(stack: Stack, asked: Asked, how: Balancing) -> None:
    """Write how many poses each tuple holds: at each asked pose bodies are apart and forces balance."""
    for t in range(len(asked.numbers)):
        asked.used[t] = 0.0
        last = asked.lengths[t] - 1
        good, s, cold = 0, 0, True
        while s <= last:
            if not _holds(stack, asked, (t, s), how, cold=cold):
                break
            cold, good = False, s + 1
            s = last if s < last < s + asked.every else s + asked.every
        s = good
        while 0 < good <= last and s < min(good + asked.every, last + 1):  # between the last that holds and the next
            if not _holds(stack, asked, (t, s), how, cold=s == good):
                break
            s += 1
        asked.lengths[t] = max(good, s) if good > 0 else 0


@leaf
def _holds(stack: Stack, asked: Asked, at: tuple[int, int], how: Balancing, cold: bool) -> bool:
    t, s = at
    n = asked.numbers.shape[1]
    for i in range(n):
        for j in range(i):
            if not _apart(stack, (i, j), (asked.numbers[t, i], asked.numbers[t, j]), s):
                return False
    for g in range(asked.weights.shape[2]):
        if _balance(stack, asked, (t, s, g), how, cold) >= asked.missed:
            return False
        asked.used[t] = max(asked.used[t], _share(how.problem))
    return True


@leaf
def _balance(
    stack: Stack,
    asked: Asked,
    at: tuple[int, int, int],
    how: Balancing,
    cold: bool,
) -> float:
    """Return what the forces of a tuple at a pose miss [N]; from a cold start or from those found before."""
    t, s, g = at
    problem = how.problem
    weights = asked.weights[t] if len(asked.weights) > 1 else asked.weights[0]
    for f in range(asked.numbers.shape[1]):
        k = asked.numbers[t, f]
        for i in range(3):
            problem.points[0, f, i] = stack.points[f, k, s, i]
            problem.inward[0, f, i] = -stack.normals[f, k, s, i]
            if cold:
                problem.inside[0, f, i] = problem.grip[0] * problem.inward[0, f, i]
                problem.pulls[0, f, i] = 0.0
    for i in range(3):
        problem.wanted[0, i] = weights[s, g, i]
    balance_world(problem, 0, how.rules, asked.missed)
    return float(problem.misses[0])


@leaf
def _share(problem: Problem) -> float:
    """Return the largest share of its cone that a contact uses."""
    most = 0.0
    for f in range(problem.points.shape[1]):
        force, normal = problem.inside[0, f], problem.inward[0, f]
        along = force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]
        aside = 0.0
        for i in range(3):
            aside += (force[i] - along * normal[i]) ** 2
        most = max(most, math.sqrt(aside) / max(problem.friction[0] * along, 1e-9))
    return most


@leaf
def _apart(stack: Stack, fingers: tuple[int, int], tracks: tuple[int, int], s: int) -> bool:
    """Return whether two fingers' bodies are apart at a pose."""
    i, j = fingers
    for p in range(stack.bodies.shape[3]):
        one = stack.bodies[i, tracks[0], s, p]
        if one[6] > 0:
            for q in range(stack.bodies.shape[3]):
                two = stack.bodies[j, tracks[1], s, q]
                least = stack.gaps[i, j, p, q] + one[6] + two[6]
                if two[6] > 0 and least > 0 and _between(one, two) < least * least:
                    return False
    return True


@leaf
def _between(one: Array, two: Array) -> float:
    """Return the squared distance of two lines between their ends [m^2] (Ericson 2005, Closest Points of Segments)."""
    a = b = c = d = e = 0.0
    for i in range(3):
        u, v, w = one[3 + i] - one[i], two[3 + i] - two[i], one[i] - two[i]
        a, b, c = a + u * u, b + u * v, c + v * v
        d, e = d + u * w, e + v * w
    a, c = max(a, 1e-15), max(c, 1e-15)
    whole = a * c - b * b
    s = min(max((b * e - c * d) / whole, 0.0), 1.0) if whole > 1e-15 * a * c else 0.0
    t = (b * s + e) / c
    if t < 0:
        t, s = 0.0, min(max(-d / a, 0.0), 1.0)
    elif t > 1:
        t, s = 1.0, min(max((b - d) / a, 0.0), 1.0)
    square = 0.0
    for i in range(3):
        x = one[i] + s * (one[3 + i] - one[i]) - two[i] - t * (two[3 + i] - two[i])
        square += x * x
    return square
