"""The reach of a hand: how far it could carry an object, by where its fingers can touch and which grips connect."""
