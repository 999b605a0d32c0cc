"""The usual links: single controls, groups, thickness, camber, radius, mirrored pairs.

The axes x, y, z of a lattice run along its own edges, those of other nets of control points are
space's. All displacements are in metres. A station is a row of control points across an axis; those
that are frozen get no number.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from scipy.spatial import KDTree

from .._types import Array
from ..deformers.base import AbstractDeformer
from ..deformers.lattice import Lattice
from ..deformers.named import AbstractNamed
from ..deformers.net import AXES, AbstractControlNet
from ..errors import ParameterError
from ..modelers.base import AbstractModeler
from .link import Across, Link

AxisName = Literal["x", "y", "z"]


def controls(
    deformer: AbstractDeformer | AbstractModeler, numbers: Sequence[int] | None = None
) -> Link:
    """One variable number for each of a deformer's controls, or for those given by number."""
    chosen = range(deformer.size) if numbers is None else numbers
    _check_numbers(chosen, deformer.size, "controls")
    matrix = np.zeros((deformer.size, len(chosen)))
    matrix[list(chosen), range(len(chosen))] = 1.0
    return Link(matrix)


def named(
    deformer: AbstractNamed | AbstractModeler,
    parameter: str | list[str],
    index: Sequence[int] | None = None,
    absolute: bool = False,
) -> Link:
    """One variable number for each number of a parameter, or for those given by index.

    Several parameters follow each other; their indices count through.

    The numbers are changes; with `absolute` they are what the parameter measures itself, such as a
    sweep of 35 degrees.
    """
    known = deformer.parameters
    names = [parameter] if isinstance(parameter, str) else parameter
    lost = [name for name in names if name not in known]
    if lost or not names:
        what = repr(lost[0]) if lost else "named"
        raise ParameterError(f"no parameter {what}; there is: {', '.join(known)}")
    rows = np.concatenate([known[name] for name in names])
    chosen = range(len(rows)) if index is None else index
    _check_numbers(chosen, len(rows), f"the numbers of {', '.join(map(repr, names))}")
    link = controls(deformer, [int(rows[i]) for i in chosen])
    if not absolute:
        return link
    return Link(link.matrix, rest=link.matrix @ (link.matrix.T @ np.asarray(deformer.values)))


def each(net: AbstractControlNet, axis: AxisName, **where: Any) -> Link:
    """One number for each chosen control point: its displacement along an axis.

    `where` is as for `group`; without it all control points that are not frozen are chosen, in the
    order of their array.
    """
    chosen = chosen_controls(net, **where)
    motion = np.zeros((net.size // 3, 3, len(chosen)))
    motion[chosen, :, range(len(chosen))] = net.direction(axis)
    return Link(motion.reshape(net.size, -1))


def group(net: AbstractControlNet, axis: AxisName, **where: Any) -> Link:
    """One number moves all chosen control points together along an axis.

    Choose by one of: `index`, a list of (i, j, k), behind the number of the box where a control
    volume has several; `inside`, two opposite corners of a box in
    space; `near` and `radius`, a point in space and a distance [m].
    """
    return Link(each(net, axis, **where).matrix.sum(axis=1, keepdims=True))


def groups(
    net: AbstractControlNet,
    direction: Sequence[float],
    index: Sequence[Sequence[Sequence[int]]],
) -> Link:
    """One number for each list of control points: all in it move together along a direction.

    `index` holds lists of indices as `group` takes one; `direction` is the motion in space for a
    number of 1.
    """
    motion = np.zeros((net.size // 3, 3, len(index)))
    for column, rows in enumerate(index):
        motion[net.numbers(rows), :, column] = np.asarray(direction, float)
    return Link(motion.reshape(net.size, -1))


def camber(lattice: Lattice, along: AxisName | Sequence[AxisName], axis: AxisName) -> Link:
    """At each station along one axis (or two), all controls move together along another."""
    return _stations(lattice, along, axis, np.ones(lattice.shape[AXES[axis]]))


def thickness(lattice: Lattice, along: AxisName | Sequence[AxisName], axis: AxisName) -> Link:
    """At each station, the two sides move apart: the number is the growth of the box there.

    Upper controls move by half of it, lower ones by minus half, rows between in proportion.
    """
    rest = lattice.axes[AXES[axis]].rest
    if len(rest) < 2:
        raise ParameterError(f"thickness along {axis} needs two control points there, got 1")
    return _stations(lattice, along, axis, rest - 0.5)


def radius(lattice: Lattice, along: AxisName) -> Link:
    """At each station along an axis, the section grows: each side moves outwards by the number."""
    place = np.stack(np.meshgrid(*(a.rest for a in lattice.axes), indexing="ij"), axis=-1)
    outward = np.zeros((*lattice.shape, 3))
    for axis in set(AXES) - {along}:
        if lattice.shape[AXES[axis]] > 1:
            share = 2 * place[..., AXES[axis]] - 1
            outward += share[..., None] * lattice.direction(axis)
    return Link(_by_station(lattice, (along,), outward))


def mirrored(net: AbstractControlNet, link: Link, across: Across) -> Link:
    """The same, with the half on the positive side of a plane of symmetry copied to the other.

    `across` names the coordinate of space that is 0 on the plane; the control points must be
    symmetric about it, or end on it. Those on the plane move only within it, and points on it stay
    there to the bit.
    """
    axis = AXES[across]
    places = net.rest.reshape(-1, 3)
    scale = float(np.ptp(places, axis=0).sum())
    flip = np.where(np.arange(3) == axis, -1.0, 1.0)
    gaps, partner = KDTree(places).query(places * flip)
    one_sided = places[:, axis].min() >= -1e-9 * scale
    if not one_sided and gaps.max() > 1e-9 * scale:
        raise ParameterError(
            f"control points from {across} = {places[:, axis].min():g} to "
            f"{places[:, axis].max():g} are not symmetric about {across} = 0; make them so, or "
            "begin them there"
        )
    motion = np.array(link.matrix).reshape(-1, 3, link.size)
    lower = places[:, axis] < -1e-9 * scale
    motion[lower] = motion[partner[lower]] * flip[:, None]
    motion[np.abs(places[:, axis]) <= 1e-9 * scale, axis] = 0.0
    both = Link(motion.reshape(net.size, -1), across)
    _check_plane_kept(net, both, across)
    return both


def _check_plane_kept(net: AbstractControlNet, link: Link, across: Across) -> None:
    """Refuse a link that would really move points off the plane, tried on a sample of them."""
    rng = np.random.default_rng(0)
    rest = net.rest.reshape(-1, 3)
    low, reach = rest.min(axis=0), np.ptp(rest, axis=0)
    places = low + rng.uniform(-0.5, 1.5, (200, 3)) * reach  # twice as large as the net
    places[:, AXES[across]] = 0.0
    controls = link.matrix @ rng.uniform(-1, 1, link.size)
    moved = np.asarray(net.follow(places, controls))
    off = np.abs(moved[:, AXES[across]]).max() / max(np.abs(controls).max(), 1e-300)
    if off > 1e-9:
        raise ParameterError(
            f"these control points move points at {across} = 0 off that plane, by {off:.2g} of its "
            f"controls' motion; make them symmetric about {across} = 0, or begin them there with "
            f"clamped ends"
        )


def _stations(lattice: Lattice, along: Any, axis: AxisName, share: np.ndarray) -> Link:
    """Controls move along an axis by their row's share of the number at their station."""
    along = (along,) if isinstance(along, str) else tuple(along)
    if not along or len(set(along)) < len(along):
        raise ParameterError(f"stations run along one axis or two different ones, got {along}")
    if axis in along:
        raise ParameterError(f"stations along {', '.join(along)} cannot move along {axis} too")
    shape = [1, 1, 1]
    shape[AXES[axis]] = -1
    motion = share.reshape(shape)[..., None] * lattice.direction(axis)
    return Link(_by_station(lattice, along, np.broadcast_to(motion, (*lattice.shape, 3))))


def _by_station(lattice: Lattice, along: tuple[str, ...], motion: Array) -> np.ndarray:
    """One column per station: the motion of its controls; the first axis of `along` runs slowest.

    Stations where every control is frozen have no column.
    """
    order = [AXES[name] for name in along]
    counts = [lattice.shape[i] for i in order]
    index = np.indices(lattice.shape)
    station = np.ravel_multi_index(tuple(index[i] for i in order), counts)
    columns = np.zeros((*lattice.shape, 3, int(np.prod(counts))))
    np.put_along_axis(columns, station[..., None, None], motion[..., None], axis=-1)
    free = np.unique(station[~lattice.frozen])
    return columns.reshape(lattice.size, -1)[:, free]


def chosen_controls(
    net: AbstractControlNet,
    index: Sequence[Sequence[int]] | None = None,
    inside: Sequence[Sequence[float]] | None = None,
    near: Sequence[float] | None = None,
    radius: float | None = None,
) -> np.ndarray:
    """Numbers of the chosen control points."""
    places = net.rest.reshape(-1, 3)
    if (near is None) != (radius is None) or sum(x is not None for x in (index, inside, near)) > 1:
        raise ParameterError("choose control points by index, by inside, or by near with radius")
    if index is not None:
        return net.numbers(index)
    if inside is not None:
        low, high = np.sort(np.asarray(inside, float), axis=0)
        chosen = np.flatnonzero(np.all((places >= low) & (places <= high), axis=1))
    elif near is not None:
        chosen = np.flatnonzero(np.linalg.norm(places - np.asarray(near), axis=1) <= radius)
    else:
        return np.flatnonzero(~net.frozen.ravel())
    if len(chosen) == 0:
        raise ParameterError(
            f"no control point there; they reach from {places.min(axis=0).tolist()} "
            f"to {places.max(axis=0).tolist()}"
        )
    return chosen


def _check_numbers(numbers: Sequence[int], count: int, what: str) -> None:
    bad = [n for n in numbers if not 0 <= n < count]
    if bad:
        raise ParameterError(f"{what} run from 0 to {count - 1}, got {bad[0]}")


LINKS: dict[str, Callable[..., Link]] = {
    "controls": controls,
    "named": named,
    "each": each,
    "group": group,
    "groups": groups,
    "camber": camber,
    "thickness": thickness,
    "radius": radius,
}
"""Links by the name that a case file calls them."""
