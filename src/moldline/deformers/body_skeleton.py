"""A body skeleton: lengths of nose, cabin and tail, radii, heights and droop as controls."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from ..mesh.planform import MOST, Places
from ..mesh.slices import NEAR, section
from ..numerics import knots
from .loft import Loft, Lofting
from .posed import AbstractPosed

ROOM = 1.1
"""How far the control points stand off each section's centre, in its own largest reach."""

CABIN = 0.95
"""Sections at least this large, in the largest one, are the cabin's."""

LEAST = 0.05
"""Nose and tail are at least this long, in lengths of the body."""

POINTED = 0.1
"""A section smaller than this, in the largest one, belongs to a tip: no station is there."""

PROBES = 101
"""Places where a body is looked at to find its cabin."""


class BodySkeleton(AbstractPosed):
    """Move a fuselage along x: aft is positive, z up, symmetric about its plane y = const.

    At each station the section at rest has a centre and a radius, the mean of its half width and
    half height. Controls move sections as a whole along x and z and scale them about their centres;
    between stations they are lofted, and the tips beyond the first and last follow rigidly.

    Controls, in this order and by these names in `parameters`: `nose`, `cabin` and `tail`, changes
    of length [m], of which the border of nose and cabin stays where it is; `radius` and `height`
    of each station [m]; `droop` of the nose tip (positive down) and `upsweep` of the tail tip
    (positive up) [m], which grow with the square of the distance from the cabin. They are changes;
    `values` are what the body has at rest.

    Attributes
    ----------
    net
        The maps of the stations, lofted; its scales are the radii.
    lengths
        Of nose, cabin and tail at rest [m].
    shares
        How far each station lies along nose, cabin and tail: from 0 at the cabin, for the cabin at
        the nose, to 1.
    """

    net: Loft
    lengths: Float[np.ndarray, "3"]
    shares: Float[np.ndarray, "3 s"]

    def __init__(self, net: Loft, nose: float, tail: float, ends: tuple[float, float]):
        """`nose` and `tail` are where the cabin begins and ends, `ends` where the body does [m]."""
        first, last = net.stations[[0, -1]]
        if not first < nose < tail < last:
            raise ParameterError(
                f"the cabin, from nose = {nose:.6g} to tail = {tail:.6g}, must lie between the "
                f"first and last station, {first:.6g} and {last:.6g}, and not reach them"
            )
        self.net = net
        self.lengths = np.diff([ends[0], nose, tail, ends[1]])
        starts, stops = np.array([nose, nose, tail]), np.array([first, tail, last])
        runs = (net.stations - starts[:, None]) / (stops - starts)[:, None]
        self.shares = np.clip(runs, 0.0, 1.0)

    @classmethod
    def fitted(
        cls,
        surface: Any,
        stations: int | Places = 7,
        component: str | None = None,
        *,
        nose: float | None = None,
        tail: float | None = None,
        loft: str = "cubic",
    ) -> "BodySkeleton":
        """On a body as it is, half or whole, or on the component that is one.

        The cabin runs from x = `nose` to x = `tail` [m], by default over the sections that are
        nearly as large as the largest. `stations` are places along x [m], to which these two are
        added, or how many there are to be: four are the ends of nose and tail, more go into the
        middle of the longest gaps.
        """
        if not isinstance(surface, Surface):
            raise GeometryError(
                f"a skeleton is fitted to a surface, got a {type(surface).__name__}"
            )
        body = _Body(surface, component)
        first, last, *cabin = body.found()
        nose = cabin[0] if nose is None else nose
        tail = cabin[1] if tail is None else tail
        if isinstance(stations, int):
            places = _placed(stations, first, nose, tail, last)
        else:
            places = np.union1d(np.array(stations, float), [nose, tail])
        sizes = np.array([body.size(x) for x in places.tolist()])
        radius = sizes[:, :2].mean(axis=1)
        reach = ROOM * (sizes[:, :2] / radius[:, None]).max(axis=0)
        origins = np.stack([np.full(len(places), body.middle), sizes[:, 2]], axis=1)
        net = Loft("x", places, origins, radius, np.stack([-reach, reach], axis=1), loft=loft)
        return cls(net, nose, tail, (body.low, body.high))

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        stations: int | tuple[float, ...] = 7,
        component: str | None = None,
        nose: float | None = None,
        tail: float | None = None,
        loft: Lofting = "cubic",
    ) -> "BodySkeleton":
        """From a case file: fitted to the geometry."""
        return cls.fitted(geometry, stations, component, nose=nose, tail=tail, loft=loft)

    @property
    @override
    def size(self) -> int:
        return 5 + 2 * len(self.net.stations)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        count = len(self.net.stations)
        counts = {"nose": 1, "cabin": 1, "tail": 1, "radius": count, "height": count}
        counts |= {"droop": 1, "upsweep": 1}
        ends = np.cumsum([0, *counts.values()])
        return {name: np.arange(ends[i], ends[i + 1]) for i, name in enumerate(counts)}

    @property
    @override
    def values(self) -> Vector:
        heights = self.net.origins[:, 1]
        nose, tail = (heights[np.argmin(self.shares[i])] for i in (0, 2))
        tips = [nose - heights[0], heights[-1] - tail]
        return np.concatenate([self.lengths, self.net.scales, heights, tips])

    @override
    def pose(self, controls: Vector) -> Float[Array, "c"]:
        given = {name: jnp.asarray(controls)[rows] for name, rows in self.parameters.items()}
        nose, cabin, tail = self.shares
        along = cabin * given["cabin"] + tail * given["tail"] - nose * given["nose"]
        up = given["height"] + tail**2 * given["upsweep"] - nose**2 * given["droop"]
        growth = given["radius"] / self.net.scales
        slopes = jnp.zeros((len(growth), 3, 2))
        slopes = slopes.at[:, 1, 0].set(growth).at[:, 2, 1].set(growth)
        return self.net.carried(jnp.stack([along, 0 * along, up], axis=1), slopes)


class _Body:
    """The triangles of a body, and its sections."""

    def __init__(self, surface: Surface, component: str | None):
        self.points, self.faces = np.asarray(surface.points), np.asarray(surface.faces)
        if component is not None:
            surface.component(component)  # refuses an unknown one
            self.faces = self.faces[np.asarray(surface.tags) == surface.components.index(component)]
        used = self.points[np.unique(self.faces)]
        if not len(used) or not np.isfinite(used).all():
            raise GeometryError("a skeleton needs triangles whose points are finite")
        low, high = used.min(axis=0), used.max(axis=0)
        extent = high - low
        if extent[0] < extent[1:].max():
            raise GeometryError(
                f"the body reaches over {extent[0]:.4g} along x, {extent[1]:.4g} along y and "
                f"{extent[2]:.4g} along z: it must run along x; name the component that does"
            )
        self.low, self.high = float(low[0]), float(high[0])
        sides = np.array([-low[1], high[1]])
        near = 0.01 * extent[1]
        # a half body ends on its plane of symmetry, which is a whole one's middle
        is_ours = np.abs(sides).min() <= near or abs(sides[0] - sides[1]) <= near
        self.middle = 0.0 if is_ours else float(low[1] + high[1]) / 2

    def size(self, at: float) -> tuple[float, float, float]:
        """Half width, half height and middle in z of a section [m]."""
        lines, near = section(self.points, self.faces, "x", at), NEAR * (self.high - self.low)
        if not lines or np.ptp(np.concatenate(lines), axis=0).max() <= near:
            raise GeometryError(
                f"there is no section at x = {at:.6g}; the body reaches from x = {self.low:.6g} "
                f"to {self.high:.6g}, and may end in a point there"
            )
        y, z = np.concatenate(lines)[:, 1:].T
        width = float(np.abs(y - self.middle).max())
        return width, float(np.ptp(z)) / 2, float(z.min() + z.max()) / 2

    def found(self) -> tuple[float, float, float, float]:
        """The first and last section that is no tip, and where the cabin begins and ends."""
        length = self.high - self.low
        places = np.linspace(self.low, self.high, PROBES)
        sizes = np.array([self._radius(x) for x in places.tolist()])
        first, last = places[np.flatnonzero(sizes >= POINTED * sizes.max())[[0, -1]]]
        large = places[np.flatnonzero(sizes >= CABIN * sizes.max())[[0, -1]]]
        nose = max(large[0], first + LEAST * length)
        tail = min(large[1], last - LEAST * length)
        if not nose < tail:
            nose, tail = first + np.array([1, 2]) * (last - first) / 3
        return float(first), float(last), float(nose), float(tail)

    def _radius(self, at: float) -> float:
        try:
            return sum(self.size(at)[:2]) / 2
        except GeometryError:
            return 0.0


def _placed(
    count: int, first: float, nose: float, tail: float, last: float
) -> Float[np.ndarray, "s"]:
    """Stations at the ends of nose and tail, and in the middle of the longest gaps."""
    if not 4 <= count <= MOST:
        raise ParameterError(f"stations are 4 to {MOST}, or places along x, got {count}")
    inner = (np.array([nose, tail]) - first) / (last - first)
    if not 0 < inner[0] < inner[1] < 1:
        raise ParameterError(
            f"the cabin, from nose = {nose:.6g} to tail = {tail:.6g}, must lie inside the body, "
            f"from x = {first:.6g} to {last:.6g}"
        )
    inner = np.array([0.0, *knots.filled(inner, count - 2), 1.0])
    return np.where(inner == 1.0, last, first + inner * (last - first))
