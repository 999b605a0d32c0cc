"""Airfoils through given coordinates: published tables and files."""

import re
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from typing_extensions import override

from .._types import Array, ArrayLike, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Section
from ..mesh.io import dat
from .airfoil import AbstractAirfoil, Edge, Outline, check_edge, outlined
from .spacing import Spacing, root

FOLDER = Path(__file__).parent / "data"

ORIGIN = 1e-5
"""A nose that is found this near to the origin, in chords, is the origin."""


class Tabulated(AbstractAirfoil):
    """A smooth curve through the points of a table, with factors on its thickness and camber.

    Parameters are "thickness" and "camber", 1 for the table itself. Half the thickness and the
    height of the camber line are taken between the two sides at the same station.

    Attributes
    ----------
    breaks, pieces
        A cubic spline of y by the root of the station, negative on the lower side, so that one
        smooth curve runs round the nose.
    ends
        Where the upper and the lower side end, in chords.
    label
        What the section is called.
    has_base
        Whether its two sides end in two points.
    wedge
        Half the height of a blunt trailing edge that a wedge takes away.
    outline
        How it is drawn.

    Notes
    -----
    The curve goes through every point of the table. The nose, the point with the least x, goes to
    the origin, and the longer side's length becomes 1; nothing is turned.
    """

    breaks: Float[np.ndarray, "b"]
    pieces: Float[np.ndarray, "4 p"]
    ends: Float[np.ndarray, "2"]
    label: str = eqx.field(static=True)
    wedge: float = eqx.field(static=True)
    has_base: bool = eqx.field(static=True)
    outline: Outline

    def __init__(
        self,
        points: Section | ArrayLike,
        *,
        name: str | None = None,
        trailing_edge: Edge | None = None,
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ):
        given = points.points if isinstance(points, Section) else points
        own = points.name if isinstance(points, Section) else "section"
        self.label = own if name is None else name
        upper, lower = two_sides(np.asarray(given, float), self.label)
        self.ends = np.array([upper[-1, 0], lower[-1, 0]])
        near, far = -np.sqrt(lower[:0:-1, 0] / lower[-1, 0]), np.sqrt(upper[:, 0] / upper[-1, 0])
        self.breaks = np.concatenate([near, far])
        spline = CubicSpline(self.breaks, np.concatenate([lower[:0:-1, 1], upper[:, 1]]))
        self.pieces = spline.c
        gap = upper[-1] - lower[-1]
        self.has_base, self.wedge = _edge(trailing_edge, gap, self.label)
        self.outline = outlined(self, points_per_side, spacing, base_points, chord)

    @classmethod
    @override
    def build(
        cls,
        folder: Path,
        *,
        section: str,
        trailing_edge: Edge | None = None,
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ) -> "Tabulated":
        """From a case file: `section` is a published table's name or a file of coordinates."""
        return cls(
            found(section, folder),
            trailing_edge=trailing_edge,
            points_per_side=points_per_side,
            spacing=spacing,
            base_points=base_points,
            chord=chord,
        )

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return {"thickness": np.array([0]), "camber": np.array([1])}

    @property
    @override
    def values(self) -> Vector:
        return np.ones(2)

    @property
    @override
    def is_blunt(self) -> bool:
        return self.has_base

    @property
    @override
    def name(self) -> str:
        return self.label

    @override
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        thickness, camber = parameters
        x = jnp.asarray(stations)
        upper = self._curve(root(x)) - self.wedge * x
        lower = self._curve(-root(x)) + self.wedge * x
        if not self.has_base:  # rounding leaves a gap
            upper = jnp.where(x < 1, upper, (upper + lower) / 2)
            lower = jnp.where(x < 1, lower, upper)
        line, half = (upper + lower) / 2, (upper - lower) / 2
        # both factors 1 leave every bit, which the mean and the difference need not
        shift = (camber - 1) * line
        growth = (thickness - 1) * half
        heights = jnp.stack([upper + shift + growth, lower + shift - growth])
        return jnp.stack([self.ends[:, None] * x, heights], axis=2)

    def _curve(self, place: Array) -> Array:
        piece = jnp.searchsorted(self.breaks[1:-1], place, side="right")
        c3, c2, c1, c0 = jnp.asarray(self.pieces)[:, piece]
        t = place - jnp.asarray(self.breaks)[piece]
        return c0 + t * (c1 + t * (c2 + t * c3))


def tables() -> dict[str, Path]:
    """Files of the published tables by the names of their sections, such as "RAE 2822"."""
    return {_title(path): path for path in sorted(FOLDER.glob("*.csv"))}


def table(name: str) -> Section | None:
    """The published section of a name, read without regard to case, spaces, dashes and "NASA"."""
    for title, path in tables().items():
        if plain(title) == plain(name):
            x, upper, lower = np.loadtxt(path, delimiter=",", skiprows=0, comments=("#", "x")).T
            loop = np.concatenate([np.stack([x, upper], 1)[::-1], np.stack([x, lower], 1)[1:]])
            return Section(np.column_stack([loop, np.zeros(len(loop))]), title)
    return None


def found(section: str, folder: Path) -> Section:
    """A published table, or else a file of coordinates."""
    if section.lower().endswith(dat.SUFFIXES):
        return dat.read(folder / section)
    known = table(section)
    if known is None:
        raise ParameterError(
            f"no table is called {section!r}, and files of coordinates end in .dat; tables: "
            f"{', '.join(tables())}"
        )
    return known


def plain(name: str) -> str:
    """A name's letters and digits; the wing M6 stands for its section."""
    short = re.sub(r"[^a-z0-9]", "", name.lower()).removeprefix("nasa")
    return "onerad" if short == "oneram6" else short


def two_sides(points: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """The upper and the lower side (x, y) from the nose, which is moved to the origin; chord 1."""
    if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) < 7:
        raise GeometryError(
            f"{name}: coordinates of an airfoil are rows of x and y, seven at least, "
            f"got an array of shape {points.shape}"
        )
    points = _with_nose(points[np.append(True, (points[1:] != points[:-1]).any(axis=1)), :2])
    nose = int(np.argmin(points[:, 0]))
    if not 2 < nose < len(points) - 3:
        raise GeometryError(
            f"{name}: point {nose} of {len(points)} has the least x; coordinates run from the "
            "trailing edge over the upper side to the nose and back below"
        )
    upper, lower = points[nose::-1] - points[nose], points[nose:] - points[nose]
    for side, where in ((upper, "upper"), (lower, "lower")):
        bad = np.flatnonzero(np.diff(side[:, 0]) <= 0)
        if len(bad):
            x, y = side[bad[0] + 1] + points[nose]
            raise GeometryError(
                f"{name}: x does not grow from the nose to the trailing edge on the {where} side "
                f"at ({x:g}, {y:g}); leave that point out"
            )
    if lower[len(lower) // 2, 1] > upper[len(upper) // 2, 1]:
        raise GeometryError(f"{name}: the first side lies below the second; give them in turn")
    chord = max(upper[-1, 0], lower[-1, 0])
    return upper / chord, lower / chord


def _with_nose(points: np.ndarray) -> np.ndarray:
    """The points with a nose put between two that share the least x: a parabola's vertex."""
    first = int(np.argmin(points[:, 0]))
    if not 0 < first < len(points) - 2 or points[first + 1, 0] != points[first, 0]:
        return points
    x, y = points[first - 1 : first + 3].T
    bend, tilt, start = np.polyfit(y, x, 2)
    vertex = np.array([start - tilt**2 / (4 * bend), -tilt / (2 * bend)])
    is_origin = bool(np.abs(vertex).max() < ORIGIN * np.ptp(points[:, 0]))
    return np.insert(points, first + 1, 0.0 if is_origin else vertex, axis=0)


def _edge(trailing_edge: str | None, gap: np.ndarray, name: str) -> tuple[bool, float]:
    """Whether there is a base, and what half of it a wedge takes away."""
    is_open = bool(np.abs(gap).max() > 1e-9)
    if trailing_edge is not None:
        check_edge(trailing_edge)
    if trailing_edge == "blunt" and not is_open:
        raise ParameterError(f"{name}: its two sides end in one point, so there is no blunt edge")
    if trailing_edge == "sharp" and is_open:
        if abs(gap[0]) > 1e-9:
            raise ParameterError(
                f"{name}: its sides end {abs(gap[0]):g} of chord apart in x; a wedge cannot "
                "close it, leave trailing_edge out"
            )
        return False, float(gap[1]) / 2
    return is_open, 0.0


def _title(path: Path) -> str:
    with path.open() as file:
        return file.readline().removeprefix("#").strip()
