"""DEFORM: recipes that move points, each obeying a vector of controls."""
