"""What is wrong with a surface, drawn over it."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..errors import GeometryError
from ..mesh import Surface
from ..mesh.health import Health, health
from .surfaces import draw_surface, fitted, frame
from .view import View


class _Look(NamedTuple):
    colour: str
    mark: str
    words: str
    """For the legend, after the count."""


_LOOKS = {
    "slivers": _Look("#f0a000", "^", "faces with an angle below 1 degree"),
    "degenerate_faces": _Look("#7a4b00", "v", "faces without area"),
    "folded_faces": _Look("#00a2a2", "p", "faces folded over"),
    "duplicate_faces": _Look("#8c8c00", "h", "faces that repeat an earlier one"),
    "back_to_back_faces": _Look("#4b6a00", "8", "faces back to back with an earlier one"),
    "open_edges": _Look("#d62728", "_", "open edges"),
    "nonmanifold_edges": _Look("#9400d3", "_", "edges of more than two faces"),
    "misoriented_edges": _Look("#0057e7", "_", "edges between faces of different sides"),
    "self_intersections": _Look("#ff00aa", "X", "pairs of faces that cross or overlap"),
    "nonmanifold_vertices": _Look("#5b2be0", "*", "points that join separate fans of faces"),
    "duplicate_vertices": _Look("#008f39", "s", "points where an earlier one lies"),
    "unused_vertices": _Look("#606060", "d", "points of no face"),
    "infinite_vertices": _Look("#000000", "", "points that are not finite, not drawn"),
    "inside_out_pieces": _Look("#000000", "P", "closed pieces that look inward"),
}
"""By the name of the fault; later ones are drawn over earlier ones."""

PALE = 0.45
"""How much colour the surface itself keeps."""

MOST_MARKED = 200
"""Places of a kind that get a mark; of more, so many are taken evenly."""


def of_faults(
    surface: Surface, found: Health | None = None, view: View | str = "iso", title: str = ""
) -> Figure:
    """A pale surface with all its faults in strong colours, also those on its far side.

    The legend counts each kind. `found` is what `mesh.health.health` gave, if that is known.
    """
    found = health(surface) if found is None else found
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    is_finite = np.isfinite(points).all(axis=1)
    if not is_finite.any():
        raise GeometryError(f"none of {len(points)} points has finite coordinates to draw it at")
    points = np.where(is_finite[:, None], points, points[is_finite][0])
    shown = View.of(view)
    figure = fitted(11.0, 9.8, *frame([points], shown))
    axes = figure.subplots()
    draw_surface(axes, points, faces[is_finite[faces].all(axis=1)], view=shown)
    for polygons in axes.collections:
        polygons.set(color=1 - PALE * (1 - np.asarray(polygons.get_facecolor())))
    told = [name for name in _LOOKS if len(getattr(found, name))]
    for name in told:
        _draw(axes, name, getattr(found, name), shown.project(points), faces)
        _mark(axes, name, shown.project(found.places[name]))
    if told:
        legend = [_key(name, len(getattr(found, name))) for name in told]
        figure.legend(handles=legend, loc="outside lower center", ncols=2, frameon=False)
    verdict = "nothing wrong was found" if found.is_sound else ""
    axes.set_title(": ".join(filter(None, [title, verdict])), fontsize=15)
    return figure


def _draw(
    axes: Axes, name: str, numbers: np.ndarray, projected: np.ndarray, faces: np.ndarray
) -> None:
    """Draw edges as lines and faces in outline; points and pieces are only marked."""
    colour = _LOOKS[name].colour
    flat = projected[:, :2]
    if name.endswith("edges"):
        lines = LineCollection(flat[numbers], colors=colour, linewidths=1.8, zorder=4)
        axes.add_collection(lines, autolim=False)
    elif not name.endswith(("vertices", "pieces")):
        corners = flat[faces[np.unique(numbers)]]
        style: dict[str, Any] = {
            "facecolors": (colour, 0.25),
            "edgecolors": colour,
            "linewidths": 0.8,
        }
        axes.add_collection(PolyCollection(corners, zorder=3, **style), autolim=False)


def _mark(axes: Axes, name: str, places: np.ndarray) -> None:
    look = _LOOKS[name]
    if name.endswith("edges") or not look.mark:
        return
    chosen = np.linspace(0, len(places) - 1, min(len(places), MOST_MARKED)).astype(int)
    right, up = places[chosen, :2].T
    size = 42 if len(places) < 40 else 18
    axes.scatter(
        right, up, s=size, marker=look.mark, color=look.colour, lw=0.4, ec="white", zorder=5
    )


def _key(name: str, count: int) -> Line2D:
    look = _LOOKS[name]
    line = "-" if name.endswith("edges") else ""
    mark = "" if line else look.mark
    label = f"{count} {look.words}"
    return Line2D([], [], color=look.colour, marker=mark, ms=8, ls=line, lw=2.5, label=label)
