"""What a hand and an object are, where fingers can touch, how far a grip can go; no time in it."""
