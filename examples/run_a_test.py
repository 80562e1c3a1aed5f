"""Run the Asterisk Test, get a DataFrame, keep the run, and load it again."""

import inhand

run = inhand.asterisk("2v2_65.35_65.35_1.1_53", "ellipse_40x25", directions=["Out", 30], trials=2)
print(run.table().groupby("direction")["distance_mm"].agg(["mean", "std"]))
run.figure().savefig("asterisk.png")
print(inhand.load(run.save("run")).table().shape)
