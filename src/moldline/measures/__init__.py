"""MEASURE: differentiable numbers taken from a shape."""
