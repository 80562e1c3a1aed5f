"""A user's controller, with what it returns looked at: what is wrong is told by name, before the engine sees it."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Controller, Task
from inhand.control.seen import View, reads_of
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.registry import describe

METHODS = ("begin", "act", "finished")
"""What a controller has."""


def maker(kind: str, name: str, given: object) -> Callable[[Task], Controller]:
    """Return what makes a user's controller of a task; `kind` is what texts call it.

    Raises:
        InputError: not what makes a controller.
    """
    lacks = [word for word in METHODS if not callable(getattr(given, word, None))] if isinstance(given, type) else []
    if not callable(given) or lacks:
        without = f" without {', '.join(lacks)}" if lacks else ""
        raise InputError(
            f"{kind} {name!r} is {describe(given)}{without}: it must be a class, made with the task, with the methods"
            " begin(state), act(state) and finished(state)"
        )
    return partial(Checked, made=given, name=name)


class Checked:
    """Hands everything on to a controller and refuses targets or ends that are no such thing."""

    def __init__(self, task: Task, made: Callable[[Task], Controller], name: str) -> None:
        """Make the controller of a task.

        Raises:
            InputError: what was made has not the three methods of a controller.
        """
        self._inner, self._name, self._task = made(task), name, task
        self.reads = reads_of(self._inner)
        for word in METHODS:
            if not callable(getattr(self._inner, word, None)):
                raise InputError(f"controller {name!r} made {type(self._inner).__name__}, which has no method {word}")

    def begin(self, state: View) -> None:
        """Start a phase from a state."""
        self._inner.begin(state)

    def act(self, state: View) -> Array:
        """Return joint targets `(B, n_joints)` [rad].

        Raises:
            InputError: another shape, or a number that is not finite.
        """
        targets = np.asarray(self._inner.act(state), dtype=float)
        if targets.shape != state.targets.shape or not np.isfinite(targets).all():
            raise InputError(
                f"act of controller {self._name!r} returned {targets.shape}"
                f"{'' if np.isfinite(targets).all() else ' with numbers that are not finite'}: it must return joint"
                f" targets {state.targets.shape} [rad], one row for each world"
            )
        return targets

    def finished(self, state: View) -> NDArray[np.bool_]:
        """Return which worlds have done what the controller was for `(B,)`.

        Raises:
            InputError: another shape, or no truth values.
        """
        done = np.asarray(self._inner.finished(state))
        if done.shape != (self._task.n_worlds,) or done.dtype != np.bool_:
            raise InputError(
                f"finished of controller {self._name!r} returned {done.dtype} {done.shape}: it must return whether each"
                f" of the {self._task.n_worlds} worlds is done"
            )
        return done
