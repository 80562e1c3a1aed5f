"""The Asterisk Test in space: its run, metrics, figures and report; what the plane has too is the plane's."""
