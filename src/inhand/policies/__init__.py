"""Trained policies that ship with the package, each with the configuration that made it."""
