"""A wing and a fuselage with 77 parameters, and the surface that the flow sees (example D).

The wing has a lattice of sections and then a skeleton, the fuselage fifteen radii; a union joins
them and keeps the wetted surface alone. As in the paper 57 of the parameters are active. Without
arguments a tenth of the paper's vertices; `--full` has all of them and takes times. Writes the
wetted surface and pictures into out/.
"""

import sys
from pathlib import Path
from typing import Any

import jax
import numpy as np
import wing_body_pictures
import wing_body_times

import moldline as ml
from moldline.measures import Area, Volume

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
SIZES = {
    False: {"chordwise": 56, "spanwise": 70, "along": 172, "around": 64},
    True: {"chordwise": 176, "spanwise": 236, "along": 554, "around": 200},
}
"""Points of a side of the wing's sections, sections, rings of the body, and points of one."""

SPAN = 17.0
STATIONS = [0.0, 2.0, 7.14, 12.0, 17.0]
"""The plane of symmetry, then the side of the body, the trailing edge's break at 42 %, and two."""

SWEEP = 27.0
ROOT = (13.0, -1.2)
"""Where the leading edge begins in the plane of symmetry, x and z [m]."""

BODY = {
    "length": [0.5, 1.5, 3.0, 5.5, 8.0, 24.0, 28.0, 32.0, 35.0, 37.5],
    "radius": [0.0, 0.72, 1.2, 1.64, 1.95, 2.0, 2.0, 1.8, 1.32, 0.82, 0.3],
    "lift": [-0.5, -0.45, -0.36, -0.2, -0.05, 0.0, 0.0, 0.15, 0.56, 0.98, 1.4],
}
"""An airliner's for 160 passengers: stations, radii and how far the axis is raised [m]."""

ACTIVE = {"normal": range(46), "sweep": range(4), "twist": range(4), "radius": range(5, 8)}
"""Numbers of variables that the paper's optimiser turns: 57. The radii are those near the root."""

DIHEDRAL = 5.0


def main(full: bool = False) -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    case, design = pipeline(full), changed()
    shape, before = case(design), case()
    slopes = gradients(case, design)
    numbers = {
        "parameters": float(sum(v.size for v in case.variables.values())),
        "active": float(sum(map(len, ACTIVE.values()))),
        "wing": float(len(case.geometries["wing"].points)),
        "fuselage": float(len(case.geometries["fuselage"].points)),
        "volume": measured(Volume, shape),
        "area": measured(Area, shape),
        "reverse": against_columns(case, design, slopes),
        "anew": against_booleans(case, design, slopes),
    }
    if full:
        times = wing_body_times.exact(case, design, columns)
        told = wing_body_times.by_processes(SIZES[full], design, slopes, int(numbers["active"]))
        numbers |= times | told
    else:
        stated = np.asarray(ml.load(HERE / "wing_body.toml").pipeline.points(design))
        gap = np.abs(stated - np.asarray(shape.points)).max()
        numbers["case"] = float(gap / np.ptp(stated, axis=0).max())
    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "wing_body.tri", shape)
    files = wing_body_pictures.draw(case, design, kept_points(), STATIONS, OUT)
    print("\n".join(f"{name:24} {value:.8g}" for name, value in numbers.items()))
    print(f"{'points':24} {len(before.points)} before, {len(shape.points)} after")
    print("wrote", ", ".join(f"{OUT.name}/{name}" for name in ("wing_body.tri", *files)))
    return numbers


def pipeline(full: bool = False) -> ml.Pipeline:
    """Wing and fuselage, what deforms them, and their wetted surface; a half model."""
    wing, body = parts(full)
    root = ml.Construction(wing, to="wing", name="wing")
    tube = ml.Construction(body, to="fuselage", name="fuselage")
    wetted = ml.Construction(
        ml.Union(symmetry="y"), to="configuration", of=["wing", "fuselage"], name="wetted surface"
    )
    return ml.Pipeline({}, [root, *wing_stages(wing), tube, body_stage(), wetted])


def parts(full: bool) -> tuple[ml.Wing, ml.Body]:
    """A flat wing, whose dihedral is the skeleton's, and half a fuselage."""
    chordwise, spanwise, along, around = SIZES[full].values()
    wing = ml.Wing(
        [STATIONS[2], SPAN],
        [7.4, 3.9, 1.6],
        sweep=SWEEP,
        twist=[3.0, 1.0, -1.0],
        thickness=[0.15, 0.121, 0.11],
        airfoil="rae 2822",
        degrees=True,
        origin=[ROOT[0], 0.0, ROOT[1]],
        root="open",
        chordwise=chordwise,
        spanwise=spanwise,
    )
    body = ml.Body(**BODY, loft="cubic", half=True, along=along, around=around)
    return wing, body


def section_box() -> ml.Lattice:
    """A box as long as the root's chord, swept as the leading edge is, with 7 x 4 x 2 points."""
    run = SPAN * np.tan(np.radians(SWEEP))
    origin = [ROOT[0] - 0.1, 0.0, ROOT[1] - 0.8]
    edges = [[7.6, 0.0, 0.0], [run, SPAN, 0.0], [0.0, 0.0, 1.6]]
    return ml.Lattice(origin, edges, (7, 4, 2), outside="extend")


def free_points() -> list[list[int]]:
    """46 of the 56.

    The eight at the trailing edge stay, for twist is the skeleton's, and the two at the root's
    leading edge, for incidence is the flow's.
    """
    every = [list(index) for index in np.ndindex(7, 4, 2)]
    return [index for index in every if index[0] < 6 and index[:2] != [0, 0]]


def kept_points() -> list[int]:
    """Numbers of the other ten."""
    free = free_points()
    return [n for n, index in enumerate(np.ndindex(7, 4, 2)) if list(index) not in free]


def wing_stages(wing: ml.Wing) -> list[ml.Stage]:
    """Sections by a lattice, then sweep, dihedral, twist by a skeleton, then the span of panels.

    With a station in the plane of symmetry the skeleton has four panels, and so four numbers of
    each; there the twist stays. Its span is one number: four take a lattice of degree 1 whose
    control points are the stations. Each moves all that is outboard of its panel.
    """
    box, skeleton = section_box(), ml.WingSkeleton.fitted(wing.geometry, STATIONS)
    knots = [station / SPAN for station in STATIONS[1:-1]]
    low, high = [ROOT[0], 0.0, ROOT[1]], [ROOT[0] + 1.0, SPAN, ROOT[1] + 1.0]
    panels = ml.Lattice.box(
        low, high, (1, 5, 1), degree=1, knots=[None, knots, None], outside="extend"
    )
    outboard = [[[0, j, 0] for j in range(i, 5)] for i in range(1, 5)]
    angles = {"unit": "deg", "bounds": (-5, 5)}
    posed = {
        ml.variable("sweep", 4, **angles): ml.links.named(skeleton, "sweep"),
        ml.variable("dihedral", 4, DIHEDRAL, unit="deg"): ml.links.named(skeleton, "dihedral"),
        ml.variable("twist", 4, **angles): ml.links.named(skeleton, "twist", [1, 2, 3, 4]),
    }
    normal = ml.variable("normal", 46, bounds=(-0.2, 0.2), unit="m")
    span = ml.variable("span", 4, bounds=(-0.5, 0.5), unit="m")
    return [
        ml.Stage(box, {normal: ml.links.each(box, "z", index=free_points())}, "wing", "sections"),
        ml.Stage(skeleton, posed, "wing", "skeleton"),
        ml.Stage(panels, {span: ml.links.groups(panels, [0, 1, 0], outboard)}, "wing", "panels"),
    ]


def body_stage() -> ml.Stage:
    """Fifteen radii along the fuselage: the four control points of a station move as one.

    The box is that of the whole fuselage, so that the plane of symmetry is its middle.
    """
    box = ml.Lattice.box([0.0, -2.2, -2.2], [37.5, 2.2, 2.2], (15, 2, 2), outside="extend")
    radius = ml.variable("radius", 15, bounds=(-0.3, 0.3), unit="m")
    link = ml.links.mirrored(box, ml.links.radius(box, "x"), "y")
    return ml.Stage(box, {radius: link}, "fuselage", "radii")


def changed() -> dict[str, np.ndarray]:
    """A design: thinner and loaded aft, swept back and washed out, with a waist at the root."""
    index = np.array(free_points())
    chord, span, side = index[:, 0] / 6, index[:, 1] / 3, 2 * index[:, 2] - 1
    depth = np.sin(np.pi * chord) * (1 - 0.6 * span)
    aft = np.exp(-(((chord - 0.8) / 0.12) ** 2)) * (1 - 0.7 * span)
    waist = np.zeros(15)
    waist[5:8] = -0.1, -0.22, -0.1
    return {
        "normal": -0.04 * side * depth + 0.08 * aft,
        "sweep": np.array([0.0, 1.0, 2.0, 2.0]),
        "twist": np.array([0.3, -0.4, -1.0, -1.6]),
        "radius": waist,
    }


def measured(measure: Any, surface: ml.Surface) -> float:
    """Its volume or area; about a place in the plane of symmetry near by, for fewer roundings."""
    near = np.asarray(surface.points) - [BODY["length"][-1] / 2, 0.0, 0.0]
    return float(measure(surface.faces)(near)[0])


def gradients(case: ml.Pipeline, values: Any) -> dict[str, dict[str, np.ndarray]]:
    """Derivatives of volume and area by all variables, in reverse."""
    shape = case(values)
    found = {}
    for name, measure in (("volume", Volume(shape.faces)), ("area", Area(shape.faces))):
        slope = jax.grad(lambda p, of=measure: of(p)[0])(shape.points)
        by_values = case.pullback(values, slope)
        found[name] = {key: np.asarray(row) for key, row in by_values.items()}
    return found


def columns(case: ml.Pipeline, values: Any) -> np.ndarray:
    """The derivative of every point by every active number, shape (n, 3, 57)."""
    found = [case.sensitivity(values, name)[..., list(rows)] for name, rows in ACTIVE.items()]
    return np.concatenate(found, axis=-1)


def against_columns(case: ml.Pipeline, values: Any, slopes: Any) -> float:
    """How far forward derivatives of volume and area are from reverse ones, of the largest."""
    shape, moves = case(values), columns(case, values)
    worst = 0.0
    for name, measure in (("volume", Volume(shape.faces)), ("area", Area(shape.faces))):
        slope = np.asarray(jax.grad(lambda p, of=measure: of(p)[0])(shape.points))
        forward = np.einsum("ni,nik->k", slope, moves)
        reverse = np.concatenate([slopes[name][key][list(rows)] for key, rows in ACTIVE.items()])
        worst = max(worst, float(np.abs(forward - reverse).max() / np.abs(reverse).max()))
    return worst


def anew(case: ml.Pipeline, values: Any) -> ml.Surface:
    """The wetted surface by a new boolean, whatever the present one's connectivity is."""
    parts = [case.of(name)(values) for name in ("wing", "fuselage")]
    return ml.Union(symmetry="y").bind(*parts).geometry


def against_booleans(case: ml.Pipeline, values: Any, slopes: Any, step: float = 4e-3) -> float:
    """How far derivatives are from differences of new booleans, of the largest in each direction.

    Along each variable and along all of them, at random. Central differences of two steps,
    extrapolated: their error is of the fourth order where the parts cross alike.
    """
    rng = np.random.default_rng(0)
    full = {name: np.asarray(value) for name, value in case.values(values).items()}
    each = {n: v.typical * rng.uniform(-1, 1, v.size) for n, v in case.variables.items()}
    worst = 0.0
    for along in [*({name: way} for name, way in each.items()), each]:

        def difference(h: float, way: Any = along) -> np.ndarray:
            ends = []
            for sign in (1, -1):
                there = {n: v + sign * h * way.get(n, 0.0) for n, v in full.items()}
                shape = anew(case, there)
                ends.append([measured(Volume, shape), measured(Area, shape)])
            return (np.array(ends[0]) - ends[1]) / (2 * h)

        found = (4 * difference(step / 2) - difference(step)) / 3
        for slope, value in zip(slopes.values(), found, strict=True):
            exact = sum(slope[n] @ way for n, way in along.items())
            size = sum(np.abs(slope[n]) @ np.abs(way) for n, way in along.items())
            worst = max(worst, float(abs(value - exact) / size))
    return worst


if __name__ == "__main__":
    main("--full" in sys.argv[1:])
