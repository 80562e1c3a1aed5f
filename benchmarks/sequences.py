"""Tracing drawings and doing tasks as sequences of primitives: what the expert and the learned policy reach.

Drawings have 60 % of the size that lies inside the hand's reach. Every row is 20 trials with start noise of 1 mm and
1 deg; trials of tasks have draws of their own. RMS, maximum and Frechet distance are the worst trial's.

Bounds: completion at least 95 %, RMS error at most 2 mm (ik) and 3 mm (rl), no drop; the tour without a drop in at
least 90 % of its trials. Under `field`, on real senses: completion at least 95 %, RMS error at most 3 mm; the tour
whole in at least 80 %.

Run: python benchmarks/sequences.py [--trials 20] [--paths square tour] [--controllers ik rl] [--disturb field]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

from inhand.tracing.config import TraceConfig
from inhand.tracing.run import prepare_trace, simulate_trace
from timing import environment

PATHS = ("square", "circle", "figure-eight", "star", "tour", "pose", "wall", "key")
HEADER = (
    "| path | size [mm] | controller | completion, mean | least | all done | lost | RMS [mm] | max [mm] | Frechet [mm]"
    " | turn [deg] | time [s] | retries |\n" + "| --- " * 13 + "|"
)


def row(path: str, config: TraceConfig) -> str:
    """Return a row of the Markdown table."""
    config = replace(config, path=path)
    setup = prepare_trace(config)
    _, traces = simulate_trace(config, setup)
    completion = [trace.completion for trace in traces]
    cells = [
        path,
        "-" if setup.size is None else f"{1e3 * setup.size:.0f}",
        config.controller,
        f"{100 * sum(completion) / len(completion):.1f} %",
        f"{100 * min(completion):.1f} %",
        f"{sum(trace.done for trace in traces)} of {len(traces)}",
        str(sum(trace.dropped for trace in traces)),
        *(f"{max(getattr(trace, name) for trace in traces):.2f}" for name in ("rms_mm", "max_mm", "frechet_mm")),
        f"{max(trace.turn_deg for trace in traces):.1f}",
        f"{sum(trace.time_s for trace in traces) / len(traces):.1f}",
        str(sum(trace.failures for trace in traces)),
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Print the table as it grows."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--paths", nargs="+", default=PATHS)
    parser.add_argument("--controllers", nargs="+", default=("ik", "rl-privileged"))
    parser.add_argument("--disturb", default="none")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print(f"{environment()}; disturbed by {given.disturb}, seed {given.seed}")
    print(HEADER)
    began = time.perf_counter()
    for path in given.paths:
        for controller in given.controllers:
            asked = TraceConfig(controller=controller, trials=given.trials, seed=given.seed, disturb=given.disturb)
            print(row(path, asked), flush=True)
    print(f"\n{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
