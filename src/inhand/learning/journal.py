"""What a run writes down as it goes: `metrics.jsonl` and TensorBoard's event files."""

import json
import math
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tensorboardX import SummaryWriter

from inhand.control.policy import Policy
from inhand.geometry import Array
from inhand.learning.collect import Finished
from inhand.learning.progress import JOURNAL
from inhand.learning.setup import Ready
from inhand.learning.trying import Tried


@dataclass
class Counters:
    """How far a run is."""

    episodes: int = 0
    """Finished episodes of the agent."""
    decisions: int = 0
    """Decisions of the agent."""
    updates: int = 0
    """Updates of the critic."""
    rounds: int = 0
    """Rounds."""
    seconds: float = 0.0
    """Time spent since the demonstrations were there, over all sittings [s]."""
    cpu_s: float = 0.0
    """Time on a core, all cores together, over all sittings [s]."""
    evaluated: int = 0
    """Episodes at the last evaluation."""
    best: float = -math.inf
    """Best score so far."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What an evaluation found."""

    counters: Counters
    """How far the run was."""
    tried: Tried
    """What the actor reached."""
    fraction: Array
    """Share of the hand's limit that each test start reached `(N,)`."""
    score: float
    """Mean sum of rewards over the training directions: what `best` is chosen by."""


@dataclass(frozen=True, eq=False)
class Trying:
    """An evaluation under way."""

    policy: Policy
    """What is tried out."""
    counters: Counters
    """How far the run was."""
    found: Future[Tried]
    """What the policy reaches, once it is known."""


class Journal:
    """Lines of JSON and TensorBoard scalars of one run."""

    def __init__(self, folder: Path, length: int) -> None:
        """Go on writing after `length` bytes; what a run that was killed wrote beyond its checkpoint is cut off."""
        self._path = folder / JOURNAL
        with self._path.open("ab") as file:
            file.truncate(length)
        self._lines: list[str] = []
        # A queue that is full makes the training wait.
        self._writer = SummaryWriter(str(folder / "events"), flush_secs=20, max_queue=1000)

    def length(self) -> int:
        """Return the length of the file once everything is on it [bytes]."""
        self._flush()
        return self._path.stat().st_size

    def _flush(self) -> None:
        with self._path.open("a") as file:
            file.writelines(self._lines)
        self._lines.clear()

    def scalars(self, kind: str, step: int, values: dict[str, float]) -> None:
        """Write some numbers at a step."""
        self._line({"kind": kind, "step": step, **values})
        for name, value in values.items():
            self._writer.add_scalar(f"{kind}/{name}", value, step)

    def episodes(self, first: int, ends: Sequence[Finished]) -> None:
        """Write finished episodes, numbered on from `first`."""
        for number, end in enumerate(ends, start=first + 1):
            self._line({"kind": "episode", "step": number, **vars(end)})
            self._writer.add_scalar("episode/sum of rewards", end.total, number)
            self._writer.add_scalar("episode/last reward", end.last, number)

    def evaluation(self, found: Evaluation, ready: Ready) -> None:
        """Write an evaluation, means for each direction, and bring it and all before it to the disk."""
        names = np.array(ready.names)
        directions: dict[str, Any] = {}
        for name in dict.fromkeys(names[np.argsort(ready.angle_deg, kind="stable")].tolist()):
            mine = names == name
            directions[name] = {
                "fraction": float(found.fraction[mine].mean()),
                "dropped": int(found.tried.dropped[mine].sum()),
                "trials": int(mine.sum()),
                "across": float(found.tried.across[mine].max()),
                "turned": float(found.tried.turned[mine].max()),
                "total": float(found.tried.total[mine].mean()),
                "expert_total": float(ready.expert_total[mine].mean()),
                "expert_fraction": float(ready.expert_fraction[mine].mean()),
            }
        told = {
            "total": float(found.tried.total.mean()),
            "expert_total": float(ready.expert_total.mean()),
            "fraction": float(found.fraction.mean()),
            "dropped": int(found.tried.dropped.sum()),
            "trials": len(names),
            "score": found.score,
        }
        self._line(
            {"kind": "evaluation", "step": found.counters.episodes, **vars(found.counters), **told}
            | {"directions": directions}
        )
        for name in ("total", "fraction", "dropped", "score"):
            self._writer.add_scalar(f"evaluation/{name}", told[name], found.counters.episodes)
        for name, numbers in directions.items():
            self._writer.add_scalar(f"fraction/{name}{ready.unit}", numbers["fraction"], found.counters.episodes)
        self._flush()

    def close(self) -> None:
        """Bring everything to the disk."""
        self._flush()
        self._writer.close()

    def _line(self, entry: dict[str, Any]) -> None:
        self._lines.append(json.dumps(entry) + "\n")
