"""How the expert does with other hands in space, objects, weights and friction: the table of docs/spatial.md.

    python studies/hands_in_space.py --out results/hands_in_space

Nothing is set for any of them: what differs from the standard hand and cube is the name alone.
"""

import argparse
import csv
from pathlib import Path

import numpy as np

import inhand
from inhand.cli.terminal import say
from inhand.control.trial import LOST

STANDARD, CUBE = "3f_60.60_40_10", "cube_50"
HANDS = (
    "3f_60.60_2v1.40.80_10",
    "4f_60.60_40_10",
    "3f_70.50_40_10",
    "3f_50.70_40_10",
    "3f_45.45.30_40_10",
    "4f_45.45.30_40_10",
)
"""Two fingers against one, four fingers, three other ratios and numbers of links, and both more."""
OBJECTS = ("cube_40", "ellipsoid_60x50x40", "cube_50:mass_kg=0.03", "cube_50:mass_kg=0.15", "cube_50:friction=0.667")
"""A smaller cube, an ellipsoid, 30 and 150 g, and a friction of 0.6 with the hand's 0.9."""
COLUMNS = ("hand", "object", "gravity", "trials", "kept", "least_mm", "mean_mm", "least_deg", "mean_deg", "off_95_mm")


def frustum(place: Path) -> Path:
    """Write a convex mesh of 50 mm height, a six-sided prism that tapers, and return its file."""
    angles = np.arange(6) * np.pi / 3
    rims = [(radius * np.cos(angles), radius * np.sin(angles), height) for radius, height in ((30, -25), (22, 25))]
    corners = [f"v {x:.4f} {y:.4f} {z}" for xs, ys, z in rims for x, y in zip(xs, ys, strict=True)]
    sides = [f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}" for k in range(6)]
    ends = ["f 6 5 4 3 2 1", "f 7 8 9 10 11 12"]
    place.write_text("\n".join([*corners, *sides, *ends]) + "\n", encoding="utf-8")
    return place


def row_of(hand: str, name: str, palm: str, words: argparse.Namespace) -> dict[str, object]:
    """Return what a run reached."""
    run = inhand.asterisk(
        hand, name, directions=words.directions, trials=words.trials, seed=words.seed, gravity=palm, noise_mm=1.0
    )
    table = run.table()
    moves, turns = (table[table["along"].isna() == turned]["reached"] for turned in (False, True))
    off = table[table["along"].notna()]["lateral_max_mm"]
    kept = int((~table["outcome"].isin(LOST)).sum())
    numbers = (moves.min(), moves.mean(), turns.min(), turns.mean(), off.quantile(0.95))
    found = (hand, Path(name).name, palm, len(table), kept, *(round(float(each), 2) for each in numbers))
    return dict(zip(COLUMNS, found, strict=True))


def main() -> None:
    """Run every hand with the cube and the standard hand with every object, and write and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/hands_in_space"))
    parser.add_argument("--palms", default="up,down,sideways")
    parser.add_argument("--directions", default="all,turns")
    parser.add_argument("--trials", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    words = parser.parse_args()
    words.out.mkdir(parents=True, exist_ok=True)
    pairs = [(hand, CUBE) for hand in HANDS] + [(STANDARD, name) for name in OBJECTS]
    pairs.append((STANDARD, str(frustum(words.out / "frustum.obj"))))
    with (words.out / "table.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for palm in words.palms.split(","):
            for hand, name in pairs:
                row = row_of(hand, name, palm, words)
                table.writerow(row)
                file.flush()
                say(" | ".join(str(value) for value in row.values()))


if __name__ == "__main__":
    main()
