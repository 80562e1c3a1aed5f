"""Tasks in space: primitives along and about any direction, their paths, and how far a hand could carry an object."""
