"""Hands in space: serial fingers of hinges round a palm, solid objects, where they touch and what holds them."""
