"""A hinge: a control surface that turns about a line."""

from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from .named import AbstractNamed

Gap = Literal["sharp", "smooth"]
Place = tuple[float, float, float]


class Hinge(AbstractNamed):
    """Turn what lies behind a hinge line, between its two ends, by an angle.

    The one control is the angle [rad], positive with the trailing edge down. The surface ends
    spanwise in planes along `aft` through the ends of the line. Behind means on the side of `aft`
    of the plane through the line that is normal to both.

    Attributes
    ----------
    start, end
        The hinge line [m].
    aft
        Chordwise direction, by default streamwise, x.
    up
        Away from where the trailing edge goes, by default z; say y for a rudder.
    gap
        "sharp": what is behind turns as one and the rest stays, to the bit; where the mesh crosses
        the hinge plane or the ends it is torn, but for the hinge line itself. "smooth": the angle
        grows from none to all over `blend_width`.
    blend_width
        Of the blend [m], half before the line and half behind.
    end_width
        The same spanwise, inside each end; by default as wide, with 0 the ends are sharp.

    Notes
    -----
    The blend is twice differentiable. It folds where, above or below the line by h, 15/8 h times
    the angle is more than `blend_width`.
    """

    start: Float[np.ndarray, "3"]
    axis: Float[np.ndarray, "3"]
    inverse: Float[np.ndarray, "3 3"]
    length: float = eqx.field(static=True)
    gap: str = eqx.field(static=True)
    blend_width: float = eqx.field(static=True)
    end_width: float = eqx.field(static=True)

    def __init__(
        self,
        start: Any,
        end: Any,
        *,
        aft: Any = (1.0, 0.0, 0.0),
        up: Any = (0.0, 0.0, 1.0),
        gap: str = "smooth",
        blend_width: float | None = None,
        end_width: float | None = None,
    ):
        if gap not in ("sharp", "smooth"):
            raise ParameterError(f"gap must be sharp or smooth, got {gap!r}")
        widths = _widths(gap, blend_width, end_width)
        self.start, line = _vector("start", start), _vector("end", end) - _vector("start", start)
        self.length = float(np.linalg.norm(line))
        if self.length == 0:
            raise ParameterError(f"a hinge line needs two places, start and end are both {end}")
        along, chordwise = line / self.length, _unit("aft", aft)
        normal = np.cross(along, chordwise)
        if np.linalg.norm(normal) < 1e-6:
            raise ParameterError(f"aft must not run along the hinge line, got {aft}")
        rise = normal @ _unit("up", up)
        if abs(rise) < 1e-6:
            raise ParameterError(
                f"up must not lie in the plane of the hinge line and aft, got {up}; for a rudder "
                "say up = (0, 1, 0)"
            )
        self.axis = -np.sign(rise) * along
        self.inverse = np.linalg.inv(np.stack([along, chordwise, normal]))
        self.gap, (self.blend_width, self.end_width) = gap, widths

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        start: Place,
        end: Place,
        aft: Place = (1.0, 0.0, 0.0),
        up: Place = (0.0, 0.0, 1.0),
        gap: Gap = "smooth",
        blend_width: float | None = None,
        end_width: float | None = None,
    ) -> "Hinge":
        """From a case file."""
        widths = {"blend_width": blend_width, "end_width": end_width}
        return cls(start, end, aft=aft, up=up, gap=gap, **widths)

    @property
    @override
    def size(self) -> int:
        return 1

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        """Number of the control by its name, "angle"."""
        return {"angle": np.array([0])}

    @property
    @override
    def values(self) -> Vector:
        """The angle at rest [rad]."""
        return np.zeros(1)

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        lever = jnp.asarray(points) - self.start
        angle = (controls[0] * self.share(points))[:, None]
        across = jnp.cross(self.axis, lever)
        turn = jnp.sin(angle) * across
        return points + turn + 2 * jnp.sin(angle / 2) ** 2 * jnp.cross(self.axis, across)

    def share(self, points: Points) -> Float[Array, "n"]:
        """Which part of the angle each point turns by, from 0 to 1."""
        along, behind, _ = ((jnp.asarray(points) - self.start) @ self.inverse).T
        chordwise = _rise(behind + self.blend_width / 2, self.blend_width)
        ends = _rise(along, self.end_width) * _rise(self.length - along, self.end_width)
        return chordwise * ends


def _rise(place: Array, width: float) -> Array:
    """From 0 at 0 to 1 at the width, with no slope or curvature at either."""
    if width == 0:
        return jnp.where(place > 0, 1.0, 0.0)
    t = jnp.clip(place / width, 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t**2)


def _widths(gap: str, blend_width: float | None, end_width: float | None) -> tuple[float, float]:
    given = [w for w in (blend_width, end_width) if w is not None]
    if gap == "sharp":
        if given:
            raise ParameterError("a sharp gap has no width; leave out blend_width and end_width")
        return 0.0, 0.0
    if blend_width is None or not 0 < blend_width < np.inf or not 0 <= given[-1] < np.inf:
        raise ParameterError(
            "a smooth gap needs a blend_width above 0, and an end_width not below it if any [m], "
            f"got {blend_width} and {end_width}"
        )
    return float(blend_width), float(given[-1])


def _vector(name: str, value: Any) -> np.ndarray:
    found = np.asarray(value, float)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise ParameterError(f"{name} must be three finite numbers, got {value}")
    return found


def _unit(name: str, value: Any) -> np.ndarray:
    found = _vector(name, value)
    length = np.linalg.norm(found)
    if length == 0:
        raise ParameterError(f"{name} must have a direction, got {value}")
    return found / length
