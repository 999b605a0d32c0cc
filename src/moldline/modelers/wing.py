"""A wing lofted through sections."""

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
from .airfoils import airfoil as airfoil_of
from .base import AbstractShape, shaped
from .loft import Lofting, loft_weights, row_places
from .profile import Profile, scaled
from .quantities import (
    Numbers,
    Quantities,
    affordable,
    ascending,
    base_points_of,
    choices,
    finite,
    placed,
    positive,
    radians,
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
    profiles
        The airfoil of each station; those alike are the same object.
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
    """

    quantities: Quantities
    profiles: tuple[Profile, ...]
    reach: np.ndarray
    weights: np.ndarray
    slope: np.ndarray
    thinning: np.ndarray
    layout: WingLayout
    sweep_at: float = eqx.field(static=True)
    twist_at: float = eqx.field(static=True)
    along: str = eqx.field(static=True)
    name: str = eqx.field(static=True)

    def __init__(
        self,
        span: Numbers,
        chord: Numbers,
        *,
        sweep: Numbers = 0.0,
        dihedral: Numbers = 0.0,
        twist: Numbers = 0.0,
        thickness: Numbers | None = None,
        camber: Numbers = 1.0,
        airfoil: Any = "naca 0012",
        section_parameters: bool | list[str] = False,
        origin: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
        degrees: bool = False,
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
        affordable(chordwise=chordwise, spanwise=spanwise)
        finite(sweep_at=sweep_at, twist_at=twist_at)
        choices(tip=(tip, Tip), root=(root, Root), along=(along, Along), sides=(sides, (1, 2)))
        if sides == 2 and along != "y":
            raise ParameterError(f"a wing with two sides lies along y, got along = {along!r}")
        angles = radians(degrees, sweep=sweep, dihedral=dihedral, twist=twist)
        panels: dict[str, Any] = {key: angles[key] for key in ("sweep", "dihedral")}
        each: dict[str, Any] = {"chord": chord, "twist": angles["twist"], "thickness": thickness}
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
        count, thick = len(self.profiles), [profile.thick for profile in self.profiles]
        if each["thickness"] is None:
            each["thickness"] = thick if np.ptp(thick) else thick[0]
        own = {key: spread(key, given, count, "station") for key, given in each.items()}
        own |= {key: spread(key, given, count - 1, "panel") for key, given in panels.items()}
        _check(own)
        names = ("chord", "sweep", "dihedral", "twist", "thickness", "camber")
        shape = {"span": reach} | {key: own[key] for key in names} | {"origin": origin}
        sections = {
            f"section {s} {name}": numbers
            for s, profile in enumerate(self.profiles)
            for name, numbers in profile.numbers.items()
        }
        self.quantities = Quantities(shape | sections)

    def _sections(
        self, airfoil: Any, count: int, wanted: bool | list[str], chordwise: int, spacing: Any
    ) -> None:
        """Draw the airfoils, each once."""
        each = airfoil if isinstance(airfoil, list | tuple) else [airfoil] * count
        made = {id(a): airfoil_of(a) for a in each}
        if len({a.is_blunt for a in made.values()}) > 1:
            raise ParameterError(
                "the airfoils of a wing must all be blunt or all be sharp at the trailing edge, "
                f"got {', '.join(a.name for a in made.values())}; say trailing_edge for each"
            )
        at = stations(made[id(each[0])], chordwise, spacing)
        drawn = {key: Profile(a, at, wanted) for key, a in made.items()}
        self.profiles = tuple(drawn[id(a)] for a in each)

    def _rows(
        self, span: np.ndarray, spanwise: int, clustering: float, loft: str, tip: str
    ) -> None:
        """Where the rows of points lie, and what each has of the stations."""
        places = self.reach @ span / span[-1]
        rows = row_places(places, spanwise, clustering, (False, True))
        self.weights = loft_weights(places, rows, loft)
        chord = np.broadcast_to(self.quantities.parted(self.values)["chord"], len(places))
        if np.any(np.diff(self.weights @ places) <= 0) or np.any(self.weights @ chord <= 0):
            raise GeometryError(
                f"a {loft} loft through chords of {chord.tolist()} turns back or falls below 0 "
                "between its stations; use more stations, or loft = 'linear'"
            )
        self.slope = loft_weights(places, rows[-1:], loft, 1)[0]
        beyond = np.clip((rows - places[-2]) / (1 - places[-2]), 0, 1)
        self.thinning = np.sqrt(1 - beyond**2) if tip == "closed" else np.ones(len(rows))

    def _laid(self, base_points: int, tip: str, root: str, sides: int) -> WingLayout:
        blunt = self.profiles[0].airfoil.is_blunt
        given = self.quantities.parted(self.values)
        drawn = np.stack([profile.drawn for profile in self.profiles])
        outlines = np.stack(self._scaled(drawn, given), axis=1)
        return WingLayout(
            rows=len(self.weights),
            side=outlines.shape[2],
            base=base_points_of(base_points, blunt),
            is_blunt=blunt,
            tip=tip,
            root="open" if sides == 2 else root,
            tip_edges=() if tip == "closed" else cap_edges(outlines[-1], tip, blunt),
            root_edges=cap_edges(outlines[0], "flat", blunt),
            is_whole=sides == 2,
        )

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Wing":
        airfoil = options.pop("airfoil", "naca 0012")
        if isinstance(airfoil, list):
            airfoil = [airfoil_of(each, folder) for each in airfoil]
        else:
            airfoil = airfoil_of(airfoil, folder)
        return cls(airfoil=airfoil, **options)

    @override
    def check(self, parameters: Vector) -> None:
        given = self.quantities.parted(np.asarray(parameters))
        ascending("span", np.asarray(given["span"]))
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
        points = points if self.along == "y" else points @ _AXES[self.along]
        place = given["origin"]
        return points + (place if len(place) == 3 else jnp.stack([place[0], 0.0, place[1]]))

    def _frames(self, given: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        """Leading edge, from the origin, chord and twist of each station."""
        count = self.weights.shape[1]
        chord, twist = (jnp.broadcast_to(given[key], (count,)) for key in ("chord", "twist"))
        away = self.reach @ given["span"]
        runs = [
            jnp.concatenate([jnp.zeros(1), jnp.cumsum(jnp.diff(away) * jnp.tan(given[key]))])
            for key in ("sweep", "dihedral")
        ]
        x = runs[0] + self.sweep_at * (chord[0] - chord * jnp.cos(twist))
        z = runs[1] + self.twist_at * chord * jnp.sin(twist)
        return jnp.stack([x, away, z], axis=1), chord, twist

    def _outlines(self, given: Mapping[str, Array]) -> Array:
        """Both sides of each station's section for the chord 1, shape (s, 2, c, 2)."""
        sides = []
        for s, profile in enumerate(self.profiles):
            sides.append(profile.sides({k: given[f"section {s} {k}"] for k in profile.exposed}))
        return jnp.stack(self._scaled(jnp.stack(sides), given), axis=1)

    def _scaled(self, sides: Array, given: Mapping[str, Array]) -> tuple[Array, Array]:
        """With the thickness and camber asked for."""
        one = np.ones(len(self.profiles))
        thick = one * np.array([profile.thick for profile in self.profiles])
        return scaled(sides, one * given["thickness"] / thick, one * given["camber"])

    @property
    @override
    def geometry(self) -> Surface:
        points = np.asarray(shaped(self, self.values))
        faces, tags = self.layout.faces(points)
        faces = faces[:, ::-1] if self.along == "-y" else faces
        names = np.array([self.name, f"{self.name} tip", f"{self.name} root"])
        is_used = np.bincount(tags, minlength=3) > 0
        tags = (np.cumsum(is_used) - 1)[tags]
        return Surface(points, faces, tags, tuple(names[is_used].tolist()))


def _check(given: Mapping[str, Any]) -> None:
    for name in ("sweep", "dihedral"):
        if not np.all(np.abs(given[name]) <= STEEPEST):
            raise ParameterError(
                f"{name} must lie within 80 degrees either way [rad], got {given[name].tolist()}; "
                "were they degrees? A wing that stands up is one with along = 'z'"
            )
    positive("chord", given["chord"])
    positive("thickness", given["thickness"], "of the chord")
