"""The picture of docs/theory/wetted_surface.md: a junction as it was cut, and cleaned."""

from pathlib import Path
from typing import Any

import bodies
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import moldline as ml
from moldline.modelers.wetted_report import altitudes
from moldline.plot.figure import blank

IMAGES = Path(__file__).parent.parent / "docs/images"
COLOURS = np.array(["#9fc3e0", "#d9dde2", "#d62728"])
LIMIT = 0.05
"""Of a sliver's altitude, in parts of its longest side."""

VIEW = ml.plot.View(azimuth_deg=100.0, elevation_deg=35.0)
LOOK_AT = [(27.8, 3.0, 0.4), (33.6, 3.0, 0.4)]
"""What the picture spans, left to right [m]."""


def main(folder: Path = IMAGES) -> None:
    """Draw it."""
    ml.plot.save(picture(), folder / "wetted_junction.png", dpi=80)


def picture() -> Figure:
    """Two close views of a wing through a body."""
    parts = bodies.supersonic_wing(41, 41), bodies.fuselage(72, 121)
    wing = parts[0].moved(np.asarray(parts[0].points) * [2.0, 2.5, 3.0] + [24.0, 1.0, 0.4])
    figure = blank(9, 6.6)
    axes = figure.subplots(2, 1)
    for place, how in zip(axes, ("keep", "clean"), strict=True):
        made = ml.Union(slivers=how, altitude=LIMIT).bind(
            wing, parts[1], names=["wing", "fuselage"]
        )
        report = made.report
        draw(place, made.geometry)
        what = "as it was cut" if how == "keep" else "cleaned"
        place.set_title(
            f"{what}: {report.slivers} slivers (red) of {report.cut} faces", fontsize=13
        )
    return figure


def draw(axes: Axes, surface: Any) -> None:
    """Faces that look to the eye with their edges, coloured by component, slivers red."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    flat = VIEW.project(points)
    a, b, c = (flat[faces[:, k]] for k in range(3))
    seen = np.flatnonzero(np.cross(b - a, c - a)[:, 2] > 0)
    seen = seen[np.argsort(flat[faces[seen], 2].sum(axis=1))]
    colour = np.asarray(surface.tags).copy()
    colour[altitudes(points, faces) < LIMIT] = 2
    polygons = PolyCollection(
        flat[faces[seen], :2],
        facecolors=COLOURS[colour[seen]],
        edgecolors=np.where(colour[seen] == 2, "#d62728", "#50657a"),
        linewidths=np.where(colour[seen] == 2, 1.2, 0.3),
    )
    axes.add_collection(polygons)
    low, high = VIEW.project(np.array(LOOK_AT))[:, :2]
    axes.set_xlim(*sorted((low[0], high[0])))
    middle = (low[1] + high[1]) / 2
    axes.set_ylim(middle - 1.0, middle + 1.0)
    axes.set_aspect("equal")
    axes.set_axis_off()


if __name__ == "__main__":
    main()
