"""Triangulated surfaces, with the lattices around them and colours on them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import CenteredNorm, Normalize, to_rgb
from matplotlib.figure import Figure

from ..errors import ParameterError
from .figure import blank
from .view import View

METAL = "#b9c4d0"
RED = "#d62728"
GREY = "#7a7a7a"
LIGHT = np.array([0.25, 0.45, 0.86])
"""Direction of the light in the picture: right, up, towards the eye."""

LatticePoints = Any
"""Control points, shape (nu, nv, nw, 3)."""


def draw_surface(
    axes: Axes,
    points: Any,
    faces: Any,
    values: Any = None,
    view: View | str = "iso",
    label: str = "",
    colours: str = "RdBu_r",
    is_signed: bool = True,
    alpha: float = 1.0,
    plain: str = METAL,
) -> ScalarMappable | None:
    """Draw shaded triangles, far ones first; with `values`, per point or per face, coloured.

    Signed values are coloured symmetrically about zero. Gives what a colour bar shows.
    """
    projected, faces = View.of(view).project(points), np.asarray(faces)
    corners = projected[faces]
    order = np.argsort(corners[:, :, 2].sum(axis=1), kind="stable")
    base, scale = _base_colours(values, len(projected), faces, colours, is_signed, plain)
    shaded = base * _brightness(corners)[:, None]
    polygons = PolyCollection(
        corners[order][:, :, :2],
        facecolors=np.clip(shaded[order], 0, 1),
        edgecolors="face",  # closes the seams that antialiasing leaves between triangles
        linewidths=0.25,
        alpha=alpha,
        rasterized=True,
    )
    axes.add_collection(polygons, autolim=False)
    axes.update_datalim(projected[:, :2])
    _tidy(axes)
    if scale is not None and label:
        axes.figure.colorbar(scale, ax=axes, label=label, shrink=0.6, pad=0.02)
    return scale


def draw_lattice(
    axes: Axes,
    rest: LatticePoints,
    moved: LatticePoints | None = None,
    highlighted: Any = (),
    view: View | str = "iso",
) -> None:
    """Draw a lattice: at rest thin and grey, moved in black with red control points.

    `highlighted` are indices (i, j, k) of control points drawn larger.
    """
    shown = View.of(view)
    both = [(rest, GREY, 0.5, "--")]
    if moved is not None:
        both.append((moved, "black", 0.7, "-"))
    for grid, colour, width, style in both:
        flat = shown.project(np.asarray(grid).reshape(-1, 3)).reshape(np.shape(grid))
        lines = LineCollection(
            grid_lines(flat[..., :2]), colors=colour, linewidths=width, linestyles=style, zorder=3
        )
        axes.add_collection(lines, autolim=False)
        axes.update_datalim(flat[..., :2].reshape(-1, 2))
    last = shown.project(np.asarray(both[-1][0]).reshape(-1, 3))
    axes.scatter(last[:, 0], last[:, 1], s=11, color=RED, zorder=4, linewidths=0)
    if len(highlighted):
        chosen = np.ravel_multi_index(tuple(np.transpose(highlighted)), np.shape(rest)[:3])
        axes.scatter(
            last[chosen, 0],
            last[chosen, 1],
            s=70,
            facecolor="#ffdd33",
            edgecolor="black",
            zorder=5,
            lw=0.8,
        )
    _tidy(axes)


def draw_edges(axes: Axes, points: Any, edges: Any, view: View | str = "iso") -> None:
    """Draw the edges of a mesh."""
    projected = View.of(view).project(points)[:, :2]
    lines = LineCollection(projected[np.asarray(edges)], colors="#33556f", linewidths=0.3)
    axes.add_collection(lines, autolim=False)
    axes.update_datalim(projected)
    _tidy(axes)


def before_and_after(
    points: Any,
    moved: Any,
    faces: Any,
    lattices: Sequence[tuple[LatticePoints, LatticePoints]] = (),
    view: View | str = "iso",
    title: str = "",
) -> Figure:
    """A picture of a surface at rest with its lattices, and deformed with them moved."""
    figure = blank(14, 6.5)
    left, right = figure.subplots(1, 2)
    draw_surface(left, points, faces, view=view)
    draw_surface(right, moved, faces, view=view)
    for rest, new in lattices:
        draw_lattice(left, rest, view=view)
        draw_lattice(right, rest, new, view=view)
    for axes in (left, right):  # both at one scale
        axes.update_datalim(np.concatenate([left.dataLim.get_points(), right.dataLim.get_points()]))
        axes.autoscale_view()
    left.set_title("before")
    right.set_title("after")
    figure.suptitle(title, fontsize=15)
    return figure


def sensitivity_map(
    points: Any,
    faces: Any,
    values: Any,
    label: str,
    lattices: Sequence[LatticePoints] = (),
    highlighted: Sequence[tuple[int, Any]] = (),
    view: View | str = "iso",
    title: str = "",
) -> Figure:
    """A picture of a surface coloured by a derivative, with its lattices.

    `highlighted` pairs the number of a lattice with the control points in it that the colours
    belong to.
    """
    figure = blank(12, 7)
    axes = figure.subplots()
    draw_surface(axes, points, faces, values, view, label)
    for number, rest in enumerate(lattices):
        draw_lattice(axes, rest, highlighted=dict(highlighted).get(number, ()), view=view)
    axes.set_title(title, fontsize=14)
    return figure


def _base_colours(
    values: Any, count: int, faces: np.ndarray, colours: str, is_signed: bool, plain: str
) -> tuple[np.ndarray, ScalarMappable | None]:
    if values is None:
        return np.broadcast_to(to_rgb(plain), (len(faces), 3)), None
    values = np.asarray(values, float)
    if values.shape not in ((count,), (len(faces),)):
        raise ParameterError(
            f"values are one per point ({count}) or per face ({len(faces)}), got {values.shape}"
        )
    per_face = values[faces].mean(axis=1) if values.shape == (count,) else values
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    norm: Normalize = (
        CenteredNorm(0.0, largest) if is_signed else Normalize(values.min(), values.max())
    )
    scale = ScalarMappable(norm, colours)
    return scale.to_rgba(per_face)[:, :3], scale


def _brightness(corners: np.ndarray) -> np.ndarray:
    """Lambert's law from both sides, with some light from everywhere."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    facing = np.where(normals[:, 2] < 0, -1.0, 1.0)
    slant = facing * (normals @ LIGHT) / np.where(lengths > 0, lengths, 1.0)
    return 0.55 + 0.47 * np.clip(slant, 0, 1)


def grid_lines(grid: np.ndarray) -> list[np.ndarray]:
    """The polylines of a grid of control points along its three axes."""
    lines = []
    for axis in range(3):
        if grid.shape[axis] > 1:
            lines += list(np.moveaxis(grid, axis, 2).reshape(-1, grid.shape[axis], 2))
    return lines


def _tidy(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_axis_off()
