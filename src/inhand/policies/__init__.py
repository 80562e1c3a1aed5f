"""Trained policies that ship with the package, each with the configuration that made it.

`default` is the best of `inhand train`, `privileged` that of `inhand train --preset privileged --seed 1`, the others
are those of the presets of their names; `spatial-privileged` is of a hand in space. `plans` are grasps
and ways of `default` with the standard hand and object (`studies/plans.py`); its risk is what stops it beyond these
(`studies/feel.py`).
"""
