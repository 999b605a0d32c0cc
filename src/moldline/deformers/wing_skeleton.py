"""A wing skeleton: span, chord, sweep, dihedral and twist as controls."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from ..mesh.planform import MOST, Places, Planform, planform
from ..mesh.slices import NEAR
from ..numerics.rotation import increments, product, quaternion
from .loft import Loft, Lofting
from .posed import AbstractPosed

Sections = Literal["streamwise", "turned"]

ROOM = 0.05
"""What the control points stand off each section, in chords."""

UPRIGHT = np.radians(80)
"""Largest sweep and dihedral at rest: beyond, their tangents mean nothing."""


class WingSkeleton(AbstractPosed):
    """Move a wing by its planform: x is streamwise, y along the span, z up.

    At each station the section at rest has a leading edge, a chord and a twist; controls change
    them. A section moves in its own plane y = const by an affine map: `chord` scales it, in x and
    z alike, `twist` turns it, positive nose up (a right-handed turn about +y), `sweep` (positive
    aft) and `dihedral` (positive up) of a panel shear it along x and z, and `span` spreads the
    stations. Between stations it is lofted, beyond the last one everything follows rigidly.

    The line at the fraction `sweep_at` of the chords carries x, that at `twist_at` carries z:
    chord and twist leave x of the former and z of the latter where they are. So what a planform
    reads back from the moved wing is what was asked for, whatever is changed together. With both
    fractions alike twist is a pure rotation about that line.

    On request sections are turned instead of sheared: each but the root's, about its point of that
    line, by the mean of what sweep and dihedral change beside it. The line has the sweep and
    dihedral asked for; chord and twist are those of the turned section, not of a streamwise one.

    Controls, in this order and by these names in `parameters`: `span` change of the semispan [m],
    `chord` of each station [m], `sweep` and `dihedral` of each panel [rad], `twist` of each
    station [rad]. They are changes; `values` are what the wing has at rest.

    Attributes
    ----------
    net
        The affine maps of the stations, lofted.
    twist
        At rest, for each station [rad].
    sweep, dihedral
        At rest, for each panel [rad].
    semispan
        At rest, from y = 0 to the tip [m].
    sweep_at, twist_at
        Fractions of the chord where sweep, and dihedral and twist, are taken.
    sections
        "streamwise" or "turned".
    """

    net: Loft
    twist: Float[np.ndarray, "s"]
    sweep: Float[np.ndarray, "p"]
    dihedral: Float[np.ndarray, "p"]
    semispan: float = eqx.field(static=True)
    sweep_at: float = eqx.field(static=True)
    twist_at: float = eqx.field(static=True)
    sections: str = eqx.field(static=True)

    def __init__(
        self,
        plan: Planform,
        semispan: float,
        *,
        sides: Sequence[int] = (1,),
        sweep_at: float = 0.0,
        twist_at: float = 0.25,
        loft: str = "linear",
        sections: str = "streamwise",
    ):
        if sections not in Sections.__args__:  # type: ignore[attr-defined]
            raise ParameterError(f"sections must be streamwise or turned, got {sections!r}")
        if sections == "turned" and sweep_at != twist_at:
            raise ParameterError(
                "turned sections turn about one line: give sweep_at and twist_at alike, got "
                f"{sweep_at} and {twist_at}"
            )
        self.sections = sections
        self.twist, self.semispan = plan.twist, float(semispan)
        self.sweep, self.dihedral = plan.sweep_at(sweep_at), plan.dihedral_at(twist_at)
        self.sweep_at, self.twist_at = float(sweep_at), float(twist_at)
        steep = np.abs(np.concatenate([self.sweep, self.dihedral])) > UPRIGHT
        if np.any(steep):
            raise GeometryError(
                f"panel {int(np.argmax(steep)) % len(self.sweep)} of the wing stands across y by "
                "more than 80 degrees; leave it out, beyond the last station"
            )
        heights = [(edge - plan.leading[:, 2]) / plan.chord for edge in (plan.low, plan.high)]
        self.net = Loft(
            "y",
            np.abs(plan.stations),
            plan.leading[:, [0, 2]],
            plan.chord,
            [[-ROOM, 1 + ROOM], [heights[0].min() - ROOM, heights[1].max() + ROOM]],
            sides,
            loft,
        )

    @classmethod
    def fitted(
        cls,
        surface: Any,
        stations: int | Places = 5,
        component: str | None = None,
        **options: Any,
    ) -> "WingSkeleton":
        """On a wing as it is, half or whole, or on the component that is one.

        `stations` are places along y from the root outwards [m], or how many to spread evenly.
        """
        if not isinstance(surface, Surface):
            raise GeometryError(
                f"a skeleton is fitted to a surface, got a {type(surface).__name__}; "
                "give span and root_chord instead"
            )
        plan = planform(surface, stations, component)
        reach, sides = _sides(surface, component)
        return cls(plan, reach, sides=sides, **options)

    @classmethod
    def drawn(
        cls,
        span: float,
        root_chord: float = 1.0,
        *,
        taper: float = 1.0,
        chord: Places | None = None,
        sweep: float | Places = 0.0,
        dihedral: float | Places = 0.0,
        twist: float | Places = 0.0,
        stations: Places = (0.0, 1.0),
        root: Places = (0.0, 0.0, 0.0),
        thickness: float = 0.12,
        sides: Sequence[int] = (1, -1),
        sweep_at: float = 0.0,
        twist_at: float = 0.25,
        **options: Any,
    ) -> "WingSkeleton":
        """By numbers, which must be those of the wing it is to move.

        `span` is from y = 0 to the tip [m], `stations` are fractions from the root to the tip,
        `root` is where the root's leading edge would be without twist [m]. Chords are given one
        by one [m], or run evenly from `root_chord` to `taper` times that. Angles [rad] are one
        number or one for each panel (sweep, dihedral) or station (twist).
        """
        fractions, corner = np.array(stations, float), np.array(root, float)
        if corner.shape != (3,) or not span > corner[1] >= 0:
            raise ParameterError(
                "a wing runs from its root (x, y, z), y at least 0, to y = span, got "
                f"root = {root} and span = {span}"
            )
        if fractions.ndim != 1 or len(fractions) < 2 or np.any(np.diff(fractions) <= 0):
            raise ParameterError(f"stations are ascending fractions of span, got {stations}")
        count = len(fractions)
        places = corner[1] + fractions * (span - corner[1])
        chords = root_chord * (1 + (taper - 1) * fractions)
        chords = chords if chord is None else _spread("chord", chord, count)
        if not np.all(chords > 0):
            raise ParameterError(f"chords must be above 0, got {chords.tolist()}")
        turned = _spread("twist", twist, count)
        runs = np.diff(places) * np.tan(
            [_spread("sweep", sweep, count - 1), _spread("dihedral", dihedral, count - 1)]
        )
        x, z = np.concatenate([np.zeros((2, 1)), np.cumsum(runs, axis=1)], axis=1)
        x = x + corner[0] + sweep_at * (chords[0] - chords * np.cos(turned))
        z = z + corner[2] + twist_at * chords * np.sin(turned)
        leading = np.stack([x, places, z], axis=1)
        run = chords[:, None] * np.stack([np.cos(turned), 0 * turned, -np.sin(turned)], axis=1)
        half = thickness / 2 * chords
        ends = np.stack([z, z + run[:, 2]])
        plan = Planform(
            places, leading, leading + run, ends.min(axis=0) - half, ends.max(axis=0) + half
        )
        return cls(plan, span, sides=sides, sweep_at=sweep_at, twist_at=twist_at, **options)

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        stations: int | tuple[float, ...] = 5,
        component: str | None = None,
        span: float | None = None,
        root_chord: float | None = None,
        taper: float = 1.0,
        chord: tuple[float, ...] | None = None,
        sweep: float | tuple[float, ...] = 0.0,
        dihedral: float | tuple[float, ...] = 0.0,
        twist: float | tuple[float, ...] = 0.0,
        root: tuple[float, float, float] = (0.0, 0.0, 0.0),
        sweep_at: float = 0.0,
        twist_at: float = 0.25,
        loft: Lofting = "linear",
        sections: Sections = "streamwise",
    ) -> "WingSkeleton":
        """From a case file: by numbers where it says span, else fitted to the geometry.

        By numbers, stations are fractions of span.
        """
        rest: dict[str, Any] = {"sweep_at": sweep_at, "twist_at": twist_at, "loft": loft}
        rest["sections"] = sections
        if span is None:
            return cls.fitted(geometry, stations, component, **rest)
        if isinstance(stations, int):
            if not 2 <= stations <= MOST:
                raise ParameterError(f"stations are 2 to {MOST}, or fractions, got {stations}")
            stations = tuple(np.linspace(0, 1, stations).tolist())
        return cls.drawn(
            span,
            root_chord or 1.0,
            taper=taper,
            chord=chord,
            sweep=sweep,
            dihedral=dihedral,
            twist=twist,
            stations=stations,
            root=root,
            **rest,
        )

    @property
    @override
    def size(self) -> int:
        return 4 * len(self.twist) - 1

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        stations, panels = len(self.twist), len(self.sweep)
        counts = {"span": 1, "chord": stations, "sweep": panels, "dihedral": panels}
        counts["twist"] = stations
        ends = np.cumsum([0, *counts.values()])
        return {name: np.arange(ends[i], ends[i + 1]) for i, name in enumerate(counts)}

    @property
    @override
    def values(self) -> Vector:
        return np.concatenate(
            [[self.semispan], self.net.scales, self.sweep, self.dihedral, self.twist]
        )

    @override
    def pose(self, controls: Vector) -> Float[Array, "c"]:
        given = {name: jnp.asarray(controls)[rows] for name, rows in self.parameters.items()}
        reach = self.net.stations - self.net.stations[0]
        stretch = given["span"][0] / reach[-1]
        slopes = self._mapped(given)
        run = jnp.stack([jnp.cos(self.twist), -jnp.sin(self.twist)], axis=1)
        moved = jnp.einsum("sij,sj->si", slopes, self.net.scales[:, None] * run)
        shifts = [
            self._sheared(self.sweep, given["sweep"], stretch) - self.sweep_at * moved[:, 0],
            stretch * reach - self.sweep_at * moved[:, 1],
            self._sheared(self.dihedral, given["dihedral"], stretch) - self.twist_at * moved[:, 2],
        ]
        return self.net.carried(jnp.stack(shifts, axis=1), slopes)

    def _mapped(self, given: Mapping[str, Array]) -> Float[Array, "s 3 2"]:
        """The stations' maps of their sections, less one: displacements are zero at rest."""
        turn, growth = given["twist"], given["chord"] / self.net.scales
        along = growth * jnp.cos(turn) - 2 * jnp.sin(turn / 2) ** 2
        up = (1 + growth) * jnp.sin(turn)
        slopes = jnp.zeros((len(turn), 3, 2))
        slopes = slopes.at[:, 0].set(jnp.stack([along, up], axis=1))
        slopes = slopes.at[:, 2].set(jnp.stack([-up, along], axis=1))
        if self.sections == "streamwise":
            return slopes
        aft, rise = (_beside(given[name])[:, None] for name in ("sweep", "dihedral"))
        turned = product(quaternion(rise * np.eye(3)[0]), quaternion(-aft * np.eye(3)[2]))
        return slopes + increments(turned) @ (np.eye(3)[:, [0, 2]] + slopes)

    def _sheared(self, angles: Array, changes: Array, stretch: Array) -> Float[Array, "s"]:
        """How far a line moves at the stations when its panels' angles change [m]."""
        steeper = jnp.sin(changes) / (jnp.cos(angles) * jnp.cos(angles + changes))
        runs = jnp.diff(self.net.stations) * ((1 + stretch) * steeper + stretch * jnp.tan(angles))
        return jnp.concatenate([jnp.zeros(1), jnp.cumsum(runs)])


def _beside(changes: Array) -> Float[Array, "s"]:
    """By how much stations turn where panels do: none at the root, all at the tip."""
    middles = (changes[:-1] + changes[1:]) / 2
    return jnp.concatenate([jnp.zeros(1), middles, changes[-1:]])


def _sides(surface: Surface, component: str | None) -> tuple[float, tuple[int, ...]]:
    """How far a wing reaches from y = 0 [m], and to which sides."""
    used = np.unique(surface.faces) if component is None else surface.component(component)
    y = np.asarray(surface.points)[used, 1]
    reaches = {1: float(y.max()), -1: float(-y.min())}
    least = NEAR * max(reaches.values())
    sides = tuple(side for side, reach in reaches.items() if reach > least)
    return max(reaches.values()), sides


def _spread(name: str, given: float | Places, count: int) -> Float[np.ndarray, "c"]:
    """One number for each, from one for all."""
    numbers = np.array(given, float)
    if numbers.shape not in ((), (count,)):
        raise ParameterError(f"{name} takes one number or {count}, got {given}")
    return np.broadcast_to(numbers, count)
