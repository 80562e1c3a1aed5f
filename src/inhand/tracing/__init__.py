"""Drawings and tasks as sequences of primitives: plan, follow, measure, draw, tell."""
