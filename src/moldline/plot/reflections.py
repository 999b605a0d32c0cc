"""Reflection lines: the eye's test of smoothness."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..mesh import Surface
from .surfaces import draw_surface, fitted, frame
from .view import View


def of_reflections(
    surface: Surface, view: View | str = "iso", lamps: int = 12, title: str = ""
) -> Figure:
    """A polished surface under parallel lamps, far away in a half circle above it.

    Lines break where the surface has an edge, have corners where its curvature jumps, and are
    smooth where it is; a fine triangulation shows what of that is the triangles'.
    """
    figure = fitted(11.0, 9.8, *frame([surface.points], view))
    axes = figure.subplots()
    stripes = _stripes(surface.points, surface.faces, View.of(view), lamps)
    draw_surface(
        axes, surface.points, surface.faces, stripes, view, colours="gray", is_signed=False
    )
    axes.set_title(title, fontsize=15)
    return figure


def _stripes(points: Any, faces: Any, view: View, lamps: int) -> np.ndarray:
    """Light or dark at each point, by the angle about the lamps' direction that it reflects."""
    normals = _point_normals(view.project(points), np.asarray(faces))
    normals = np.where(normals[:, 2:] < 0, -normals, normals)  # the side that the eye sees
    seen = 2 * normals[:, 2:] * normals - np.array([0.0, 0.0, 1.0])
    angle = np.arctan2(seen[:, 1], seen[:, 2])
    return np.sin(lamps * angle) > 0


def _point_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals at points, from the faces around each by their area."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)
    total = np.zeros_like(points)
    for corner in faces.T:
        np.add.at(total, corner, areas)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(lengths > 0, lengths, 1.0)
