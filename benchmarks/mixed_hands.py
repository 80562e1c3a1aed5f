"""A batch of worlds in which every hand and object differs against one of one hand and object, in turns in one run.

Worlds of 24 drawn pairs of each form of hand, held and carried by a network over joints with drawn weights; and as many
worlds of the first of these pairs alone. Both are stepped on one thread, by the same lines as training: what is seen,
decided, simulated, measured and paid. Prints decisions a second of all worlds, and the ratio of processor times.
"""

import time

import numpy as np

from inhand.control.joint_network import actions_of_joints, joint_sizes
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.family import Form, HandFamily
from inhand.hands.fit import Held
from inhand.hands.pair_family import PairFamily
from inhand.learning.pairs import Pairs
from inhand.learning.starts import Starts, gripped, joined, plans_for
from inhand.learning.worlds import Interface, ManipulationWorlds

PAIRS, WORLDS, DECISIONS, TURNS = 24, 240, 20, 4
FORMS: tuple[Form, ...] = ("2v2", "2v3", "3v3")
INTERFACE = Interface("joints", "steps", "progress", horizon=200)


def held_starts(form: Form, count: int) -> list[Starts]:
    """Return four starts of each of some drawn pairs of a form of hand, each held for Out."""
    family, found = PairFamily(hands=HandFamily(forms=(form,), limits=("free", "lab"))), list[Starts]()
    rng, number = np.random.default_rng(1), 0
    while len(found) < count:
        held, number = family.drawn(rng, number), number + 1
        try:
            starts = gripped(*held, (plans_for(*held, (90.0,)), np.full(4, 90.0)), rng)
        except InputError:
            continue
        found.append(with_pair(starts, held))
    return found


def with_pair(starts: Starts, held: Held) -> Starts:
    """Return starts that know their hand and object, with 40 mm to go."""
    pairs, count = Pairs((held,), np.zeros(len(starts), dtype=np.int64)), len(starts)
    return Starts(
        starts.snapshot, starts.state, starts.angle_deg, np.full(count, 0.04), pairs=pairs, turn=np.zeros(count)
    )


def pair_of(starts: Starts) -> Held:
    """Return the one pair of some starts."""
    (held,) = starts.pairs.held if starts.pairs else ()
    return held


def seconds(worlds: ManipulationWorlds, layers: list[tuple[Array, Array]]) -> float:
    """Return the processor time of some decisions of all worlds [s]."""
    seen, began = worlds.reset(), time.process_time()
    for _ in range(DECISIONS):
        seen = worlds.step(0.05 * actions_of_joints(layers, seen, np)).observation
    return time.process_time() - began


def main() -> None:
    """Measure every form of hand."""
    rng = np.random.default_rng(0)
    for form in FORMS:
        each = held_starts(form, PAIRS)
        held, mixed = pair_of(each[0]), joined(each)
        both = [ManipulationWorlds(held, some, WORLDS, INTERFACE, rng, threads=1) for some in (mixed, each[0])]
        size = both[0].layout.size(held.hand)
        layers = [
            (rng.standard_normal(s) / np.sqrt(s[0]), np.zeros(s[1]))
            for s in joint_sizes(size, both[0].layout.columns, (64, 64))
        ]
        taken = np.array([[seconds(worlds, layers) for worlds in both] for _ in range(TURNS + 1)])[1:]
        rates = WORLDS * DECISIONS / taken.min(axis=0)
        ratios = taken[:, 0] / taken[:, 1]
        print(
            f"{form}: {rates[0]:,.0f} decisions a second of {PAIRS} pairs, {rates[1]:,.0f} of one; time of the mixed"
            f" batch {np.median(ratios):.3f} of the other ({ratios.min():.3f} to {ratios.max():.3f})"
        )


if __name__ == "__main__":
    main()
