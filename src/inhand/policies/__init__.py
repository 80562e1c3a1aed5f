"""Trained policies that ship with the package, each with the configuration that made it.

`default` is the best of `inhand train`, `privileged` that of `inhand train --preset privileged --seed 1`, `spatial`
that of `--preset spatial --seed 2`, the others are those of the presets of their names; two are of a hand in space.
`plans` are grasps and ways of `default` and `spatial`, and of `ik-sensed` in the plane, with the standard hands and
objects (`studies/plans.py`); the risk of `default` is what stops it beyond these (`studies/feel.py`).
"""
