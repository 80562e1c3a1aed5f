"""Structured in-hand manipulation: the Asterisk Test in simulation, an expert, people, figures."""

__version__ = "0.1.0"
