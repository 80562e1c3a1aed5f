"""Worlds to learn in, demonstrations, DDPGfD, environments, and the reports of all that."""
