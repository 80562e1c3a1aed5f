"""Loop over hands: how far each could carry the cube, and how far the expert does."""

import pandas as pd

import inhand

rows = []
for hand in ("2v2_50.50_50.50_1.1_53", "2v2_65.35_65.35_1.1_53"):
    table = inhand.asterisk(hand, "cube_39", directions="Out,Right", trials=1).table()
    rows.append({"hand": hand, "distance_mm": table["distance_mm"].mean(), "limit_mm": table["limit_mm"].mean()})
print(pd.DataFrame(rows))
