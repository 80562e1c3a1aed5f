"""Metrics, labels, averages and runs of the Asterisk Test."""
