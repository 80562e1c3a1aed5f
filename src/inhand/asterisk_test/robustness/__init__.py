"""The test in worlds that differ, seen and commanded as in the real world."""
