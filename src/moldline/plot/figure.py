"""Figures drawn in memory, and how they are saved."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..errors import FileError
from ..mesh.io.files import replacing

FORMATS = (".png", ".svg", ".pdf")


def blank(width: float = 12.0, height: float = 7.0) -> Figure:
    """An empty white figure [in]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path | str, dpi: int = 130) -> None:
    """Write a figure as PNG, SVG or PDF, by the file's name; an old file stays till it is done."""
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise FileError(f"{path}: pictures are written as {', '.join(FORMATS)}")
    with replacing(target) as file:
        figure.savefig(file, format=target.suffix[1:].lower(), dpi=dpi, facecolor="white")
