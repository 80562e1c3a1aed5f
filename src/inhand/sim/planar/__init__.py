"""The planar engine: a hand, an object and walls in the plane, with MuJoCo's contact law, compiled by Numba."""
