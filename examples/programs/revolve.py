"""Somebody else's program: a body of revolution from a file of numbers, with NumPy alone.

    python revolve.py body.in body.tri

It knows nothing of moldline. `body.in` holds lines such as `length = 12.0`; `body.tri` is Cart3D's
text format.
"""

import sys
from pathlib import Path

import numpy as np

RINGS, AROUND = 40, 24


def numbers(path: str) -> dict[str, float]:
    """What a file of lines `name = value` says."""
    lines = Path(path).read_text().splitlines()
    pairs = (line.split("=") for line in lines if "=" in line)
    return {name.strip(): float(value) for name, value in pairs}


def radii(x: np.ndarray, given: dict[str, float]) -> np.ndarray:
    """Radius along the body, from 0 to 1: a blunt nose, a pointed tail."""
    nose, tail = given["nose"], given["tail"]
    crest = (nose / (nose + tail)) ** nose * (tail / (nose + tail)) ** tail
    return given["radius"] * x**nose * (1 - x) ** tail / crest


def surface(given: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles, closed at the two tips."""
    x = (1 - np.cos(np.pi * np.arange(1, RINGS) / RINGS)) / 2
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    radius = radii(x, given)[:, None]
    rings = [
        np.broadcast_to(given["length"] * x[:, None], (RINGS - 1, AROUND)),
        radius * np.sin(angle),
        radius * np.cos(angle) * given["flatness"],
    ]
    tips = [[0.0, 0.0, 0.0], [given["length"], 0.0, 0.0]]
    points = np.concatenate([np.stack(rings, axis=-1).reshape(-1, 3), tips])
    nose, tail = len(points) - 2, len(points) - 1
    faces = []
    for j in range(AROUND):
        k = (j + 1) % AROUND
        faces.append((nose, j, k))
        for i in range(RINGS - 2):
            a, b, c, d = i * AROUND + j, i * AROUND + k, (i + 1) * AROUND + k, (i + 1) * AROUND + j
            faces += [(a, c, b), (a, d, c)]
        last = (RINGS - 2) * AROUND
        faces.append((tail, last + k, last + j))
    return points, np.array(faces)


def main() -> None:
    """Read, make, write."""
    source, target = sys.argv[1:]
    given = numbers(source)
    if given["length"] <= 0 or given["radius"] <= 0:
        sys.exit(f"length and radius must be above 0, got {given}")
    points, faces = surface(given)
    with Path(target).open("w") as file:
        file.write(f"{len(points)} {len(faces)}\n")
        np.savetxt(file, points, "%.15g")
        np.savetxt(file, faces + 1, "%d")
        np.savetxt(file, np.ones(len(faces)), "%d")
    print(f"wrote {len(points)} points")


if __name__ == "__main__":
    main()
