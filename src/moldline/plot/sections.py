"""Drawn sections: airfoils, and what planes cut from surfaces."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..errors import ParameterError
from ..mesh.slices import axis_number, cut
from .figure import blank
from .nets import DARK, DASHES, GREY, RED, Net


def draw_section(
    axes: Axes,
    points: Any,
    moved: Any = None,
    nets: Sequence[Net] = (),
    plane: str = "xy",
) -> None:
    """Draw a curve: at rest dashed, deformed solid, moved control points red."""
    i, j = (axis_number(name) for name in plane)
    points = np.asarray(points)
    if moved is None:
        axes.plot(points[:, i], points[:, j], color=DARK, lw=1.5)
    else:
        moved = np.asarray(moved)
        axes.plot(points[:, i], points[:, j], ls=DASHES, color=GREY, lw=1.2, label="initial")
        axes.plot(moved[:, i], moved[:, j], color=DARK, lw=1.6, label="deformed")
    for net in nets:
        rest, new = (np.asarray(places)[:, [i, j]] for places in (net.rest, net.moved))
        axes.add_collection(
            LineCollection(rest[net.lines], colors=GREY, linewidths=0.5, linestyles=DASHES)
        )
        colour = GREY if net.is_hidden else RED
        axes.add_collection(LineCollection(new[net.lines], colors=colour, linewidths=0.7))
        if not net.is_hidden:
            axes.scatter(new[:, 0], new[:, 1], s=20, color=RED, zorder=3)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(plane[0])
    axes.set_ylabel(plane[1])
    axes.spines[["top", "right"]].set_visible(False)


def section_picture(
    points: Any, moved: Any, faces: Any, stations: Sequence[float], axis: str = "y"
) -> Figure:
    """Cuts of a surface at several stations, before (dashed) and after."""
    styles = [(points, DASHES, GREY, 1.2, "before"), (moved, "-", DARK, 1.5, "after")]
    figure = blank(10.0, 2.0 * len(stations) + 0.6)
    rows = np.atleast_1d(figure.subplots(len(stations), 1))
    i, j = (k for k in range(3) if k != axis_number(axis))
    for panel, at in zip(rows, stations, strict=True):
        for shape, style, colour, width, _ in styles:
            lines = [line[:, [i, j]] for line in _section(shape, faces, axis, at)]
            panel.add_collection(
                LineCollection(lines, colors=colour, linestyles=style, linewidths=width)
            )
        panel.autoscale_view()
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(f"{axis} = {at:g}", fontsize=11, loc="left")
        panel.set_ylabel("xyz"[j])
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=9, color=GREY)
    rows[-1].set_xlabel("xyz"[i])
    handles = [Line2D([], [], ls=s, color=c, lw=w, label=name) for _, s, c, w, name in styles]
    rows[0].legend(handles=handles, loc="upper right", frameon=False, fontsize=10)
    return figure


def _section(points: Any, faces: Any, axis: str, at: float) -> list[np.ndarray]:
    lines = cut(points, faces, axis, at)
    if not lines:
        along = np.asarray(points)[:, axis_number(axis)]
        raise ParameterError(
            f"there is no section at {axis} = {at:g}; the surface reaches from "
            f"{along.min():g} to {along.max():g}"
        )
    return lines
