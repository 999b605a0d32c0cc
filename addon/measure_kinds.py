# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shape can be asked for: kinds of measures, what each needs, and their tables in a case."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from .edits import Wrong, numbers_in


class Kind(NamedTuple):
    """A kind of measure.

    Attributes
    ----------
    label, told
        For the menu: its name and a sentence.
    needs
        What it takes of `Asked`: component, at, chord, side, along, relative, spot, ends, region,
        box, across; those behind a question mark may be left out.
    unit
        Of its numbers, for the readout.
    """

    label: str
    told: str
    needs: tuple[str, ...]
    unit: str


PART = "?component"

KINDS: dict[str, Kind] = {
    "volume": Kind("Volume", "Volume within closed faces", (PART,), "m³"),
    "area": Kind("Wetted Area", "Area of the faces", (PART,), "m²"),
    "projected_area": Kind(
        "Projected Area", "Area seen along a direction: planform, front", ("along", PART), "m²"
    ),
    "cross_section": Kind(
        "Cross Section", "Area that planes, fixed in space, cut out", ("at", "along", PART), "m²"
    ),
    "section_area": Kind("Section Area", "Area within an airfoil", (), "m²"),
    "centroid": Kind("Centroid", "Middle of the volume", ("?along", PART), "m"),
    "thickness": Kind(
        "Thickness",
        "Thickness at parts of the chord and at stations, between places that move with the shape",
        ("chord", "?at", "?relative", PART),
        "m",
    ),
    "ray_thickness": Kind(
        "Thickness along Rays",
        "What of rays, fixed in space, lies within the shape",
        ("chord", "?at", "?relative", PART),
        "m",
    ),
    "chord": Kind("Chord", "Length of the chord at a station", ("?at", PART), "m"),
    "incidence": Kind("Incidence", "Twist of the chord at a station", ("?at", PART), "rad"),
    "camber": Kind(
        "Camber", "Height of the middle line over the chord", ("chord", "?at", PART), "of chord"
    ),
    "edge_radius": Kind(
        "Leading Edge Radius", "Radius of the leading edge at a station", ("?at", PART), "m"
    ),
    "opening": Kind(
        "Trailing Edge Angle", "Angle of the trailing edge at a station", ("?at", PART), "rad"
    ),
    "position": Kind("Position", "Where the selected vertex is", ("spot", "?along"), "m"),
    "distance": Kind("Distance", "How far two selected vertices are apart", ("ends",), "m"),
    "separation": Kind(
        "Separation", "A selected vertex seen from another", ("ends", "?along"), "m"
    ),
    "fixed": Kind("Fixed Region", "Motion of the selected vertices", ("region", "?along"), "m"),
    "rigid": Kind(
        "Rigid Region", "How far the selected vertices move unlike one body", ("region",), "m"
    ),
    "planarity": Kind(
        "Planar Region", "How far the selected vertices are off a plane", ("region",), "m"
    ),
    "enclosed": Kind(
        "Enclosed Box",
        "How deep the box around another selected object lies below the surface",
        ("box", PART),
        "m",
    ),
    "curvature": Kind("Curvature", "Square of the mean curvature, integrated", (PART,), ""),
    "bending_energy": Kind("Bending", "How unsmoothly the shape was bent", (PART,), "m²"),
    "symmetry": Kind("Symmetry", "How far points are from their mirror images", ("across",), "m"),
}
"""By the name that case files call them; others can be written into the case by hand."""

SCALAR_AT = ("chord", "incidence", "camber", "edge_radius", "opening")
"""Kinds that take one station, where others take a list."""


@dataclass
class Asked:
    """What a person chose for a measure; a text of numbers may be empty."""

    component: str = ""
    at: str = ""
    chord: str = ""
    along: str = ""
    across: str = "y"
    relative: bool = False
    vertices: Sequence[int] = ()
    box: Sequence[Sequence[float]] = field(default_factory=list)


def table(kind: str, asked: Asked) -> dict[str, Any]:
    """The table of a measure in a case."""
    if kind not in KINDS:
        raise Wrong(f"no measure {kind!r}; there is: {', '.join(KINDS)}")
    found: dict[str, Any] = {"measure": kind}
    for need in KINDS[kind].needs:
        must, key = not need.startswith("?"), need.lstrip("?")
        found |= _TAKEN[key](kind, asked, must)
    return found


def unit_of(told: dict[str, Any]) -> str:
    """Unit of a measure's numbers, from its table."""
    kind = KINDS.get(told.get("measure", ""))
    return "of chord" if told.get("relative") else kind.unit if kind else ""


def _component(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    return {"component": asked.component} if asked.component else {}


def _at(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    found = numbers_in(asked.at, "stations")
    if not found:
        if must:
            raise Wrong("at which stations? give one or more, apart by commas")
        return {}
    if kind in SCALAR_AT and len(found) > 1:
        raise Wrong(f"{KINDS[kind].label} is measured at one station, got {asked.at!r}")
    return {"at": found[0] if len(found) == 1 else found}


def _chord(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    found = numbers_in(asked.chord, "parts of the chord")
    if not found:
        raise Wrong("at which part of the chord? 0 is the leading edge, 1 the trailing edge")
    if not all(0 <= x <= 1 for x in found):
        raise Wrong(f"parts of the chord lie from 0 to 1, got {asked.chord!r}")
    if kind in SCALAR_AT and len(found) > 1:
        raise Wrong(
            f"{KINDS[kind].label} is measured at one part of the chord, got {asked.chord!r}"
        )
    return {"chord": found[0] if len(found) == 1 else found}


def _along(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    if must and not asked.along:
        raise Wrong(f"along which axis? {KINDS[kind].label} needs one of x, y and z")
    return {"along": asked.along} if asked.along else {}


def _across(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    return {"across": asked.across}


def _relative(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    return {"relative": True} if asked.relative else {}


def _spot(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    _check_count(kind, asked, 1, 1)
    return {"spot": {"vertex": asked.vertices[0]}}


def _ends(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    _check_count(kind, asked, 2, 2)
    return {"start": {"vertex": asked.vertices[0]}, "end": {"vertex": asked.vertices[1]}}


def _region(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    _check_count(kind, asked, 4 if kind == "planarity" else 3 if kind == "rigid" else 1)
    return {"region": {"vertices": list(asked.vertices)}}


def _box(kind: str, asked: Asked, must: bool) -> dict[str, Any]:
    if len(asked.box) != 8:
        raise Wrong("what is to be enclosed? select an object beside the surface, e.g. a cube")
    return {"box": [list(corner) for corner in asked.box]}


def _check_count(kind: str, asked: Asked, least: int, most: int | None = None) -> None:
    count = len(asked.vertices)
    if count < least or (most is not None and count > most):
        wanted = f"{least}" if most == least else f"at least {least}"
        raise Wrong(
            f"{KINDS[kind].label} needs {wanted} selected "
            f"{'vertex' if wanted == '1' else 'vertices'} of the surface (edit mode), got {count}"
        )


_TAKEN = {
    "component": _component,
    "at": _at,
    "chord": _chord,
    "along": _along,
    "across": _across,
    "relative": _relative,
    "spot": _spot,
    "ends": _ends,
    "region": _region,
    "box": _box,
}
