"""What an episode leaves: trials, their files, and the recordings of people."""
