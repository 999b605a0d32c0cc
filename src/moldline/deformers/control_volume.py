"""Control volumes: free-form deformation by curved, body-fitted boxes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector, is_concrete
from ..errors import GeometryError, ParameterError
from ..mesh import Grid, Surface
from ..mesh.io import METRES, found, read, su2
from ..mesh.io.su2_boxes import read_boxes
from ..mesh.planform import planform
from ..numerics.inversion import Places
from .base import AbstractBinding, DefinedBinding
from .embedding import EmbeddedBinding, Embedding, Part
from .generators import along_wing
from .net import AXES, AbstractControlNet, grid_lines
from .refinement import Finer, Transfer, counted, cut, elevated, kept
from .volume_frame import Box, Frame, as_array

Outside = Literal["refuse", "keep"]

NAMED = 3
"""Points outside that an error names."""

PLANFORM = 33
"""Stations at least where the sections of a wing are taken for its box."""

HALVINGS = 40
"""Of a mesh edge, to find where it leaves the volumes."""


class ControlVolume(AbstractControlNet):
    """Move what is inside some curved boxes by their control points.

    A box is a tensor-product B-spline of its control points, as well fitted to a body as these
    are. Each point is embedded at rest: its box coordinates are found by Newton's method. Then it
    moves by the sum of the control points' displacements, each with its weight there. Control
    points that boxes have in common, on a shared face, are one. Controls are their displacements
    in space [m], and the axes are those of space.

    Attributes
    ----------
    frame
        The boxes at rest.
    outside
        "refuse": points in no box are an error that names them. "keep": they stay.
    frozen
        Which control points never move, whatever the controls say, shape (m,).

    Notes
    -----
    Points that an earlier stage moves out of all boxes stay, whatever `outside` says.
    Source: Sederberg and Parry, Free-Form Deformation of Solid Geometric Models, SIGGRAPH 1986;
    docs/theory/control_volume.md derives the embedding.
    """

    frame: Frame = eqx.field(static=True)
    outside: str = eqx.field(static=True)
    frozen: np.ndarray

    def __init__(
        self, boxes: Sequence[Box], *, outside: str = "refuse", freeze: Sequence[str] = ()
    ):
        if outside not in ("refuse", "keep"):
            raise ParameterError(f"outside must be refuse or keep, got {outside!r}")
        self.frame = Frame(boxes)
        self.outside = outside
        self.frozen = self.frame.sides(freeze)

    @classmethod
    def read(
        cls,
        path: Path | str,
        *,
        units: str | None = None,
        names: Sequence[str] | None = None,
        degree: int | Sequence[int] | None = None,
        **options: Any,
    ) -> "ControlVolume":
        """From a PLOT3D file of boxes, or from the FFD boxes inside an SU2 mesh.

        `units` is the file's unit of length; `names` chooses some of its boxes: PLOT3D's are
        called 1, 2 ..., SU2's by their tags. `degree` is cubic for PLOT3D where the counts
        allow it, and what the file says for SU2.
        """
        boxes = _in_file(path, METRES[units] if units else 1.0, degree)
        known = {box.name: box for box in boxes}
        unknown = [name for name in names or () if name not in known]
        if unknown:
            raise ParameterError(f"{path}: no box named {unknown[0]!r}; it has: {', '.join(known)}")
        return cls([known[name] for name in names or known], **options)

    @classmethod
    def along_wing(
        cls,
        surface: Any,
        shape: Sequence[int],
        *,
        component: str | None = None,
        stations: Sequence[float] | None = None,
        margin: float | Sequence[float] = 0.05,
        degree: int | Sequence[int] = 3,
        **options: Any,
    ) -> "ControlVolume":
        """One box along a wing, half or whole, or along the component that is one: it encloses it.

        `shape` counts control points along the chord (i), the span (j) and upwards (k); x is
        streamwise, y along the span, z up. Its sections are as wide and high as the wing's there,
        and swept, tapered and twisted as they are; `margin` is what they are larger by at each
        side, and the box beyond the tip, as a fraction. `stations` are the places along y of the
        spanwise rows [m], such as one at a kink. A half wing's box ends on its plane y = 0.
        """
        if not isinstance(surface, Surface):
            raise GeometryError(f"a wing's box needs a surface, got a {type(surface).__name__}")
        counts, degrees = counted(shape), (degree,) * 3 if isinstance(degree, int) else degree
        if min(counts) < 2:
            raise ParameterError(f"a wing's box needs 2 control points each way, got {counts}")
        points = np.asarray(surface.points)
        if component is not None:
            points = points[surface.component(component)]
        plan = planform(surface, max(PLANFORM, counts[1]), component)
        box = along_wing(points, plan, counts, margin, degrees, stations)
        return cls([Box.of("wing", box, degrees)], **options)

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        file: Path | None = None,
        units: Literal["m", "cm", "mm", "in", "ft"] | None = None,
        names: tuple[str, ...] | None = None,
        wing: bool = False,
        shape: tuple[int, int, int] | None = None,
        component: str | None = None,
        stations: tuple[float, ...] | None = None,
        margin: float | tuple[float, float, float] = 0.05,
        degree: int | tuple[int, int, int] | None = None,
        outside: Outside = "refuse",
        freeze: tuple[str, ...] = (),
    ) -> "ControlVolume":
        """From a case file: the boxes in a file, or one along the geometry's wing."""
        rest: dict[str, Any] = {"outside": outside, "freeze": freeze}
        if file is not None and not wing:
            return cls.read(file, units=units, names=names, degree=degree, **rest)
        if file is not None or not wing or shape is None:
            raise ParameterError("a control volume takes either file, or wing = true and shape")
        rest |= {"component": component, "stations": stations, "margin": margin}
        return cls.along_wing(geometry, shape, degree=degree or 3, **rest)

    def refined(self, shape: int | Sequence[int]) -> tuple["ControlVolume", Transfer]:
        """More control points that give the same shape: the volume, and the transfer of controls.

        `transfer @ controls` moves every point by the fine volume as `controls` do by this one.
        `shape` is how many each box is to have, or into how many parts each cell is cut.
        """
        return self._finer([cut(box.axes, shape, "keep") for box in self.frame.boxes])

    def elevated(self, degree: int | Sequence[int]) -> tuple["ControlVolume", Transfer]:
        """The same by polynomials of a higher degree."""
        return self._finer([elevated(box.axes, degree, "keep") for box in self.frame.boxes])

    def _finer(self, finer: Sequence[Finer]) -> tuple["ControlVolume", Transfer]:
        boxes, weights = self.frame.finer(finer)
        transfer, frozen = kept(weights, self.frozen)
        fine = ControlVolume(boxes, outside=self.outside)
        return eqx.tree_at(lambda volume: volume.frozen, fine, frozen), transfer

    @property
    @override
    def size(self) -> int:
        return 3 * len(self.frame.rest)

    @property
    @override
    def rest(self) -> Float[np.ndarray, "m 3"]:
        return self.frame.rest

    @override
    def moves(self, controls: Vector) -> Float[Array, "m 3"]:
        return controls.reshape(-1, 3) * ~self.frozen[:, None]

    @override
    def numbers(self, index: Any) -> Int[np.ndarray, "c"]:
        """From rows (i, j, k) where there is one box, else (box, i, j, k), all from 0."""
        rows = np.asarray(index, int)
        if rows.ndim == 2 and rows.shape[1] == 3 and len(self.frame.index) == 1:
            rows = np.insert(rows, 0, 0, axis=1)
        shapes = [grid.shape for grid in self.frame.index]
        if rows.ndim != 2 or rows.shape[1] != 4 or not all(_is_in(row, shapes) for row in rows):
            raise ParameterError(
                f"indices (box, i, j, k) of boxes with {shapes} control points, got {index}"
            )
        return np.array([self.frame.index[box][i, j, k] for box, i, j, k in rows])

    @override
    def direction(self, axis: str) -> Float[np.ndarray, "3"]:
        return np.eye(3)[AXES[axis]]

    @property
    @override
    def lines(self) -> Int[np.ndarray, "l 2"]:
        return np.concatenate([grid_lines(index) for index in self.frame.index])

    @override
    def samples(self, most: int) -> Points:
        side = int((most / len(self.frame.boxes)) ** (1 / 3))
        found = []
        for volume in self.frame.volumes:
            lines = [axis.samples(side) for axis in volume.axes]
            grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
            found.append(volume.at(grid.reshape(-1, 3)))
        return np.concatenate(found)

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        (places,) = self.frame.location(points)
        return points + self.frame.field(places, self.moves(controls))

    @override
    def bind(self, points: Points) -> AbstractBinding:
        """Raises GeometryError where points lie in no box and `outside` is "refuse"."""
        if not is_concrete(points):
            return DefinedBinding(self, points)
        places = self.embedded(points)
        lost = np.flatnonzero(places.volume < 0)
        if len(lost) and self.outside == "refuse":
            raise GeometryError(self._lost(np.asarray(points), lost, places))
        return self._bound(np.asarray(points), places)

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        if not is_concrete(points, controls):
            return self(points, controls)
        points = np.asarray(points)
        return self._bound(points, self.frame.locate(points))(controls)

    def embedded(self, points: Points) -> Places:
        """Where each point lies, how far it is missed, and Newton's steps; shows progress."""
        return self.frame.locate(np.asarray(points), progress=True)

    @override
    def tears(self, points: Points, edges: Array, controls: Vector) -> tuple[Array, Array]:
        points, edges = np.asarray(points), np.asarray(edges)
        inside = self.frame.locate(points).volume >= 0
        start, end = points[edges.T]
        start, end = np.where(inside[edges.T[0]][:, None], (start, end), (end, start))
        crossing = inside[edges].any(axis=1) & ~inside[edges].all(axis=1)
        low, high = start[crossing], end[crossing]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            still = (self.frame.locate(middle).volume >= 0)[:, None]
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        return low, np.linalg.norm(
            np.asarray(self.follow(low, jnp.asarray(controls))) - low, axis=1
        )

    def _bound(self, points: np.ndarray, places: Places) -> EmbeddedBinding:
        whole = len(self.frame.boxes) == 1 and bool(np.all(places.volume == 0))
        parts = []
        for number, box in enumerate(self.frame.boxes):
            rows = np.flatnonzero(places.volume == number)
            if len(rows):
                u = places.u if whole else places.u[rows]
                parts.append(Part(box.axes, self.frame.index[number], u, None if whole else rows))
        located = as_array(places)

        def field(moves: Array) -> Array:
            return self.frame.field(located, moves)

        return EmbeddedBinding(self, Embedding(points, parts, len(self.rest), field))

    def _lost(self, points: np.ndarray, lost: np.ndarray, places: Places) -> str:
        first = "; ".join(
            f"point {i} at ({', '.join(f'{x:.6g}' for x in points[i])})"
            + (f", {places.miss[i]:.2g} from it" if np.isfinite(places.miss[i]) else "")
            for i in lost[:NAMED]
        )
        spans = [
            " x ".join(f"{a:.4g}..{b:.4g}" for a, b in zip(p.min(0), p.max(0), strict=True))
            for p in (self.rest, points)
        ]
        return (
            f"{len(lost)} of {len(points)} points lie outside the control volume (first: {first}); "
            f"enlarge it, mind its unit of length (it spans {spans[0]}, the points {spans[1]}), or "
            'give outside = "keep" to leave such points where they are'
        )


def _is_in(row: np.ndarray, shapes: Sequence[tuple[int, ...]]) -> bool:
    box, *place = row.tolist()
    return 0 <= box < len(shapes) and all(
        0 <= i < n for i, n in zip(place, shapes[box], strict=True)
    )


def _in_file(path: Path | str, scale: float, degree: Any) -> list[Box]:
    """The boxes of a PLOT3D file or of an SU2 mesh."""
    if found(path) is su2:
        boxes = read_boxes(path)
        if not boxes:
            raise GeometryError(f"{path}: the mesh has no FFD box; name the file that has them")
        return [Box.of(b.name, scale * b.points, degree or b.degrees) for b in boxes]
    grid = read(path)
    if not isinstance(grid, Grid):
        raise GeometryError(
            f"{path}: control volumes are boxes in PLOT3D or SU2, got a {type(grid).__name__}"
        )
    return [
        Box.of(str(n + 1), scale * np.asarray(grid.block(n)), degree or 3)
        for n in range(len(grid.shapes))
    ]
