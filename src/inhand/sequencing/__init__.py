"""What people draw, and the sequence of primitives that traces it in the hand."""
