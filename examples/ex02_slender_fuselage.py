"""Turn an airliner's fuselage into a slender supersonic one by a lattice (Figure 2's idea).

A lattice of 13 stations with four control points each: every station is moved along the body,
lifted, and grown or shrunk as a whole. Writes the body and pictures into out/.
"""

from pathlib import Path

import numpy as np
from bodies import fuselage

import moldline as ml

OUT = Path(__file__).parent.parent / "out"

FORWARD = [-8.0, -5.0, -1.5, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.5, 3.0, 5.5, 8.0]
THICKER = [-2.6, -2.5, -2.2, -1.8, -1.5, -1.3, -1.3, -1.3, -1.4, -1.6, -1.9, -2.3, -2.6]
HIGHER = [-0.3, -0.1, 0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1, -0.4, -0.9, -1.4]


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    body = fuselage()
    lattice = ml.Lattice.around(body, shape=(13, 2, 2))
    station = [[[i, j, k] for j in (0, 1) for k in (0, 1)] for i in range(13)]
    along = ml.variable("along", value=FORWARD, bounds=(-10, 10), unit="m")
    radius = ml.variable("radius", value=THICKER, bounds=(-2.8, 2.8), unit="m")
    height = ml.variable("height", value=HIGHER, bounds=(-3, 3), unit="m")
    links = {
        along: ml.links.groups(lattice, (1, 0, 0), station),
        radius: ml.links.radius(lattice, along="x"),
        height: ml.links.camber(lattice, along="x", axis="z"),
    }
    case = ml.Pipeline(body, [ml.Stage(lattice, links)])
    slender = case()

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "slender_fuselage.tri", slender)
    title = "An airliner's fuselage made slender by a lattice"
    picture = ml.plot.of_deformation(case, view="iso", title=title)
    ml.plot.save(picture, OUT / "slender_fuselage.png")

    before, after = (_slenderness(shape.points) for shape in (body, slender))
    print(f"length over height  {before:.1f} before, {after:.1f} after")
    print(f"wrote {OUT.name}/slender_fuselage.tri, {OUT.name}/slender_fuselage.png")
    slope = case.pullback(None, np.asarray(slender.points) - np.asarray(body.points))
    return {
        "slenderness": after,
        "gradient": float(np.linalg.norm(np.concatenate([*slope.values()]))),
    }


def _slenderness(points: np.ndarray) -> float:
    extent = np.ptp(np.asarray(points), axis=0)
    return float(extent[0] / extent[2])


if __name__ == "__main__":
    main()
