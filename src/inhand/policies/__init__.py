"""Trained policies that ship with the package, each with the configuration that made it.

`default` is the best of `inhand train --preset default --seed 0`.
"""
