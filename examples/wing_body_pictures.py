"""Pictures of the wing and the fuselage: parameters, before and after, a derivative."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import moldline as ml
from moldline.modelers.wetting import Wetting
from moldline.plot.figure import blank
from moldline.plot.pictures import nets

BLUE, RED = "#1f5fa8", "#d62728"
WHOLE = ml.plot.View(azimuth_deg=140.0, elevation_deg=30.0)
ABOVE = ml.plot.View(azimuth_deg=165.0, elevation_deg=48.0)
CLOSE = ml.plot.View(azimuth_deg=125.0, elevation_deg=22.0)
CUTS = [2.6, 7.14, 13.0]


def draw(case: ml.Pipeline, design: Any, kept: Any, stations: Any, folder: Path) -> list[str]:
    """All pictures; the names of the files."""
    figures = {
        "wing_body_parameters": parameters(case, kept, stations),
        "wing_body": before_and_after(case, design),
        "wing_body_cuts": cuts(case, design),
        "wing_body_sensitivity": junction(case, design, "radius", 6),
        "wing_body_chart": ml.plot.of_pipeline(case, design, "A wing, a fuselage, what is wetted"),
    }
    for name, figure in figures.items():
        ml.plot.save(figure, folder / f"{name}.png", dpi=78)
    return [f"{name}.png" for name in figures]


def parameters(case: ml.Pipeline, kept: Any, stations: Any) -> Figure:
    """The wing's skeleton, two of the fuselage's radii, and the lattice of the wing's sections."""
    wing, body = case.of("wing"), case.of("fuselage")
    sections, _, _, radii = nets(case, {"dihedral": np.zeros(4)})
    figure = blank(14, 5.2)
    left, middle, right = figure.subplots(1, 3, width_ratios=[1, 1.3, 1])
    ml.plot.draw_surface(left, wing.geometry.points, wing.geometry.faces, view="top")
    plan = ml.planform(wing.geometry, stations)
    for ends in np.stack([plan.leading, plan.trailing], axis=1):
        left.plot(ends[:, 0], ends[:, 1], "o-", color=BLUE, ms=4)
    left.plot(*plan.leading[:, :2].T, color=BLUE, lw=2)
    left.set_title("sweep, dihedral, twist, span: skeleton")
    ml.plot.draw_surface(middle, *mirrored(body.geometry), view=WHOLE)
    shown = radii.rest.reshape(15, 4, 3)[[5, 7]]
    ml.plot.draw_net(middle, radii.lines, radii.rest, view=WHOLE)
    for square in shown:
        flat = WHOLE.project(square[[0, 1, 3, 2, 0]])
        middle.plot(flat[:, 0], flat[:, 1], "o-", color=RED, lw=2, ms=6, zorder=6)
    middle.set_title("fifteen radii, two of them drawn")
    ml.plot.draw_surface(right, wing.geometry.points, wing.geometry.faces, view=ABOVE)
    ml.plot.draw_net(right, sections.lines, sections.rest, view=ABOVE)
    flat = ABOVE.project(sections.rest[kept])
    right.plot(flat[:, 0], flat[:, 1], "o", mfc="white", mec="#22282f", ms=5, zorder=6)
    right.set_title("sections: 46 control points free, 10 (white) kept")
    return figure


def before_and_after(case: ml.Pipeline, design: Any) -> Figure:
    """The wetted surface of the whole configuration, twice."""
    figure = blank(13, 5.5)
    for axes, values, title in zip(
        figure.subplots(1, 2), (None, design), ("before", "after"), strict=True
    ):
        ml.plot.draw_surface(axes, *mirrored(case(values)), view=WHOLE)
        axes.set_title(title, fontsize=12)
    return figure


def cuts(case: ml.Pipeline, design: Any) -> Figure:
    """Sections of the wing, before (dashed) and after."""
    wing = case.of("wing")
    return ml.plot.section_picture(
        np.asarray(wing.points()), np.asarray(wing.points(design)), wing.geometry.faces, CUTS
    )


def junction(case: ml.Pipeline, design: Any, name: str, index: int) -> Figure:
    """By how much the surface moves outwards for one number, near the wing's root."""
    shape = case(design)
    motion = case.sensitivity(design, name)[..., index]
    faces = np.asarray(shape.faces)
    outwards = np.einsum("mi,mi->m", normals(shape), motion[faces].mean(axis=1))
    figure = blank(10, 5.5)
    axes = figure.subplots()
    label = f"outward motion by {name}[{index}] [m per m]"
    ml.plot.draw_surface(axes, shape.points, faces, outwards, CLOSE, label)
    making = case.at(design).branches["configuration"].making
    assert isinstance(making, Wetting)
    zoom(axes, CLOSE.project(np.asarray(shape.points)[making.report.kept :]), 0.3)
    axes.set_title("Across the junction: the fuselage moves, the wing stays", fontsize=13)
    return figure


def zoom(axes: Axes, flat: np.ndarray, room: float) -> None:
    """Show only what is around some places."""
    low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    more = room * (high - low).max()
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(low[0] - more, high[0] + more)
    axes.set_ylim(low[1] - more, high[1] + more)


def normals(surface: ml.Surface) -> np.ndarray:
    """Unit normals of the faces."""
    a, b, c = (np.asarray(surface.points)[surface.faces[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    return areas / np.where(lengths > 0, lengths, 1.0)


def mirrored(surface: ml.Surface) -> tuple[np.ndarray, np.ndarray]:
    """Points and faces of a half model and its mirror image, in pieces."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    both = np.concatenate([points, points * [1.0, -1.0, 1.0]])
    return both, np.concatenate([faces, faces[:, ::-1] + len(points)])
