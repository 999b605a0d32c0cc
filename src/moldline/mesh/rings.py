"""Cages of rings: control sections along a wing or a body."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError, ParameterError
from .enclosure import clear_of, part_of
from .planform import planform
from .slices import NEAR, section
from .surface import Surface
from .symmetric import FLIP, evened, with_image

TRIES = 12
NEAREST = 0.3
"""Of the distance from the smallest section, how near the cage may come."""

SWELL = 1.25
"""By how much the distance grows where a cage does not enclose at the present one."""


class Rings(NamedTuple):
    """A cage of rings.

    Attributes
    ----------
    surface
        The cage; behind the rings' points come one at each end.
    numbers
        Points of each ring, in order around it: rows are rings from the first station on.
    clearance
        How near the cage comes to the geometry [m].
    """

    surface: Surface
    numbers: Int[np.ndarray, "rings around"]
    clearance: float


def wing_rings(
    surface: Surface,
    stations: int | Sequence[float] = 5,
    chordwise: int = 4,
    offset: float = 0.1,
    component: str | None = None,
    symmetric: bool = False,
) -> Rings:
    """A cage around a half wing: at each station a ring that fits its chord and height.

    A ring runs from its upper leading corner along the chord and back below: the first `chordwise`
    points are above, the others below from the trailing edge to the leading one. `offset` is its
    distance from the section, as a part of the chord along it and of the largest height above and
    below. Rings beyond root and tip close it. Where it is `symmetric`, the root's ring lies at
    y = 0, and rings from the mirror image's tip to there come first.
    """
    if chordwise < 2:
        raise ParameterError(f"a ring has two points or more along the chord, got {chordwise}")
    found = planform(surface, stations, component)
    y, chord = found.stations, found.chord
    points, triangles = part_of(surface, component)
    low, high = points[:, 1].min(), points[:, 1].max()
    if min(high, -low) > NEAR * max(high, -low):
        raise GeometryError(
            f"rings go around a half wing, and this one reaches from y = {low:.6g} to {high:.6g}; "
            "give one side of it, or a component"
        )
    outward = np.sign(y[-1] - y[0])
    root, tip = (low, high) if outward > 0 else (high, low)
    if symmetric:
        points, triangles = with_image(points, triangles)
    height = np.maximum(found.high - found.low, 0.02 * chord)

    def rings(grown: float) -> np.ndarray:
        ends = np.array(
            [root - outward * grown * offset * chord[0], tip + outward * grown * offset * chord[-1]]
        )
        at = np.concatenate([[0.0] if symmetric else ends[:1], y[1:-1], ends[1:]])
        nose = np.stack([_along(y, found.leading[:, d], at) for d in (0, 2)], axis=1)
        aft = np.stack([_along(y, found.trailing[:, d], at) for d in (0, 2)], axis=1)
        length, tall = _along(y, chord, at), _along(y, height, at)
        length, tall = np.maximum(length, 0.1 * chord.max()), np.maximum(tall, 0.1 * height.max())
        centre = np.stack([_along(y, (found.low + found.high) / 2, at)], axis=1)[:, 0]
        share = np.linspace(0, 1, chordwise)
        reach = grown * offset
        start, end = nose[:, 0] - reach * length, aft[:, 0] + reach * length
        x = start[:, None] + share * (end - start)[:, None]
        up = centre + (0.5 + grown * 0.5) * tall / 2 + reach * tall
        down = centre - (0.5 + grown * 0.5) * tall / 2 - reach * tall
        tops = np.stack(
            [x, np.broadcast_to(at[:, None], x.shape), np.broadcast_to(up[:, None], x.shape)], -1
        )
        bottoms = np.stack([x, tops[..., 1], np.broadcast_to(down[:, None], x.shape)], -1)
        own = np.concatenate([tops, bottoms[:, ::-1]], axis=1)
        return np.concatenate([own[:0:-1] * FLIP, own]) if symmetric else own

    least = NEAREST * offset * float(height.min())
    what = f"{len(y)} stations"
    return _enclosing(rings, points, triangles, least, what, symmetric)


def body_rings(
    surface: Surface,
    stations: int | Sequence[float] = 7,
    around: int = 8,
    offset: float = 0.1,
    component: str | None = None,
    symmetric: bool = False,
) -> Rings:
    """A cage around a body along x: at each station a ring around its section.

    A ring begins above and runs towards positive y. `offset` is its distance, as a part of the
    largest half width. Rings beyond nose and tail close it. Where it is `symmetric`, it goes around
    a half body and its mirror image about y = 0.
    """
    if around < 4 or (symmetric and around % 2):
        even = ", an even number where it is symmetric" if symmetric else ""
        raise ParameterError(f"a ring has four points or more{even}, got {around}")
    points, triangles = part_of(surface, component)
    if symmetric:
        points, triangles = with_image(points, triangles)
    low, high = points[:, 0].min(), points[:, 0].max()
    if isinstance(stations, int):
        if stations < 2:
            raise ParameterError(f"a body has two stations or more, got {stations}")
        inner = low + (high - low) * (1 - np.cos(np.pi * np.linspace(0.1, 0.9, stations))) / 2
    else:
        inner = np.asarray(stations, float)
    boxes = np.array([_box(points, triangles, at) for at in inner.tolist()])
    centre, half = boxes.mean(axis=1), np.ptp(boxes, axis=1) / 2
    widest = float(half.max())
    angle = 2 * np.pi * np.arange(around) / around
    circle = np.stack([np.sin(angle), np.cos(angle)], axis=1) / np.cos(np.pi / around)

    def rings(grown: float) -> np.ndarray:
        reach = grown * offset * widest
        at = np.concatenate([[low - reach], inner, [high + reach]])
        middles = np.concatenate([centre[:1], centre, centre[-1:]])
        radii = np.concatenate([half[:1] / 2, grown * half, half[-1:] / 2]) + reach
        ring = middles[:, None] + radii[:, None] * circle
        return np.concatenate([np.broadcast_to(at[:, None, None], (*ring.shape[:2], 1)), ring], -1)

    least = NEAREST * offset * widest
    what = f"{len(inner)} stations"
    return _enclosing(rings, points, triangles, least, what, symmetric)


def _enclosing(
    rings: Callable[[float], np.ndarray],
    points: np.ndarray,
    triangles: np.ndarray,
    least: float,
    what: str,
    symmetric: bool,
) -> Rings:
    """Rings far enough out to enclose, closed at both ends."""
    grown = 1.0
    for _ in range(TRIES):
        cage, numbers = _skinned(rings(grown), symmetric)
        clearance = clear_of(cage, points, triangles)
        if clearance > least:
            return Rings(cage, numbers, clearance)
        grown *= SWELL
    raise GeometryError(f"no rings at {what} enclose this geometry; ask for more stations")


def _skinned(rings: Float[np.ndarray, "s k 3"], symmetric: bool) -> tuple[Surface, np.ndarray]:
    count, around = rings.shape[:2]
    numbers = np.arange(count * around).reshape(count, around)
    a, d = numbers[:-1].ravel(), np.roll(numbers, -1, axis=1)[:-1].ravel()
    b, c = numbers[1:].ravel(), np.roll(numbers, -1, axis=1)[1:].ravel()
    first, last = count * around, count * around + 1
    start, end = numbers[0], numbers[-1]
    faces = np.concatenate(
        [
            np.stack([a, c, b], axis=1),
            np.stack([a, d, c], axis=1),
            np.stack([np.full(around, first), np.roll(start, -1), start], axis=1),
            np.stack([np.full(around, last), end, np.roll(end, -1)], axis=1),
        ]
    )
    points = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(axis=1)])
    if symmetric:  # quadrilaterals are cut alike on both sides
        points, image = evened(points)
        faces = faces[np.all(points[faces, 1] >= 0, axis=1)]
        faces = np.concatenate([faces, image[faces][:, ::-1]])
    corners = points[faces]
    if np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0:
        faces = faces[:, ::-1]
    return Surface(points, faces), numbers


def _along(y: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values between stations, and beyond them as in the panel next to them."""
    order = np.argsort(y)
    y, values = y[order], values[order]
    panel = np.clip(np.searchsorted(y, at) - 1, 0, len(y) - 2)
    share = (at - y[panel]) / (y[panel + 1] - y[panel])
    return values[panel] + share * (values[panel + 1] - values[panel])


def _box(points: np.ndarray, triangles: np.ndarray, at: float) -> np.ndarray:
    """Lowest and highest y and z of a section across x."""
    lines = section(points, triangles, "x", at)
    if not lines:
        raise GeometryError(f"the body has no section at x = {at:.6g}")
    flat = np.concatenate(lines)[:, 1:]
    return np.stack([flat.min(axis=0), flat.max(axis=0)])
