"""A cage: deformation by the vertices of a closed coarse surface around the geometry."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector, is_concrete
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from ..mesh.enclosure import Denser, enclosure
from ..mesh.io import read
from ..mesh.rings import body_rings, wing_rings
from ..numerics.harmonic import Harmonic
from ..numerics.mean_value import MeanValue
from ..numerics.winding import winding, winding_in_jax
from .base import AbstractBinding, DefinedBinding
from .cage_embedding import embedded
from .cage_kernels import Following
from .cage_shape import Shape, shaped
from .embedding import EmbeddedBinding
from .net import AXES, AbstractControlNet
from .refinement import Transfer, kept, subdivided

Coordinates = Literal["harmonic", "mean value"]

Precision = Literal["double", "single"]

BATCH = 2048
"""Points that are looked at together in JAX."""

HALVINGS = 40
"""Of a mesh edge, to find where it leaves the cage."""


class Cage(AbstractControlNet):
    """Move what is inside a closed surface by its vertices.

    A point moves by the sum of the vertices' displacements, each with its weight at the point.
    Weights sum to one and reproduce the point, so that an affine motion of the vertices is that
    motion of the geometry. Controls are displacements in space [m], the axes those of space.

    Attributes
    ----------
    shape
        The cage at rest: its points, polygons and triangles.
    coordinates
        "harmonic": never negative, with little effect far away; all points must lie inside.
        "mean value": a closed form that holds outside too; negative in places where the cage is not
        convex.
    cells
        Harmonic: of the grid over the cage's extent, one count or three; by the cage if None.
    shift
        Harmonic: where the grid lies, 0 to 3; the first that does if None.
    store
        Folder that keeps the weights of points, so that they are found once; None keeps none.
    precision
        Of the weights that bound points keep. "single" halves what is read, and with it the time;
        sums are of doubles, and points then lie within 1e-7 of the largest displacement (measured
        in docs/benchmarks.md). So a binding agrees with the definition to that, not to rounding;
        its derivatives are exactly its own. Points that move have double weights always.
    frozen
        Which vertices never move, whatever the controls say, shape (m,).

    Notes
    -----
    Points that an earlier stage moves out of a harmonic cage stay where that stage took them.
    Source: Joshi et al., Harmonic Coordinates for Character Articulation, SIGGRAPH 2007; Ju,
    Schaefer and Warren, Mean Value Coordinates for Closed Triangular Meshes, SIGGRAPH 2005;
    docs/theory/cage.md derives what is exact.
    """

    shape: Shape = eqx.field(static=True)
    coordinates: str = eqx.field(static=True)
    cells: tuple[int, ...] | None = eqx.field(static=True)
    shift: int | None = eqx.field(static=True)
    store: Path | None = eqx.field(static=True)
    precision: str = eqx.field(static=True)
    frozen: np.ndarray

    def __init__(
        self,
        points: Any,
        faces: Sequence[Sequence[int]] | Array,
        *,
        coordinates: str = "harmonic",
        cells: int | Sequence[int] | None = None,
        shift: int | None = None,
        freeze: Sequence[int] = (),
        store: Path | str | None = None,
        precision: str = "double",
    ):
        _check_one_of("coordinates", coordinates, Coordinates)
        _check_one_of("precision", precision, Precision)
        self.shape = shaped(points, faces)
        self.coordinates = coordinates
        self.cells = None if cells is None else tuple(np.atleast_1d(cells).tolist())
        self.shift = shift
        self.store = None if store is None else Path(store)
        self.precision = precision
        self.frozen = np.zeros(len(self.shape.points), bool)
        self.frozen[self.numbers([[n] for n in freeze]) if len(freeze) else []] = True

    @classmethod
    def of(cls, surface: Surface, **options: Any) -> "Cage":
        """A cage of a surface's points and triangles."""
        return cls(surface.points, surface.faces, **options)

    @classmethod
    def read(cls, path: Path | str, units: str | None = None, **options: Any) -> "Cage":
        """A cage from a file of triangles, in any format of surfaces."""
        surface = read(path, units=units)
        if not isinstance(surface, Surface):
            raise GeometryError(f"{path}: a cage is a surface, got a {type(surface).__name__}")
        try:
            return cls.of(surface, **options)
        except GeometryError as error:
            raise GeometryError(f"{path}: {error}") from None

    @classmethod
    def around(
        cls,
        surface: Surface,
        faces: int = 200,
        offset: float = 0.05,
        *,
        component: str | None = None,
        denser: Sequence[Denser] = (),
        symmetric: bool = False,
        **options: Any,
    ) -> "Cage":
        """An even cage of about `faces` triangles around a surface, or one component of it.

        `offset` is its distance as a part of the diagonal of what it encloses; each of `denser`,
        a place, a radius [m] and a factor, makes edges there as many times shorter. A `symmetric`
        one goes around a half model and its mirror image about y = 0, and is symmetric itself, so
        that `links.mirrored` keeps points on that plane.
        """
        made = enclosure(surface, faces, offset, component, denser, symmetric)
        return cls.of(made.surface, **options)

    @classmethod
    def around_wing(
        cls,
        surface: Surface,
        stations: int | Sequence[float] = 5,
        chordwise: int = 4,
        offset: float = 0.1,
        *,
        component: str | None = None,
        symmetric: bool = False,
        **options: Any,
    ) -> "Cage":
        """Rings around the sections of a half wing, numbered station by station.

        Ring s has the points from 2 s chordwise on: the upper ones along the chord, then the lower
        ones back. `offset` is its distance in chords and in section heights. `symmetric` is as in
        `around`; stations then run from the tip of the mirror image to that of the wing.
        """
        made = wing_rings(surface, stations, chordwise, offset, component, symmetric)
        return cls.of(made.surface, **options)

    @classmethod
    def around_body(
        cls,
        surface: Surface,
        stations: int | Sequence[float] = 7,
        around: int = 8,
        offset: float = 0.1,
        *,
        component: str | None = None,
        symmetric: bool = False,
        **options: Any,
    ) -> "Cage":
        """Rings of `around` points around the sections of a body along x, from the nose on.

        Ring s has the points from s around on, the first above, then towards positive y.
        `symmetric` is as in `around`.
        """
        made = body_rings(surface, stations, around, offset, component, symmetric)
        return cls.of(made.surface, **options)

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        file: Path,
        units: Literal["m", "cm", "mm", "in", "ft"] | None = None,
        coordinates: Coordinates = "harmonic",
        cells: int | tuple[int, int, int] | None = None,
        freeze: tuple[int, ...] = (),
        precision: Precision = "double",
        store: Path = Path(".moldline"),
    ) -> "Cage":
        """From a case file: the cage in a file."""
        options: dict[str, Any] = {"coordinates": coordinates, "cells": cells, "freeze": freeze}
        return cls.read(file, units, store=store, precision=precision, **options)

    @property
    @override
    def size(self) -> int:
        return 3 * len(self.shape.points)

    @property
    @override
    def rest(self) -> Float[np.ndarray, "m 3"]:
        return self.shape.points

    @override
    def moves(self, controls: Vector) -> Float[Array, "m 3"]:
        return controls.reshape(-1, 3) * ~self.frozen[:, None]

    @override
    def numbers(self, index: Any) -> Int[np.ndarray, "c"]:
        """From rows (n,): numbers of the cage's points, from 0."""
        rows, count = np.asarray(index, int), len(self.shape.points)
        if rows.ndim != 2 or rows.shape[1] != 1 or np.any((rows < 0) | (rows >= count)):
            raise ParameterError(f"rows [n] with numbers of a cage of {count} points, got {index}")
        return rows[:, 0]

    @override
    def direction(self, axis: str) -> Float[np.ndarray, "3"]:
        return np.eye(3)[AXES[axis]]

    @property
    @override
    def lines(self) -> Int[np.ndarray, "l 2"]:
        return self.shape.lines

    @cached_property
    def solved(self) -> Harmonic | MeanValue:
        """The coordinates; harmonic ones are solved for here, once."""
        if self.coordinates == "mean value":
            return MeanValue(self.shape.points, self.shape.faces)
        cells = self.cells if self.cells is None or len(self.cells) > 1 else self.cells[0]
        return Harmonic(self.shape.points, self.shape.faces, cells, True, self.shift)

    @cached_property
    def following(self) -> Following:
        """The kernel of a harmonic cage for points that move."""
        return Following(self)

    @override
    def samples(self, most: int) -> Points:
        low, high = self.rest.min(axis=0), self.rest.max(axis=0)
        side = int((2 * most) ** (1 / 3)) + 2
        share = (np.arange(side) + 0.5) / side
        grid = np.stack(np.meshgrid(share, share, share, indexing="ij"), axis=-1).reshape(-1, 3)
        places = low + grid * (high - low)
        return places[winding(places, self.rest, self.shape.faces) > 0.5]

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return self.followed(jnp.asarray(points), self.moves(jnp.asarray(controls)))

    def followed(self, points: Points, moves: Float[Array, "m 3"]) -> Points:
        """The definition by displacements of the vertices; those frozen have none."""
        if not isinstance(self.solved, Harmonic):
            return points + self.solved.evaluated(points) @ moves
        still = jax.lax.stop_gradient(points)
        inside = _inside(still, self.rest, self.shape.faces)[:, None]
        somewhere = jnp.asarray(self.samples(1)[0])  # a slope there is not asked for
        shift = self.solved.evaluated(jnp.where(inside, points, somewhere), moves)
        return points + jnp.where(inside, shift, 0.0)

    @override
    def bind(self, points: Points) -> AbstractBinding:
        """Raises GeometryError where points lie outside a harmonic cage, or touch it."""
        if not is_concrete(points):
            return DefinedBinding(self, points)
        return EmbeddedBinding(self, embedded(self, np.asarray(points), refuse=True))

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        if isinstance(self.solved, Harmonic):
            return self.following(points, self.moves(controls))[0]
        if not is_concrete(points, controls):
            return self(points, controls)
        embedding = embedded(self, np.asarray(points), refuse=False)
        return EmbeddedBinding(self, embedding)(controls)

    @override
    def tears(self, points: Points, edges: Array, controls: Vector) -> tuple[Array, Array]:
        if self.coordinates == "mean value":
            return np.empty((0, 3)), np.empty(0)
        points, edges = np.asarray(points), np.asarray(edges)
        inside = winding(points, self.rest, self.shape.faces) > 0.5
        crossing = inside[edges].any(axis=1) & ~inside[edges].all(axis=1)
        start, end = edges[crossing].T
        start, end = np.where(inside[start], (start, end), (end, start))
        low, high = points[start], points[end]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            still = (winding(middle, self.rest, self.shape.faces) > 0.5)[:, None]
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        gaps = np.asarray(self.follow(low, jnp.asarray(controls))) - low
        return low, np.linalg.norm(gaps, axis=1)

    def refined(self) -> tuple["Cage", Transfer]:
        """A cage of more points, and the matrix that takes controls of this one to its.

        Each triangle is cut in four, so the cage stays where it is, and on the same grid harmonic
        coordinates give the same shape to rounding.
        """
        points, faces, weights = subdivided(self.rest, self.shape.faces)
        cells, shift = None, None
        if isinstance(self.solved, Harmonic):
            cells, shift = self.solved.report.cells, self.solved.report.shift
        transfer, frozen = kept(weights, self.frozen)
        fine = Cage(
            points, faces, coordinates=self.coordinates, cells=cells, shift=shift,
            store=self.store, precision=self.precision,
            freeze=np.flatnonzero(frozen).tolist(),
        )  # fmt: skip
        return fine, transfer


@jax.jit
def _inside(points: Points, corners: Array, faces: Array) -> Bool[Array, "n"]:
    def winds(point: Float[Array, "3"]) -> Float[Array, ""]:
        return winding_in_jax(point[None], corners, faces)[0]

    return jax.lax.map(winds, points, batch_size=BATCH) > 0.5


def _check_one_of(name: str, given: str, names: Any) -> None:
    if given not in names.__args__:
        raise ParameterError(f"{name} must be one of {', '.join(names.__args__)}, got {given!r}")
