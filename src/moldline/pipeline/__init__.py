"""DERIVE: stages in order, from variable values to a shape and its exact derivatives."""
