"""Thickness along rays through a shape."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from typing_extensions import override

from .._types import Array, Points, Scalar, Vector
from ..errors import ParameterError
from ..mesh import Geometry, Section
from .base import AbstractMeasure
from .circularity import spanned
from .directions import Along, Way, direction
from .needs import faces_of, up
from .picks import Point
from .spot import padded
from .thickness import Ends, Several, own_chords, picks_over


class RayThickness(AbstractMeasure):
    """What of each ray lies within a closed shape [m], however the shape moves along it.

    A surface's faces look outwards; the segments of a section lie in the x-y plane and run
    counter-clockwise. A ray that misses the shape has thickness zero.

    Attributes
    ----------
    corners
        Faces, or segments, counted among the points read.
    origins
        A point of each ray; it runs both ways.
    along
        Direction of all rays.
    frame
        Two directions across it; for segments the first lies in their plane.
    rows, weights
        Points of both ends of each ray's chord and their weights; no rays where there is none.

    Notes
    -----
    It has no derivative where a ray meets an edge of the mesh; its value there is that of a ray
    beside it, by the rule of Edelsbrunner and Muecke, Simulation of simplicity, ACM Transactions on
    Graphics 9, 1990.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m c"]
    origins: Float[np.ndarray, "k 3"]
    along: Float[np.ndarray, "3"]
    frame: Float[np.ndarray, "2 3"]
    rows: Int[np.ndarray, "c 2 w"]
    weights: Float[np.ndarray, "c 2 w"]

    def __init__(
        self,
        faces: Array,
        origins: Sequence[Sequence[float]] | Float[np.ndarray, "k 3"],
        along: Along = "z",
        chord: Ends | Sequence[Ends] | None = None,
    ):
        self.origins = np.atleast_2d(np.asarray(origins, float))
        self.along = direction(along)
        self.frame = spanned(self.along)
        cells = np.asarray(faces)
        if cells.shape[1] == 2:
            self.frame = np.stack([np.cross(self.along, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]])
            if abs(self.along[2]) > 1e-12:
                raise ParameterError(f"rays through a section run in its plane, got {along}")
        chords = own_chords(chord, len(self.origins))
        rows, weights = padded([spot for pair in chords for spot in pair])
        self.weights = weights.reshape(-1, 2, weights.shape[1])
        self.reads = np.union1d(cells, rows if chords else [])
        self.reads = self.reads.astype(int)
        self.corners = np.searchsorted(self.reads, cells)
        self.rows = np.searchsorted(self.reads, rows).reshape(self.weights.shape)

    @classmethod
    def over(
        cls,
        geometry: Geometry,
        chord: Several,
        at: Several | None = None,
        component: str | None = None,
        along: Along | None = None,
        relative: bool = False,
    ) -> "RayThickness":
        """Rays at fractions of the chord, for each station y = `at` of a wing in turn."""
        lower, upper, chords = picks_over(geometry, chord, at, component)
        points = np.asarray(geometry.points)
        middles = [(a.of(points) + b.of(points)) / 2 for a, b in zip(lower, upper, strict=True)]
        way = up(geometry) if along is None else along
        cells = _cells(geometry, component)
        return cls(cells, np.array(middles), way, chords if relative else None)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        origins: list[Point] | None = None,
        chord: float | list[float] | None = None,
        at: float | list[float] | None = None,
        component: str | None = None,
        along: Way | None = None,
        relative: bool = False,
    ) -> "RayThickness":
        """Along rays through points, or at fractions of the chord over stations y = `at`.

        Upwards by default; `relative` divides by the length of the chord at the station.
        """
        if chord is not None and origins is None:
            return cls.over(geometry, chord, at, component, along, relative)
        if not origins or chord is not None or at is not None or relative:
            raise ParameterError("a ray's thickness is said by origins, or by chord and at")
        return cls(_cells(geometry, component), origins, up(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.origins)

    @override
    def of(self, places: Points) -> Vector:
        one = self._within_faces if self.corners.shape[1] == 3 else self._within_segments
        thickness = jax.lax.map(lambda origin: one(places - origin), jnp.asarray(self.origins))
        if not len(self.rows):
            return thickness
        ends = jnp.einsum("cew,cewi->cei", self.weights, places[self.rows])
        return thickness / jnp.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    def _within_faces(self, places: Points) -> Scalar:
        """Heights where the ray leaves less those where it enters."""
        flat, heights = places @ self.frame.T, places @ self.along
        sides, lefts = [], []
        for i in range(3):
            start, end = (self.corners[:, (i + k) % 3] for k in (1, 2))
            side, is_left = _side(flat, np.minimum(start, end), np.maximum(start, end))
            turn = np.where(start < end, 1.0, -1.0)
            sides.append(side * turn)
            lefts.append(is_left == (start < end))
        leaves, enters = lefts[0] & lefts[1] & lefts[2], ~(lefts[0] | lefts[1] | lefts[2])
        total = sides[0] + sides[1] + sides[2]
        met = (leaves | enters) & (total != 0)
        weights = jnp.stack(sides, axis=1) / jnp.where(met, total, 1.0)[:, None]
        height = jnp.sum(weights * heights[self.corners], axis=1)
        return jnp.sum(jnp.where(met, jnp.where(leaves, height, -height), 0.0))

    def _within_segments(self, places: Points) -> Scalar:
        beside, heights = places @ self.frame[0], places @ self.along
        start, end = self.corners.T
        leaves = (beside[start] > 0) & (beside[end] <= 0)
        enters = (beside[start] <= 0) & (beside[end] > 0)
        met = leaves | enters
        share = beside[start] / jnp.where(met, beside[start] - beside[end], 1.0)
        height = (1 - share) * heights[start] + share * heights[end]
        return jnp.sum(jnp.where(met, jnp.where(leaves, height, -height), 0.0))


def _side(
    flat: Float[Array, "r 2"], low: Int[np.ndarray, "m"], high: Int[np.ndarray, "m"]
) -> tuple[Float[Array, "m"], Bool[Array, "m"]]:
    """Twice the area that edges span with the ray, and whether the ray is left of each.

    Both faces of an edge ask this way round, so that they agree; ties go to a ray a little beside.
    """
    (x, y), (u, v) = flat[low].T, flat[high].T
    side = x * v - y * u
    tie = jnp.where(v != y, v < y, u > x)
    return side, jnp.where(side == 0, tie, side > 0)


def _cells(geometry: Geometry, component: str | None) -> Array:
    """Faces of a surface, or segments of a section, counter-clockwise."""
    if not isinstance(geometry, Section):
        return np.asarray(faces_of(geometry, component, "a ray's thickness"))
    start, end = geometry.segments.T
    x, y, _ = np.asarray(geometry.points).T
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return np.stack([start, end] if area > 0 else [end, start], axis=1)
