"""Evaluations of an object in Blender at many values, over several processes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import override

from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Surface
from ..workers import Threads
from .blender_process import Pool, Setup
from .in_blender.frames import Message
from .program_runs import AbstractRuns, Place

ROUNDING = 2.0**-25
"""About the standard deviation of rounding to single precision, of the largest number."""


@dataclass(frozen=True)
class Scene:
    """What is opened in Blender, and how it is asked.

    Attributes
    ----------
    told
        The file, the object, and the paths and controls that are turned.
    labels
        A name for each number.
    limit
        How long an answer may take [s].
    pool
        Processes of the Blender to ask.
    """

    told: dict[str, Any]
    labels: tuple[str, ...]
    limit: float | None
    pool: Pool

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"the object {self.told['object']!r} of {self.told['file']}"


class BlenderRuns(AbstractRuns):
    """Has an object evaluated, at several places at a time.

    Its points are single precision in Blender. Where nothing but motions is made of a geometry
    that is given, its own points in double precision are moved by what Blender moved its copy.

    Attributes
    ----------
    given
        The geometry that is put into the object's mesh; None for what the file has.
    rounding
        About the standard deviation of Blender's rounding [m].
    """

    given: Geometry | None
    rounding: float

    def __init__(self, scene: Scene, given: Geometry | None, executor: Threads):
        self._scene, self.given, self._executor = scene, given, executor
        arrays = {}
        if given is not None:
            faces = np.asarray(getattr(given, "faces", np.zeros((0, 3))), np.int32)
            arrays = {"points": np.asarray(given.points, float), "faces": faces}
        self._setup = Setup(scene.told, arrays)
        self._form: list[int] = []
        self._is_deforming = False

    @property
    @override
    def labels(self) -> Sequence[str]:
        return self._scene.labels

    @property
    @override
    def told(self) -> str:
        return self._scene.name

    def first(self, numbers: np.ndarray) -> Geometry:
        """The geometry that its own values make."""
        points = None if self.given is None else np.asarray(self.given.points)
        opened, (said, arrays) = self._asked(Place(numbers, points), has_faces=True)
        if said["problems"]:
            raise GeometryError(
                f"{self.told}: {said['problems'][0]}, so that it moves nothing; bind it in "
                "Blender, on a mesh with these vertices, and save the file"
            )
        self._form = said["form"]
        self._is_deforming = self.given is not None and said["is_same"]
        scale = np.linalg.norm(arrays["matrix"][:3, :3], 2)
        largest = np.abs(arrays["points"]).max(initial=0.0)
        self.rounding = float(ROUNDING * scale * largest)
        found = self._placed(points, opened, arrays, "its own values")
        if self.given is not None and self._is_deforming:
            return self.given.moved(found)
        if not len(arrays["faces"]):
            raise GeometryError(
                f"{self.told} makes {len(found)} points and no faces; instances of geometry nodes "
                "must be made real (Realize Instances)"
            )
        return _surface(found, arrays["faces"], arrays["materials"], said["materials"])

    @override
    def points(
        self, places: Sequence[Place], names: Sequence[str], rest: Geometry
    ) -> list[np.ndarray]:
        tasks: dict[str, Place] = {}
        for k, (name, place) in enumerate(zip(names, places, strict=True)):
            tasks[f"{name} ({k})" if name in tasks else name] = place
        answers = self._executor.all(self._asked, tasks)
        found = []
        for name, place, (opened, (said, arrays)) in zip(names, places, answers, strict=True):
            self._check_form(said["form"], name)
            found.append(self._placed(place.points, opened, arrays, name))
        return found

    @override
    def check_seen(self, numbers: np.ndarray, moved: np.ndarray, name: str) -> None:
        if np.array_equal(numbers.astype(np.float32), moved.astype(np.float32)):
            size = np.abs(moved - numbers).max(initial=0.0)
            raise ParameterError(
                f"{self.told}: a step of {size:.2g} in {name} is lost in Blender's single "
                "precision; give a larger step"
            )

    def _asked(self, place: Place, has_faces: bool = False) -> tuple[Message, Message]:
        given = {"numbers": np.asarray(place.numbers, float)}
        told = {"do": "evaluate", "faces": has_faces}
        pool, limit = self._scene.pool, self._scene.limit
        if place.points is not None:
            opened, _ = pool.ask(self._setup, limit=limit)
            given["points"] = _into(opened, place.points).astype(np.float32)
        return pool.ask(self._setup, told, given, limit)

    def _placed(
        self, points: np.ndarray | None, opened: Message, arrays: Any, name: str
    ) -> np.ndarray:
        """Points in space, in double precision as far as Blender lets them."""
        own, matrix = arrays["points"].astype(float), arrays["matrix"]
        if not np.isfinite(own).all():
            bad = int(np.flatnonzero(~np.isfinite(own).all(axis=1))[0])
            raise GeometryError(f"{self.told}: point {bad} is no finite number for {name}")
        if points is None or not self._is_deforming:
            return own @ matrix[:3, :3].T + matrix[:3, 3]
        start = opened[1]["matrix"]
        exact = _into(opened, points)
        change = own - exact.astype(np.float32)
        turned = exact @ (matrix - start)[:3, :3].T + (matrix - start)[:3, 3]
        return points + (change @ matrix[:3, :3].T + turned)

    def _check_form(self, form: list[int], name: str) -> None:
        if form == self._form:
            return
        now, own = (dict(zip(("points", "faces"), f, strict=False)) for f in (form, self._form))
        raise GeometryError(
            f"{self.told} makes {now['points']} points and {now['faces']} faces for {name}, and "
            f"{own['points']} and {own['faces']} for its own values"
            + (", joined otherwise" if now == own else "")
            + ": its topology must never change; turn off or apply the modifier that changes it "
            "(Remesh, Decimate, Boolean ...), or do not turn what its counts depend on"
        )


def _into(opened: Message, points: np.ndarray) -> np.ndarray:
    """Points of space in the object's own coordinates."""
    matrix = opened[1]["matrix"]
    return np.linalg.solve(matrix[:3, :3], (np.asarray(points, float) - matrix[:3, 3]).T).T


def _surface(
    points: np.ndarray, faces: np.ndarray, materials: np.ndarray, names: Sequence[str]
) -> Surface:
    """Triangles; where there are several materials, components by their names."""
    used = np.unique(materials)
    if len(used) < 2:
        return Surface(points, faces)
    known = {int(k): (names[k] if k < len(names) else "") or f"material {k + 1}" for k in used}
    components = tuple(dict.fromkeys(known.values()))
    tags = np.array([components.index(known[int(k)]) for k in materials])
    return Surface(points, faces, tags, components)
