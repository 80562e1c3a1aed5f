"""Questions asked of many runs: a sweep over hands and objects."""
