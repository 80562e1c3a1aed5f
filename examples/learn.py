"""Record demonstrations, learn from them, set the policy beside the expert; `smoke` takes seconds and learns little.

Needs the extra `rl`: pip install 'inhand[rl]'.
"""

import inhand

same = {"observation": "grip", "actions": "steps", "reward": "progress", "horizon": 25}
shown = inhand.record(expert="thesis-ik", episodes=32, midway=0.0, seed=1, **same)
print(shown.table().groupby("direction")["distance_mm"].mean())
run = inhand.train(preset="smoke", demonstrations=shown, episodes=30, seed=1)
print(run.table()[["direction", "fraction", "dropped"]])
run.figure().savefig("learning.png")
compared = inhand.evaluate(run, trials=1, episodes=16)
print(compared.table().groupby("controller")["distance_mm"].mean())
