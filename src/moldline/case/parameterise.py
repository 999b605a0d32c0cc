"""A case file to begin with, made for a geometry."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import registry
from ..deformers.posed import AbstractPosed
from ..errors import GeometryError, MoldlineError, ParameterError
from ..measures.position import Position
from ..mesh import Geometry, Section, Surface
from ..mesh.enclosure import part_of
from ..mesh.io import read, write
from ..mesh.io.files import replacing
from ..mesh.symmetric import is_half
from ..parameters.variable import UNITS
from .case import Case, load

ALONG = 8
"""Control points along the longest side of a lattice, where nothing else is asked for."""

BOUND = 0.25
"""Bounds of a motion, in spacings of control points; of a length, in parts of it."""

TURN = 15.0
"""Bounds of an angle, to each side [deg]."""

ANGLES = ("sweep", "dihedral", "twist", "rotation", "angle")
"""Parameters that are angles."""


@dataclass
class Draft:
    """What a kind of parameterisation puts into a case file.

    Attributes
    ----------
    stage
        The stage's own keys.
    why
        How many controls, and why as many.
    variables
        Tables of variables by name.
    links
        Tables of links.
    beside
        Geometries to write beside the case file, by the end of their name.
    """

    stage: dict[str, Any]
    why: str
    variables: dict[str, Any] = field(default_factory=dict)
    links: list[dict[str, Any]] = field(default_factory=list)
    beside: dict[str, Surface] = field(default_factory=dict)

    def add(self, name: str, link: Mapping[str, Any], size: int, bound: float, unit: str) -> None:
        """A variable and its link; zero at rest."""
        low_high = [-_rounded(bound), _rounded(bound)]
        self.variables[name] = {"size": size, "value": 0.0, "bounds": low_high, "unit": unit}
        self.links.append({"variable": name, **link})


def parameterise(
    source: Path, target: Path, kind: str, units: str | None = None, **options: Any
) -> tuple[Case, str]:
    """Write a case file for a geometry's file; gives the case, and why it is as it is.

    `options` are those of the kind, see `KINDS`. Lengths in them, and in the file, are metres where
    `units` says what the geometry's are, else the geometry's own.
    """
    draft = made(kind, read(source, units=units), options)
    for ending, surface in draft.beside.items():
        beside = target.with_name(f"{target.stem}{ending}")
        write(beside, surface, units=units)
        draft.stage |= {"file": beside.name} | ({"units": units} if units else {})
    name = re.sub(r"\W", "_", source.stem) or "geometry"
    begin = f"made for {source.name} by moldline parameterise; edit it"
    with replacing(target) as stream:
        stream.write(written(draft, name, _beside(source, target), units, begin).encode())
    return load(target), draft.why


def made(kind: str, geometry: Geometry, options: Mapping[str, Any]) -> Draft:
    """A draft of one of `KINDS` for a geometry, by options that are not None."""
    if kind not in KINDS:
        raise ParameterError(f"no kind {kind!r}; there is: {', '.join(KINDS)}")
    try:
        return KINDS[kind](geometry, **{k: v for k, v in options.items() if v is not None})
    except MoldlineError:
        raise
    except (TypeError, ValueError) as error:
        wrong = re.search(r"unexpected keyword argument '(\w+)'", str(error))
        if wrong is not None:
            raise ParameterError(f"{kind} takes no {wrong[1]}") from None
        told = ", ".join(f"{k} = {v!r:.40}" for k, v in options.items())
        raise ParameterError(f"{kind} cannot be made with {told}: {error}") from None


def written(draft: Draft, name: str, file: str, units: str | None, begin: str) -> str:
    """The text of a new case of one geometry."""
    table = {"file": file} | ({"units": units} if units else {})
    tables = {
        "moldline": 1,
        "geometry": {name: table},
        "variable": draft.variables,
        "stage": [{**draft.stage, "link": draft.links}],
    }
    return f"# {begin}\n# {draft.why}\n{_toml(tables)}"


def _toml(table: Mapping[str, Any], name: str = "") -> str:
    """Tables as a person writes them: an array to a line, what belongs together in one place."""
    inner = {k: v for k, v in table.items() if isinstance(v, dict) or _is_tables(v)}
    lines = [f"{k} = {json.dumps(v)}\n" for k, v in table.items() if k not in inner]
    for key, value in inner.items():
        path = f"{name}.{key}" if name else key
        if isinstance(value, dict):
            has_own = not all(isinstance(v, dict) for v in value.values())
            lines.append((f"\n[{path}]\n" if has_own else "") + _toml(value, path))
        else:
            lines += [f"\n[[{path}]]\n{_toml(row, path)}" for row in value]
    return "".join(lines)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)


def _beside(source: Path, target: Path) -> str:
    """The source's path as the case file names it."""
    folder, place = target.parent.resolve(), source.resolve()
    return place.relative_to(folder).as_posix() if place.is_relative_to(folder) else str(place)


def lattice(
    geometry: Geometry, *, shape: tuple[int, int, int] | None = None, **options: Any
) -> Draft:
    """A box around it all or a part, each control point moving along the box's three axes.

    A count of 0 in the shape is by the box's proportions.
    """
    if isinstance(geometry, Section):
        return _section_lattice(_counts(shape, (10, 2, 1)))
    made = registry.deformer("lattice")
    extent = made.over(geometry, (2, 2, 2), **{**options, "freeze": ()}).edges
    lengths = np.linalg.norm(extent, axis=1)
    spacing = lengths.max() / (ALONG - 1)
    dense = np.clip(np.rint(lengths / spacing) + 1, 2, ALONG)
    counts = _counts(shape, tuple(int(n) for n in dense))
    mirror: dict[str, Any] = {}
    on_plane = bool(np.any(geometry.points[:, 1] == 0)) and not np.any(geometry.points[:, 1] < 0)
    if on_plane and not options:
        mirror = {"mirrored": "y"}
        options = {"margin": [0.02, 0.0, 0.05]}  # begins in the plane, so that points stay on it
    draft = Draft(
        {"deformer": "lattice", "shape": list(counts), **options},
        f"{counts[0]} x {counts[1]} x {counts[2]} control points: "
        + (
            "as asked for"
            if shape and any(shape)
            else f"{ALONG} along the longest side, as dense along others"
        )
        + "; each acts on about two spacings to each side of it",
    )
    free = int(np.sum(~np.asarray(made.over(geometry, counts, **options).frozen)))
    for axis, length, count in zip("xyz", lengths, counts, strict=True):
        if count > 1:
            link = {"link": "each", "axis": axis} | mirror
            step = BOUND * length / (count - 1)
            draft.add(f"move_{axis}", link, free, step, "m")
    return draft


def wing_lattice(
    geometry: Geometry, *, shape: tuple[int, int, int] | None = None, **options: Any
) -> Draft:
    """A swept, tapered box along a wing; stations rise, and sections move up and grow thicker."""
    geometry = _surface(geometry, "a wing's own box is fitted to a surface")
    counts = _counts(shape, (7, 5, 2))
    made = registry.deformer("control_volume").build(geometry, wing=True, shape=counts, **options)
    draft = Draft(
        {"deformer": "control_volume", "wing": True, "shape": list(counts), **_plain(options)},
        f"{counts[0]} x {counts[1]} x {counts[2]} control points along chord, span and height of "
        "the wing's own box, each moving up and down",
    )
    span = float(np.ptp(made.rest[:, 1]))
    draft.add("move_z", {"link": "each", "axis": "z"}, math.prod(counts), 0.01 * span, "m")
    return draft


def cage(maker: str) -> Callable[..., Draft]:
    """A kind of cage; its vertices move along the axes of space.

    Around a half model it is symmetric and moves so, or points on the plane would leave it.
    """

    def drafted(geometry: Geometry, **options: Any) -> Draft:
        geometry = _surface(geometry, "a cage goes around a surface")
        half = is_half(part_of(geometry, options.get("component"))[0])
        if half:
            options["symmetric"] = True
        made = getattr(registry.deformer("cage"), maker)(geometry, **options)
        draft = Draft(
            {"deformer": "cage"},
            f"{len(made.rest)} vertices and {len(made.shape.faces)} triangles around the geometry"
            + (" and its mirror image; those at y < 0 follow the others" if half else "")
            + "; each vertex moves along x, y and z, its effect fades in a few edges",
            beside={"_cage.obj": Surface(made.rest, made.shape.faces)},
        )
        edges = made.rest[made.lines[:, 0]] - made.rest[made.lines[:, 1]]
        step = BOUND * float(np.median(np.linalg.norm(edges, axis=1)))
        for axis in "xyz":
            link: dict[str, Any] = {"link": "each", "axis": axis}
            free = np.arange(len(made.rest))
            if half:
                y = made.rest[:, 1]
                free = np.flatnonzero(y > 0 if axis == "y" else y >= 0)
                link |= {"index": free[:, None].tolist(), "mirrored": "y"}
            draft.add(f"move_{axis}", link, len(free), step, "m")
        return draft

    return drafted


def pilots(
    geometry: Geometry,
    *,
    spots: Sequence[Sequence[float]],
    names: Sequence[str] | None = None,
    along: str | Sequence[float] | None = None,
) -> Draft:
    """Places of the shape that go where they are told; the rest follows by the least motion.

    `along` is the direction that they are held in, by default every one: names of axes, such as
    "xz", or a vector.
    """
    places = np.asarray(spots, float)
    if places.ndim != 2 or places.shape[1:] != (3,) or not len(places):
        raise ParameterError(f"spots are places in space, three numbers each, got {spots!r:.80}")
    chosen = list(names) if names else [f"p{i + 1}" for i in range(len(places))]
    if len(chosen) != len(places) or len(set(chosen)) < len(chosen):
        raise ParameterError(f"{len(places)} spots need as many different names, got {chosen}")
    if odd := [one for one in chosen if not isinstance(one, str) or not one.isidentifier()]:
        raise ParameterError(f"a pilot's name is a word without spaces, got {odd[0]!r}")
    way = along if isinstance(along, str) or along is None else _direction(along)
    own: dict[str, Any] = {} if way is None else {"along": way}
    rows = [(float(x), float(y), float(z)) for x, y, z in places]
    held = {
        name: Position.build(geometry, spot={"near": row}, along=way)
        for name, row in zip(chosen, rows, strict=True)
    }
    size = sum(one.size for one in held.values())
    draft = Draft(
        {"deformer": "pilots"},
        f"{size} numbers: {len(places)} places of the shape that go where they are told",
    )
    draft.stage["pilot"] = {
        name: {"measure": "position", "spot": {"near": row}} | own
        for name, row in zip(chosen, rows, strict=True)
    }
    reach = BOUND * float(np.ptp(np.asarray(geometry.points), axis=0).max())
    for name, one in held.items():
        draft.add(f"move_{name}", {"link": "named", "parameter": name}, one.size, reach, "m")
    return draft


def _direction(along: Sequence[float]) -> tuple[float, float, float]:
    if len(along) != 3:
        raise ParameterError(f"along is names of axes, or a vector, got {along!r:.40}")
    x, y, z = map(float, along)
    return x, y, z


def _surface(geometry: Geometry, need: str) -> Surface:
    if not isinstance(geometry, Surface):
        raise GeometryError(
            f"{need}, got a {type(geometry).__name__}; write its boundary or stitched patches with "
            "moldline convert first"
        )
    return geometry


def _counts(shape: tuple[int, int, int] | None, usual: Sequence[int]) -> tuple[int, ...]:
    """The counts that are asked for; where they are none or 0, the usual ones."""
    return tuple(own or one for own, one in zip(shape or (0, 0, 0), usual, strict=True))


def _section_lattice(shape: Sequence[int]) -> Draft:
    draft = Draft(
        {"deformer": "lattice", "shape": list(shape), "margin": [0.02, 0.1, 0.0]},
        f"{shape[0]} stations along the chord, at each a number for thickness and one for camber",
    )
    for name in ("thickness", "camber"):
        link = {"link": name, "along": "x", "axis": "y"}
        draft.add(name, link, shape[0], 0.05, "m")
    return draft


def posed(name: str) -> Callable[..., Draft]:
    """A kind whose parameters have names and measure something: the skeletons."""

    def drafted(geometry: Geometry, **options: Any) -> Draft:
        geometry = _surface(geometry, f"a {name.replace('_', ' ')} needs a surface of triangles")
        deformer: AbstractPosed = registry.deformer(name).build(geometry, **options)
        draft = Draft({"deformer": name, **_plain(options)}, "")
        for parameter, numbers in deformer.parameters.items():
            _add_measured(draft, parameter, np.asarray(deformer.values)[numbers])
        total = sum(len(numbers) for numbers in deformer.parameters.values())
        listed = ", ".join(f"{len(n)} of {p}" for p, n in deformer.parameters.items())
        draft.why = f"{total} numbers: {listed}; they measure what they are named for"
        return draft

    return drafted


def _add_measured(draft: Draft, parameter: str, values: np.ndarray) -> None:
    is_angle = parameter.rpartition(".")[2] in ANGLES
    own = values / UNITS["deg"] if is_angle else values
    reach = np.full(len(own), TURN) if is_angle else BOUND * np.maximum(np.abs(own), 1e-3)
    pairs = [[_rounded(v - r), _rounded(v + r)] for v, r in zip(own, reach, strict=True)]
    name = parameter.replace(".", "_")
    unit = "deg" if is_angle else "m"
    draft.variables[name] = {"value": own.tolist(), "bounds": pairs, "unit": unit}
    link = {"variable": name, "link": "named", "parameter": parameter, "absolute": True}
    draft.links.append(link)


def _plain(options: Mapping[str, Any]) -> dict[str, Any]:
    return {k: list(v) if isinstance(v, tuple) else v for k, v in options.items()}


def _rounded(number: float) -> float:
    """Three digits: a bound is a judgement."""
    return float(f"{number:.3g}")


KINDS: dict[str, Callable[..., Draft]] = {
    "lattice": lattice,
    "wing-lattice": wing_lattice,
    "cage": cage("around"),
    "wing-cage": cage("around_wing"),
    "body-cage": cage("around_body"),
    "wing-skeleton": posed("wing_skeleton"),
    "body-skeleton": posed("body_skeleton"),
    "pilots": pilots,
}
"""Kinds of parameterisation by the name that the command line calls them."""
