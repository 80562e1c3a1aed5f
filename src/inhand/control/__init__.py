"""Control and senses: who decides, the one loop, and what it leaves."""
