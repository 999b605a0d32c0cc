"""Is this deformation sound: does space fold over, does the mesh tear, are derivatives right?"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from .._types import Array
from ..deformers.base import map_slopes
from ..deformers.control_volume import ControlVolume
from ..deformers.foreign import AbstractNumpyDeformer
from ..deformers.net import AbstractControlNet
from ..mesh import Geometry, Surface, VolumeMesh, quality, topology
from ..mesh.cap import capped
from ..mesh.joined import joined_points
from ..modelers.program_making import ProgramMaking
from ..modelers.union import Union
from ..numerics import taylor
from ..numerics.taylor import Remainder, remainder
from .pipeline import Pipeline, Values

MOST_SAMPLES = 200_000
"""Places in the box of a lattice or control volume that are searched for folds."""

CLEAR = 30.0
"""Times what programs say of their differences, a remainder has an order that can be seen."""

SHORTEST = 1e-8
"""Part of a typical change below which a union is not looked for that stays as it is."""


@dataclass(frozen=True)
class Folding:
    """The smallest Jacobian determinant of a map of space; 1 is no change, below 0 is folded over.

    Attributes
    ----------
    smallest
        Over the geometry's points and a grid of samples in every stage's box.
    place
        Where that is, before the deformation [m].
    at_points
        The smallest over the geometry's own points.
    samples
        How many places were looked at.
    """

    smallest: float
    place: tuple[float, float, float]
    at_points: float
    samples: int

    @property
    def folds(self) -> bool:
        """Whether space is turned inside out anywhere looked at."""
        return self.smallest <= 0.0


@dataclass(frozen=True)
class Tear:
    """A stage that pulls a mesh apart where it leaves the stage's box."""

    stage: str
    edges: int
    widest: float
    place: tuple[float, float, float]

    def __str__(self) -> str:
        x, y, z = self.place
        return (
            f"stage {self.stage!r} tears the mesh: {self.edges} edges leave its box where it "
            f"moves, by up to {self.widest:.3g} near ({x:.4g}, {y:.4g}, {z:.4g}); freeze that "
            f'side, enlarge the box or let outside = "extend"'
        )


@dataclass(frozen=True)
class Embedded:
    """How well a control volume found the points that it is bound to.

    Attributes
    ----------
    residual
        The largest distance from a point to where its box coordinates lie [m].
    most_steps, mean_steps
        Newton's steps for one point.
    outside
        Points in no box, which stay.
    """

    stage: str
    points: int
    boxes: int
    residual: float
    most_steps: int
    mean_steps: float
    outside: np.ndarray

    def __str__(self) -> str:
        lost = f"; {len(self.outside)} points lie outside and stay" if len(self.outside) else ""
        first = f", the first is {self.outside[0]}" if len(self.outside) else ""
        return (
            f"stage {self.stage!r}: {self.points - len(self.outside)} points in {self.boxes} "
            f"box{'es' if self.boxes > 1 else ''}, residual at most {self.residual:.1e}, "
            f"{self.most_steps} Newton steps at most, {self.mean_steps:.1f} on average{lost}{first}"
        )


@dataclass(frozen=True)
class Proof:
    """The derivatives of a case, proved along one direction.

    Attributes
    ----------
    forward
        Taylor remainder of the points along random changes of all variables.
    mismatch
        Relative difference of forward and reverse derivatives, <w, J d> against <J'w, d>.
    method
        "exact", or what stages written in NumPy and other programs fall back to.
    accuracy
        About how wrong differences are that are taken, relative.
    """

    forward: Remainder
    mismatch: float
    method: str
    accuracy: float = 0.0

    @property
    def is_right(self) -> bool:
        """Whether both derivatives are proved."""
        return self.forward.is_right and self.mismatch < max(1e-6, self.accuracy)


def at_rest(pipeline: Pipeline, values: Values | None = None) -> tuple[Geometry, str | None]:
    """The result before its stages, whose mesh is to be sound; and what closes it, if anything.

    Half a model that a union left open in its plane of symmetry is closed there.
    """
    here = pipeline.at(values)
    made = here.branches[here.result].construction
    geometry = here.geometry if made is None else here.geometry.moved(_start(here, values))
    plane = made.modeler.symmetry if made and isinstance(made.modeler, Union) else None
    if plane is None or not isinstance(geometry, Surface) or topology.is_closed(geometry.faces):
        return geometry, None
    return capped(geometry, "symmetry plane", plane)[0], plane


def folding(pipeline: Pipeline, values: Values | None = None) -> Folding:
    """Search a deformation for folds, at samples; a small fold between them is not seen.

    What the result is made from is searched too, each by its own stages.
    """
    parts = [_own_folding(part, values) for part in _parts(pipeline, values)]
    worst = min(parts, key=lambda part: part.smallest)
    return Folding(
        worst.smallest,
        worst.place,
        min(part.at_points for part in parts),
        sum(part.samples for part in parts),
    )


def _own_folding(pipeline: Pipeline, values: Values | None) -> Folding:
    points = _start(pipeline, values)
    steps = pipeline.steps(values)
    nets = [step.deformer for step in steps]
    samples = [net.samples(MOST_SAMPLES) for net in nets if isinstance(net, AbstractControlNet)]
    places = np.concatenate([points, *samples])
    slopes: np.ndarray = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    rest: Array = jnp.asarray(places)
    present: Array = rest
    for step in steps:
        is_carried = step.stage.carried
        own = map_slopes(step.deformer, rest if is_carried else present, step.controls)
        slopes = slopes + np.asarray(own) - np.eye(3) if is_carried else np.asarray(own) @ slopes
        present = step.after(rest, present)
    determinants = np.linalg.det(slopes)
    worst = int(determinants.argmin())
    return Folding(
        float(determinants[worst]),
        _place(places[worst]),
        float(determinants[: len(points)].min()),
        len(places),
    )


def tears(pipeline: Pipeline, values: Values | None = None) -> list[Tear]:
    """Stages that tear the mesh where it leaves their boxes."""
    return [tear for part in _parts(pipeline, values) for tear in _own_tears(part, values)]


def _own_tears(pipeline: Pipeline, values: Values | None) -> list[Tear]:
    steps = pipeline.steps(values)
    if not steps:
        return []
    edges = joined_points(pipeline.geometry)
    found = []
    rest = _start(pipeline, values)
    present = rest
    size = float(np.ptp(rest, axis=0).max())
    for step in steps:
        if isinstance(step.deformer, AbstractControlNet):
            bound = rest if step.stage.carried else present
            places, gaps = step.deformer.tears(bound, edges, step.controls)
            torn = np.flatnonzero(gaps > 1e-9 * size)
            if len(torn):
                widest = int(gaps.argmax())
                place = _place(places[widest])
                found.append(Tear(step.stage.name, len(torn), float(gaps[widest]), place))
        present = np.asarray(step.after(rest, present))
    return found


def embedded(pipeline: Pipeline) -> list[Embedded]:
    """How well control volumes found the points that they are bound to."""
    return [one for part in _parts(pipeline, None) for one in _own_embedded(part)]


def _own_embedded(pipeline: Pipeline) -> list[Embedded]:
    points = pipeline.geometry.points
    found = []
    for number in pipeline.branches[pipeline.result].bindings:
        stage = pipeline.own_stages[number]
        if isinstance(stage.deformer, ControlVolume):
            places = stage.deformer.embedded(points)
            inside = places.volume >= 0
            found.append(
                Embedded(
                    stage.name,
                    len(points),
                    len(stage.deformer.frame.boxes),
                    float(places.miss[inside].max(initial=0.0)),
                    int(places.steps[inside].max(initial=0)),
                    float(places.steps[inside].mean()) if inside.any() else 0.0,
                    np.flatnonzero(~inside),
                )
            )
    return found


def proof(pipeline: Pipeline, values: Values | None = None, seed: int = 0) -> Proof:
    """Prove the derivatives at these values along a random direction of typical size."""
    rng = np.random.default_rng(seed)
    full = pipeline.values(values)
    along: dict[str, Array] = {
        name: jnp.asarray(variable.typical * rng.uniform(-1, 1, variable.size))
        for name, variable in pipeline.variables.items()
    }
    methods: set[str] = {
        stage.deformer.method(part.geometry.points, stage.controls(full))
        for part in _parts(pipeline, full)
        for stage in part.own_stages
        if isinstance(stage.deformer, AbstractNumpyDeformer)
    }
    accuracy = 1e-7 if "central differences" in methods else 0.0
    pipeline = pipeline.at(full)
    along = _within(pipeline, full, along)
    weights = rng.normal(size=pipeline.geometry.points.shape)
    pushed = float(np.vdot(weights, np.asarray(pipeline.pushforward(full, along))))
    pulled = pipeline.pullback(full, weights)
    dotted = float(sum(np.vdot(pulled[name], along[name]) for name in along))
    scale = max(abs(pushed), abs(dotted), 1e-300)
    told = _told(pipeline)
    if told > 0:
        methods.add("differences of programs")
    return Proof(
        remainder(pipeline.points, full, along, max(accuracy, CLEAR * told)),
        abs(pushed - dotted) / scale,
        ", ".join(sorted(methods)) or "exact",
        told,
    )


def _told(pipeline: Pipeline) -> float:
    """How wrong, relative to a derivative, programs say that their differences are; the worst."""
    worst = 0.0
    for name in pipeline.feeding:
        making = pipeline.branches[name].making
        for slope in making.accuracy.values() if isinstance(making, ProgramMaking) else ():
            size = float(np.linalg.norm(slope.column))
            if size > 0 and np.isfinite(slope.error):
                worst = max(worst, slope.error * np.sqrt(slope.column.size) / size)
    return float(worst)


def _parts(pipeline: Pipeline, values: Values | None) -> list[Pipeline]:
    """A pipeline for each geometry that the result is made from, and for itself."""
    here = pipeline.at(values)
    return [here.of(name) for name in here.feeding]


def _within(pipeline: Pipeline, full: Values, along: Values) -> dict[str, Array]:
    """A direction, shortened until the connectivity is right on all the way."""
    length = 1.0
    while length > SHORTEST:
        steps = [
            {name: full[name] + h * length * along[name] for name in full} for h in taylor.STEPS
        ]
        if all(pipeline.holds(there) for there in steps):
            break
        length /= 4
    return {name: length * along[name] for name in along}


def _start(pipeline: Pipeline, values: Values | None) -> np.ndarray:
    """Points of the result before its stages."""
    rides = pipeline.result != pipeline.leading
    return np.asarray(pipeline.geometry.points if rides else pipeline.source(values))


def _place(point: Array) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])


def inverted_cells(pipeline: Pipeline, values: Values | None = None) -> np.ndarray:
    """Cells of a volume mesh that the deformation turns inside out."""
    if not isinstance(pipeline.geometry, VolumeMesh):
        return np.empty(0, int)
    after = quality.inverted_cells(pipeline.geometry.moved(pipeline.points(values)))
    return np.setdiff1d(after, quality.inverted_cells(pipeline.geometry))


def turned_faces(pipeline: Pipeline, values: Values | None = None) -> np.ndarray:
    """Faces of a surface whose normals its stages turn by more than 90 degrees."""
    if not isinstance(pipeline.geometry, Surface):
        return np.empty(0, int)
    pipeline = pipeline.at(values)
    faces = np.asarray(pipeline.geometry.faces)  # type: ignore[union-attr]
    before, after = (
        _normals(np.asarray(points), faces)
        for points in (_start(pipeline, values), pipeline.points(values))
    )
    return np.flatnonzero(np.einsum("ij,ij->i", before, after) < 0)


def _normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    return np.cross(b - a, c - a)
