"""Structured in-hand manipulation: the Asterisk Test in simulation, an expert, people, figures.

Everything a program needs has a name here and is imported when it is first used. What is your own is registered with
the decorators of `inhand.register` (docs/extend.md).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from inhand.environment_ids import register_when_imported

if TYPE_CHECKING:
    from inhand import register as register
    from inhand.asterisk_test.asterisk import asterisk as asterisk
    from inhand.asterisk_test.design.run import design as design
    from inhand.asterisk_test.reach import reach as reach
    from inhand.asterisk_test.robustness.run import robustness as robustness
    from inhand.asterisk_test.sweep.run import sweep as sweep
    from inhand.control.drive import drive as drive
    from inhand.control.onnx_export import export as export
    from inhand.control.readings import Frame as Frame
    from inhand.control.readings import Reading as Reading
    from inhand.control.user_policy import user_policy as policy
    from inhand.errors import InputError as InputError
    from inhand.hands.by_name import hand as hand
    from inhand.hands.by_name import object as object
    from inhand.learning.evaluate import evaluate as evaluate
    from inhand.learning.make import make as make
    from inhand.learning.record import record as record
    from inhand.learning.train import train as train
    from inhand.loading import load as load
    from inhand.tracing.tracing import trace as trace

__version__ = "0.1.0"

NAMES = {
    "hand": "hands.by_name:hand",
    "object": "hands.by_name:object",
    "reach": "asterisk_test.reach:reach",
    "asterisk": "asterisk_test.asterisk:asterisk",
    "trace": "tracing.tracing:trace",
    "design": "asterisk_test.design.run:design",
    "sweep": "asterisk_test.sweep.run:sweep",
    "robustness": "asterisk_test.robustness.run:robustness",
    "record": "learning.record:record",
    "train": "learning.train:train",
    "evaluate": "learning.evaluate:evaluate",
    "drive": "control.drive:drive",
    "Reading": "control.readings:Reading",
    "Frame": "control.readings:Frame",
    "export": "control.onnx_export:export",
    "load": "loading:load",
    "make": "learning.make:make",
    "policy": "control.user_policy:user_policy",
    "register": "register:",
    "InputError": "errors:InputError",
}
"""Where each public name is: a module, and the name in it."""
__all__ = [
    "Frame",
    "InputError",
    "Reading",
    "asterisk",
    "design",
    "drive",
    "evaluate",
    "export",
    "hand",
    "load",
    "make",
    "object",
    "policy",
    "reach",
    "record",
    "register",
    "robustness",
    "sweep",
    "trace",
    "train",
]


def __getattr__(name: str) -> Callable[..., Any] | ModuleType:
    """Return a public name, its module imported now."""
    if name not in NAMES:
        raise AttributeError(f"module 'inhand' has no attribute {name!r}; it offers {', '.join(NAMES)}")
    module, _, word = NAMES[name].partition(":")
    found = import_module(f"inhand.{module}")
    named: Callable[..., Any] | ModuleType = getattr(found, word) if word else found
    return named


def __dir__() -> list[str]:
    """Return the public names, for completion."""
    return [*__all__, "__version__"]


register_when_imported()
