"""Recordings of people: files, units, labels, and the paths that they took."""
