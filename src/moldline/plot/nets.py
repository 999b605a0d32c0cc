"""Control points and the lines that join them, over pictures."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba_array

from .view import View

RED = "#d62728"
GREY = "#7a7a7a"
DARK = "#22282f"
DASHES = (0, (4, 3))


class Net(NamedTuple):
    """Control points to draw.

    Attributes
    ----------
    lines
        Pairs of control points that lines join, shape (l, 2).
    rest, moved
        Where they are at rest and where the controls put them, shape (m, 3).
    is_hidden
        Whether it is drawn by its lines alone, as what is behind pilots.
    """

    lines: Any
    rest: Any
    moved: Any
    is_hidden: bool = False


def draw_net(
    axes: Axes,
    lines: Any,
    rest: Any,
    moved: Any = None,
    highlighted: Any = (),
    view: View | str = "iso",
    is_hidden: bool = False,
) -> None:
    """Draw a lattice or cage: at rest thin, grey and dashed, moved dark with red control points.

    `rest` and `moved` are control points (m, 3), `lines` pairs of their numbers, `highlighted` the
    numbers of those drawn larger. What is farther from the eye is paler. Of a hidden net only the
    lines are drawn.
    """
    shown = View.of(view)
    flat = shown.project(rest)
    colour, width = (GREY, 0.4) if is_hidden else (DARK, 0.8)
    if moved is None:
        _draw_lines(axes, flat, lines, colour, min(width, 0.5), "-")
    else:
        if not is_hidden:
            _draw_lines(axes, flat, lines, GREY, 0.5, DASHES)
        flat = shown.project(moved)
        _draw_lines(axes, flat, lines, colour, width, "-")
    right, up, depth = flat.T
    if not is_hidden:
        axes.scatter(right, up, s=13, color=_faded(RED, depth), zorder=4, linewidths=0)
    if len(highlighted):
        places = right[highlighted], up[highlighted]
        axes.scatter(*places, s=80, color="#ffd43b", edgecolors=DARK, lw=0.9, zorder=5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_axis_off()


def _draw_lines(
    axes: Axes, flat: np.ndarray, lines: Any, colour: str, width: float, style: Any
) -> None:
    if not len(lines):
        return
    ends = flat[np.asarray(lines)]
    drawn = LineCollection(
        list(ends[..., :2]),
        colors=_faded(colour, ends[..., 2].mean(axis=1)),
        linewidths=width,
        linestyles=style,
        zorder=3,
    )
    axes.add_collection(drawn, autolim=False)
    axes.update_datalim(flat[:, :2])


def _faded(colour: str, depth: np.ndarray) -> np.ndarray:
    """A colour for each depth, paler for the farther ones."""
    nearness = (depth - depth.min(initial=np.inf)) / (np.ptp(depth) or 1.0)
    faded = np.repeat(to_rgba_array(colour), len(depth), axis=0)
    faded[:, 3] = 0.45 + 0.55 * nearness
    return faded
