"""The ids of the environments, told to Gymnasium when a program imports it; this file never does.

Gymnasium loads no plug-ins of installed packages. So `import inhand` registers at once where Gymnasium is there,
and otherwise watches for the import of the one module that keeps its table, once.
"""

import importlib.util
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

IDS: dict[str, tuple[str, dict[str, object]]] = {
    "inhand/Asterisk-v0": ("Asterisk", {}),
    "inhand/AsteriskGoal-v0": ("AsteriskGoal", {}),
    "inhand/SpatialAsterisk-v0": ("SpatialAsterisk", {}),
    "inhand/AsteriskEasy-v0": (
        "Asterisk",
        {"observation": "grip", "actions": "fine", "reward": "gain", "horizon": 200, "stop": True},
    ),
}
"""Environments by id, with the beginning of their classes' names and what is not as in `EnvironmentConfig`."""
MODULE = "inhand.learning.environments"
"""Where those classes are."""
TABLE = "gymnasium.envs.registration"
"""The module that keeps Gymnasium's table of ids."""


def register(table: ModuleType) -> None:
    """Put the environments into Gymnasium's table of ids, where they are not in it yet."""
    for name, (start, keywords) in IDS.items():
        if name not in table.registry:
            single, vector = (f"{MODULE}:{start}{end}" for end in ("Env", "VectorEnv"))
            table.register(name, entry_point=single, vector_entry_point=vector, kwargs=dict(keywords))


def register_when_imported() -> None:
    """Register now if Gymnasium is there, or else as soon as it is imported."""
    table = sys.modules.get(TABLE)
    if table is not None:
        register(table)
    elif not any(isinstance(finder, _Watch) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Watch())


class _Watch(MetaPathFinder):
    """Waits for the import of Gymnasium's table, and finds it as Python would have."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the table's own spec with a loader that registers too; None for every other module."""
        del path, target
        if fullname != TABLE:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            spec.loader = _Registering(spec.loader)
        return spec


class _Registering(Loader):
    """Loads the table as its own loader does, and registers the environments."""

    def __init__(self, own: Loader) -> None:
        self._own = own

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Return what the table's own loader makes."""
        return self._own.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """Run the table's module and register."""
        self._own.exec_module(module)
        register(module)
