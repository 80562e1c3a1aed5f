"""How much sooner plans for real senses are there where every core makes some: `python benchmarks/planning.py`."""

import os
import tempfile
import time

import numpy as np

from inhand import caches
from inhand.control.grades import GRADES
from inhand.control.sensed_plan import Carrier, graded, sensed_grasp
from inhand.cores import one_core, usable
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.tasks.paths import stacked, straight_path
from inhand.tasks.primitives import primitive_at
from timing import environment

HAND, OBJECT = load_hand("2v2_50.50_50.50_1.1_53"), load_object("cylinder_43")
PATHS = HAND.start_pose + stacked([straight_path(primitive_at(angle)).poses for angle in (0.0, 90.0, 180.0, 270.0)])


def planned(paths: Array) -> tuple[float, Array]:
    """Return how long the plans of `ik-sensed` for paths `(P, S, 3)` took [s], with nothing kept, and their ways."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ[caches.PLACE] = folder
        began = time.perf_counter()
        grasp = sensed_grasp(HAND, OBJECT, paths, carrier=graded(Carrier()))
        return time.perf_counter() - began, np.array(grasp.way)


def main() -> None:
    """Print the time of four paths on one core and on all, and their ratio."""
    print(environment())
    os.environ.setdefault("NUMBA_CACHE_DIR", str(caches.base() / "compiled"))  # where other processes find it, too
    planned(PATHS[:1])  # compiles
    with one_core():
        alone, ways = planned(PATHS)
    together, same = planned(PATHS)
    print(
        f"four paths, {len(GRADES)} grades: {alone:.1f} s on one core, {together:.1f} s on {usable()}:"
        f" {alone / together:.2f} times, {'the same ways' if np.array_equal(ways, same) else 'OTHER WAYS'}"
    )


if __name__ == "__main__":
    main()
