"""Triangulated surfaces, with the lattices around them and colours on them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import CenteredNorm, Normalize, to_rgb, to_rgba_array
from matplotlib.figure import Figure

from ..errors import ParameterError
from ..mesh import topology
from .figure import blank
from .view import View

METAL = "#b4c2d2"
RED = "#d62728"
GREY = "#7a7a7a"
DARK = "#22282f"
LIGHT = np.array([-0.48, 0.62, 0.62])
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
) -> ScalarMappable | None:
    """Draw shaded triangles, far ones first; with `values`, per point or per face, coloured.

    Signed values are coloured symmetrically about zero. Gives what a colour bar shows. Of a closed
    surface only the triangles that face the eye are drawn.
    """
    projected, faces = View.of(view).project(points), np.asarray(faces)
    base, scale = _base_colours(values, len(projected), faces, colours, is_signed)
    normals = _normals(projected, faces)
    seen = np.flatnonzero(_faces_eye(projected, faces, normals))
    seen = seen[np.argsort(projected[faces[seen], 2].sum(axis=1), kind="stable")]
    shade = _brightness(normals[seen])
    if values is not None:
        shade = 0.55 + 0.4 * shade  # strong shading would hide the colours, none the shape
    corners: Any = projected[faces[seen], :2]  # matplotlib's annotation knows no arrays
    polygons = PolyCollection(
        corners,
        facecolors=np.clip(base[seen] * shade[:, None], 0, 1),
        edgecolors="face",  # closes the seams that antialiasing leaves between triangles
        linewidths=0.5,
        rasterized=True,
    )
    axes.add_collection(polygons, autolim=False)
    axes.update_datalim(projected[:, :2])
    _tidy(axes)
    if scale is not None and label:
        bar = axes.figure.colorbar(scale, ax=axes, shrink=0.7, aspect=28, pad=0.02)
        bar.set_label(label, fontsize=12)
        bar.outline.set_visible(False)
    return scale


def draw_lattice(
    axes: Axes,
    rest: LatticePoints,
    moved: LatticePoints | None = None,
    highlighted: Any = (),
    view: View | str = "iso",
) -> None:
    """Draw a lattice: at rest thin, grey and dashed, moved dark with red control points.

    `highlighted` are indices (i, j, k) of control points drawn larger. What is farther from the
    eye is paler.
    """
    shown, rest = View.of(view), np.asarray(rest, float)
    flat = shown.project(rest.reshape(-1, 3)).reshape(rest.shape)
    if moved is None:
        _draw_lines(axes, flat, DARK, 0.5, "-")
    else:
        _draw_lines(axes, flat, GREY, 0.5, (0, (4, 3)))
        flat = shown.project(np.asarray(moved, float).reshape(-1, 3)).reshape(rest.shape)
        _draw_lines(axes, flat, DARK, 0.8, "-")
    right, up, depth = flat.reshape(-1, 3).T
    axes.scatter(right, up, s=13, color=_faded(RED, depth), zorder=4, linewidths=0)
    if len(highlighted):
        chosen = np.ravel_multi_index(tuple(np.transpose(highlighted)), rest.shape[:3])
        axes.scatter(
            right[chosen], up[chosen], s=80, color="#ffd43b", edgecolors=DARK, lw=0.9, zorder=5
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
    shapes = [points, moved, *(grid for lattice in lattices for grid in lattice)]
    low, high = frame(shapes, view)
    figure = fitted(14.0, 7.0, low, high)
    left, right = figure.subplots(1, 2)
    draw_surface(left, points, faces, view=view)
    draw_surface(right, moved, faces, view=view)
    for rest, new in lattices:
        draw_lattice(left, rest, view=view)
        draw_lattice(right, rest, new, view=view)
    for axes, name in ((left, "before"), (right, "after")):
        axes.update_datalim([low, high])  # both at one scale and place
        axes.autoscale_view()
        axes.set_title(name, fontsize=12)
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
    figure = fitted(11.0, 9.8, *frame([points, *lattices], view))
    axes = figure.subplots()
    draw_surface(axes, points, faces, values, view, label)
    for number, rest in enumerate(lattices):
        draw_lattice(axes, rest, highlighted=dict(highlighted).get(number, ()), view=view)
    axes.set_title(title, fontsize=15)
    return figure


def grid_lines(grid: np.ndarray) -> list[np.ndarray]:
    """The polylines of a grid of control points along its three axes."""
    lines = []
    for axis in range(3):
        if grid.shape[axis] > 1:
            lines += list(np.moveaxis(grid, axis, 2).reshape(-1, grid.shape[axis], grid.shape[3]))
    return lines


def _draw_lines(axes: Axes, flat: np.ndarray, colour: str, width: float, style: Any) -> None:
    """Draw a projected grid of control points."""
    lines = grid_lines(flat)
    colours = _faded(colour, np.array([line[:, 2].mean() for line in lines]))
    drawn = LineCollection(
        [line[:, :2] for line in lines],
        colors=colours,
        linewidths=width,
        linestyles=style,
        zorder=3,
    )
    axes.add_collection(drawn, autolim=False)
    axes.update_datalim(flat[..., :2].reshape(-1, 2))


def _faded(colour: str, depth: np.ndarray) -> np.ndarray:
    """A colour for each depth, paler for the farther ones."""
    nearness = (depth - depth.min()) / (np.ptp(depth) or 1.0)
    faded = np.repeat(to_rgba_array(colour), len(depth), axis=0)
    faded[:, 3] = 0.45 + 0.55 * nearness
    return faded


def _base_colours(
    values: Any, count: int, faces: np.ndarray, colours: str, is_signed: bool
) -> tuple[np.ndarray, ScalarMappable | None]:
    """Each face's colour before shading, and the scale of the values."""
    if values is None:
        return np.broadcast_to(to_rgb(METAL), (len(faces), 3)), None
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


def _normals(projected: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals of the faces in the picture's axes; 0 where a face has no area."""
    a, b, c = (projected[faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(lengths > 0, lengths, 1.0)


def _faces_eye(projected: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Which faces can be seen: of a closed surface those that look at the eye, else all.

    Sorting by depth lets the far side of a thin edge show through; leaving it out does not.
    """
    edges = topology.edges(faces)
    if len(edges.ends) == 0 or np.any(edges.uses != 2) or np.any(edges.forward != 1):
        return np.ones(len(faces), bool)
    middle = projected.mean(axis=0)
    a, b, c = (projected[faces[:, i]] - middle for i in range(3))
    outward = np.sign(np.einsum("ij,ij->", a, np.cross(b, c)))  # of the enclosed volume
    return outward * normals[:, 2] > 0


def _brightness(normals: np.ndarray) -> np.ndarray:
    """Lambert's law on both sides, wrapped around so that no side is black."""
    towards = np.where(normals[:, 2:] < 0, -normals, normals)
    slant = towards @ (LIGHT / np.linalg.norm(LIGHT))
    return 0.38 + 0.7 * (0.5 + 0.5 * slant) ** 1.5


def frame(shapes: Sequence[Any], view: View | str) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of everything, projected."""
    flat = np.concatenate([np.reshape(shape, (-1, 3)) for shape in shapes])
    flat = View.of(view).project(flat)[:, :2]
    return flat.min(axis=0), flat.max(axis=0)


def fitted(width: float, panel: float, low: np.ndarray, high: np.ndarray) -> Figure:
    """An empty figure with panels of a given width [in] and the proportions of what they show."""
    across, up = high - low
    return blank(width, float(np.clip(panel * up / (across or 1.0), 2.5, 10.0)) + 0.7)


def _tidy(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_axis_off()
