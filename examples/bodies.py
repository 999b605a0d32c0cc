"""What the examples deform: a re-entry capsule, a fuselage, a supersonic wing, an airfoil."""

from typing import Any

import numpy as np

import moldline as ml

APOLLO = {"heat_shield": 4.694, "diameter": 3.912, "shoulder": 0.196, "cone": 33.0, "apex": 0.231}
"""Radii [m] and half-angle [deg] of the Apollo command module (NASA TN D-6028, figure 1)."""


def capsule(around: int = 96, along: int = 24) -> ml.Surface:
    """Spherical heat shield, torus shoulder, cone and round apex; x runs aft [m].

    `along` is the number of rings on each of the four.
    """
    shield, shoulder, apex = APOLLO["heat_shield"], APOLLO["shoulder"], APOLLO["apex"]
    cone = np.radians(APOLLO["cone"])
    centre = APOLLO["diameter"] / 2 - shoulder  # of the torus, from the axis
    corner = np.arcsin(centre / (shield - shoulder))  # where shield and shoulder touch
    at = shield - np.sqrt((shield - shoulder) ** 2 - centre**2)
    tip = (at * np.sin(cone) + centre * np.cos(cone) + shoulder - apex) / np.sin(cone)
    share = np.arange(along) / along
    turn = corner * share[1:]
    arcs = [
        (shield * (1 - np.cos(turn)), shield * np.sin(turn)),
        _arc(at, centre, shoulder, np.pi - corner, np.pi / 2 - cone, share),
        _straight(_on(at, centre, shoulder, cone), _on(tip, 0.0, apex, cone), share),
        _arc(tip, 0.0, apex, np.pi / 2 - cone, 0.0, share),
    ]
    x, radius = np.concatenate(arcs, axis=1)
    return revolved(x, radius, (0.0, tip + apex), around)


def _on(x: float, radius: float, size: float, cone: float) -> tuple[float, float]:
    """Where a circle touches the cone."""
    return x + size * np.sin(cone), radius + size * np.cos(cone)


def _arc(x: float, radius: float, size: float, start: float, end: float, share: Any) -> Any:
    angle = start + (end - start) * share
    return x + size * np.cos(angle), radius + size * np.sin(angle)


def _straight(start: tuple[float, float], end: tuple[float, float], share: Any) -> Any:
    return tuple(a + (b - a) * share for a, b in zip(start, end, strict=True))


def fuselage(around: int = 96, along: int = 241) -> ml.Surface:
    """A body like an airliner's: 60 m long, 6 m thick, tail swept up; x runs aft [m]."""
    x = 30.0 * (1 - np.cos(np.linspace(0, np.pi, along)))[1:-1]
    nose = np.clip(1 - x / 9.0, 0, None) ** 2
    tail = np.clip((x - 42.0) / 18.0, 0, None) ** 2
    radius = 3.0 * np.sqrt(1 - nose) * (1 - tail)
    height = 1.8 * tail - 0.6 * nose
    return revolved(x, radius, (0.0, 60.0), around, height, (-0.6, 1.8))


def revolved(
    x: Any,
    radius: Any,
    ends: tuple[float, float],
    around: int,
    height: Any = 0.0,
    end_heights: tuple[float, float] = (0.0, 0.0),
) -> ml.Surface:
    """A closed body of circles at x, with a point at each end; `height` lifts the circles."""
    angle = 2 * np.pi * np.arange(around) / around
    x, radius, height = (
        np.asarray(a)[..., None] for a in (x, radius, np.broadcast_to(height, np.shape(x)))
    )
    rings = np.stack(
        np.broadcast_arrays(x, radius * np.cos(angle), height + radius * np.sin(angle)), axis=-1
    )
    return skinned(rings, [[ends[0], 0, end_heights[0]], [ends[1], 0, end_heights[1]]])


def supersonic_wing(chordwise: int = 61, spanwise: int = 81) -> ml.Surface:
    """Half a thin trapezoidal wing with biconvex sections, swept back by 55 degrees [m]."""
    y = 7.0 * np.linspace(0, 1, spanwise)
    chord = 8.0 - 5.6 * y / 7.0
    leading = np.tan(np.radians(55.0)) * y
    share = 0.5 * (1 - np.cos(np.pi * np.linspace(0, 1, chordwise)))
    upper = np.stack([share, 0.08 * share * (1 - share)], axis=1)
    loop = np.concatenate([upper, upper[-2:0:-1] * [1, -1]])
    rings = np.empty((spanwise, len(loop), 3))
    rings[..., 0] = leading[:, None] + chord[:, None] * loop[:, 0]
    rings[..., 1] = y[:, None]
    rings[..., 2] = chord[:, None] * loop[:, 1]
    middle = np.stack([leading + chord / 2, y, np.zeros(spanwise)], axis=1)
    return skinned(rings, middle[[0, -1]])


def naca_0012(side: int = 100) -> ml.Section:
    """The airfoil of chord 1 with a sharp trailing edge, by its formula; `side` segments a side.

    The last coefficient is 0.1036 instead of 0.1015, which closes the trailing edge.
    """
    x = 0.5 * (1 - np.cos(np.pi * np.arange(side + 1) / side))
    slopes = -0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    y = 0.6 * (0.2969 * np.sqrt(x) + slopes)
    y[-1] = 0.0
    upper = np.stack([x, y, np.zeros(side + 1)], axis=1)
    return ml.Section(np.concatenate([upper[::-1], upper[1:] * [1, -1, 1]]), "NACA 0012")


def skinned(rings: Any, ends: Any) -> ml.Surface:
    """The closed surface through rings of points (s, k, 3), with a point that closes each end."""
    count, around = rings.shape[:2]
    number = np.arange(count * around).reshape(count, around)
    following = np.roll(number, -1, axis=1)
    a, b, c, d = (n.ravel() for n in (number[:-1], number[1:], following[1:], following[:-1]))
    first, last = count * around, count * around + 1
    faces = [
        np.stack([a, c, b], axis=1),
        np.stack([a, d, c], axis=1),
        np.stack([np.full(around, first), following[0], number[0]], axis=1),
        np.stack([np.full(around, last), number[-1], following[-1]], axis=1),
    ]
    return ml.Surface(np.concatenate([rings.reshape(-1, 3), ends]), np.concatenate(faces))
