"""Make the transport wing of the examples from published planform and section numbers.

usage: python examples/make_transport_wing.py [-o FILE] [--chordwise 60] [--spanwise 80]

Planform, twist, thickness and camber are those of the NASA Common Research Model's wing, station
by station (`data/crm_wing.csv` names the source). Its section coordinates are not in that table;
here the thickness follows the NACA four-digit form with a closed trailing edge and the mean line
two parabolas with the crest at 70 % chord (Abbott and von Doenhoff, Theory of Wing Sections, 6.4).
The right half, in metres, x aft, y to the tip, z up. Component 1 is the wing with its flat tip,
component 2 the cap in the symmetry plane, where y is exactly 0.
"""

import argparse
from pathlib import Path

import numpy as np

import moldline as ml

DATA = Path(__file__).parent / "data"
INCH = 0.0254
CREST = 0.7


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Write the wing; returns its semispan, planform area (both sides) and mean chord [m].

    The Model's published area and mean chord are smaller: they leave out the trailing-edge break.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=DATA / "transport_wing.tri")
    parser.add_argument("--chordwise", type=int, default=60, help="intervals on each side")
    parser.add_argument("--spanwise", type=int, default=80, help="intervals, about")
    given = parser.parse_args(arguments)
    table = np.genfromtxt(DATA / "crm_wing.csv", delimiter=",", names=True, skip_header=5)
    stations = refined(table, given.spanwise)
    surface = wing(stations, given.chordwise)
    ml.write(given.output, surface)
    span, chord = stations["y"] * INCH, stations["chord"] * INCH
    area = np.trapezoid(chord, span)
    mean_chord = np.trapezoid(chord**2, span) / area
    print(f"{given.output}: {len(surface.points)} points, {len(surface.faces)} triangles")
    return {"semispan": float(span[-1]), "area": 2 * area, "mean_chord": mean_chord}


def refined(table: np.ndarray, intervals: int) -> dict[str, np.ndarray]:
    """Stations between the published ones, which all stay, by linear interpolation."""
    eta = table["eta"]
    parts = np.maximum(1, np.round(np.diff(eta) * intervals)).astype(int)
    pieces = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(eta[:-1], eta[1:], parts, strict=True)
    ]
    fine = np.append(np.concatenate(pieces), 1.0)
    return {name: np.interp(fine, eta, table[name]) for name in table.dtype.names}


def wing(stations: dict[str, np.ndarray], count: int) -> ml.Surface:
    """Closed triangulation: the sections' loops joined, and both ends capped."""
    x, upper, lower = sections(stations["thickness"], stations["camber"], count)
    twist = np.radians(stations["twist"])[:, None]
    chord = stations["chord"][:, None] / np.cos(twist)  # the published one is the planform's
    loop_x = np.concatenate([x[::-1], x[1:-1]])  # trailing edge, upper side, nose, lower side
    loop_z = np.concatenate([upper[:, ::-1], lower[:, 1:-1]], axis=1)
    points = np.stack(
        [
            stations["x"][:, None] + chord * (np.cos(twist) * loop_x + np.sin(twist) * loop_z),
            np.broadcast_to(stations["y"][:, None], loop_z.shape),
            stations["z"][:, None] + chord * (np.cos(twist) * loop_z - np.sin(twist) * loop_x),
        ],
        axis=-1,
    )
    points = np.round(INCH * points, 6)  # micrometres keep the file small
    around = 2 * count
    skin = joined(np.arange(points.shape[0] * around).reshape(-1, around))
    tip = capped(count)[:, ::-1] + (points.shape[0] - 1) * around
    root = capped(count)
    faces = np.concatenate([skin, tip, root])
    tags = np.concatenate([np.zeros(len(skin) + len(tip), int), np.ones(len(root), int)])
    return ml.Surface(points.reshape(-1, 3), faces, tags, ("1", "2"))


def sections(
    thickness: np.ndarray, camber: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Chord fractions, and heights of both sides of every section as fractions of chord."""
    x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, count + 1)))
    x[-1] = 1.0
    half = 5 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    half[-1] = 0.0
    mean = np.where(
        x < CREST,
        (2 * CREST * x - x**2) / CREST**2,
        (1 - 2 * CREST + 2 * CREST * x - x**2) / (1 - CREST) ** 2,
    )
    line = camber[:, None] * mean
    return x, line + thickness[:, None] * half, line - thickness[:, None] * half


def joined(index: np.ndarray) -> np.ndarray:
    """Two triangles per cell between neighbouring loops."""
    a, b = index[:-1], np.roll(index[:-1], -1, axis=1)
    d, c = index[1:], np.roll(index[1:], -1, axis=1)
    cells = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, c, b), (a, d, c))]
    return np.concatenate(cells)


def capped(count: int) -> np.ndarray:
    """Triangles across one loop, between points that face each other on both sides."""
    upper = np.arange(1, count)
    lower = 2 * count - upper
    u, v, p, q = upper[:-1], upper[1:], lower[:-1], lower[1:]
    inner = np.concatenate([np.stack([u, v, q], 1), np.stack([u, q, p], 1)])
    ends = [[0, 1, 2 * count - 1], [count - 1, count, count + 1]]
    return np.concatenate([inner, ends])


if __name__ == "__main__":
    main()
