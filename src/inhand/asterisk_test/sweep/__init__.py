"""The test over many hands and objects."""
