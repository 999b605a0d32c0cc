"""More control points that give the same shape to begin with: of splines, and of cages."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse
from jaxtyping import Bool, Float, Int

from ..errors import ParameterError
from ..numerics import bspline, knots
from ..numerics.cellwise import Axes

Transfer: TypeAlias = scipy.sparse.csr_array
"""Takes the controls of the coarse deformer to those of the fine one that move points alike."""

LONGEST, MOST = 512, 2**20
"""Control points along an axis, and in all; more are a slip of the pen."""

HIGHEST = 20
"""Degree; higher polynomials are a slip of the pen."""


class Finer(NamedTuple):
    """The splines of a box with more control points.

    Attributes
    ----------
    axes
        Its splines.
    weights
        The values of its control points from the coarse ones', shape (fine, coarse).
    """

    axes: Axes
    weights: scipy.sparse.csr_array


def counted(shape: Sequence[int]) -> tuple[int, int, int]:
    """Three counts of control points, refused where there are too few or too many."""
    if len(shape) != 3 or any(n != int(n) or n < 1 for n in shape):
        raise ParameterError(f"a lattice has three counts of at least 1, got {tuple(shape)}")
    if max(shape) > LONGEST or math.prod(map(int, shape)) > MOST:
        raise ParameterError(
            f"a lattice has at most {LONGEST} points along an axis and {MOST} in all, got "
            f"{tuple(shape)}; give fewer"
        )
    return int(shape[0]), int(shape[1]), int(shape[2])


def cut(axes: Axes, shape: int | Sequence[int], outside: str) -> Finer:
    """By knots inserted: to as many control points along each axis, or each cell into parts."""
    have = tuple(axis.size for axis in axes)
    if isinstance(shape, int):
        counts = counted([axis.size + (shape - 1) * _cells(axis) for axis in axes])
    else:
        counts = counted(shape)
    if any(new < old for new, old in zip(counts, have, strict=True)):
        raise ParameterError(
            f"{have} control points are refined to three counts that are no smaller, or by a "
            f"whole number of parts of each cell, got {shape}"
        )

    def finer(number: int, axis: bspline.Axis) -> tuple[int, np.ndarray]:
        inner = axis.interior
        if axis.size == 1:
            degree = min(3, counts[number] - 1)
            return degree, knots.filled(inner, counts[number] - 1 - degree)
        if isinstance(shape, int):
            return axis.degree, knots.cut(inner, shape)
        return axis.degree, knots.filled(inner, counts[number] - 1 - axis.degree)

    return _finer(axes, finer, outside)


def elevated(axes: Axes, degree: int | Sequence[int], outside: str) -> Finer:
    """By polynomials of a higher degree, no smoother than they are; one control point stays one."""
    given = (degree,) * 3 if isinstance(degree, int) else tuple(degree)
    have = tuple(axis.degree for axis in axes)
    if len(given) != 3 or any(
        old and not old <= new <= HIGHEST for new, old in zip(given, have, strict=True)
    ):
        raise ParameterError(
            f"degrees {have} are elevated to one or three that are no lower, {HIGHEST} at most, "
            f"got {degree}"
        )
    times = [new - old if old else 0 for new, old in zip(given, have, strict=True)]
    counted([axis.size + n * _cells(axis) for axis, n in zip(axes, times, strict=True)])

    def finer(number: int, axis: bspline.Axis) -> tuple[int, np.ndarray]:
        return axis.degree + times[number], knots.raised(axis.interior, times[number])

    return _finer(axes, finer, outside)


def kept(weights: Transfer, frozen: Bool[np.ndarray, "coarse"]) -> tuple[Transfer, np.ndarray]:
    """The transfer of controls, and which fine control points it leaves where they are.

    Those are frozen: what only frozen ones gave is as smooth at the border as it was.
    """
    free = scipy.sparse.diags_array((~frozen).astype(float))
    moving = scipy.sparse.csr_array(weights @ free)
    moving.eliminate_zeros()
    transfer = scipy.sparse.csr_array(scipy.sparse.kron(moving, np.eye(3)))
    return transfer, np.diff(moving.indptr) == 0


def subdivided(
    points: Float[np.ndarray, "n 3"], faces: Sequence[Sequence[int]] | Int[np.ndarray, "m k"]
) -> tuple[Float[np.ndarray, "p 3"], list[tuple[int, ...]], Transfer]:
    """Each triangle of a cage in four, any other polygon in one quadrilateral for each corner.

    New points lie in the middles of edges, and of polygons, so that the surface stays where it is;
    `transfer @ points` are the new points, the old ones first. All new faces turn as the old did.
    """
    loops = [tuple(map(int, face)) for face in faces]
    sides = [
        sorted(side) for loop in loops for side in zip(loop, (*loop[1:], loop[0]), strict=True)
    ]
    edges, number = np.unique(np.array(sides, int).reshape(-1, 2), axis=0, return_inverse=True)
    middles = iter((len(points) + number.ravel()).tolist())
    parents = [*([i] for i in range(len(points))), *edges.tolist()]
    new: list[tuple[int, ...]] = []
    for loop in loops:
        after = [next(middles) for _ in loop]
        before = [after[-1], *after[:-1]]
        if len(loop) == 3:
            new += [*zip(loop, after, before, strict=True), tuple(after)]
        else:
            centre = len(parents)
            parents.append(list(loop))
            new += [(a, b, centre, c) for a, b, c in zip(loop, after, before, strict=True)]
    counts = [len(of) for of in parents]
    shares = 1 / np.repeat(counts, counts)
    entries = (shares, np.concatenate(parents), np.cumsum([0, *counts]))
    transfer = scipy.sparse.csr_array(entries, shape=(len(parents), len(points)))
    return transfer @ points, new, transfer


def _finer(
    axes: Axes, change: Callable[[int, bspline.Axis], tuple[int, np.ndarray]], outside: str
) -> Finer:
    """The axes by what degree and knots become of each, and the weights of all three."""
    found, weights = [], scipy.sparse.csr_array(np.ones((1, 1)))
    for number, axis in enumerate(axes):
        degree, inner = change(number, axis)
        count = len(inner) + degree + 1
        if axis.size == 1 < count and outside != "extend":
            raise ParameterError(
                f"with one control point along {'xyz'[number]} nothing depends on it, in the box "
                "and beyond; more would act in the box only: begin with two, or with "
                'outside = "extend"'
            )
        found.append(bspline.clamped(count, degree, outside, tuple(inner)))
        own = scipy.sparse.csr_array(knots.transfer(axis, found[-1]))
        weights = scipy.sparse.csr_array(scipy.sparse.kron(weights, own))
    u, v, w = found
    return Finer((u, v, w), weights)


def _cells(axis: bspline.Axis) -> int:
    """Inside the box, where anything depends on the axis."""
    return len(axis.starts) - 2 if axis.size > 1 else 0
