"""How far a hand could carry an object: where its fingers can touch, and which grips a slide connects."""
