"""Loop's subdivision: a smooth, fine surface from a coarse one by a constant sparse matrix."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import numpy as np
import scipy.sparse
from jaxtyping import Int
from typing_extensions import override

from .._types import Array, ArrayLike, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Surface
from ..mesh.surface import check_indices
from ..numerics.sparse_product import SparseProduct
from . import loop_scheme
from .base import AbstractMaking, AbstractModeler

MOST_FACES = 2**28
"""More faces than this have no place in memory."""

NO_PAIRS = np.empty((0, 2), np.int64)


class Subdivision(AbstractModeler):
    """Refine a surface, each triangle into four, towards a smooth limit.

    It has no parameters. Components and data of faces go to the children, data of points (if of
    real numbers) is subdivided as the points are. Open edges become cubic B-splines.

    Attributes
    ----------
    levels
        How often it is refined.
    creases
        Edges that stay sharp, as pairs of points.
    corners
        Points that stay where they are.
    sharp_angle
        An edge whose two faces' normals differ by more than this stays sharp [rad]; in the rest
        geometry. None for no such edges.
    component_borders
        Whether edges between two components stay sharp.

    Notes
    -----
    Source: Loop, Smooth subdivision surfaces based on triangles, 1987, with its own weights;
    borders, creases, corners: Hoppe et al., Piecewise smooth surface reconstruction, 1994.
    """

    levels: int = eqx.field(static=True)
    creases: Int[np.ndarray, "c 2"]
    corners: Int[np.ndarray, "k"]
    sharp_angle: float | None = eqx.field(static=True)
    component_borders: bool = eqx.field(static=True)

    def __init__(
        self,
        levels: int = 1,
        *,
        creases: ArrayLike = None,
        corners: ArrayLike = None,
        sharp_angle: float | None = None,
        component_borders: bool = False,
    ):
        if not 1 <= levels <= 12:
            raise ParameterError(f"levels must be 1 to 12, got {levels}")
        if sharp_angle is not None and not 0 < sharp_angle < np.pi:
            raise ParameterError(
                f"sharp_angle must lie between 0 and pi [rad], got {sharp_angle}; leave it out for "
                "no creases by angle"
            )
        self.levels, self.sharp_angle = levels, sharp_angle
        self.component_borders = component_borders
        self.creases = _pairs(creases)
        self.corners = np.asarray([] if corners is None else corners, np.int64).reshape(-1)

    @property
    @override
    def takes(self) -> tuple[int, float]:
        return (1, 1)

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> "Subdivided":
        surface = _only_surface(geometries)
        faces, count = np.asarray(surface.faces, np.int64), len(surface.points)
        if len(faces) * 4**self.levels > MOST_FACES:
            raise ParameterError(
                f"{len(faces)} faces become {len(faces) * 4**self.levels} after {self.levels} "
                f"levels, more than {MOST_FACES}; give fewer levels"
            )
        creases = np.concatenate([self._given(faces, count), self._found(surface, faces, count)])
        matrix = None
        for _ in range(self.levels):
            refined = loop_scheme.step(faces, count, creases, self.corners)
            matrix = refined.matrix if matrix is None else refined.matrix @ matrix
            faces, creases, count = refined.faces, refined.creases, refined.matrix.shape[0]
        product = SparseProduct(matrix)
        return Subdivided(_refined(surface, faces, product, self.levels), product)

    def _given(self, faces: np.ndarray, count: int) -> np.ndarray:
        check_indices(self.creases, count, "crease")
        check_indices(self.corners[:, None], count, "corner")
        absent = loop_scheme.missing(faces, count, self.creases)
        if len(absent):
            raise GeometryError(
                f"{len(absent)} of {len(self.creases)} creases are no edges of the surface, the "
                f"first joins the points {absent[0, 0]} and {absent[0, 1]}"
            )
        return self.creases

    def _found(self, surface: Surface, faces: np.ndarray, count: int) -> np.ndarray:
        """Creases by angle, and between components."""
        if self.sharp_angle is None and not self.component_borders:
            return NO_PAIRS
        edges = loop_scheme.sharpened(faces, count, NO_PAIRS)
        order = np.argsort(edges.of_sides.ravel(), kind="stable")
        number = edges.of_sides.ravel()[order]
        first = np.flatnonzero(np.append(number[1:] == number[:-1], False))
        first = first[~edges.is_sharp[number[first]]]  # those of two faces
        one, other = order[first] // 3, order[first + 1] // 3
        is_crease = np.zeros(len(first), bool)
        if self.component_borders:
            tags = np.asarray(surface.tags)
            is_crease |= tags[one] != tags[other]
        if self.sharp_angle is not None:
            normals = _normals(np.asarray(surface.points), faces)
            cosine = np.sum(normals[one] * normals[other], axis=1)
            sine = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
            is_crease |= np.arctan2(sine, cosine) > self.sharp_angle
        return edges.ends[number[first][is_crease]]


class Subdivided(AbstractMaking):
    """A surface's refinement; its points are a constant matrix times those of the surface."""

    geometry: Surface
    product: SparseProduct = eqx.field(static=True)

    @override
    def __call__(self, parameters: Vector, *points: Array) -> Array:
        (coarse,) = points
        return self.product(coarse)[0]

    @property
    def matrix(self) -> scipy.sparse.csr_array:
        """Weight of each coarse point in each fine one: the derivative."""
        return self.product.matrix


def _refined(surface: Surface, faces: np.ndarray, product: SparseProduct, levels: int) -> Surface:
    data = {
        name: product.matrix @ np.asarray(value)
        for name, value in surface.point_data.items()
        if np.issubdtype(np.asarray(value).dtype, np.floating)
    }
    return Surface(
        product.run(np.asarray(surface.points))[0],
        faces,
        np.repeat(np.asarray(surface.tags), 4**levels),
        surface.components,
        data,
        {k: np.repeat(np.asarray(v), 4**levels, axis=0) for k, v in surface.face_data.items()},
    )


def _only_surface(geometries: tuple[Geometry, ...]) -> Surface:
    surface = geometries[0] if len(geometries) == 1 else None
    if not isinstance(surface, Surface):
        kinds = ", ".join(type(g).__name__ for g in geometries) or "nothing"
        raise GeometryError(f"subdivision refines one surface, got {kinds}")
    faces = np.asarray(surface.faces)
    bad = np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1))
    if len(bad):
        raise GeometryError(
            f"face {bad[0]} uses a point twice ({faces[bad[0]].tolist()}), so it has no three "
            "edges; remove such faces first"
        )
    return surface


def _pairs(creases: Any) -> np.ndarray:
    found = NO_PAIRS if creases is None or not len(creases) else np.asarray(creases)
    if found.ndim != 2 or found.shape[1] != 2 or np.any(found != np.floor(found)):
        raise ParameterError(f"creases are pairs of points (numbers from 0), got {creases}")
    return found.astype(np.int64)


def _normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.where(length > 0, length, 1.0)
