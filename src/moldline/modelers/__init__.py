"""CONSTRUCT: what makes a geometry from parameters, or from other geometries."""
