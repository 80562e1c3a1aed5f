"""Learning: networks, replay, DDPGfD and the loop that trains."""
