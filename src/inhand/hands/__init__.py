"""Hands and objects: what they are, where fingers can touch, how far a grip can go; no time in it."""
