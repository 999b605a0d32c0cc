"""A wing lofted through sections."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Surface
from .airfoil import AbstractAirfoil
from .airfoils import airfoil as airfoil_of
from .base import AbstractShape
from .loft import Lofting, loft_weights, row_places
from .quantities import (
    Quantities,
    choices,
    placed,
    positive,
    reaches,
    spread,
    station_count,
)
from .spacing import Spacing, stations
from .wing_layout import Root, Tip, WingLayout, cap_edges

Along = Literal["y", "-y", "z", "-z"]

_AXES = {
    "y": np.eye(3),
    "-y": np.diag([1.0, -1.0, 1.0]),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""Rows are where x, y and z of a wing along y lie."""

STEEPEST = np.radians(80)
"""Of sweep and dihedral: beyond, their tangents mean nothing."""


class Wing(AbstractShape):
    """A closed wing through sections in planes y = const; x is streamwise, y to the tip, z up.

    At each station an airfoil is scaled to its chord and turned by its twist, positive nose up. The
    line at the fraction `sweep_at` of the chords carries x, that at `twist_at` carries z and is
    what sections turn about: these are the conventions of the wing skeleton, and what
    `mesh.planform` reads from the wing is what was asked for.

    Parameters are what was given, under the same names: `span`, `chord`, `sweep`, `dihedral`,
    `twist`, `thickness`, `camber`, `origin`; then the airfoils' own, such as "section 2 upper", if
    `section_parameters` says so. What was given as one number is one parameter for all stations or
    panels, a list has one for each: so a wing has five parameters, or hundreds.

    Attributes
    ----------
    quantities
        The parameters.
    airfoils
        Of each station; those alike are the same object.
    own
        Each airfoil's own values.
    drawn
        Both sides of each station's airfoil by these values, for the chord 1.
    thick
        The greatest thickness of each, of the chord.
    stations
        Chordwise, from the nose to the trailing edge.
    reach
        Takes `span` to the distance of each station from the root.
    weights
        Of each station in each row of points.
    slope
        The same for how the last row changes along the loft.
    thinning
        What is left of each row's thickness where the tip is closed.
    layout
        The order of the points.
    exposed
        Which parameters of each airfoil are the wing's.
    """

    quantities: Quantities
    airfoils: tuple[AbstractAirfoil, ...]
    own: tuple[np.ndarray, ...]
    drawn: np.ndarray
    thick: np.ndarray
    stations: np.ndarray
    reach: np.ndarray
    weights: np.ndarray
    slope: np.ndarray
    thinning: np.ndarray
    layout: WingLayout
    exposed: tuple[tuple[str, ...], ...] = eqx.field(static=True)
    sweep_at: float = eqx.field(static=True)
    twist_at: float = eqx.field(static=True)
    along: str = eqx.field(static=True)
    name: str = eqx.field(static=True)

    def __init__(
        self,
        span: float | Sequence[float],
        chord: float | Sequence[float],
        *,
        sweep: float | Sequence[float] = 0.0,
        dihedral: float | Sequence[float] = 0.0,
        twist: float | Sequence[float] = 0.0,
        thickness: float | Sequence[float] | None = None,
        camber: float | Sequence[float] = 1.0,
        airfoil: Any = "naca 0012",
        section_parameters: bool | list[str] = False,
        origin: Sequence[float] = (0.0, 0.0, 0.0),
        sweep_at: float = 0.0,
        twist_at: float = 0.25,
        loft: Lofting = "linear",
        tip: Tip = "round",
        root: Root = "closed",
        sides: Literal[1, 2] = 1,
        along: Along = "y",
        chordwise: int = 65,
        spanwise: int = 64,
        base_points: int = 0,
        spacing: Spacing | list[float] = "half-cosine",
        clustering: float = 0.7,
        name: str = "wing",
    ):
        self.sweep_at, self.twist_at, self.along, self.name = sweep_at, twist_at, along, name
        choices(tip=(tip, Tip), root=(root, Root), along=(along, Along), sides=(sides, (1, 2)))
        panels: dict[str, Any] = {"sweep": sweep, "dihedral": dihedral}
        each: dict[str, Any] = {"chord": chord, "twist": twist, "thickness": thickness}
        each["camber"] = camber
        lists = each | ({"airfoil": airfoil} if isinstance(airfoil, list | tuple) else {})
        count = station_count(lists, {"span": span} | panels, "wing")
        self._sections(airfoil, count, section_parameters, chordwise, spacing)
        reach, self.reach = reaches("span", span, count)
        self._numbers(reach, each, panels, placed(origin, sides == 2, "a wing with two sides"))
        self._rows(reach, spanwise, clustering, loft, tip)
        self.layout = self._laid(base_points, tip, root, sides)

    def _numbers(
        self, reach: np.ndarray, each: dict[str, Any], panels: dict[str, Any], origin: np.ndarray
    ) -> None:
        """Name the parameters."""
        count = len(self.thick)
        if each["thickness"] is None:
            each["thickness"] = self.thick[:1] if np.ptp(self.thick) == 0 else self.thick
        own = {key: spread(key, given, count, "station") for key, given in each.items()}
        for key, given in panels.items():
            own[key] = _leaning(key, spread(key, given, count - 1, "panel"))
        positive("chord", own["chord"])
        positive("thickness", own["thickness"], "of the chord")
        names = ("chord", "sweep", "dihedral", "twist", "thickness", "camber")
        shape = {"span": reach} | {key: own[key] for key in names} | {"origin": origin}
        self.quantities = Quantities(shape | self._exposed())

    def _sections(
        self, airfoil: Any, count: int, wanted: bool | list[str], chordwise: int, spacing: Any
    ) -> None:
        """Draw the airfoils by their own values."""
        each = airfoil if isinstance(airfoil, list | tuple) else [airfoil] * count
        made: dict[int, AbstractAirfoil] = {id(a): airfoil_of(a) for a in each}
        self.airfoils = tuple(made[id(a)] for a in each)
        blunt = {a.is_blunt for a in self.airfoils}
        if len(blunt) > 1:
            raise ParameterError(
                "the airfoils of a wing must all be blunt or all be sharp at the trailing edge, "
                f"got {', '.join(a.name for a in self.airfoils)}; say trailing_edge for each"
            )
        self.stations = stations(self.airfoils[0], chordwise, spacing)
        self.own = tuple(np.asarray(a.values, float) for a in self.airfoils)
        seen = {id(a): np.asarray(a.sides(a.values, self.stations)) for a in self.airfoils}
        self.drawn = np.stack([seen[id(a)] for a in self.airfoils])
        thick = {id(a): _thickest(a) for a in self.airfoils}
        self.thick = np.array([thick[id(a)] for a in self.airfoils])
        self.exposed = tuple(_wanted(a, wanted) for a in self.airfoils)

    def _exposed(self) -> dict[str, np.ndarray]:
        """The airfoils' parameters that are the wing's, by its names for them."""
        return {
            f"section {s} {name}": own[a.parameters[name]]
            for s, (a, own) in enumerate(zip(self.airfoils, self.own, strict=True))
            for name in self.exposed[s]
        }

    def _rows(
        self, span: np.ndarray, spanwise: int, clustering: float, loft: str, tip: str
    ) -> None:
        """Where the rows of points lie, and what each has of the stations."""
        places = self.reach @ span / span[-1]
        rows = row_places(places, spanwise, clustering, (False, True))
        self.weights = loft_weights(places, rows, loft)
        self.slope = loft_weights(places, rows[-1:], loft, 1)[0]
        beyond = np.clip((rows - places[-2]) / (1 - places[-2]), 0, 1)
        self.thinning = np.sqrt(1 - beyond**2) if tip == "closed" else np.ones(len(rows))

    def _laid(self, base_points: int, tip: str, root: str, sides: int) -> WingLayout:
        blunt = self.airfoils[0].is_blunt
        if base_points < 0 or (base_points and not blunt):
            raise ParameterError(
                f"base_points = {base_points}: it must be 0 or more, and 0 where the trailing edge "
                "is sharp"
            )
        ends = {"tip": (-1, tip), "root": (0, "flat")}
        edges = {k: self._edges(s, how) for k, (s, how) in ends.items()}
        return WingLayout(
            rows=len(self.weights),
            side=len(self.stations),
            base=base_points,
            is_blunt=blunt,
            tip=tip,
            root="open" if sides == 2 else root,
            tip_edges=() if tip == "closed" else edges["tip"],
            root_edges=edges["root"],
            is_whole=sides == 2,
        )

    def _edges(self, station: int, kind: str) -> tuple[int, ...]:
        """Edges across a cap at a station, by the section with the thickness asked for."""
        outlines = np.asarray(self._outlines(self.quantities.parted(self.values)))
        upper, lower = outlines[station]
        return cap_edges(upper, lower, kind, self.airfoils[0].is_blunt)

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Wing":
        airfoil = options.pop("airfoil", "naca 0012")
        if isinstance(airfoil, list):
            airfoil = [airfoil_of(each, folder) for each in airfoil]
        else:
            airfoil = airfoil_of(airfoil, folder)
        return cls(airfoil=airfoil, **options)

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
        count = self.weights.shape[1]
        outlines = self._outlines(given)
        leading, chord, twist = self._frames(given)
        cosine, sine = (chord * f(twist) for f in (jnp.cos, jnp.sin))
        aft, up = outlines[..., 0], outlines[..., 1]
        turns = [each[:, None, None] for each in (cosine, sine)]
        x = leading[:, 0, None, None] + turns[0] * aft + turns[1] * up
        z = leading[:, 2, None, None] - turns[1] * aft + turns[0] * up
        at = jnp.stack([x, z]).reshape(2, count, -1)
        rows = jnp.einsum("rs,asp->rpa", self.weights, at)
        y = jnp.broadcast_to((self.weights @ leading[:, 1])[:, None], rows.shape[:2])
        both = jnp.stack([rows[..., 0], y, rows[..., 1]], axis=-1)
        upper, lower = jnp.split(both, 2, axis=1)
        if self.layout.tip == "closed":
            middle, thinning = (upper + lower) / 2, self.thinning[:, None, None]
            upper, lower = (
                middle + thinning * (upper - middle),
                middle + thinning * (lower - middle),
            )
        grown = jnp.einsum("s,asp->pa", self.slope, at) / (self.slope @ leading[:, 1])
        slopes = jnp.stack([grown[:, 0], jnp.ones(len(grown)), grown[:, 1]], axis=1)
        points = self.layout.points(upper, lower, slopes.reshape(2, -1, 3))
        return points if self.along == "y" else points @ _AXES[self.along]

    def _frames(self, given: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        """Leading edge, chord and twist of each station."""
        count = self.weights.shape[1]
        chord, twist = (jnp.broadcast_to(given[key], (count,)) for key in ("chord", "twist"))
        away = self.reach @ given["span"]
        runs = [
            jnp.concatenate([jnp.zeros(1), jnp.cumsum(jnp.diff(away) * jnp.tan(given[key]))])
            for key in ("sweep", "dihedral")
        ]
        start = given["origin"]
        y = away + (start[1] if len(start) == 3 else 0.0)
        x = start[0] + runs[0] + self.sweep_at * (chord[0] - chord * jnp.cos(twist))
        z = start[-1] + runs[1] + self.twist_at * chord * jnp.sin(twist)
        return jnp.stack([x, y, z], axis=1), chord, twist

    def _outlines(self, given: Mapping[str, Array]) -> Array:
        """Both sides of each station's section for the chord 1, shape (s, 2, c, 2)."""
        if any(self.exposed):
            outlines = jnp.stack([self._outline(s, given) for s in range(len(self.airfoils))])
        else:
            outlines = jnp.asarray(self.drawn)
        middle, half = (outlines[:, 0] + outlines[:, 1]) / 2, (outlines[:, 0] - outlines[:, 1]) / 2
        count = len(outlines)
        camber = jnp.broadcast_to(given["camber"], (count,))[:, None]
        middle = middle.at[..., 1].multiply(camber)
        half = half * (jnp.broadcast_to(given["thickness"], (count,)) / self.thick)[:, None, None]
        return jnp.stack([middle + half, middle - half], axis=1)

    def _outline(self, station: int, given: Mapping[str, Array]) -> Array:
        foil, own = self.airfoils[station], jnp.asarray(self.own[station])
        for name in self.exposed[station]:
            own = own.at[foil.parameters[name]].set(given[f"section {station} {name}"])
        return foil.sides(own, self.stations)

    @property
    @override
    def geometry(self) -> Surface:
        points = np.asarray(self(self.values))
        faces, tags = self.layout.faces(points)
        faces = faces[:, ::-1] if self.along == "-y" else faces
        names = np.array([self.name, f"{self.name} tip", f"{self.name} root"])
        used, tags = np.unique(tags, return_inverse=True)
        return Surface(points, faces, tags, tuple(names[used].tolist()))


def _leaning(name: str, angles: np.ndarray) -> np.ndarray:
    if not np.all(np.abs(angles) <= STEEPEST):
        raise ParameterError(
            f"{name} must lie within 80 degrees either way [rad], got {angles.tolist()}; were "
            "they degrees? A wing that stands up is one with along = 'z'"
        )
    return angles


def _wanted(airfoil: AbstractAirfoil, wanted: bool | list[str]) -> tuple[str, ...]:
    """Names of an airfoil's parameters that are to be the wing's."""
    if isinstance(wanted, bool):
        return tuple(airfoil.parameters) if wanted else ()
    for name in wanted:
        if name not in airfoil.parameters:
            raise ParameterError(
                f"{airfoil.name} has no parameter {name!r}; section_parameters may be: "
                f"{', '.join(airfoil.parameters)}"
            )
    return tuple(wanted)


def _thickest(airfoil: AbstractAirfoil) -> float:
    """The greatest distance of the two sides, between close stations by a parabola."""
    upper, lower = np.asarray(airfoil.sides(airfoil.values, stations(None, 2001)))
    gap = np.linalg.norm(upper - lower, axis=1)
    k = int(np.clip(np.argmax(gap), 1, len(gap) - 2))
    before, most, after = gap[k - 1 : k + 2]
    return float(most + (after - before) ** 2 / (8 * (2 * most - before - after)))
