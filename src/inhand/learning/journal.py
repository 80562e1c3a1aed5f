"""What a run writes down as it goes: `metrics.jsonl` and TensorBoard's event files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from tensorboardX import SummaryWriter

from inhand.learning.collect import Finished
from inhand.learning.setup import Ready

if TYPE_CHECKING:
    from inhand.learning.training import Evaluation

METRICS = "metrics.jsonl"
"""Name of the file of lines."""


class Journal:
    """Lines of JSON and TensorBoard scalars of one run."""

    def __init__(self, folder: Path, length: int) -> None:
        """Go on writing after `length` bytes; what a run that was killed wrote beyond its checkpoint is cut off."""
        self._path = folder / METRICS
        with self._path.open("ab") as file:
            file.truncate(length)
        self._lines: list[str] = []
        self._writer = SummaryWriter(str(folder / "events"), flush_secs=20)

    def length(self) -> int:
        """Return the length of the file once everything is on it [bytes]."""
        with self._path.open("a") as file:
            file.writelines(self._lines)
        self._lines.clear()
        return self._path.stat().st_size

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
        """Write an evaluation, means for each direction."""
        angles = ready.tests.angle_deg
        directions: dict[str, Any] = {}
        for angle in np.unique(angles):
            mine = angles == angle
            directions[f"{angle:g}"] = {
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
            "trials": len(angles),
            "score": found.score,
        }
        self._line(
            {"kind": "evaluation", "step": found.counters.episodes, **vars(found.counters), **told}
            | {"directions": directions}
        )
        for name in ("total", "fraction", "dropped", "score"):
            self._writer.add_scalar(f"evaluation/{name}", told[name], found.counters.episodes)
        for angle_name, numbers in directions.items():
            self._writer.add_scalar(f"fraction/{angle_name} deg", numbers["fraction"], found.counters.episodes)

    def close(self) -> None:
        """Bring everything to the disk."""
        self.length()
        self._writer.close()

    def _line(self, entry: dict[str, Any]) -> None:
        self._lines.append(json.dumps(entry) + "\n")
