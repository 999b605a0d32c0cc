"""A nacelle with its duct."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from .airfoils import airfoil as airfoil_of
from .base import AbstractShape, shaped
from .profile import Profile, scaled
from .quantities import (
    Numbers,
    Quantities,
    affordable,
    base_points_of,
    even_ring,
    placed,
    positive,
    radians,
)
from .ring_layout import MIRROR, directions
from .skin import between_rows, mirrored
from .spacing import Spacing, stations

STEEPEST = np.radians(60)
"""Of droop and scarf."""


class Nacelle(AbstractShape):
    """A through-flow nacelle: an airfoil led around the x axis, closed like a ring.

    The airfoil's upper side is the cowl, its lower side the duct, its nose the lip. Its chord runs
    from `radius`, at the lip, to `exit_radius` along `length`. What is given as one number is the
    same all around; three are for the crown, the side and the keel, with a smooth blend between
    them, a + b cos t + c cos 2t of the angle t from the crown.

    Parameters are what was given, under the same names: `length`, `radius`, `exit_radius`,
    `thickness`, `camber`, `droop`, `scarf`, `origin`; then the airfoil's own, such as "section
    upper", if `section_parameters` says so. `droop` lowers the lip: so much does the axis point
    down there [rad]. `scarf` tilts the lip's plane, its keel forward [rad]. `origin` is where the
    axis meets the plane of the lip.

    Attributes
    ----------
    quantities
        The parameters.
    profile
        The airfoil.
    rows
        Of points, from the crown to the keel.
    base
        Points inside of a blunt base in each row.
    is_whole
        Whether it is the whole ring, not the half at y >= 0.
    """

    quantities: Quantities
    profile: Profile
    rows: int = eqx.field(static=True)
    base: int = eqx.field(static=True)
    is_blunt: bool = eqx.field(static=True)
    is_whole: bool = eqx.field(static=True)
    name: str = eqx.field(static=True)

    def __init__(
        self,
        length: float,
        radius: Numbers,
        exit_radius: Numbers | None = None,
        *,
        thickness: Numbers | None = None,
        camber: float = 1.0,
        droop: float = 0.0,
        scarf: float = 0.0,
        airfoil: Any = "naca 0012",
        section_parameters: bool | list[str] = False,
        origin: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        degrees: bool = False,
        half: bool = False,
        chordwise: int = 65,
        around: int = 96,
        base_points: int = 0,
        spacing: Spacing | list[float] = "half-cosine",
        name: str = "nacelle",
    ):
        affordable(chordwise=chordwise, around=around)
        self._ring(around, half, name)
        foil = airfoil_of(airfoil)
        self.profile = Profile(foil, stations(foil, chordwise, spacing), section_parameters)
        self.base, self.is_blunt = base_points_of(base_points, foil.is_blunt), foil.is_blunt
        thick = self.profile.thick if thickness is None else thickness
        exits = radius if exit_radius is None else exit_radius
        own = {
            "length": np.atleast_1d(np.array(length, float)),
            "radius": _around("radius", radius),
            "exit_radius": _around("exit_radius", exits),
            "thickness": _around("thickness", thick),
        }
        own["camber"] = np.array([camber])
        for key, angle in radians(degrees, droop=droop, scarf=scarf).items():
            own[key] = np.array([angle], float)
        _check(own)
        own["origin"] = placed(origin, half, "half a nacelle")
        sections = {f"section {key}": numbers for key, numbers in self.profile.numbers.items()}
        self.quantities = Quantities(own | sections)

    def _ring(self, around: int, half: bool, name: str) -> None:
        self.rows, self.is_whole, self.name = even_ring(around) + 1, not half, name

    def __check_init__(self) -> None:
        start = self.quantities.parted(self.values)["origin"]
        y = np.asarray(shaped(self, self.values))[:, 1]
        least = y[: self.rows * self._row].min() - (start[1] if len(start) == 3 else 0.0)
        if least < 0:
            raise GeometryError(
                f"the duct closes: its radius falls to {least:.6g} or below; a larger radius or "
                "exit_radius, or a thinner section keeps it open"
            )

    @property
    def _row(self) -> int:
        """Points in a row."""
        return 2 * len(self.profile.stations) - (1 if self.is_blunt else 2) + self.base

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Nacelle":
        return cls(airfoil=airfoil_of(options.pop("airfoil", "naca 0012"), folder), **options)

    @override
    def check(self, parameters: Vector) -> None:
        _check(self.quantities.parted(np.asarray(parameters)))

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
        x, radius = self._meridians(given)
        across, up = (jnp.asarray(part)[:, None] for part in self._directions())
        origin, ahead = given["origin"], 1 - x / given["length"][0]
        lip = self._blended(given["radius"])[:, None] * up
        droop = jnp.tan(given["droop"][0]) * given["length"][0] / 2
        place = [
            origin[0] + x + jnp.tan(given["scarf"][0]) * lip * ahead,
            radius * across,
            origin[-1] + radius * up - droop * ahead**2,
        ]
        rows = jnp.stack(place, axis=-1)
        points = rows.reshape(-1, 3)
        if self.is_whole:
            points = jnp.concatenate([points, rows[1:-1].reshape(-1, 3) * MIRROR])
        return points + origin[1] * np.eye(3)[1] if len(origin) == 3 else points

    def _directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Sine and cosine of the angle from the crown at each row."""
        return directions(np.arange(self.rows) / (self.rows - 1))

    def _blended(self, given: Array) -> Array:
        """What is given for all, or for the crown, the side and the keel, at each row."""
        _, up = self._directions()
        if len(given) == 1:
            return jnp.broadcast_to(given[0], up.shape)
        twice = 2 * up**2 - 1
        weights = [(1 + 2 * up + twice) / 4, (1 - twice) / 2, (1 - 2 * up + twice) / 4]
        return np.stack(weights, axis=1) @ given

    def _meridians(self, given: Mapping[str, Array]) -> tuple[Array, Array]:
        """Distance behind the lip and radius of the points in each row, not tilted yet."""
        length = given["length"][0]
        names = {name: given[f"section {name}"] for name in self.profile.exposed}
        sides = self.profile.sides(names)
        count = self.rows
        sides = jnp.broadcast_to(sides, (count, *sides.shape))
        factor = self._blended(given["thickness"]) / self.profile.thick
        upper, lower = scaled(sides, factor, jnp.broadcast_to(given["camber"], (count,)))
        share = jnp.linspace(0, 1, self.base + 2)[1:-1, None]
        base = (1 - share) * upper[:, -1:] + share * lower[:, -1:]
        last = upper.shape[1] if self.is_blunt else upper.shape[1] - 1
        loop = jnp.concatenate([upper, lower[:, 1:last], base], axis=1)
        at, out = loop[..., 0], loop[..., 1]
        start, end = (self._blended(given[key])[:, None] for key in ("radius", "exit_radius"))
        return length * at, start + at * (end - start) + length * out

    @property
    @override
    def geometry(self) -> Surface:
        points = np.asarray(shaped(self, self.values))
        faces, tags = self._faces(points)
        return Surface(points, faces, tags, (f"{self.name} cowl", f"{self.name} duct"))

    def _faces(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles, and for each 0, or 1 in the duct; a base is the cowl's."""
        side, rows = len(self.profile.stations), self.rows
        number = np.arange(rows * self._row, dtype=np.int32).reshape(rows, -1)
        upper = number[:, :side]
        rest = number[:, side:] if self.is_blunt else np.hstack([number[:, side:], upper[:, -1:]])
        lower = np.hstack([number[:, :1], rest[:, : side - 1]])
        base = np.hstack([upper[:, -1:], rest[:, side - 1 :], lower[:, -1:]])
        parts = [
            between_rows(upper, points),
            between_rows(base, points),
            between_rows(lower, points)[:, ::-1],
        ]
        faces = np.concatenate(parts)
        tags = (np.arange(len(faces)) >= len(parts[0]) + len(parts[1])).astype(np.int32)
        if not self.is_whole:
            return faces, tags
        is_shared = np.zeros(number.size, bool)
        is_shared[number[[0, -1]]] = True
        image, _ = mirrored(faces, is_shared)
        return np.concatenate([faces, image]), np.concatenate([tags, tags])


def _around(name: str, given: Any) -> np.ndarray:
    numbers = np.atleast_1d(np.array(given, float))
    if numbers.shape not in ((1,), (3,)):
        raise ParameterError(
            f"{name} takes one number, or three, for the crown, the side and the keel; got {given}"
        )
    return numbers


def _check(given: Mapping[str, Any]) -> None:
    for name in ("length", "radius", "exit_radius", "thickness"):
        positive(name, given[name], "of the length" if name == "thickness" else "m")
    for name in ("droop", "scarf"):
        if not abs(given[name][0]) <= STEEPEST:
            raise ParameterError(
                f"{name} must lie within 60 degrees either way [rad], got {given[name][0]}; was "
                "it degrees?"
            )
