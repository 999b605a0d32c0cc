"""Boxes that enclose a geometry: along the axes of space or its own, and along a wing."""

import itertools
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import scipy.sparse
from jaxtyping import Float, Int
from scipy.interpolate import BSpline

from .._types import Array, ArrayLike
from ..errors import GeometryError, ParameterError
from ..mesh.joined import joined_points
from ..mesh.planform import Planform
from ..numerics import bspline

Align = Literal["axes", "principal"]
Triple = tuple[int, int, int]
Placed = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]
"""A box: its corner, and its three edges from there."""

EVEN = 1e-9
"""Moments this close in proportion count as equal: space's own axes then decide."""

LEAST_CHORD = 0.1
"""Chord of a wing's box, in largest ones: beyond a pointed tip it still has an inside."""

LEAST_HEIGHT = 0.01
"""Height of a wing's box to each side of its chords, in chords."""

ON_PLANE = 1e-6
"""A half wing that begins this near to y = 0, in spans, begins there."""


def surrounding(
    geometry: Any,
    shape: Triple,
    margin: float | Sequence[float],
    component: str | None = None,
    region: ArrayLike | None = None,
    align: str = "axes",
) -> Placed:
    """The box of what a geometry has in a component and a region, larger by a margin."""
    points = np.asarray(getattr(geometry, "points", geometry), float)
    low, high = _corners(region)
    chosen = _covered(geometry, points, component, low, high)
    if align not in ("axes", "principal"):
        raise ParameterError(f"align must be one of axes, principal, got {align!r}")
    with np.errstate(over="ignore", invalid="ignore"):  # refused later with what came out
        if align == "axes":
            ends = _spread(points[chosen], margin)
            return spanned(np.maximum(ends[0], low), np.minimum(ends[1], high), shape)
        axes = principal(_pieces(geometry, points, chosen))
        ends = _spread(points[chosen] @ axes.T, margin)
        # turning there and back costs some roundings of the largest coordinate
        room = 16 * np.finfo(float).eps * np.abs(points[chosen]).max()
        flat = ends[1] - ends[0] <= 4 * room
        corner, edges = spanned(
            np.where(flat, ends[0], ends[0] - room), np.where(flat, ends[0], ends[1] + room), shape
        )
        return corner @ axes, edges @ axes


def spanned(low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], shape: Triple) -> Placed:
    """The box from one corner to the opposite one, refused where it is flat."""
    extent = high - low
    flat = (extent <= 0) & (np.array(shape) > 1)
    if np.any(flat):
        raise GeometryError(
            f"a lattice from {low.tolist()} to {high.tolist()} is flat along "
            f"{'xyz'[int(np.argmax(flat))]}; give that axis one control point"
        )
    return low, np.diag(np.where(extent > 0, extent, 1.0))


def principal(corners: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "3 3"]:
    """Principal axes, as rows, of some triangles by area; of their points where none has any.

    They turn right-handed, and their order and signs are those nearest to the axes of space. So
    are those across a body of revolution, where any do.
    """
    size = float(np.ptp(corners, axis=(0, 1)).max())
    a, b, c = np.moveaxis((corners - corners[0, 0]) / (size or 1.0), 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    share = area / area.sum() if area.any() else np.full(len(area), 1 / len(area))
    middle = share @ (a + b + c) / 3
    a, b, c = a - middle, b - middle, c - middle
    moments = sum((share[:, None] * x).T @ x for x in (a, b, c, a + b + c))
    sizes, axes = np.linalg.eigh(moments)
    group = np.cumsum([0, *(np.diff(sizes) > EVEN * sizes.sum())])
    among = np.where(group[:, None] == group, axes.T @ np.diag([2.0, 1.0, 0.0]) @ axes, 0.0)
    own = (axes @ np.linalg.eigh(among + np.diag(10.0 * group))[1]).T
    orders = itertools.permutations(range(3))
    turns = itertools.product(orders, itertools.product((1, -1), repeat=3))
    turned = [np.array(signs)[:, None] * own[list(order)] for order, signs in turns]
    return max((axes for axes in turned if np.linalg.det(axes) > 0), key=np.trace)


def exits(
    u: Float[Array, "n 3"], edges: Int[Array, "e 2"], free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where mesh edges leave the unit box: the end inside, the one outside, share, and side.

    `share` is how much of the edge is inside; sides are numbered x-, x+, y-, y+, z-, z+. Nothing
    ends along the axes that are `free`.
    """
    room = bspline.ROUNDING
    inside = np.all(((u >= -room) & (u <= 1 + room)) | free, axis=1)
    start, end = np.asarray(edges).T
    start, end = np.where(inside[start], (start, end), (end, start))
    crossing = inside[start] & ~inside[end]
    start, end = start[crossing], end[crossing]
    step = np.where(free, 0.0, u[end] - u[start])
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step > 0, (1 - u[start]) / step, -u[start] / step)
    reach = np.where(step == 0, np.inf, reach)
    axis = reach.argmin(axis=1)
    row = np.arange(len(start))
    return start, end, reach[row, axis], 2 * axis + (step[row, axis] > 0)


def crossed(geometry: Any, corner: Array, edges: Array, shape: Triple) -> tuple[str, ...]:
    """The sides of a box that edges of a mesh cross; points that nothing joins cross none."""
    if not hasattr(geometry, "points"):
        return ()
    u = (np.asarray(geometry.points) - corner) @ np.linalg.inv(edges)
    sides = exits(u, joined_points(geometry), np.array(shape) == 1)[3]
    return tuple("xyz"[side // 2] + "-+"[side % 2] for side in np.unique(sides).tolist())


def along_wing(
    points: Float[np.ndarray, "n 3"],
    plan: Planform,
    shape: Sequence[int],
    margin: float | Sequence[float],
    degrees: Sequence[int],
    stations: Sequence[float] | None = None,
) -> Float[np.ndarray, "ni nj nk 3"]:
    """Control points of a swept, tapered, twisted box that encloses a wing.

    Its rows at the stations along y run along the chords there. Splines do not go through their
    control points: where a point of the wing would be outside, the rows that act on it are moved
    out by as much, which brings it in, as weights sum to one.
    """
    rooms = _margins(margin)
    x, y, z = points.T
    axis = bspline.clamped(shape[1], degrees[1], "keep")
    rows = _rows(y, axis, rooms[1], stations)
    weights = _weights(axis, rows, y)
    front, front_z, back, back_z, low, high = _at(plan, rows)
    chord = np.maximum(back - front, LEAST_CHORD * plan.chord.max())
    slope, back = (back_z - front_z) / chord, front + chord
    ahead = rooms[0] * chord + _shortfall(weights, weights @ front - x)
    behind = rooms[0] * chord + _shortfall(weights, x - weights @ back)
    front, back = front - ahead, back + behind
    front_z, back_z = front_z - slope * ahead, front_z + slope * (chord + behind)
    share = (x - weights @ front) / (weights @ (back - front))
    above = z - (1 - share) * (weights @ front_z) - share * (weights @ back_z)
    low, high = np.minimum(low, -LEAST_HEIGHT * chord), np.maximum(high, LEAST_HEIGHT * chord)
    low = low - _shortfall(weights, weights @ low - above)
    high = high + _shortfall(weights, above - weights @ high)
    room = rooms[2] * (high - low)
    u, w = (bspline.clamped(shape[i], degrees[i], "keep").rest for i in (0, 2))
    box = np.empty((*shape, 3))
    box[..., 0] = (front + u[:, None] * (back - front))[..., None]
    box[..., 1] = rows[:, None]
    box[..., 2] = (front_z + u[:, None] * (back_z - front_z))[..., None]
    box[..., 2] += (low - room)[:, None] + w * (high - low + 2 * room)[:, None]
    return box


def _at(plan: Planform, rows: np.ndarray) -> list[np.ndarray]:
    """Of a wing at rows: x and z of its edges, and how far it reaches below and above its chords.

    Beyond the planform's ends, as there.
    """
    (x, _, z), (x_aft, _, z_aft) = plan.leading.T, plan.trailing.T
    low = np.minimum(plan.low - np.minimum(z, z_aft), 0.0)
    high = np.maximum(plan.high - np.maximum(z, z_aft), 0.0)
    own = np.abs(rows) if plan.stations.max() > 0 else -rows
    return [np.interp(own, np.abs(plan.stations), v) for v in (x, z, x_aft, z_aft, low, high)]


def _corners(region: ArrayLike | None) -> tuple[np.ndarray, np.ndarray]:
    """Of a region, refused where it has no inside; all of space where there is none."""
    if region is None:
        return np.full(3, -np.inf), np.full(3, np.inf)
    corners = np.array(region, float) if [*map(len, region)] == [3, 3] else np.zeros((2, 3))
    if not np.all(corners[0] < corners[1]):
        raise ParameterError(
            f"a region is two corners (x, y, z), the first below the second, got {region}"
        )
    return corners[0], corners[1]


def _covered(
    geometry: Any, points: np.ndarray, component: str | None, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Numbers of a geometry's points in a component and a region: one at least, all finite."""
    chosen = np.arange(len(points))
    if component is not None:
        if not hasattr(geometry, "component"):
            raise ParameterError(
                f"component = {component!r}: a {type(geometry).__name__} has no components "
                "(one that is streamed neither); give low and high instead"
            )
        chosen = geometry.component(component)
    bad = chosen[~np.isfinite(points[chosen]).all(axis=1)]
    if len(bad):
        raise GeometryError(f"point {bad[0]} at {points[bad[0]].tolist()} is in no box: not finite")
    inside = np.all((points[chosen] >= low) & (points[chosen] <= high), axis=1)
    if not inside.any():
        spans = f"; they span {_box(points[chosen])}" if len(chosen) else ""
        raise GeometryError(
            f"none of {len(chosen)} points lies in the region from {low.tolist()} to "
            f"{high.tolist()}{spans}"
        )
    return chosen[inside]


def _box(points: np.ndarray) -> str:
    return f"{points.min(axis=0).tolist()} to {points.max(axis=0).tolist()}"


def _pieces(geometry: Any, points: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Corners (m, 3, 3) of a geometry's faces among chosen points, or these points themselves."""
    faces = np.asarray(getattr(geometry, "faces", np.empty((0, 3), int)))
    is_chosen = np.zeros(len(points), bool)
    is_chosen[chosen] = True
    corners = points[faces[is_chosen[faces].all(axis=1)]]
    return corners if len(corners) else np.repeat(points[chosen, None], 3, axis=1)


def _margins(margin: float | Sequence[float]) -> np.ndarray:
    margins = np.array(margin, float)
    if margins.shape not in ((), (3,)) or not np.all(margins >= 0):
        raise ParameterError(f"margin is one fraction or three, of at least 0, got {margin}")
    return np.broadcast_to(margins, 3)


def _spread(points: np.ndarray, margin: float | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    low, high = points.min(axis=0), points.max(axis=0)
    room = _margins(margin) * (high - low)
    return low - room, high + room


def _rows(
    y: np.ndarray, axis: bspline.Axis, room: float, stations: Sequence[float] | None
) -> np.ndarray:
    """Where along y the rows of a wing's box are: at the stations, else at Greville's places."""
    low, high = float(y.min()), float(y.max())
    span = high - low
    if stations is None:
        ends = low - room * span, high + room * span
        if abs(low) <= ON_PLANE * span:
            ends = min(low, 0.0), ends[1]
        if abs(high) <= ON_PLANE * span:
            ends = ends[0], max(high, 0.0)
        return ends[0] + axis.rest * (ends[1] - ends[0])
    rows = np.array(stations, float)
    if len(rows) != axis.size or np.any(np.diff(rows) <= 0) or rows[0] > low or rows[-1] < high:
        raise ParameterError(
            f"stations of a wing's box are ascending places along y, as many as its {axis.size} "
            f"spanwise control points, that take in {low:.6g}..{high:.6g}, got {list(stations)}"
        )
    return rows


def _weights(axis: bspline.Axis, rows: np.ndarray, y: np.ndarray) -> scipy.sparse.csr_array:
    """Weights (n, rows) of the rows at places along y: the spline of the rows, inverted."""
    along = BSpline(axis.knots, rows, axis.degree)
    slope = along.derivative()
    tries = np.union1d(np.linspace(0, 1, 1001), axis.knots)
    v = np.interp(y, along(tries), tries)
    for _ in range(4):  # Newton's steps: the start is good to six digits
        v = np.clip(v - (along(v) - y) / slope(v), 0, 1)
    return scipy.sparse.csr_array(BSpline.design_matrix(v, axis.knots, axis.degree))


def _shortfall(weights: scipy.sparse.csr_array, excess: np.ndarray) -> np.ndarray:
    """How far each row must be moved so that no point where it acts is in excess."""
    entries, found = weights.tocoo(), np.zeros(weights.shape[1])
    np.maximum.at(found, entries.col, np.where(entries.data > 0, excess[entries.row], 0.0))
    return found
