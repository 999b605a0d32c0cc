"""Curved boxes at rest: their splines, the control points they share, and where points lie."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points
from ..errors import GeometryError, ParameterError
from ..mesh import topology
from ..numerics import bspline
from ..numerics.inversion import Locator, Places, Volume
from ..numerics.kernel import AbstractKernel, Arrays, empty
from ..numerics.tensor_spline import evaluated
from .refinement import Finer

SHARED = 1e-8
"""Control points nearer than this, in sizes of all boxes, are one."""

SAME = 1e-12
"""Weights of one control point by two boxes may differ by this."""

SIDES = ("i-", "i+", "j-", "j+", "k-", "k+")


class Box(NamedTuple):
    """One volume: its name, splines, and control points at rest (ni, nj, nk, 3) [m]."""

    name: str
    axes: tuple[bspline.Axis, bspline.Axis, bspline.Axis]
    points: np.ndarray

    @classmethod
    def of(cls, name: str, points: Array, degree: int | Sequence[int] = 3) -> "Box":
        """With clamped ends and even knots; too few control points lower the degree."""
        points = np.ascontiguousarray(points, dtype=float)
        if points.ndim != 4 or points.shape[3] != 3 or not np.isfinite(points).all():
            raise GeometryError(
                f"control volume {name!r} needs finite points of shape (ni, nj, nk, 3), "
                f"got {points.shape}"
            )
        degrees = (degree,) * 3 if isinstance(degree, int) else tuple(degree)
        if len(degrees) != 3 or min(degrees) < 1:
            raise ParameterError(f"degrees of a control volume are at least 1, got {degree}")
        u, v, w = (
            bspline.clamped(n, p, "keep") for n, p in zip(points.shape[:3], degrees, strict=True)
        )
        return cls(name, (u, v, w), points)

    @property
    def acts(self) -> np.ndarray:
        """Which of its coordinates it depends on."""
        return np.array([axis.size > 1 for axis in self.axes])


class Frame:
    """Boxes at rest, the control points that they share, and where points lie in them.

    Compared by identity, as its kernel is.
    """

    def __init__(self, boxes: Sequence[Box]):
        if not boxes:
            raise ParameterError("a control volume needs a box at least")
        self.boxes = tuple(boxes)
        flat = np.concatenate([box.points.reshape(-1, 3) for box in boxes])
        size = float(np.linalg.norm(np.ptp(flat, axis=0)))
        kept, number = topology.weld(flat, SHARED * size)
        self.rest = flat[kept]
        ends = np.cumsum([box.points[..., 0].size for box in boxes])
        self.index = [
            part.reshape(box.points.shape[:3])
            for part, box in zip(np.split(number, ends[:-1]), boxes, strict=True)
        ]
        self.volumes = [Volume.of(box.axes, box.points) for box in boxes]
        for box, volume in zip(boxes, self.volumes, strict=True):
            if volume.size == 0.0:
                raise GeometryError(f"control volume {box.name!r} is a single point")
        self.locate = Locator(self.volumes)
        self.location = Location(self)

    def field(self, places: Float[Array, "n 4"], moves: Float[Array, "m 3"]) -> Points:
        """Displacements of located points by those of the control points, in plain JAX."""
        total = jnp.zeros((len(places), 3))
        for number, (box, index) in enumerate(zip(self.boxes, self.index, strict=True)):
            inside = (places[:, 3] == number)[:, None]
            total = jnp.where(inside, evaluated(box.axes, places[:, :3], moves[index]), total)
        return total

    def finer(self, finer: Sequence[Finer]) -> tuple[list[Box], scipy.sparse.csr_array]:
        """Boxes with more control points, and the weights (fine, coarse) of all that are different.

        Raises ParameterError where a face that two boxes share would no longer be one.
        """
        boxes, rows = [], []
        for box, index, (axes, weights) in zip(self.boxes, self.index, finer, strict=True):
            shape = [axis.size for axis in axes]
            boxes.append(
                Box(box.name, axes, (weights @ box.points.reshape(-1, 3)).reshape(*shape, 3))
            )
            entries = (np.ones(index.size), (np.arange(index.size), index.ravel()))
            chosen = scipy.sparse.csr_array(entries, shape=(index.size, len(self.rest)))
            rows.append(weights @ chosen)
        fine = Frame(boxes)
        number = np.concatenate([index.ravel() for index in fine.index])
        every = scipy.sparse.csr_array(scipy.sparse.vstack(rows))
        kept = every[np.unique(number, return_index=True)[1]]
        own, other = fine.membership(), self.membership()
        # what only control points of a shared face determine must itself be shared
        torn = ((kept != 0).astype(float) @ (1.0 - other) == 0) & (own == 0)
        if torn.any() or abs(every - kept[number]).max() > SAME:
            raise ParameterError(
                "boxes that share a face must be refined alike there: give a whole number of parts "
                "of each cell, and mind that degrees and knots agree on both sides"
            )
        return boxes, kept

    def membership(self) -> Float[np.ndarray, "m boxes"]:
        """1 where a control point belongs to a box."""
        found = np.zeros((len(self.rest), len(self.boxes)))
        for box, index in enumerate(self.index):
            found[index.ravel(), box] = 1.0
        return found

    def sides(self, chosen: Sequence[str]) -> np.ndarray:
        """Which control points lie next to the named sides, as many rows as motion needs to fade.

        A side is `i-`, `i+`, `j-` ... of all boxes, or `name:i-` of one.
        """
        found = np.zeros(len(self.rest), bool)
        for text in chosen:
            name, _, side = text.rpartition(":")
            own = [n for n, box in enumerate(self.boxes) if name in ("", box.name)]
            if side not in SIDES or not own:
                raise ParameterError(
                    f"freeze: got {text!r}, expected one of {', '.join(SIDES)}, with a box's name "
                    f"and a colon before it for one box ({', '.join(b.name for b in self.boxes)})"
                )
            for n in own:
                found[self._rows(n, side)] = True
        if found.all():
            raise ParameterError(f"freezing {', '.join(chosen)} leaves no free control point")
        return found

    def _rows(self, number: int, side: str) -> np.ndarray:
        axis = "ijk".index(side[0])
        index, rows = self.index[number], self.boxes[number].axes[axis].terms - 1
        if rows >= index.shape[axis]:
            raise ParameterError(
                f"freezing {side} of box {self.boxes[number].name!r} takes {rows} rows, but it has "
                f"only {index.shape[axis]}; give it more control points or a lower degree"
            )
        places = slice(None, rows) if side[1] == "-" else slice(-rows, None)
        return index[(slice(None),) * axis + (places,)].ravel()


class Location(AbstractKernel):
    """Points to where they lie: box coordinates and the number of the box (-1: in none), (n, 4).

    It has no plain form but Newton's method itself, which is called back wherever this runs; its
    derivative is the inverse of the box's slopes.
    """

    def __init__(self, frame: Frame):
        self.frame = frame

    @override
    def run(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        return (as_array(self.frame.locate(np.asarray(points))),)

    @override
    def plain(self, points: Array) -> tuple[Array, ...]:
        shape = jax.ShapeDtypeStruct((len(points), 4), jnp.float64)
        return (jax.pure_callback(lambda p: self.run(np.asarray(p))[0], shape, points),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        places, motion = self(*arrays)[0], tangents[0]
        total = jnp.zeros((len(motion), 3))
        for number, box in enumerate(self.frame.boxes):
            inside = places[:, 3] == number
            change = _unmapped(box, places[:, :3], motion, inside)
            total = jnp.where(inside[:, None], change, total)
        return (jnp.concatenate([total, jnp.zeros((len(motion), 1))], axis=1),)


def as_array(places: Places) -> np.ndarray:
    """Box coordinates and numbers in one array, for JAX; 0 for points in no box."""
    out = empty((len(places.volume), 4))
    out[:, :3] = np.where(places.volume[:, None] < 0, 0.0, places.u)
    out[:, 3] = places.volume
    return out


def _unmapped(box: Box, u: Points, motion: Points, inside: Array) -> Points:
    """Change of box coordinates for a motion of points in space."""
    slopes = jnp.stack(
        [
            jax.jvp(lambda u: evaluated(box.axes, u, box.points), (u,), (along,))[1]
            for along in (jnp.zeros_like(u).at[:, i].set(1.0) for i in range(3))
        ],
        axis=2,
    )
    # other boxes' points, and coordinates that nothing depends on, are solved for as they are
    slopes = jnp.where(inside[:, None, None], slopes, jnp.eye(3))
    if box.acts.all():
        return jnp.linalg.solve(slopes, motion[..., None])[..., 0]
    turned = jnp.swapaxes(slopes, 1, 2)
    normal = turned @ slopes + jnp.diag(~box.acts * 1.0)
    return jnp.linalg.solve(normal, turned @ motion[..., None])[..., 0] * box.acts
