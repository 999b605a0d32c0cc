"""PARAMETERISE: what the designer turns, and how it turns controls."""
