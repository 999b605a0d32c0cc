"""Triangulated surfaces, with the control points around them and colours on them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import CenteredNorm, Normalize, to_rgb
from matplotlib.figure import Figure

from ..errors import ParameterError
from ..mesh import topology
from .figure import blank
from .nets import Net, draw_net
from .view import View

METAL = "#b4c2d2"
LIGHT = np.array([-0.48, 0.62, 0.62])
"""Direction of the light in the picture: right, up, towards the eye."""


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
    nets: Sequence[Net] = (),
    view: View | str = "iso",
    title: str = "",
) -> Figure:
    """A picture of a surface at rest with its control points, and deformed with them moved."""
    shapes = [points, moved, *(places for net in nets for places in (net.rest, net.moved))]
    low, high = frame(shapes, view)
    figure = fitted(14.0, 7.0, low, high)
    left, right = figure.subplots(1, 2)
    draw_surface(left, points, faces, view=view)
    draw_surface(right, moved, faces, view=view)
    for net in nets:
        hidden = net.is_hidden
        draw_net(left, net.lines, net.rest, view=view, is_hidden=hidden)
        draw_net(right, net.lines, net.rest, net.moved, view=view, is_hidden=hidden)
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
    nets: Sequence[Net] = (),
    highlighted: Sequence[Any] = (),
    view: View | str = "iso",
    title: str = "",
) -> Figure:
    """A picture of a surface coloured by a derivative, with its moved control points.

    `highlighted` are, for each net, the numbers of the control points that the colours belong to.
    """
    figure = fitted(11.0, 9.8, *frame([points, *(net.moved for net in nets)], view))
    axes = figure.subplots()
    draw_surface(axes, points, faces, values, view, label)
    for net, chosen in zip(nets, highlighted or [()] * len(nets), strict=True):
        hidden = net.is_hidden
        draw_net(axes, net.lines, net.moved, highlighted=chosen, view=view, is_hidden=hidden)
    axes.set_title(title, fontsize=15)
    return figure


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
