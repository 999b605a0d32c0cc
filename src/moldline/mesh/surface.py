"""A triangulated surface."""

from collections.abc import Mapping

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Int

from .._types import Array, ArrayLike, Faces, Points, is_concrete
from ..errors import GeometryError


class Surface(eqx.Module):
    """Points joined by triangles, in named components; it never changes.

    Attributes
    ----------
    points
        Vertices, in the file's unit unless it was read with `units=` (then in m).
    faces
        Three vertices each, counted from 0, counter-clockwise seen from the flow.
    tags
        The component of each face, as an index into `components`.
    components
        Names of the components.
    point_data, face_data
        Named arrays whose first axis runs over the points or the faces.
    """

    points: Points
    faces: Faces
    tags: Int[Array, "m"]
    components: tuple[str, ...] = eqx.field(static=True)
    point_data: dict[str, Array]
    face_data: dict[str, Array]

    def __init__(
        self,
        points: ArrayLike,
        faces: ArrayLike,
        tags: ArrayLike | None = None,
        components: tuple[str, ...] | None = None,
        point_data: Mapping[str, Array] | None = None,
        face_data: Mapping[str, Array] | None = None,
    ):
        self.points = as_points(points)
        self.faces = np.asarray(faces, dtype=np.int32).reshape(-1, 3)
        self.tags = (
            np.zeros(len(self.faces), np.int32) if tags is None else np.asarray(tags, np.int32)
        )
        self.components = ("1",) if components is None else tuple(components)
        self.point_data = dict(point_data or {})
        self.face_data = dict(face_data or {})

    def __check_init__(self) -> None:
        if not is_concrete(self.points):
            return
        check_indices(self.faces, len(self.points), "face")
        check_indices(self.tags[:, None], len(self.components), "component tag")
        if len(self.tags) != len(self.faces):
            raise GeometryError(f"{len(self.faces)} faces need as many tags, got {len(self.tags)}")
        check_lengths(self.point_data, len(self.points), "point")
        check_lengths(self.face_data, len(self.faces), "face")

    def moved(self, points: Array) -> "Surface":
        """The same triangles on other points; data that came with the points stays."""
        return eqx.tree_at(lambda s: s.points, self, points)

    def component(self, name: str) -> Int[Array, "c"]:
        """Indices of the points that faces of a component use, ascending."""
        if name not in self.components:
            raise GeometryError(
                f"no component named {name!r}; the surface has: {', '.join(self.components)}"
            )
        faces = np.asarray(self.faces)[np.asarray(self.tags) == self.components.index(name)]
        return np.unique(faces)


def as_points(points: ArrayLike) -> Array:
    """Float64 and of shape (n, 3); a JAX array stays one, traced ones too."""
    if not is_concrete(points):
        return points
    array = points if isinstance(points, jax.Array) else np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GeometryError(f"points must have the shape (n, 3), got {array.shape}")
    return array


def check_indices(indices: Array, count: int, what: str) -> None:
    """Refuse indices outside 0 .. count - 1."""
    indices = np.asarray(indices)
    if not indices.size or (indices.min() >= 0 and indices.max() < count):
        return
    bad = np.argwhere((indices < 0) | (indices >= count))
    row, value = int(bad[0, 0]), int(indices[tuple(bad[0])])
    raise GeometryError(f"{what} {row} refers to {value}, but there are only {count} (from 0)")


def check_lengths(data: Mapping[str, Array], count: int, what: str) -> None:
    """Refuse data arrays that do not have one entry per point or face."""
    for name, array in data.items():
        if len(array) != count:
            raise GeometryError(f"{what} data {name!r} has {len(array)} entries, expected {count}")
