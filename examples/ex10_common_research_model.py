"""A legacy geometry: patches of one wetted surface become wing and body, and are joined again.

The half model of NASA's Common Research Model in 18 patches (inches, from pyGeo's tests) is welded.
Its wing is extended into the body, the body's hole is filled: two closed components, each with its
own deformers, whose union is the configuration again. Writes it and pictures into out/.

The file is not part of this project: put `crm_wing_body_patches.xyz.gz` into a folder and name that
in the environment variable MOLDLINE_DATA.
"""

import os
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from matplotlib.figure import Figure

import moldline as ml
from moldline.measures import Area, Volume
from moldline.mesh import topology
from moldline.mesh.cap import capped
from moldline.mesh.extend import extended
from moldline.mesh.fill import filled
from moldline.mesh.stitch import stitched
from moldline.modelers.wetting import Wetting, followed
from moldline.numerics.closest import nearest, tree
from moldline.numerics.taylor import remainder
from moldline.plot.figure import blank

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
FILE = "crm_wing_body_patches.xyz.gz"
BLOCKS = {
    "wing": [3, 4, 5, 6, 9, 10, 11, 12, 17, 18],
    "body": [1, 2, 7, 8, 13, 14, 15, 16],
}
"""Patches of each, counted from 1; `moldline convert` suggests them."""

INNER = 1.8
"""Where the extended wing ends, 1.2 m inside the body [m]."""

ROWS = (0.15, 0.5, 1.0)
"""Where the root's points go, and rows behind them, as parts of the way to there."""

SPACING = 0.12
"""Of the points that fill the body's hole [m]."""

STATIONS = [1.9, 10.87, 20.0, 29.0]
"""Of the skeleton: inside the body, where the trailing edge breaks, and two more [m]."""

PARTS = ("wing", "body")
COLOURS = "Set3"
NEAR = ml.plot.View(azimuth_deg=150.0, elevation_deg=28.0)


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    original = welded()
    case, design = pipeline(*components(original)), changed()
    back = compared(original, case)
    here = case.at(design)
    report = made(here).report
    check = proved(here, design)

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "crm.tri", here(design))
    pictures(case, here, design)
    lines = {
        "at rest": f"surfaces {back.apart:.2g} m apart at most, curves {back.curve:.2g} m; volume "
        f"off by {back.volume:.2g} m3, area by {back.area:.2g} m2",
        "slopes": f"volume and area off by {check.gap:.1e} of the largest, against new booleans",
        "remainder": f"of order {check.order:.3f}; forward and reverse differ by {check.ways:.1e}",
    }
    print("\n".join([*report.sentences(), *(f"{k:12} {v}" for k, v in lines.items())]))
    return {
        "apart": back.apart,
        "curve": back.curve,
        "volume_off": abs(back.volume),
        "area_off": abs(back.area),
        "volume": report.volume,
        "area": report.area,
        "slid": slid(here, case),
        "watertight": report.is_watertight,
        "pieces": report.pieces,
        "genus": report.genus,
        "root": report.components.get("root", 0),
        "order": check.order,
        "ways": check.ways,
        "gap": check.gap,
    }


def found() -> Path:
    """The file, in the folder that MOLDLINE_DATA names."""
    path = Path(os.environ.get("MOLDLINE_DATA", "")) / FILE
    if not path.exists():
        raise FileNotFoundError(
            f"{path} is absent: it is no part of this project, but among pyGeo's test inputs; say "
            "in the environment variable MOLDLINE_DATA which folder has it"
        )
    return path


def welded() -> ml.Surface:
    """The wetted surface as it was given, in metres, open at the plane of symmetry."""
    surface, _ = stitched(ml.read(found(), units="in"), BLOCKS)
    return surface


def components(original: ml.Surface) -> tuple[ml.Surface, ml.Surface]:
    """The wing, extended and closed, and the body, its hole filled.

    Both had the same points along the root, so neither may keep them: those of the wing slide on
    inwards, and the body's filling begins one ring of faces farther out.
    """
    wing, body = (_alone(original, name) for name in PARTS)
    longer, extension = extended(wing, "y", INNER, ROWS)
    closed, capping = capped(longer, "root", "y", INNER)
    hole = min(topology.boundary_loops(body.faces), key=len)  # the other is in the plane
    whole, filling = filled(body, hole, clear=1, rings=1, spacing=SPACING)
    print("\n".join([*extension.sentences(), *capping.sentences(), *filling.sentences()]))
    return closed, whole


def _alone(surface: ml.Surface, name: str) -> ml.Surface:
    """One component by itself."""
    own = np.asarray(surface.faces)[np.asarray(surface.tags) == surface.components.index(name)]
    used, faces = np.unique(own, return_inverse=True)
    return ml.Surface(np.asarray(surface.points)[used], faces.reshape(-1, 3), None, (name,))


def pipeline(wing: ml.Surface, body: ml.Surface) -> ml.Pipeline:
    """Sections and planform of the wing, radii of the body, and their union."""
    sections = ml.ControlVolume.along_wing(wing, (5, 4, 2))
    skeleton = ml.WingSkeleton.fitted(wing, STATIONS)
    tube = ml.Lattice.box([2.0, -3.6, 2.0], [65.5, 3.6, 9.0], (12, 2, 2))
    angles = {"unit": "deg", "typical": 1.0}
    heights = ml.variable("sections", 40, unit="m", typical=0.05)
    radii = ml.variable("radii", 12, unit="m", typical=0.1)
    posed = {
        ml.variable("span", unit="m", typical=0.5): ml.links.named(skeleton, "span"),
        ml.variable("sweep", 3, **angles): ml.links.named(skeleton, "sweep"),
        ml.variable("dihedral", 3, **angles): ml.links.named(skeleton, "dihedral"),
        ml.variable("twist", 4, **angles): ml.links.named(skeleton, "twist"),
    }
    radial = ml.links.mirrored(tube, ml.links.radius(tube, "x"), "y")
    return ml.Pipeline(
        {"wing": wing, "body": body},
        [
            ml.Stage(sections, {heights: ml.links.each(sections, "z")}, "wing", "sections"),
            ml.Stage(skeleton, posed, "wing", "skeleton"),
            ml.Stage(tube, {radii: radial}, "body", "radii"),
            ml.Construction(ml.Union(symmetry="y"), to="configuration", of=PARTS),
        ],
    )


def changed() -> dict[str, np.ndarray]:
    """Two degrees more sweep, more dihedral, washout, a fuller crest, and a waist at the wing."""
    crest = np.zeros((5, 4, 2))
    crest[2, :, 1] = 0.12, 0.08, 0.05, 0.02
    waist = np.zeros(12)
    waist[5:8] = -0.15, -0.25, -0.15
    return {
        "sections": crest.ravel(),
        "sweep": np.array([2.0, 2.0, 2.0]),
        "dihedral": np.array([1.5, 1.0, 1.0]),
        "twist": np.array([1.5, 0.5, -1.0, -2.0]),
        "radii": waist,
    }


def made(case: ml.Pipeline) -> Wetting:
    """What the union made."""
    making = case.branches["configuration"].making
    assert isinstance(making, Wetting)
    return making


def junction(case: ml.Pipeline) -> np.ndarray:
    """Points of the wetted surface where wing and body meet; those after the kept ones."""
    making = made(case)
    return np.asarray(making.geometry.points)[making.report.kept :]


class Return(NamedTuple):
    """How near the union at rest comes to what was given.

    Attributes
    ----------
    apart
        The largest distance of a point of either surface from the other [m].
    curve
        The largest distance of a point of the new junction from the old one [m].
    volume, area
        New less old [m3, m2].
    """

    apart: float
    curve: float
    volume: float
    area: float


def compared(original: ml.Surface, case: ml.Pipeline) -> Return:
    """The union at rest against the surface as it was given."""
    again = case()
    shapes = [(np.asarray(s.points), np.asarray(s.faces)) for s in (original, again)]
    apart = [
        nearest(shapes[k][0][np.unique(shapes[k][1])], tree(*shapes[1 - k])).distances.max()
        for k in range(2)
    ]
    wing = _alone(original, "wing")
    loop = np.asarray(wing.points)[topology.boundary_loops(wing.faces)[0]]
    sizes = [[measured(f, s) for s in (original, again)] for f in (Volume, Area)]
    return Return(
        float(max(apart)),
        float(_off(junction(case), loop).max()),
        sizes[0][1] - sizes[0][0],
        sizes[1][1] - sizes[1][0],
    )


def _off(places: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Distance of places from a closed line."""
    along = np.roll(loop, -1, axis=0) - loop
    away = places[:, None] - loop
    share = np.einsum("ijk,jk->ij", away, along) / np.einsum("jk,jk->j", along, along)
    return np.linalg.norm(away - np.clip(share, 0, 1)[..., None] * along, axis=2).min(axis=1)


def slid(here: ml.Pipeline, case: ml.Pipeline) -> float:
    """How far the middle of the junction has moved [m]."""
    return float(np.linalg.norm(junction(here).mean(axis=0) - junction(case).mean(axis=0)))


def measured(measure: Any, surface: ml.Surface) -> float:
    """Volume or area, about a place in the plane of symmetry near by, for fewer roundings."""
    near = np.asarray(surface.points) - [33.0, 0.0, 5.0]
    return float(measure(surface.faces)(near)[0])


class Proof(NamedTuple):
    """How right the derivatives are.

    Attributes
    ----------
    order
        Of the Taylor remainder of all points while the same edges run through the same faces.
    ways
        Relative difference of forward and reverse derivative.
    gap
        Largest error of the derivatives of volume and area, along each variable and along all of
        them, by the largest: against central differences with a new boolean on either side.
    """

    order: float
    ways: float
    gap: float


def proved(case: ml.Pipeline, design: dict[str, Any]) -> Proof:
    """Prove the derivatives at a design."""
    full = {name: np.asarray(value) for name, value in case.values(design).items()}
    rng = np.random.default_rng(0)
    along = {n: v.typical * rng.uniform(-1, 1, v.size) for n, v in case.variables.items()}
    recipe = made(case).recipe

    def frozen(values: Any) -> Any:
        parts = tuple(case.of(name).points(values) for name in PARTS)
        return followed(recipe, parts)[0]

    order = remainder(frozen, full, {n: 0.02 * way for n, way in along.items()}).order
    motion = np.asarray(case.pushforward(full, along))
    weights = rng.normal(size=motion.shape)
    back = case.pullback(full, weights)
    forward = float(np.sum(weights * motion))
    reverse = sum(float(np.sum(np.asarray(back[n]) * along[n])) for n in full)
    ways = abs(forward - reverse) / abs(forward)
    return Proof(order, ways, against_booleans(case, full, along))


def against_booleans(case: ml.Pipeline, full: Any, along: Any, step: float = 1e-3) -> float:
    """See `Proof.gap`."""
    shape, slopes = case(full), []
    for measure in (Volume(shape.faces), Area(shape.faces)):
        slope = jax.grad(lambda points, of=measure: of(points)[0])(shape.points)
        slopes.append({n: np.asarray(row) for n, row in case.pullback(full, slope).items()})
    misses, sizes = [], []
    for way in [*({name: one} for name, one in along.items()), along]:
        ends = []
        for sign in (1, -1):
            there = {n: v + sign * step * way.get(n, 0.0) for n, v in full.items()}
            parts = [case.of(name)(there) for name in PARTS]
            surface = ml.Union(symmetry="y", crossings="allow").bind(*parts).geometry
            ends.append([measured(Volume, surface), measured(Area, surface)])
        exact = np.array([sum(slope[n] @ one for n, one in way.items()) for slope in slopes])
        misses.append(np.abs((np.array(ends[0]) - ends[1]) / (2 * step) - exact))
        sizes.append(np.abs(exact))
    return float((np.max(misses, axis=0) / np.max(sizes, axis=0)).max())


def pictures(case: ml.Pipeline, here: ml.Pipeline, design: dict[str, Any]) -> None:
    """Draw the parts, the configuration before and after, a sensitivity and the pipeline."""
    ml.plot.save(parts_picture(case), OUT / "crm_parts.png", dpi=80)
    ml.plot.save(junction_picture(case, here, design), OUT / "crm_junction.png", dpi=80)
    ml.plot.save(sensitivity_picture(here, design), OUT / "crm_sensitivity.png", dpi=80)
    chart = ml.plot.of_pipeline(here, design, "The Common Research Model, taken apart")
    ml.plot.save(chart, OUT / "crm_chart.png", dpi=80)


def parts_picture(case: ml.Pipeline) -> Figure:
    """The two components, the wing pulled out; what was added is yellow."""
    wing, body = case.geometries["wing"], case.geometries["body"]
    points = np.concatenate([wing.points + np.array([0.0, 4.0, 0.0]), body.points])
    faces = np.concatenate([wing.faces, np.asarray(body.faces) + len(wing.points)])
    inner = (wing.points[np.asarray(wing.faces), 1] < 3.0).any(axis=1)
    added = np.append(inner, np.asarray(body.tags) == body.components.index("filling"))
    figure = blank(12, 6)
    axes = figure.subplots()
    view = ml.plot.View(azimuth_deg=120.0, elevation_deg=28.0)
    ml.plot.draw_surface(axes, points, faces, 1.0 * added, view, colours=COLOURS, is_signed=False)
    return figure


def _beside(surface: ml.Surface) -> ml.Surface:
    """What lies around the root; each point's number goes along."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    middle = points[faces].mean(axis=1)
    stays = (np.abs(middle[:, 0] - 31.5) < 9.5) & (middle[:, 1] < 6.0)
    used, own = np.unique(faces[stays], return_inverse=True)
    tags = np.asarray(surface.tags)[stays]
    number = {"number": used}
    return ml.Surface(points[used], own.reshape(-1, 3), tags, surface.components, number)


def junction_picture(case: ml.Pipeline, here: ml.Pipeline, design: dict[str, Any]) -> Figure:
    """The root before and after, with the curve where the faces of wing and body meet."""
    figure = blank(13, 5)
    panels = figure.subplots(1, 2)
    shapes = case(), here(design)
    curves = [NEAR.project(_curve(shape))[:, :2].T for shape in shapes]
    for axes, shape in zip(panels, shapes, strict=True):
        near = _beside(shape)
        owner = np.array([name == "wing" for name in near.components])[np.asarray(near.tags)]
        ml.plot.draw_surface(
            axes, near.points, near.faces, 1.0 * owner, NEAR, colours=COLOURS, is_signed=False
        )
    panels[0].plot(*curves[0], color="black", lw=1.2)
    panels[1].plot(*curves[0], color="black", lw=0.8, ls="--")
    panels[1].plot(*curves[1], color="#c1272d", lw=1.4)
    panels[0].set_title("as given", fontsize=13)
    panels[1].set_title("swept, raised, twisted, with a waist", fontsize=13)
    return figure


def _curve(shape: ml.Surface) -> np.ndarray:
    """Around the wing where it meets the body; the first point again at its end."""
    own = np.asarray(shape.tags) == shape.components.index("wing")
    (loop,) = topology.boundary_loops(np.asarray(shape.faces)[own])
    return np.asarray(shape.points)[[*loop, loop[0]]]


def sensitivity_picture(here: ml.Pipeline, design: dict[str, Any]) -> Figure:
    """How far points move up for a degree of dihedral of the inner panel; the body stays."""
    motion = np.asarray(here.pushforward(design, {"dihedral": np.eye(3)[0]}))[:, 2]
    shape = _beside(here(design))
    values = motion[np.asarray(shape.point_data["number"])]
    most = 0.09  # of the wing's own points there; some on the curve slide faster
    label = "dz / d dihedral[0] [m/deg]"
    return ml.plot.sensitivity_map(
        shape.points, shape.faces, np.clip(values, -most, most), label, view=NEAR
    )


if __name__ == "__main__":
    try:
        main()
    except FileNotFoundError as absent:
        raise SystemExit(str(absent)) from None
