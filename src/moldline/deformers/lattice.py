"""A lattice: free-form deformation by a box of control points."""

from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, ArrayLike, Points, Vector, is_concrete
from ..errors import ParameterError
from ..mesh import Cloud
from ..numerics import bspline
from ..numerics.tensor_spline import evaluated
from .base import AbstractBinding, DefinedBinding
from .embedding import EmbeddedBinding, Embedding, Part
from .generators import Align, crossed, exits, spanned, surrounding
from .lattice_kernels import Following
from .net import AXES, AbstractControlNet, grid_lines
from .refinement import Finer, Transfer, counted, cut, elevated, kept

Triple = tuple[int, int, int]
Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
Basis = Literal["b-spline", "bernstein"]


class Lattice(AbstractControlNet):
    """Move what is inside a box by its control points.

    A point moves by the sum of the control points' displacements, each with its tensor-product
    spline weight at the point. Controls are displacements in space [m], in the order of an array
    of shape (nu, nv, nw, 3). The lattice's own axes x, y and z run along its edges.

    Attributes
    ----------
    origin
        The corner of the box where all three indices are zero.
    edges
        Rows are the three edges of the box from there: any directions that span a box.
    inverse
        Takes a place relative to the origin to box coordinates: (x - origin) @ inverse.
    shape
        Control points along each axis. With one, nothing depends on that axis.
    axes
        The spline of each axis.
    outside
        "keep": points outside the box stay. "extend": they move as the nearest end does.
    ends
        "clamped": control points at the Greville positions, so that an affine motion of the
        controls is that motion of the geometry. "blender": Blender's even spacing and end rule.
    frozen
        Which control points never move, whatever the controls say, shape (nu, nv, nw).

    Notes
    -----
    Source: Sederberg and Parry, Free-Form Deformation of Solid Geometric Models, SIGGRAPH 1986
    (Bernstein); Piegl and Tiller, The NURBS Book (B-splines). docs/theory/lattice.md derives it.
    """

    origin: Float[np.ndarray, "3"]
    edges: Float[np.ndarray, "3 3"]
    inverse: Float[np.ndarray, "3 3"]
    axes: tuple[bspline.Axis, bspline.Axis, bspline.Axis]
    frozen: np.ndarray
    shape: Triple = eqx.field(static=True)
    ends: str = eqx.field(static=True)
    outside: str = eqx.field(static=True)
    following: Following = eqx.field(static=True)

    def __init__(
        self,
        origin: Any,
        edges: Any,
        shape: Sequence[int],
        *,
        ends: str = "clamped",
        outside: str = "keep",
        basis: str = "b-spline",
        degree: int | Sequence[int] = 3,
        knots: Sequence[Sequence[float] | None] = (None, None, None),
        freeze: Sequence[str] = (),
    ):
        _check_choice("ends", ends, bspline.Ends)
        _check_choice("outside", outside, bspline.Outside)
        _check_choice("basis", basis, Basis)
        self.shape = counted(shape)
        self.origin, self.edges = _spanning(origin, edges)
        self.inverse = np.linalg.inv(self.edges)
        self.ends, self.outside = ends, outside
        degrees = (degree,) * 3 if isinstance(degree, int) else tuple(degree)
        if basis == "bernstein":
            degrees = tuple(n - 1 for n in self.shape)
        if min(degrees) < 1 and max(self.shape) > 1 and basis == "b-spline":
            raise ParameterError(f"the degree of a lattice is at least 1, got {degree}")
        if ends == "blender" and (degrees != (3, 3, 3) or any(knots)):
            raise ParameterError("ends='blender' is cubic, with even spacing; leave out the rest")
        self.axes = tuple(  # type: ignore[assignment]
            bspline.even(n, outside)
            if ends == "blender"
            else bspline.clamped(n, p, outside, None if k is None else tuple(k))
            for n, p, k in zip(self.shape, degrees, knots, strict=True)
        )
        self.frozen = _frozen(self.shape, self.axes, ends, tuple(freeze))
        self.following = Following(self)

    @classmethod
    def box(cls, low: Any, high: Any, shape: Sequence[int], **options: Any) -> "Lattice":
        """A lattice along the axes of space from one corner to the opposite one [m]."""
        corners = np.asarray(low, float), np.asarray(high, float)
        return cls(*spanned(*corners, counted(shape)), shape, **options)

    @classmethod
    def around(
        cls,
        geometry: Any,
        shape: Sequence[int],
        margin: float | Sequence[float] = 0.02,
        component: str | None = None,
        **options: Any,
    ) -> "Lattice":
        """The box along the axes of space that encloses a geometry, or one component of it.

        `margin` is what it is larger by at each side, as a fraction of the extent; three numbers
        for three axes.
        """
        box = surrounding(geometry, counted(shape), margin, component)
        return cls(*box, shape, **options)

    @classmethod
    def over(
        cls,
        geometry: Any,
        shape: Sequence[int],
        margin: float | Sequence[float] = 0.02,
        component: str | None = None,
        region: ArrayLike | None = None,
        align: str = "axes",
        freeze: Sequence[str] | None = None,
        **options: Any,
    ) -> "Lattice":
        """A local lattice: over one component or a region, along its own axes where one wants.

        It encloses the component's points inside the region, two opposite corners [m] that may be
        infinite, and `margin` more; along the axes of space it ends where the region does. With
        `align` "principal" its axes are the principal ones of what it covers, by area on a
        surface, ordered and turned so that x, y and z are nearest to those of space. Sides that
        mesh edges cross are frozen, so that nothing tears, unless `freeze` says which are.
        """
        counts = counted(shape)
        box = surrounding(geometry, counts, margin, component, region, align)
        sides = crossed(geometry, *box, counts) if freeze is None else tuple(freeze)
        try:
            return cls(*box, counts, freeze=sides, **options)
        except ParameterError as error:
            if freeze is not None or not sides:
                raise
            raise ParameterError(
                f"the mesh crosses the sides {', '.join(sides)} of the box, which are therefore to "
                f"stay: {error}; give more control points, or say which stay with freeze"
            ) from None

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        shape: tuple[int, int, int],
        margin: float | tuple[float, float, float] = 0.02,
        component: str | None = None,
        region: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None,
        align: Align = "axes",
        low: tuple[float, float, float] | None = None,
        high: tuple[float, float, float] | None = None,
        origin: tuple[float, float, float] | None = None,
        edges: tuple[tuple[float, float, float], ...] | None = None,
        ends: bspline.Ends = "clamped",
        outside: bspline.Outside = "keep",
        basis: Basis = "b-spline",
        degree: int | tuple[int, int, int] = 3,
        knots: tuple[tuple[float, ...] | None, ...] = (None, None, None),
        freeze: tuple[Side, ...] | None = None,
    ) -> "Lattice":
        """From a case file: by low and high, by origin and edges, else around or over something."""
        rest: dict[str, Any] = {
            "ends": ends, "outside": outside, "basis": basis, "degree": degree, "knots": knots
        }  # fmt: skip
        if (low is None) != (high is None) or (origin is None) != (edges is None):
            raise ParameterError("low goes with high, and origin with edges")
        if region is not None or align != "axes":
            if origin is not None or low is not None or isinstance(geometry, Cloud):
                raise ParameterError(
                    "region and align go over a geometry's points: not with low and high, origin "
                    "and edges, or where it is streamed"
                )
            place: dict[str, Any] = {
                "margin": margin,
                "component": component,
                "region": region,
                "align": align,
            }
            return cls.over(geometry, shape, **place, freeze=freeze, **rest)
        rest["freeze"] = freeze or ()
        if origin is not None:
            return cls(origin, edges, shape, **rest)
        if low is not None:
            return cls.box(low, high, shape, **rest)
        return cls.around(geometry, shape, margin, component, **rest)

    def refined(self, shape: int | Sequence[int]) -> tuple["Lattice", Transfer]:
        """More control points that give the same shape: the lattice, and the transfer of controls.

        `transfer @ controls` moves every point by the fine lattice as `controls` do by this one.
        `shape` is how many there are to be along each axis, or into how many parts each cell is
        cut. Degrees stay; knots are inserted in the middle of the longest cells. Control points
        that only frozen ones determine are frozen.
        """
        self._check_clamped()
        return self._finer(cut(self.axes, shape, self.outside))

    def elevated(self, degree: int | Sequence[int]) -> tuple["Lattice", Transfer]:
        """The same by polynomials of a higher degree; an axis with one control point keeps it."""
        self._check_clamped()
        return self._finer(elevated(self.axes, degree, self.outside))

    def _check_clamped(self) -> None:
        if self.ends == "blender":
            raise ParameterError(
                "a lattice with ends = 'blender' cannot be refined: by Blender's rule more control "
                "points do not span what fewer do; use ends = 'clamped'"
            )

    def _finer(self, finer: Finer) -> tuple["Lattice", Transfer]:
        transfer, frozen = kept(finer.weights, self.frozen.ravel())
        fine = Lattice(
            self.origin,
            self.edges,
            [axis.size for axis in finer.axes],
            outside=self.outside,
            degree=[max(axis.degree, 1) for axis in finer.axes],
            knots=[axis.interior.tolist() for axis in finer.axes],
        )
        shaped = frozen.reshape(fine.shape)
        return eqx.tree_at(lambda lattice: lattice.frozen, fine, shaped), transfer

    @property
    @override
    def size(self) -> int:
        return 3 * self.shape[0] * self.shape[1] * self.shape[2]

    @property
    @override
    def rest(self) -> Float[np.ndarray, "nu nv nw 3"]:
        """Control points at rest [m]."""
        u, v, w = np.meshgrid(*(axis.rest for axis in self.axes), indexing="ij")
        return self.origin + np.stack([u, v, w], axis=-1) @ self.edges

    @override
    def moves(self, controls: Vector) -> Float[Array, "nu nv nw 3"]:
        """Displacements of the control points [m], zero for the frozen ones."""
        return controls.reshape(*self.shape, 3) * ~self.frozen[..., None]

    @override
    def numbers(self, index: Any) -> Int[np.ndarray, "c"]:
        rows = np.asarray(index, int)
        if rows.ndim != 2 or rows.shape[1] != 3 or np.any((rows < 0) | (rows >= self.shape)):
            raise ParameterError(f"indices (i, j, k) of a lattice of {self.shape}, got {index}")
        return np.ravel_multi_index(tuple(rows.T), self.shape)

    @property
    @override
    def lines(self) -> Int[np.ndarray, "l 2"]:
        return grid_lines(np.arange(self.size // 3).reshape(self.shape))

    @override
    def samples(self, most: int) -> Points:
        side = int(most ** (1 / 3))
        lines = [axis.samples(side) for axis in self.axes]
        u = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
        return self.origin + u @ self.edges

    @override
    def direction(self, axis: str) -> Float[np.ndarray, "3"]:
        """Unit vector of one of the lattice's own axes."""
        edge = self.edges[AXES[axis]]
        return edge / np.linalg.norm(edge)

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return points + self.field(points, self.moves(controls))

    def field(self, points: Points, moves: Float[Array, "nu nv nw 3"]) -> Points:
        """Displacements of points by displacements of the control points [m]."""
        u = (jnp.asarray(points) - self.origin) @ self.inverse
        return evaluated(self.axes, u, moves)

    @override
    def bind(self, points: Points) -> AbstractBinding:
        if not is_concrete(points):
            return DefinedBinding(self, points)
        points = np.asarray(points)
        index = np.arange(self.size // 3).reshape(self.shape)
        part = Part(self.axes, index, (points - self.origin) @ self.inverse, None)

        def field(moves: Array) -> Array:
            return self.field(points, moves.reshape(*self.shape, 3))

        return EmbeddedBinding(self, Embedding(points, [part], self.size // 3, field))

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        return self.following(points, self.moves(controls))[0]

    @override
    def tears(self, points: Points, edges: Array, controls: Vector) -> tuple[Array, Array]:
        """Where a mesh is torn by a box whose outside stays: places (t, 3) and gaps (t,) [m].

        Each mesh edge (pairs of points) that leaves the box is followed to where it leaves; the
        gap is how far the inside moves there.
        """
        if self.outside == "extend":
            return np.empty((0, 3)), np.empty(0)
        points = np.asarray(points)
        u = (points - self.origin) @ self.inverse
        start, end, share, _ = exits(u, edges, np.array(self.shape) == 1)
        places = points[start] + (1 - 1e-9) * share[:, None] * (points[end] - points[start])
        gaps = np.asarray(self(places, jnp.asarray(controls))) - places
        return places, np.linalg.norm(gaps, axis=1)


def _frozen(
    shape: Triple, axes: tuple[bspline.Axis, ...], ends: str, sides: tuple[str, ...]
) -> np.ndarray:
    """The rows next to each named side whose rest makes the motion fade smoothly to nothing."""
    frozen = np.zeros(shape, bool)
    for side in sides:
        _check_choice("freeze", side, Side)
        axis = AXES[side[0]]
        rows = 2 if ends == "blender" else axes[axis].terms - 1
        if rows >= shape[axis]:
            raise ParameterError(
                f"freezing {side} takes {rows} rows, but the lattice has only {shape[axis]} "
                f"along {side[0]}; give it more control points there"
            )
        places = slice(None, rows) if side[1] == "-" else slice(-rows, None)
        frozen[(slice(None),) * axis + (places,)] = True
    if frozen.all():
        raise ParameterError(f"freezing {', '.join(sides)} leaves no free control point in {shape}")
    return frozen


def _spanning(origin: Any, edges: Any) -> tuple[np.ndarray, np.ndarray]:
    """A box's corner and edges, refused where they span none."""
    origin, edges = np.asarray(origin, float), np.asarray(edges, float)
    if origin.shape != (3,) or edges.shape != (3, 3):
        raise ParameterError(
            f"a box needs an origin (3,) and edges (3, 3), got {origin.shape} and {edges.shape}"
        )
    lengths = np.linalg.norm(edges, axis=1, keepdims=True)
    if not np.isfinite(origin).all() or not np.isfinite(lengths).all():
        raise ParameterError(
            f"origin and edges must be finite, got {origin.tolist()} and {edges.tolist()}"
        )
    if np.any(lengths == 0) or abs(np.linalg.det(edges / lengths)) < 1e-9:
        raise ParameterError(f"the edges of a lattice must span a box, got {edges.tolist()}")
    return origin, edges


def _check_choice(name: str, value: str, choices: Any) -> None:
    allowed = choices.__args__
    if value not in allowed:
        raise ParameterError(f"{name} must be one of {', '.join(allowed)}, got {value!r}")
