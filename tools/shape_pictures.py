"""Draw the pictures of wings, bodies and nacelles that the docs show, into docs/images/."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import moldline as ml
from moldline.plot.figure import blank
from moldline.plot.surfaces import draw_edges, draw_surface
from moldline.plot.view import View

IMAGES = Path(__file__).parent.parent / "docs/images"
INK = "#1d3b53"

WING = {
    "span": [3.0, 9.6, 15.0],
    "chord": [7.6, 6.2, 3.5, 1.7],
    "sweep": [0.52, 0.49, 0.49],
    "dihedral": [0.06, 0.1, 0.12],
    "twist": [0.05, 0.03, 0.0, -0.04],
    "thickness": [0.15, 0.135, 0.115, 0.105],
    "airfoil": "naca 2412",
}
BODY = {
    "length": [1.6, 5.5, 11.0, 24.0, 31.0, 37.0],
    "width": [0, 2.2, 3.8, 4.0, 4.0, 2.4, 0],
    "height": [0, 1.9, 3.9, 4.1, 4.1, 2.8, 0],
    "lift": [-0.7, -0.5, -0.1, 0.0, 0.0, 0.6, 1.1],
    "tail": "pointed",
    "loft": "cubic",
}


def main() -> None:
    """Draw all."""
    for name, figure in {
        "all": together(),
        "wing": tips(),
        "body": ends(),
        "nacelle": rings(),
    }.items():
        ml.plot.save(figure, IMAGES / f"modelers_{name}.png", dpi=85)


def together() -> Any:
    """An aeroplane of six modelers, not united."""
    main_wing = ml.Wing(**WING, sides=2, origin=(12.0, 0.0, -1.2))
    parts = [
        ml.Body(**BODY).geometry,
        main_wing.geometry,
        ml.Wing(
            6.5, [3.9, 1.6], sweep=0.6, dihedral=0.09, sides=2, origin=(31.5, 0.0, 1.1)
        ).geometry,
        ml.Wing(6.0, [5.2, 2.2], sweep=0.7, along="z", origin=(29.5, 0.0, 1.0)).geometry,
    ]
    for side in (1, -1):
        place = (12.0, 5.6 * side, -2.9)
        parts.append(
            ml.Nacelle(
                4.3, [1.25, 1.3, 1.2], 0.95, droop=0.06, airfoil="naca 2410", origin=place
            ).geometry
        )
        parts.append(
            ml.Wing(
                1.2, [4.2, 3.6], sweep=0.75, along="z", thickness=0.08, chordwise=33, spanwise=16,
                origin=(12.9, 5.6 * side, -2.0),
            ).geometry
        )  # fmt: skip
    figure = blank(11, 6.6)
    axes = figure.subplots()
    whole = joined(parts)
    draw_surface(axes, whole.points, whole.faces, view=View(150.0, 32.0))
    return figure


def tips() -> Any:
    """A wing, and its tip closed in three ways."""
    figure = blank(13, 2.6)
    axes = figure.subplots(1, 4)
    options = {"chordwise": 49, "spanwise": 60}
    shape = ml.Wing(**WING, **options).geometry
    draw_surface(axes[0], shape.points, shape.faces)
    titled(axes[0], "four stations, linear loft")
    for panel, tip in zip(axes[1:], ("round", "flat", "closed"), strict=True):
        shape = ml.Wing(**WING, tip=tip, chordwise=33, spanwise=60, clustering=0.8).geometry
        points = np.asarray(shape.points)
        near(panel, shape, (points[:, 1] > 14.6) & (points[:, 0] < 8.75), View(140.0, 25.0))
        titled(panel, f'tip = "{tip}"')
    return figure


def ends() -> Any:
    """Bodies, and how triangles meet at a pole."""
    figure = blank(13, 4.0)
    axes = figure.subplots(1, 4)
    shown = {
        "round nose, pointed tail": ml.Body(**BODY),
        "exponents of 2 and 4": ml.Body(
            [2.0, 8.0, 10.0], width=[0, 2.4, 2.4, 0], height=[0, 2.6, 2.6, 0],
            exponent=[2, 4, 4, 2], lower_exponent=2.0,
        ),
        "flat ends": ml.Body([3.0, 6.0], [1.0, 1.2, 0.6], along=48),
    }  # fmt: skip
    for panel, (title, body) in zip(axes, shown.items(), strict=False):
        shape = body.geometry
        draw_surface(panel, shape.points, shape.faces, view=View(150.0, 25.0))
        titled(panel, title)
    shape = ml.Body([2.0, 6.0], [0, 1.0, 1.0], around=36, along=48).geometry
    near(axes[3], shape, np.asarray(shape.points)[:, 0] < 1.0, View(160.0, 25.0))
    titled(axes[3], "rows grow by six from a pole")
    return figure


def rings() -> Any:
    """Nacelles."""
    figure = blank(13, 3.8)
    axes = figure.subplots(1, 3)
    shown = {
        "one radius": {"radius": 1.2},
        "crown, side and keel": {"radius": [1.2, 1.4, 1.05], "thickness": [0.08, 0.12, 0.14]},
        "droop and scarf": {"radius": 1.2, "droop": 0.12, "scarf": 0.25},
    }
    for panel, (title, said) in zip(axes, shown.items(), strict=True):
        shape = ml.Nacelle(
            4.0, exit_radius=0.95, airfoil="naca 2410", around=192, chordwise=81, **said
        ).geometry
        draw_surface(panel, shape.points, shape.faces, view=View(150.0, 20.0))
        titled(panel, title)
    return figure


def near(axes: Axes, shape: ml.Surface, is_near: np.ndarray, view: View) -> None:
    """The part of a surface whose points are near, with its edges."""
    own = is_near[np.asarray(shape.faces)].all(axis=1)
    used, faces = np.unique(np.asarray(shape.faces)[own], return_inverse=True)
    part = ml.Surface(np.asarray(shape.points)[used], faces.reshape(-1, 3))
    part = ml.Surface(part.points, facing(part, view))
    draw_surface(axes, part.points, part.faces, view=view)
    draw_edges(axes, part.points, seen(part, view), view=view)


def facing(shape: ml.Surface, view: View) -> np.ndarray:
    """Faces that look at the eye."""
    flat = view.project(shape.points)[:, :2]
    a, b, c = (flat[np.asarray(shape.faces)[:, k]] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.asarray(shape.faces)[turn > 0]


def seen(shape: ml.Surface, view: View) -> np.ndarray:
    """Edges of the faces that look at the eye."""
    faces = facing(shape, view)
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def joined(parts: list[ml.Surface]) -> ml.Surface:
    """All of them, side by side."""
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    faces = [np.asarray(part.faces) + start for part, start in zip(parts, starts, strict=False)]
    return ml.Surface(np.concatenate([p.points for p in parts]), np.concatenate(faces))


def titled(axes: Axes, title: str) -> None:
    """In the colour of all."""
    axes.set_title(title, fontsize=12, color=INK)


if __name__ == "__main__":
    main()
