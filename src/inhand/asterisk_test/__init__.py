"""The Asterisk Test: run, metrics, table, report."""
