"""What is asked, seen, done and paid: pure functions."""
