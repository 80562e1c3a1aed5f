"""Primitives, reference paths, observations and rewards: pure functions."""
