"""Draw the pictures of airfoils and of subdivision that the docs show, into docs/images/."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import moldline as ml
from moldline.modelers.airfoils import airfoil
from moldline.modelers.spacing import NAMES, stations
from moldline.modelers.subdivision import Subdivision
from moldline.plot.figure import blank
from moldline.plot.surfaces import draw_edges, draw_surface
from moldline.plot.view import View

IMAGES = Path(__file__).parent.parent / "docs/images"
INK, FAINT, MARK = "#1d3b53", "#9db4c8", "#c8553d"

FAMILIES: list[tuple[str, Any, str, int, float]] = [
    ("NACA 2412: camber", "2412", "camber", 0, 0.02),
    ("NACA 23012: design lift", "23012", "lift", 0, 0.45),
    ("NACA 0012-64: index of the nose", "0012-64", "nose", 0, 4.0),
    (
        "Kulfan at order 8: one upper coefficient",
        {"airfoil": "kulfan", "fit": "rae 2822"},
        "upper",
        4,
        0.2,
    ),
    ("RAE 2822: thickness", "RAE 2822", "thickness", 0, 0.25),
    ("RAE 104: thickness", "RAE 104", "thickness", 0, 0.25),
    ("NASA SC(2)-0714: camber", "SC(2)-0714", "camber", 0, 1.0),
    ("ONERA D: thickness", "ONERA D", "thickness", 0, 0.25),
]
"""Title, airfoil, parameter and which of its numbers, and how far it is turned to either side."""


def main() -> None:
    """Draw both."""
    ml.plot.save(airfoils(), IMAGES / "airfoils.png", dpi=90)
    ml.plot.save(subdivision(), IMAGES / "subdivision.png", dpi=90)


def airfoils() -> Any:
    """A panel for each family, and one of the spacings."""
    figure = blank(13, 5.2)
    panels = figure.subplots(3, 3).ravel()
    for axes, (title, said, name, which, turn) in zip(panels, FAMILIES, strict=False):
        made = airfoil(said, spacing="half-cosine", points_per_side=161)
        for share, colour, width in ((-1, FAINT, 1.0), (1, MARK, 1.0), (0, INK, 1.8)):
            values = np.array(made.values)
            values[made.parameters[name][which]] += share * turn
            points = np.asarray(made(values))
            loop = np.append(points, points[:1], axis=0)
            axes.plot(loop[:, 0], loop[:, 1], color=colour, lw=width)
        finished(axes, title)
    spacings(panels[-1])
    return figure


def spacings(axes: Axes) -> None:
    """Where 21 points are on a side, by each rule."""
    made = airfoil("2412")
    for row, spacing in enumerate(NAMES):
        place = stations(made, 21, spacing)
        side = np.asarray(made.sides(made.values, place))[0]
        axes.plot(side[:, 0], side[:, 1] - 0.09 * row, "-", color=FAINT, lw=0.8)
        axes.plot(side[:, 0], side[:, 1] - 0.09 * row, ".", color=INK, ms=4)
        axes.text(0.5, 0.04 - 0.09 * row, spacing, ha="center", fontsize=9, color=INK)
    finished(axes, "Spacing, 21 points a side", (-0.29, 0.1))


def finished(axes: Axes, title: str, height: tuple[float, float] = (-0.13, 0.13)) -> None:
    """The same frame for all."""
    axes.set_aspect("equal")
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(*height)
    axes.set_axis_off()
    axes.set_title(title, fontsize=11, color=INK)


def subdivision() -> Any:
    """A coarse pod, refined, and refined with the rims of its ends kept sharp."""
    coarse = pod()
    shapes = [
        ("control surface", coarse),
        ("one level", Subdivision(1).bind(coarse).geometry),
        ("three levels", Subdivision(3).bind(coarse).geometry),
        ("three, sharp by angle", Subdivision(3, sharp_angle=1.0).bind(coarse).geometry),
    ]
    figure = blank(13, 3.6)
    for axes, (title, shape) in zip(figure.subplots(1, 4), shapes, strict=True):
        draw_surface(axes, shape.points, shape.faces)
        if len(shape.faces) < 500:
            draw_edges(axes, shape.points, seen(shape))
        axes.set_title(title, fontsize=12, color=INK)
    return figure


def seen(shape: ml.Surface) -> np.ndarray:
    """Edges of the faces that face the eye of the usual picture."""
    flat = View.of("iso").project(shape.points)[:, :2]
    a, b, c = (flat[np.asarray(shape.faces)[:, k]] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = np.asarray(shape.faces)[turn > 0]
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def pod() -> ml.Surface:
    """Six rings of eight points with flat ends."""
    x = np.array([0.0, 0.8, 1.8, 2.8, 3.6, 4.2])
    radius = np.array([0.5, 0.75, 0.85, 0.8, 0.6, 0.45])
    angle = 2 * np.pi * np.arange(8) / 8
    rings = np.stack(
        np.broadcast_arrays(
            x[:, None], radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
        ),
        axis=-1,
    )
    number = np.arange(48).reshape(6, 8)
    following = np.roll(number, -1, axis=1)
    a, b, c, d = (n.ravel() for n in (number[:-1], number[1:], following[1:], following[:-1]))
    faces = [
        np.stack([a, c, b], axis=1),
        np.stack([a, d, c], axis=1),
        np.stack([np.full(8, 48), following[0], number[0]], axis=1),
        np.stack([np.full(8, 49), number[-1], following[-1]], axis=1),
    ]
    ends = [[x[0], 0, 0], [x[-1], 0, 0]]
    return ml.Surface(np.concatenate([rings.reshape(-1, 3), ends]), np.concatenate(faces))


if __name__ == "__main__":
    main()
