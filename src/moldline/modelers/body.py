"""A body along x with super-ellipses as its sections."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from .base import AbstractShape, shaped
from .body_loft import body_weights
from .loft import Lofting, row_places
from .quantities import (
    Numbers,
    Quantities,
    affordable,
    ascending,
    choices,
    even_ring,
    placed,
    positive,
    reaches,
    spread,
    station_count,
)
from .ring_layout import RingLayout

End = Literal["round", "pointed"]


class Body(AbstractShape):
    """A closed body along x: sections are super-ellipses |2y / width|^n + |2z / height|^n = 1.

    At each station they are given by `radius`, or by `width` and `height`; between stations they
    are lofted. An end whose size is 0 is a point, round or pointed; any other is flat. Triangles
    keep their shape towards a pole, which is a single point.

    Parameters are what was given, under the same names: `length`, `radius` or `width` and `height`,
    `lift`, `exponent`, `lower_exponent` where it was given, `origin`. One number is one parameter
    for all stations, a list has one for each, but for sizes of 0, which stay.

    Attributes
    ----------
    quantities
        The parameters.
    reach
        Takes `length` to the distance of each station from the first.
    even, odd
        Weights of the stations in each row: for places, and for sizes.
    free
        Stations whose size is not 0.
    layout
        The order of the points.
    """

    quantities: Quantities
    reach: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    free: np.ndarray
    layout: RingLayout
    name: str = eqx.field(static=True)

    def __init__(
        self,
        length: Numbers,
        radius: Numbers | None = None,
        *,
        width: Numbers | None = None,
        height: Numbers | None = None,
        lift: Numbers = 0.0,
        exponent: Numbers = 2.0,
        lower_exponent: Numbers | None = None,
        origin: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        loft: Lofting = "linear",
        nose: End = "round",
        tail: End = "round",
        half: bool = False,
        along: int = 96,
        around: int = 64,
        clustering: float = 0.8,
        name: str = "body",
    ):
        affordable(along=along, around=around)
        choices(nose=(nose, End), tail=(tail, End), loft=(loft, Lofting))
        sizes = _sizes(radius, width, height)
        each = {**sizes, "lift": lift, "exponent": exponent}
        if lower_exponent is not None:
            each["lower_exponent"] = lower_exponent
        count = station_count(each, {"length": length}, "body")
        own = {key: spread(key, given, count, "station") for key, given in each.items()}
        self.free = _free({key: own[key] for key in sizes}, count)
        for key in sizes:
            own[key] = own[key][self.free] if len(own[key]) > 1 else own[key]
        _check(own)
        reach, self.reach = reaches("length", length, count)
        place = placed(origin, half, "half a body")
        self.quantities = Quantities({"length": reach} | own | {"origin": place})
        self.name = name
        self._rows(loft, (nose, tail), along, clustering, even_ring(around), not half)

    def _rows(
        self,
        loft: str,
        ends: tuple[str, str],
        along: int,
        clustering: float,
        edges: int,
        is_whole: bool,
    ) -> None:
        """Where the rows of points lie, and what each has of the stations."""
        given = self.quantities.parted(self.values)
        x, size = self.reach @ given["length"], np.zeros(len(self.reach))
        size[self.free] = np.maximum(*self._halves(given))
        run = np.cumsum(np.hypot(np.diff(x, prepend=x[0]), np.diff(size, prepend=size[0])))
        rows = row_places(run, along, clustering)
        is_flat = size[[0, -1]] > 0
        is_round = tuple(
            word == "round" and not flat for word, flat in zip(ends, is_flat, strict=True)
        )
        even, odd = body_weights(run, rows, loft, (bool(is_round[0]), bool(is_round[1])))
        rings = -(-edges // 3)
        share = np.arange(rings)[:, None] / rings
        if is_flat[0]:
            even = np.concatenate([np.repeat(even[:1], rings, axis=0), even])
            odd = np.concatenate([share * odd[:1], odd])
        if is_flat[1]:
            even = np.concatenate([even, np.repeat(even[-1:], rings, axis=0)])
            odd = np.concatenate([odd, share[::-1] * odd[-1:]])
        if not is_flat[0]:
            odd[0] = 0.0
        if not is_flat[1]:
            odd[-1] = 0.0
        self.even, self.odd = even, odd
        self.layout = RingLayout(rows=len(even), edges=edges, is_whole=is_whole)
        if np.any(np.diff(even @ x) < 0) or np.any((odd @ size)[1:-1] <= 0):
            raise GeometryError(
                f"a {loft} loft through stations at x = {x.tolist()} with half sizes "
                f"{size.tolist()} turns back or falls below 0 between them; use more stations, or "
                "loft = 'linear'"
            )

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Body":
        return cls(**options)

    @override
    def check(self, parameters: Vector) -> None:
        given = self.quantities.parted(np.asarray(parameters))
        ascending("length", np.asarray(given["length"]))
        for name in ("radius", "width", "height"):
            if name in given:
                positive(name, np.asarray(given[name]))
        _check(given)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return self.quantities.rows

    @property
    @override
    def values(self) -> Vector:
        return self.quantities.values

    @override
    def __call__(self, parameters: Vector) -> Points:
        given = self.quantities.parted(parameters)
        count = len(self.reach)
        each = {
            key: jnp.broadcast_to(given.get(key, given["exponent"]), (count,))
            for key in ("lift", "exponent", "lower_exponent")
        }
        width, height = (self._full(half) for half in self._halves(given))
        origin = given["origin"]
        points = self.layout.points(
            {
                "x": origin[0] + self.even @ (self.reach @ given["length"]),
                "half_width": self.odd @ width,
                "half_height": self.odd @ height,
                "lift": origin[-1] + self.even @ each["lift"],
                "upper": self.even @ each["exponent"],
                "lower": self.even @ each["lower_exponent"],
            }
        )
        return points + origin[1] * np.eye(3)[1] if len(origin) == 3 else points

    def _halves(self, given: dict[str, Array]) -> tuple[Array, Array]:
        """Half the width and the height, where they are not 0."""
        if "radius" in given:
            return given["radius"], given["radius"]
        return given["width"] / 2, given["height"] / 2

    def _full(self, given: Array) -> Array:
        """One for each station."""
        return jnp.zeros(len(self.reach)).at[self.free].set(given)

    @property
    @override
    def geometry(self) -> Surface:
        points = np.asarray(shaped(self, self.values))
        return Surface(points, self.layout.faces(points), components=(self.name,))


def _check(given: Mapping[str, Any]) -> None:
    for name in ("exponent", "lower_exponent"):
        if name in given and not np.all(given[name] >= 1):
            raise ParameterError(f"{name} must be 1 or more, got {given[name].tolist()}")


def _sizes(radius: Any, width: Any, height: Any) -> dict[str, Any]:
    """What tells the sizes of sections."""
    if radius is None and width is not None and height is not None:
        return {"width": width, "height": height}
    if radius is None or width is not None or height is not None:
        raise ParameterError(
            "a body takes radius, or width and height [m]; got "
            + ", ".join(
                f"{k} = {v}"
                for k, v in {"radius": radius, "width": width, "height": height}.items()
            )
        )
    return {"radius": radius}


def _free(sizes: dict[str, np.ndarray], count: int) -> np.ndarray:
    """Stations whose size is not 0."""
    full = {name: np.broadcast_to(own, count) for name, own in sizes.items()}
    for name, own in full.items():
        positive(f"{name} between the ends", own[1:-1])
        if np.any(own < 0) or not own.any():
            raise ParameterError(
                f"{name} must be above 0 [m], or 0 at an end that is a point; got {own.tolist()}"
            )
    free = [own > 0 for own in full.values()]
    if not np.array_equal(free[0], free[-1]):
        raise ParameterError("at an end that is a point width and height are both 0")
    return np.flatnonzero(free[0])
