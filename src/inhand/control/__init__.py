"""Who decides, the one loop, and what it leaves."""
