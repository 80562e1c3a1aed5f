"""The reference of the public names: directives by which Sphinx puts each one's signature and docstring in."""

import inspect
from collections.abc import Sequence
from types import ModuleType

import inhand

DIRECTIVES: dict[str, Sequence[str]] = {
    "What runs": ("asterisk", "reach", "trace", "sweep", "design", "robustness", "load"),
    "Learning": ("make", "record", "train", "evaluate", "policy", "export"),
    "Hands, objects, a hand outside the simulator": ("hand", "object", "drive", "Reading", "Frame"),
    "Errors": ("InputError",),
}
"""Public names of `inhand` by what they are for; those of `inhand.register` follow."""
RESULTS = (
    "asterisk_test.report:Run",
    "asterisk_test.reach:Reach",
    "tracing.report:TraceRun",
    "asterisk_test.sweep.run:SweepRun",
    "asterisk_test.design.run:DesignRun",
    "asterisk_test.robustness.run:RobustnessRun",
    "learning.record:Dataset",
    "learning.train:Trained",
    "learning.report:Compared",
    "control.drive:Driven",
    "control.trial:Trial",
)
"""What functions return, as a module of the package and a class."""
SPECS = ("hands.hand:HandSpec", "hands.hand:FingerSpec", "hands.objects:ObjectSpec", "sim.disturbance:Disturbance")
"""What hands, objects and disturbances are."""
STATES = ("sim.state:State", "control.seen:Seen")
"""What controllers are given."""


def page() -> str:
    """Return every public name, and the classes that functions take and give."""
    parts = [_section(title, [_directive(f"inhand.{name}") for name in names]) for title, names in DIRECTIVES.items()]
    added = [
        f"inhand.register.{name}" for name, given in vars(inhand.register).items() if _is_own(given, inhand.register)
    ]
    parts.append(_section("Registering what is yours", [_directive(name) for name in added]))
    for title, places in (("What functions return", RESULTS), ("Specs", SPECS), ("What controllers see", STATES)):
        parts.append(_section(title, [_class(place) for place in places]))
    return "\n\n".join(parts)


def _is_own(given: object, module: ModuleType) -> bool:
    """Tell whether something is a public function that a module defines."""
    return inspect.isfunction(given) and given.__module__ == module.__name__ and not given.__name__.startswith("_")


def _section(title: str, directives: Sequence[str]) -> str:
    return "\n".join([f"## {title}", "", "```{eval-rst}", *directives, "```"])


def _directive(name: str) -> str:
    found: object = getattr(inhand, name.rpartition(".")[2], None)
    kind = "autofunction"
    if name.count(".") == 1 and inspect.isclass(found):
        kind = "autoexception" if issubclass(found, Exception) else "autoclass"
    return f".. {kind}:: {name}\n" + ("   :members:\n" if kind == "autoclass" else "")


def _class(place: str) -> str:
    module, _, name = place.partition(":")
    options = ("members:", "inherited-members: Config", "exclude-members: write, mark, cells")
    return "\n".join([f".. autoclass:: inhand.{module}.{name}", *(f"   :{option}" for option in options), ""])
