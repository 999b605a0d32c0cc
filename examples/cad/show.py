"""CAD shapes with parameters: their triangles, moved ones, and a derivative.

Needs OpenCascade: `pip install 'moldline[step]'`. Run it: `python examples/cad/show.py`.
"""

import time
from pathlib import Path

import numpy as np

import moldline as ml
from moldline.mesh.quality import signed_volume
from moldline.modelers.cad import Cad
from moldline.plot.figure import blank

HERE = Path(__file__).parent
OUT = HERE.parents[1] / "out"
WING = {"span": 3.0, "chord": 1.0, "taper": 0.5, "sweep": 20.0, "twist": -3.0, "thickness": 0.12}
SIDE = ml.plot.View(azimuth_deg=215.0, elevation_deg=35.0)
ABOVE = ml.plot.View(azimuth_deg=250.0, elevation_deg=55.0)


def main() -> dict[str, float]:
    """Run it; returns key numbers."""
    start = time.perf_counter()
    wing = Cad(script=HERE / "wing.py", parameters=WING, max_edge=0.1, sag=1e-3)
    made = time.perf_counter()
    found = wing.differences()
    taken = time.perf_counter()
    plate = Cad(script=HERE / "plate.py", parameters={"place": 1.4, "radius": 0.45}, max_edge=0.2)
    moved = np.asarray(plate(np.array([1.75, 0.55])))
    figure = blank(14, 4.6)
    left, *others = figure.subplots(1, 3, width_ratios=[1.25, 1, 1])
    motion = found.jacobian[:, 2, wing.parameters["twist"][0]]
    drawn = ml.plot.draw_surface(
        left, wing.geometry.points, wing.geometry.faces, motion * 1e3, view=SIDE
    )
    figure.colorbar(drawn, ax=left, label="upward motion for twist [mm/degree]", shrink=0.7)
    left.set_title("a loft, and its derivative")
    for axes, points, title in zip(
        others, (plate.geometry.points, moved), ("a boolean", "the same triangles"), strict=True
    ):
        ml.plot.draw_surface(axes, points, plate.geometry.faces, view=ABOVE)
        edges(axes, points, plate.geometry.faces)
        axes.set_title(title)
    OUT.mkdir(exist_ok=True)
    ml.plot.save(figure, OUT / "cad.png", dpi=70)
    numbers = {
        "points": float(len(wing.geometry.points)),
        "volume": float(signed_volume(wing.geometry)),
        "error": float(found.errors.max()),
    }
    print("\n".join(f"{name:10} {value:.6g}" for name, value in numbers.items()))
    print(f"made in {made - start:.2f} s, derivatives of 6 parameters in {taken - made:.2f} s")
    return numbers


def edges(axes, points, faces):
    """Edges of the triangles that face the eye."""
    flat = ABOVE.project(points)[:, :2]
    a, b, c = (flat[np.asarray(faces)[:, k]] for k in range(3))
    seen = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0
    shown = np.asarray(faces)[seen]
    axes.triplot(flat[:, 0], flat[:, 1], shown, color="#33556f", lw=0.3)


if __name__ == "__main__":
    main()
