"""`python -m inhand`: the command line."""

from inhand.cli import main

main()
