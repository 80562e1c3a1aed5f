"""The folder of a training run: made, checked, gone on from, finished."""

import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from inhand.control.loop import Told
from inhand.errors import InputError
from inhand.folders import alone, check_folder, clear, writing
from inhand.learning.ahead import compile_ahead, keep_programs
from inhand.learning.config import Training
from inhand.learning.journal import Evaluation
from inhand.learning.progress import AGENT, BEST, CHECKPOINT, COMPILING, EXPERT, PAGE, READY
from inhand.learning.run_cards import MARK, card_of, check, read_config
from inhand.learning.setup import Ready, columns_of, load_ready, make_ready, save_ready
from inhand.learning.training import Trainer
from inhand.records import text_of

WORKING = (CHECKPOINT, READY, EXPERT, AGENT)
"""What only a run that is not finished needs."""


def train(
    config: Training, out: Path, told: tuple[Told, Callable[[Evaluation], None]], *, overwrite: bool = False
) -> Path:
    """Train in a new folder and return the folder of the best policy.

    Args:
        config: what to train.
        out: the run's folder.
        told: told how far the preparations are, and every evaluation.
        overwrite: whether a run that the folder holds may be replaced.

    Raises:
        InputError: a configuration that cannot be trained or a folder that may not be written.
    """
    check(config)
    check_folder(out, overwrite=overwrite, mark=MARK)
    with alone(out, out), writing(out):
        clear(out)
        (out / MARK).write_text(text_of(card_of(config)))
        return _go(config, out, told)


def resume(out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    """Go on with the run of a folder from its last checkpoint and return the folder of the best policy.

    Raises:
        InputError: no run there, one that is finished and has its page, one of another version or observation layout,
            or one that another process is busy with.
    """
    config = read_config(out)
    if finished(out) and (out / PAGE).is_file():
        raise InputError(f"the run in {out} is finished; its policy is in {out / BEST}. Train another with --out")
    with alone(out, out), writing(out):
        return out / BEST if finished(out) else _go(config, out, told)


def finished(out: Path) -> bool:
    """Return whether the run of a folder has come to its end."""
    return (out / "finished.json").is_file()


def _go(config: Training, out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    from threadpoolctl import threadpool_limits

    keep_programs()
    # Products as small as the actor's gain nothing from threads of BLAS, which fight with the updates for the cores.
    with threadpool_limits(1, "blas"):
        return _to_the_end(config, out, told)


def _to_the_end(config: Training, out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    began, spent = time.perf_counter(), time.process_time()
    beside = ThreadPoolExecutor(1, COMPILING)
    try:
        compiled = beside.submit(compile_ahead, config, columns_of(config, config.held.hand))
        ready = _ready(config, out, told[0])
        compiled.result()
    finally:
        beside.shutdown(wait=False)  # whoever stops it should not wait for JAX's compiler, which nothing stops
    trainer = Trainer(config, ready, out, told[1], told[0], spent=time.process_time() - spent)
    best = trainer.run()
    sitting = {"last_sitting_s": time.perf_counter() - began}
    (out / "finished.json").write_text(json.dumps(vars(trainer.counters) | sitting) + "\n")
    for name in WORKING:
        (out / name).unlink(missing_ok=True)
    return best


def _ready(config: Training, out: Path, told: Told) -> Ready:
    path = out / READY
    if path.is_file():
        return load_ready(config, path)
    for name in WORKING:
        (out / name).unlink(missing_ok=True)
    ready = make_ready(config, out, told)
    save_ready(ready, path)
    return ready
