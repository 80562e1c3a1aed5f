"""What is written below the fields of a configuration."""

import ast
import dataclasses
import inspect
from typing import Any


def texts_of(kind: type) -> dict[str, tuple[Any, str]]:
    """Return default and text of each field of a configuration, those of its parents among them."""
    told: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        if dataclasses.is_dataclass(each):
            told |= _texts(each)
    return {field.name: (field.default, told.get(field.name, "")) for field in dataclasses.fields(kind)}


def _texts(kind: type) -> dict[str, str]:
    """Return the text below each field in the source of a class."""
    found: dict[str, str] = {}
    field = ""
    for node in ast.walk(ast.parse(inspect.getsource(kind))):
        if isinstance(node, ast.ClassDef):
            for each in node.body:
                match each:
                    case ast.AnnAssign(target=ast.Name(id=field)):
                        continue
                    case ast.Expr(value=ast.Constant(value=str(text))) if field:
                        found[field] = " ".join(text.split())
                field = ""
    return found
