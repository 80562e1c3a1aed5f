"""What training calls, compiled while demonstrations are recorded, and kept for the next run."""

import zlib
from pathlib import Path
from typing import Any, cast

import jax
import numpy as np

from inhand.compiled import programs_folder
from inhand.learning.config import Training
from inhand.learning.ddpgfd import imitate_many, new_learner, update_many
from inhand.learning.replay_buffer import Columns, Rows

CHUNK = 1000
"""Updates of the actor's imitation that run at a time."""


KEPT_FROM = 0.1
"""Programs are kept that took so long to compile [s]."""
ZSTD = b"\x28\xb5\x2f\xfd"
"""What programs begin with that JAX has packed otherwise than by zlib."""


def keep_programs() -> None:
    """Let JAX keep on disk what it compiles, as kernels are, unless somebody has told it where."""
    folder, settings = programs_folder(), cast("Any", jax.config)
    if folder is not None and settings.jax_compilation_cache_dir is None:
        _drop_damaged(folder)
        settings.update("jax_compilation_cache_dir", str(folder))
        settings.update("jax_persistent_cache_min_compile_time_secs", KEPT_FROM)


def _drop_damaged(folder: Path) -> None:
    """Remove programs that JAX cannot unpack: it would warn of them in every run, and never write them anew."""
    for file in folder.glob("*-cache"):
        try:
            packed = file.read_bytes()
            if not packed.startswith(ZSTD):
                zlib.decompress(packed)
        except (OSError, zlib.error):
            file.unlink(missing_ok=True)


def compile_ahead(config: Training, columns: Columns) -> None:
    """Compile what training calls, in sizes it will have: beside other work, so that training need not wait for it."""
    learning, learner = config.learning, new_learner(config.learning, columns, config.seed)
    rows, weights = _room(config.updates, learning.batch, columns.width), _room(config.updates, learning.batch)
    update_many.lower(learner, rows, weights, learning, columns, strength=1.0).compile()
    if config.imitate:
        rate = learning.imitation_rate
        many = _room(CHUNK, 2 * learning.batch, columns.d + columns.n)
        for total in {config.imitate, *([config.refit] if config.rounds > 1 else [])}:
            first = imitate_many.lower(learner.actor, None, many, columns, total, rate=rate)
            first.compile()
            imitate_many.lower(*first.out_info[:2], many, columns, total, rate=rate).compile()


def _room(*shape: int) -> Rows:
    """Return rows that are not looked at."""
    return np.empty(shape, dtype=np.float32)
