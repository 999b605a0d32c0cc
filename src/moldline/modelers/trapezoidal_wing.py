"""A wing of two stations, by the numbers of its trapezium."""

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Scalar, Vector
from ..errors import ParameterError
from ..mesh import Surface
from .airfoils import airfoil as airfoil_of
from .base import AbstractShape, shaped
from .quantities import Quantities, positive, radians
from .wing import Wing

REFUSED = {"section_parameters": None}
"""What this wing does not take."""


class TrapezoidalWing(AbstractShape):
    """A wing whose only parameters are span, area or root chord, taper, sweep, dihedral and twist.

    Parameters have these names. `span` is from the root to the tip and `area` that of one side,
    [m] and [m²]; `chord` is the root's, in place of `area`. `taper` is tip by root chord, `twist`
    the tip's against the root, positive nose up.

    Attributes
    ----------
    quantities
        The parameters.
    wing
        What is made of them; all else that it could change stays.
    """

    quantities: Quantities
    wing: Wing

    def __init__(
        self,
        span: float,
        area: float | None = None,
        *,
        chord: float | None = None,
        taper: float = 1.0,
        sweep: float = 0.0,
        dihedral: float = 0.0,
        twist: float = 0.0,
        degrees: bool = False,
        **options: Any,
    ):
        if REFUSED.keys() & options:
            raise ParameterError("section_parameters are those of a Wing, which has more of them")
        if (area is None) == (chord is None):
            raise ParameterError(f"give area or chord, got area = {area} and chord = {chord}")
        size = {"area": area} if chord is None else {"chord": chord}
        angles = radians(degrees, sweep=sweep, dihedral=dihedral, twist=twist)
        given = {"span": span, **size, "taper": taper, **angles}
        for name, value in given.items():
            if np.ndim(value):
                raise ParameterError(
                    f"{name} of a trapezoidal wing is one number, got {value}; a Wing takes lists"
                )
        self.quantities = Quantities(given)
        own = {name: float(own[0]) for name, own in self.quantities.parted(self.values).items()}
        _check(own)
        root, tip = _chords(own)
        self.wing = Wing(
            own["span"],
            [float(root), float(tip)],
            sweep=own["sweep"],
            dihedral=own["dihedral"],
            twist=[0.0, own["twist"]],
            **options,
        )

    @classmethod
    @override
    def options(cls) -> dict[str, inspect.Parameter]:
        own = dict(inspect.signature(cls, eval_str=True).parameters)
        del own["options"]
        return own | {k: p for k, p in Wing.options().items() if k not in own | REFUSED}

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "TrapezoidalWing":
        return cls(airfoil=airfoil_of(options.pop("airfoil", "naca 0012"), folder), **options)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return self.quantities.rows

    @property
    @override
    def values(self) -> Vector:
        return self.quantities.values

    @override
    def check(self, parameters: Vector) -> None:
        given = self.quantities.parted(np.asarray(parameters))
        _check({name: float(own[0]) for name, own in given.items()})
        self.wing.check(np.asarray(self._full(jnp.asarray(parameters))))

    @override
    def __call__(self, parameters: Vector) -> Points:
        return self.wing(self._full(parameters))

    def _full(self, parameters: Vector) -> Array:
        """Parameters of the wing."""
        given = {name: own[0] for name, own in self.quantities.parted(parameters).items()}
        root, tip = _chords(given)
        full = jnp.concatenate([jnp.asarray(own) for own in self.wing.quantities.numbers])
        rows = self.wing.parameters
        for name in ("span", "sweep", "dihedral"):
            full = full.at[rows[name]].set(given[name])
        full = full.at[rows["chord"]].set(jnp.stack([root, tip]))
        return full.at[rows["twist"][1]].set(given["twist"])

    @property
    @override
    def geometry(self) -> Surface:
        return self.wing.geometry.moved(np.asarray(shaped(self, self.values)))


def _check(given: Mapping[str, float]) -> None:
    for name, unit in {"span": "m", "area": "m²", "chord": "m", "taper": "1"}.items():
        if name in given:
            positive(name, np.array(given[name]), unit)


def _chords(given: dict[str, Any]) -> tuple[Scalar | Array, Scalar | Array]:
    """Of the root and the tip."""
    root = given.get("chord")
    if root is None:
        root = 2 * given["area"] / (given["span"] * (1 + given["taper"]))
    return root, root * given["taper"]
