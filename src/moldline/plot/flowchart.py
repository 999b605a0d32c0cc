"""A picture of a pipeline: what is made, deformed and joined, and what turns it."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from ..mesh import Surface
from ..pipeline.overview import Entry, Overview, Row, overview
from ..pipeline.pipeline import Pipeline, Values
from .figure import blank
from .surfaces import draw_surface

COLUMN, LINE, BOX = 3.6, 2.0, (2.9, 1.3)
"""Distances between boxes, and their size [in]."""

THUMBNAIL = 2.2
"""Width of a surface's picture [in]."""

MADE, GIVEN, DEFORMS = "#dcebd8", "#e8e8e8", "#dbe6f2"
LONGEST = 34
"""Letters that fit into a box."""


def of_pipeline(pipeline: Pipeline, values: Values | None = None, title: str = "") -> Figure:
    """Boxes for stages, left to right, one line for each geometry; small pictures of surfaces."""
    told, here = overview(pipeline), pipeline.at(values)
    depth = _depths(told)
    columns = 1 + max(depth[row.geometry] + len(row.steps) for row in told.rows)
    width, height = COLUMN * columns, LINE * len(told.rows) + 0.5
    figure = blank(width, height)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    axes.text(0.2, height - 0.3, title, fontsize=14, weight="bold")
    ends: dict[str, tuple[float, float]] = {}
    for line, row in enumerate(told.rows):
        y = height - 0.5 - LINE * (line + 0.5)
        ends[row.geometry] = _row(axes, row, depth[row.geometry], y, row.geometry == told.result)
        first = 0.3 + COLUMN * depth[row.geometry], y
        for other in row.of:
            below = ends[other][0] + 0.15 + THUMBNAIL / 2, ends[other][1] - 0.72
            _arrow(axes, below, first, "angle3,angleA=-90,angleB=0")
        shape = here.of(row.geometry)(values)
        if isinstance(shape, Surface):
            _thumbnail(figure, shape, ends[row.geometry], (width, height))
    return figure


def _depths(told: Overview) -> dict[str, int]:
    """The column in which each geometry begins: behind the pictures of what it is made from."""
    found: dict[str, int] = {}
    length = {row.geometry: len(row.steps) for row in told.rows}
    for row in told.rows:
        found[row.geometry] = max((found[name] + length[name] + 1 for name in row.of), default=0)
    return found


def _row(axes: Axes, row: Row, depth: int, y: float, is_result: bool) -> tuple[float, float]:
    """The boxes of a geometry; where its last one ends."""
    for number, step in enumerate(row.steps):
        x = 0.3 + COLUMN * (depth + number)
        colour = DEFORMS if number else (GIVEN if step.name == "given" else MADE)
        _box(axes, (x, y), step, colour)
        if number:
            _arrow(axes, (x - COLUMN + BOX[0], y), (x, y))
    end = 0.3 + COLUMN * (depth + len(row.steps) - 1) + BOX[0]
    name = f"{row.geometry} (result)" if is_result else row.geometry
    axes.text(end + 0.1, y - 0.62, row.size, fontsize=8, color="#555555")
    axes.text(end + 0.1, y + 0.55, name, fontsize=11, weight="bold")
    return end, y


def _box(axes: Axes, place: tuple[float, float], step: Entry, colour: str) -> None:
    x, y = place
    axes.add_patch(
        FancyBboxPatch(
            (x, y - BOX[1] / 2),
            *BOX,
            boxstyle="round,pad=0,rounding_size=0.1",
            facecolor=colour,
            edgecolor="#444444",
        )
    )
    rows = [step.name, step.kind, step.detail, *_wrapped(step.variables)]
    for number, text in enumerate(filter(None, rows)):
        short = text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"
        weight = "normal" if number else "bold"
        axes.text(x + 0.12, y + 0.44 - 0.22 * number, short, fontsize=9, weight=weight)


def _wrapped(variables: tuple[str, ...]) -> list[str]:
    """Variables on two lines at most, the rest counted."""
    lines, left = [""], list(variables)
    while left and len(lines) < 3:
        text = f"{lines[-1]} {left[0]}".strip()
        if len(text) <= LONGEST - 8:
            lines[-1] = text
            left.pop(0)
        elif len(lines) == 2:
            break
        else:
            lines.append("")
            lines[-1] = left.pop(0)
    if left:
        lines[-1] += f" and {len(left)} more"
    return lines


def _arrow(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], curve: str = "arc3"
) -> None:
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=14,
            color="#444444",
            connectionstyle=curve,
            shrinkA=0,
        )
    )


def _thumbnail(
    figure: Figure, surface: Surface, end: tuple[float, float], size: tuple[float, float]
) -> None:
    """The surface at the end of its line."""
    x, y = end
    low = ((x + 0.15) / size[0], (y - 0.5) / size[1])
    axes = figure.add_axes((*low, THUMBNAIL / size[0], 1.0 / size[1]))
    draw_surface(axes, surface.points, surface.faces)
    axes.axis("off")
