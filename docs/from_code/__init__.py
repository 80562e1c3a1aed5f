"""Pages of the documentation that are made from the code, as Markdown; needs no Sphinx."""
