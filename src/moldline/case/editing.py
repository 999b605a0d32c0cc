"""The text of a case, edited."""
