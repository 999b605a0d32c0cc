"""Airfoil sections, and the sections that planes cut from surfaces."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from .figure import blank
from .surfaces import GREY, RED, grid_lines


def cut(points: Any, faces: Any, axis: str, at: float) -> np.ndarray:
    """Where a plane x, y or z = `at` cuts a triangulation: segments, shape (s, 2, 3)."""
    points, faces = np.asarray(points, float), np.asarray(faces)
    height = points[:, "xyz".index(axis)] - at
    above = height[faces] > 0
    crossed = faces[above.any(axis=1) & ~above.all(axis=1)]
    ends = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = crossed[:, i], crossed[:, j]
        differs = (height[a] > 0) != (height[b] > 0)
        share = height[a] / np.where(differs, height[a] - height[b], 1.0)
        place = points[a] + share[:, None] * (points[b] - points[a])
        ends.append(np.where(differs[:, None], place, np.nan))
    stacked = np.stack(ends, axis=1)
    met = ~np.isnan(stacked[:, :, 0])
    return stacked[met].reshape(-1, 2, 3)


def draw_section(
    axes: Axes,
    points: Any,
    moved: Any = None,
    lattices: Sequence[tuple[Any, Any]] = (),
    plane: str = "xy",
) -> None:
    """Draw a curve: at rest dashed, deformed solid, the lattices' moved control points red."""
    i, j = ("xyz".index(name) for name in plane)
    points = np.asarray(points)
    axes.plot(points[:, i], points[:, j], "--" if moved is not None else "-", color=GREY, lw=1.2)
    if moved is not None:
        moved = np.asarray(moved)
        axes.plot(moved[:, i], moved[:, j], color="black", lw=1.4)
    for lattice in lattices:
        rest, new = (np.asarray(grid)[..., [i, j]] for grid in lattice)
        axes.add_collection(LineCollection(grid_lines(rest), colors=GREY, linewidths=0.5))
        axes.add_collection(LineCollection(grid_lines(new), colors=RED, linewidths=0.6))
        axes.scatter(new[..., 0], new[..., 1], s=16, color=RED, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"{plane[0]}")
    axes.set_ylabel(f"{plane[1]}")


def section_picture(
    points: Any, moved: Any, faces: Any, stations: Sequence[float], axis: str = "y"
) -> Figure:
    """Cuts of a surface at several stations, before (dashed) and after."""
    figure = blank(11, 2.1 * len(stations) + 0.6)
    rows = np.atleast_1d(figure.subplots(len(stations), 1))
    i, j = (k for k in range(3) if k != "xyz".index(axis))
    for panel, at in zip(rows, stations, strict=True):
        for shape, style, colour in ((points, "--", GREY), (moved, "-", "black")):
            lines = list(cut(shape, faces, axis, at)[:, :, [i, j]])
            panel.add_collection(
                LineCollection(lines, colors=colour, linestyles=style, linewidths=1.2),
            )
        panel.autoscale_view()
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(f"{axis} = {at:g}", fontsize=10, loc="left")
    return figure
