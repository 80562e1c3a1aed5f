"""Trained policies that ship with the package, each with the configuration that made it.

`default` is the best of `inhand train`, `privileged` that of `inhand train --preset privileged --seed 1`, `family` and
`spatial` (a hand in space) those of the presets of their names. `plans` are grasps and ways of `default` with the
standard hand and object (`studies/plans.py`).
"""
