"""A case's text with one more stage."""
