"""Arrays from a `.npz` file that may hold anything: checked against their headers before anything is made of them."""

import math
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from inhand.errors import InputError

_KINDS: dict[str, tuple[str, type]] = {
    "text": ("U", np.str_),
    "whole numbers": ("iu", np.int64),
    "numbers": ("f", np.float64),
}
"""What an array may hold: NumPy's letters for it, and the type it is given as."""
LARGEST = 1e100
"""Numbers that are larger cannot be squared safely."""


def read_arrays(path: Path, holds: Mapping[str, str]) -> dict[str, NDArray[Any]]:
    """Return arrays of a `.npz` file by name; nothing of a size that a header claims is made before it is checked.

    Args:
        path: the file.
        holds: what each array must hold: text, numbers (finite) or whole numbers. Others in the file are left alone.

    Raises:
        InputError: it cannot be read, an array is missing, is cut off, or holds something else.
    """
    try:
        with zipfile.ZipFile(path) as file:
            return {name: _array(file, name, kind) for name, kind in holds.items()}
    except InputError:
        raise
    except (ValueError, TypeError, OSError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(str(error) or type(error).__name__) from error


def check_shapes(
    arrays: Mapping[str, NDArray[Any]], shapes: Mapping[str, tuple[str | int, ...]], sizes: Mapping[str, int]
) -> None:
    """Refuse arrays whose shapes do not fit together, or that hold nothing.

    Args:
        arrays: arrays by name.
        shapes: sizes of each array; a letter stands for the same number everywhere.
        sizes: what some letters stand for; the others stand for what is met first.

    Raises:
        InputError: the text gives both shapes.
    """
    known = dict(sizes)
    for name, wanted in shapes.items():
        given = arrays[name].shape
        if len(given) == len(wanted):
            known = {key: size for key, size in zip(wanted, given, strict=True) if isinstance(key, str)} | known
        needed = tuple(known.get(size, size) if isinstance(size, str) else size for size in wanted)
        if given != needed:
            told = ", ".join(map(str, needed))
            raise InputError(f"{name} has the shape {given}; it must be ({told}{',' if len(needed) == 1 else ''})")
        if 0 in given:
            raise InputError(f"{name} has the shape {given} and holds nothing")


def _array(file: zipfile.ZipFile, name: str, kind: str) -> NDArray[Any]:
    if f"{name}.npy" not in file.namelist():
        raise InputError(f"it has no array {name}")
    info = file.getinfo(f"{name}.npy")
    letters, dtype = _KINDS[kind]
    with file.open(info) as stream:
        read_header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
        shape, fortran, found = read_header(stream)
        if found.kind not in letters:
            raise InputError(f"{name} holds {found}; it must hold {kind}")
        claimed, there = math.prod(shape) * found.itemsize, info.file_size - stream.tell()
        content = stream.read() if claimed == there and min(shape, default=0) >= 0 else b""
    if len(content) != claimed or claimed != there:
        raise InputError(f"{name} claims the shape {shape}, {claimed} bytes; the file holds {there}")
    array: NDArray[Any] = (
        np.frombuffer(content, found).reshape(shape, order="F" if fortran else "C").astype(dtype, order="C")
    )
    usable = np.abs(array) < LARGEST if kind == "numbers" else np.True_
    if not usable.all():
        where = np.argwhere(~usable)[0].tolist()
        raise InputError(
            f"{name} holds {array[tuple(where)]} at {where}; it must hold finite numbers below {LARGEST:g}"
        )
    return array
