"""A run's page for a browser: one file with all that it shows, drawn from plain arrays by the scripts beside this."""
