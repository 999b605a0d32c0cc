"""SHARE OUT: independent tasks to processes, or to other machines."""
