"""A nacelle from a modeler, reshaped by a cage, joined with a pylon and a wing: one wetted surface.

Numbers of the modelers and of the cage are variables side by side, and the derivatives run through
all of it. Writes the configuration and pictures into out/.
"""

from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import moldline as ml
from moldline.measures import Area, Volume
from moldline.modelers.wetting import Wetting, followed
from moldline.numerics.taylor import remainder
from moldline.plot.figure import blank
from moldline.plot.pictures import nets

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
CAGE = HERE / "data/nacelle_cage.obj"
PARTS = ("nacelle", "pylon", "wing")

LIP = [0, 1, 7, 8, 9, 15]
"""Numbers of the cage's points ahead of and above the lip: they move forward."""

KEEL = [4, 12, 20, 28]
"""Below the keel: they move up."""

POUCHES = [11, 19], [13, 21]
"""Beside the keel, to starboard and to port: they move outwards."""

DESIGN: dict[str, Any] = {
    "length": 3.7, "radius": 1.08, "droop": 3.0, "lip": 0.3, "keel": 0.7, "pouches": 0.6,
    "pylon_sweep": 49.0, "twist": [3.5, 1.5, -2.5],
}  # fmt: skip
"""In the variables' units."""

STEPS = (0.1, 0.01, 0.001, 0.0001)
"""Of the pylon's sweep, one after the other [deg]."""

TRIES = 4
"""Steps of each size."""

COLOURS = "Set3"

NEAR = ml.plot.View(azimuth_deg=215.0, elevation_deg=-14.0)
SIDE = ml.plot.View(azimuth_deg=242.0, elevation_deg=-6.0)


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    case = pipeline().at(DESIGN)
    final = case(DESIGN)
    report = made(case).report
    check = proved(case)
    anew = {step: made_anew(case, step) for step in STEPS}
    stated = ml.load(HERE / "nacelle.toml").pipeline(DESIGN)
    own = ml.Cage.of(ml.read(CAGE)).rest

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "nacelle.tri", final)
    pictures(case)
    lines = {
        "slopes": f"volume and area off by {check.gap:.1e} of the largest, against new booleans",
        "remainder": f"of order {check.order:.3f}; forward and reverse differ by {check.ways:.1e}",
        "new booleans": ", ".join(f"{n} of {TRIES} at {h:g} deg" for h, n in anew.items()),
    }
    print("\n".join([*report.sentences(), *(f"{k:12} {v}" for k, v in lines.items())]))
    return {
        "volume": report.volume,
        "area": report.area,
        "reshaped": float(np.abs(reshaped(case)).max()),
        "genus": report.genus,
        "openings": report.openings,
        "watertight": report.is_watertight,
        "order": check.order,
        "gap": check.gap,
        "ways": check.ways,
        "anew": anew[STEPS[0]],
        "anew_small": anew[STEPS[-1]],
        "cage": float(np.abs(own - enclosing(engine()).rest).max()),
        "case": float(np.abs(np.asarray(stated.points) - np.asarray(final.points)).max()),
    }


def engine() -> ml.Nacelle:
    """A nacelle with a drooped lip, ahead of and below the wing."""
    return ml.Nacelle(
        3.6,
        1.05,
        0.92,
        droop=2.0,
        degrees=True,
        origin=[0.4, 5.5, -1.75],
        chordwise=33,
        around=64,
    )


def pylon() -> ml.Wing:
    """A wing that stands up, from inside the cowl to inside the wing."""
    return ml.Wing(
        1.35,
        [2.0, 2.3],
        sweep=50.0,
        thickness=0.09,
        degrees=True,
        along="z",
        origin=[1.6, 5.5, -0.82],
        tip="flat",
        chordwise=25,
        spanwise=24,
        name="pylon",
    )


def wing() -> ml.Wing:
    """Half a wing, open at the plane of symmetry."""
    return ml.Wing(
        [5.5, 15.0],
        [6.5, 4.4, 1.9],
        sweep=[29.0, 27.0],
        dihedral=5.0,
        twist=[3.0, 1.0, -2.0],
        thickness=[0.14, 0.12, 0.11],
        airfoil="sc(2)-0714",
        degrees=True,
        root="open",
        chordwise=33,
        spanwise=40,
    )


def enclosing(nacelle: ml.Nacelle) -> ml.Cage:
    """Rings of eight points around the nacelle and through no part of it: its duct is inside too.

    `examples/data/nacelle_cage.obj` is what this makes.
    """
    return ml.Cage.around_body(nacelle.geometry, stations=5, around=8, offset=0.15)


def pipeline() -> ml.Pipeline:
    """Three branches, and the union of what they give."""
    nacelle, strut, lifting = engine(), pylon(), wing()
    cage = ml.Cage.read(CAGE)
    sizes = {
        ml.variable("length", value=3.6, typical=0.1, unit="m"): _is(nacelle, "length"),
        ml.variable("radius", value=1.05, typical=0.03, unit="m"): _is(nacelle, "radius"),
        ml.variable("droop", value=2.0, typical=1.0, unit="deg"): _is(nacelle, "droop"),
    }
    sweep = ml.variable("pylon_sweep", value=50.0, typical=1.0, unit="deg")
    twist = ml.variable("twist", value=[3.0, 1.0, -2.0], typical=1.0, unit="deg")
    return ml.Pipeline(
        {},
        [
            ml.Construction(nacelle, sizes, to="nacelle"),
            ml.Stage(cage, reshaping(cage), on="nacelle"),
            ml.Construction(strut, {sweep: _is(strut, "sweep")}, to="pylon", name="pylon"),
            ml.Construction(lifting, {twist: _is(lifting, "twist")}, to="wing"),
            ml.Construction(ml.Union(symmetry="y"), to="configuration", of=PARTS),
        ],
    )


def _is(modeler: Any, name: str) -> ml.Link:
    """A variable that is what a parameter measures."""
    return ml.links.named(modeler, name, absolute=True)


def reshaping(cage: ml.Cage) -> dict[Any, ml.Link]:
    """Control points move forward at the lip, up at the keel, and outwards beside it."""

    def group(axis: Any, numbers: list[int]) -> ml.Link:
        return ml.links.group(cage, axis, index=[[n] for n in numbers])

    starboard, port = (group("y", side) for side in POUCHES)
    return {
        ml.variable("lip", typical=0.1, unit="m"): -1.0 * group("x", LIP),
        ml.variable("keel", typical=0.1, unit="m"): group("z", KEEL),
        ml.variable("pouches", typical=0.1, unit="m"): starboard + -1.0 * port,
    }


def made(case: ml.Pipeline) -> Wetting:
    """What the union made."""
    making = case.branches["configuration"].making
    assert isinstance(making, Wetting)
    return making


def reshaped(case: ml.Pipeline) -> np.ndarray:
    """How the cage moves each point of the nacelle."""
    part = case.of("nacelle")
    return np.asarray(part.points(DESIGN)) - np.asarray(part.source(DESIGN))


class Proof(NamedTuple):
    """How right the derivatives are.

    Attributes
    ----------
    order
        Of the Taylor remainder of all points while the same edges run through the same faces.
    ways
        Relative difference of forward and reverse derivative.
    gap
        Largest error of volume's and area's derivatives by any number, by the largest of them, each
        for a typical change: against central differences with a new boolean on either side.
    """

    order: float
    ways: float
    gap: float


def proved(case: ml.Pipeline) -> Proof:
    """Prove the derivatives at the design."""
    full = {name: np.asarray(value) for name, value in case.values(DESIGN).items()}
    typical = {name: variable.typical for name, variable in case.variables.items()}
    rng = np.random.default_rng(0)
    along = {n: 0.02 * typical[n] * rng.uniform(-1, 1, v.shape) for n, v in full.items()}
    recipe = made(case).recipe

    def frozen(values: Any) -> Any:
        parts = tuple(case.of(name).points(values) for name in PARTS)
        return followed(recipe, parts)[0]

    order = remainder(frozen, full, along).order
    motion = np.asarray(case.pushforward(full, along))
    weights = rng.normal(size=motion.shape)
    back = case.pullback(full, weights)
    forward = float(np.sum(weights * motion))
    reverse = sum(float(np.sum(np.asarray(back[n]) * along[n])) for n in full)
    return Proof(order, abs(forward - reverse) / abs(forward), _gap(case, full, typical))


def _gap(case: ml.Pipeline, full: dict[str, np.ndarray], typical: dict[str, float]) -> float:
    shape = case(full)
    slopes = []
    for measure in (Volume(shape.faces), Area(shape.faces)):
        by_points = jax.grad(lambda points, of=measure: of(points)[0])(jnp.asarray(shape.points))
        slopes.append(case.pullback(full, by_points))
    exact, differences = [], []
    for name, value in full.items():
        for k in range(len(value)):
            step = 2e-4 * typical[name] * np.eye(len(value))[k]
            ends = [fresh(case, {**full, name: value + way * step}) for way in (1, -1)]
            differences.append((ends[0] - ends[1]) / 4e-4)
            exact.append([float(s[name][k]) * typical[name] for s in slopes])
    misses, sizes = np.abs(np.array(exact) - differences), np.abs(exact)
    return float((misses.max(axis=0) / sizes.max(axis=0)).max())


def fresh(case: ml.Pipeline, values: dict[str, Any]) -> np.ndarray:
    """Volume and area with a new boolean, whether one is needed or not."""
    parts = [case.of(name)(values) for name in PARTS]
    report = ml.Union(symmetry="y").bind(*parts, names=PARTS).report
    return np.array([report.volume, report.area])


def made_anew(case: ml.Pipeline, step: float) -> int:
    """How often the boolean is made anew while the pylon's sweep grows step by step [deg]."""
    here, count = case, 0
    for k in range(1, TRIES + 1):
        values = {**DESIGN, "pylon_sweep": DESIGN["pylon_sweep"] + k * step}
        there = here.at(values)
        count += there is not here
        here = there
    return count


def pictures(case: ml.Pipeline) -> None:
    """Draw the parts and the result, the cage, a sensitivity, and the pipeline."""
    ml.plot.save(parts_picture(case), OUT / "nacelle_parts.png", dpi=90)
    ml.plot.save(cage_picture(case), OUT / "nacelle_cage.png", dpi=70)
    ml.plot.save(sensitivity_picture(case), OUT / "nacelle_sensitivity.png", dpi=90)
    chart = ml.plot.of_pipeline(case, DESIGN, "Nacelle, pylon and wing")
    ml.plot.save(chart, OUT / "nacelle_chart.png", dpi=80)


def parts_picture(case: ml.Pipeline) -> Figure:
    """The three parts pulled apart, and the wetted surface, one colour for each part."""
    apart = [_near(case.of(name)(DESIGN), 2.5, 9.0) for name in PARTS]
    shifts = np.array([[0, 0, -1.2], [0, 0, -0.4], [0, 0, 0.6]])
    points = np.concatenate([s.points + d for s, d in zip(apart, shifts, strict=True)])
    first = np.cumsum([0, *(len(s.points) for s in apart)])
    faces = np.concatenate([s.faces + k for s, k in zip(apart, first, strict=False)])
    owner = np.repeat(np.arange(3), [len(s.faces) for s in apart])
    whole = _near(case(DESIGN), 2.5, 9.0)
    owners = np.array([_owner(name) for name in whole.components])[np.asarray(whole.tags)]
    figure = blank(14, 6)
    left, right = figure.subplots(1, 2)
    ml.plot.draw_surface(left, points, faces, owner / 2, NEAR, colours=COLOURS, is_signed=False)
    ml.plot.draw_surface(
        right, whole.points, whole.faces, owners / 2, NEAR, colours=COLOURS, is_signed=False
    )
    left.set_title("nacelle, pylon and wing", fontsize=13)
    right.set_title("their wetted surface", fontsize=13)
    return figure


def cage_picture(case: ml.Pipeline) -> Figure:
    """The reshaped nacelle, and its cage at rest and moved."""
    part, figure = case.of("nacelle"), blank(8, 5.5)
    axes = figure.subplots()
    ml.plot.draw_surface(axes, part.points(DESIGN), part.geometry.faces, view=NEAR)
    for net in nets(part, DESIGN):
        ml.plot.draw_net(axes, net.lines, net.rest, net.moved, view=NEAR)
    return figure


def _owner(component: str) -> int:
    return next(k for k, name in enumerate(PARTS) if component.startswith(name))


def _near(surface: ml.Surface, low: float, high: float) -> ml.Surface:
    """What lies between two y; each point's number goes along."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    y = points[faces, 1]
    stays = (y.max(axis=1) < high) & (y.min(axis=1) > low)
    used, faces = np.unique(faces[stays], return_inverse=True)
    tags = np.asarray(surface.tags)[stays]
    number = {"number": used}
    return ml.Surface(points[used], faces.reshape(-1, 3), tags, surface.components, number)


def sensitivity_picture(case: ml.Pipeline) -> Figure:
    """How far points move aft for each degree of the pylon's sweep.

    Colours end at what the pylon's own points do: where an edge all but lies in the face that it
    runs through, the point on the curve slides faster.
    """
    shape = _near(case(DESIGN), 3.6, 7.4)
    motion = np.asarray(case.pushforward(DESIGN, {"pylon_sweep": 1.0}))[:, 0]
    values = motion[np.asarray(shape.point_data["number"])]
    most = np.abs(np.asarray(case.of("pylon").pushforward(DESIGN, {"pylon_sweep": 1.0}))[:, 0])
    values = np.clip(values, -most.max(), most.max())
    label = "dx / d pylon_sweep [m/deg]"
    return ml.plot.sensitivity_map(shape.points, shape.faces, values, label, view=SIDE)


if __name__ == "__main__":
    main()
