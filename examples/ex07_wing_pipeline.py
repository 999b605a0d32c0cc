"""A wing from a modeler, swept at its tip and bent as under load, in one pipeline (example E).

The modeler has no parabolic sweep and no bent shape: a lattice over the tip and another along the
span add them behind it. All 129 numbers, the modeler's and the lattices', are then found together
from a shape alone. Writes the wing and pictures into out/.
"""

from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import cumulative_simpson
from scipy.optimize import least_squares

import moldline as ml
from moldline.plot.figure import blank
from moldline.plot.pictures import nets

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
SPAN = [1.9, 7.1, 10.4, 13.7, 17.0]
"""Of each station from the root [m]; the trailing edge breaks at the second, at 42 %."""

CHORD = [7.0, 6.1, 3.8, 3.1, 2.4, 1.7]
TIP = (11.0, 18.0)
"""Where parabolic sweep begins, and where the boxes end, beyond the tip and its cap [m]."""

ROWS = 9
"""Control points along the span that bend the wing."""

POWER = 3.0
"""Of the chord, by which bending stiffness falls: skins of one gauge on a box as high as wide."""

DESIGN = {"tip_sweep": [2.4, 1.5], "tip_deflection": 1.6}
"""Motion of the leading and the trailing edge at the end of the tip's box, and of the tip [m]."""

VIEW = ml.plot.View(azimuth_deg=-120.0, elevation_deg=28.0)

OFF = {
    "span": 0.1, "chord": 0.1, "sweep": 2.0, "dihedral": 1.0, "twist": 1.0, "thickness": 0.005,
    "camber": 0.1, "origin": 0.1, "sections": 0.01, "tip_sweep": 1.0, "tip_deflection": 0.5,
}  # fmt: skip
"""How far the hidden target's numbers are off at most, in the variables' units."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    case = pipeline()
    final = case(DESIGN)
    found = matched(case)
    stated = ml.load(HERE / "wing_pipeline.toml").pipeline
    size = float(np.ptp(np.asarray(final.points), axis=0).max())
    gap = np.abs(np.asarray(stated.points(DESIGN)) - np.asarray(final.points)).max()
    curve = fitted_curve()

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "wing_pipeline.tri", final)
    ml.plot.save(steps_picture(case), OUT / "wing_pipeline_steps.png", dpi=100)
    ml.plot.save(final_picture(case), OUT / "wing_pipeline.png", dpi=110)
    chart = ml.plot.of_pipeline(case, DESIGN, "A modeler and two lattices")
    ml.plot.save(chart, OUT / "wing_pipeline_chart.png", dpi=90)
    ml.plot.save(history_picture(found), OUT / "wing_pipeline_match.png", dpi=90)
    print("\n".join(told(found, curve, gap / size)))
    motion = np.asarray(final.points) - np.asarray(case.source(DESIGN))
    return {
        "motion": float(np.linalg.norm(motion)),
        "numbers": float(len(found.x)),
        "rank": float(found.rank),
        "uniform": float(beam(np.ones_like, 0.0)[1][-1]),
        "curve": curve.miss,
        "orders": float(np.log10(found.history[0] / found.history[-1])),
        "off": found.off,
        "case": float(gap / size),
    }


def pipeline() -> ml.Pipeline:
    """The modeler with all its parameters, and the two lattices behind it."""
    wing = modeled()
    sections = [name for name in wing.parameters if name.startswith("section")]
    shape = [name for name in wing.parameters if name not in sections]
    units = dict.fromkeys(("sweep", "dihedral", "twist"), "deg")
    links = {}
    for name in shape:
        unit = units.get(name, "m" if name in ("span", "chord", "origin") else "")
        own = np.asarray(wing.values)[wing.parameters[name]]
        value = np.degrees(own).round(9) if unit == "deg" else own
        variable = ml.variable(name, value=value.tolist(), unit=unit, typical=OFF[name])
        links[variable] = ml.links.named(wing, name, absolute=True)
    count = sum(len(wing.parameters[name]) for name in sections)
    coefficients = ml.variable("sections", count, typical=OFF["sections"])
    links[coefficients] = ml.links.named(wing, sections)
    tip, bend = tip_box(), span_box()
    sweep = ml.variable("tip_sweep", 2, unit="m", typical=OFF["tip_sweep"])
    deflection = ml.variable("tip_deflection", unit="m", typical=OFF["tip_deflection"])
    rows = ml.links.camber(bend, along="y", axis="z") @ fitted_curve().rows[:, None]
    return ml.Pipeline(
        {},
        [
            ml.Construction(wing, links, to="wing", name="modeler"),
            ml.Stage(tip, {sweep: ml.links.each(tip, "x")}, on="wing", name="tip"),
            ml.Stage(bend, {deflection: rows}, on="wing", name="bend"),
        ],
    )


def modeled() -> ml.Wing:
    """Six stations of sections with fourteen coefficients each, near RAE 2822."""
    section = ml.Kulfan.build(HERE, fit="rae 2822", order=6)
    return ml.Wing(
        SPAN,
        CHORD,
        sweep=[27.0] * 5,
        dihedral=[5.0] * 5,
        twist=[3.0, 2.5, 1.0, 0.0, -1.0, -2.0],
        thickness=[0.15, 0.14, 0.12, 0.12, 0.11, 0.11],
        camber=[1.0] * 6,
        airfoil=section,
        section_parameters=True,
        degrees=True,
        chordwise=25,
        spanwise=32,
    )


def tip_box() -> ml.Lattice:
    """Two control points along the chord, three along the span, one height.

    Of degree 2 along the span, with two of the three rows at rest, motion grows as the square of
    the distance from the box's begin: there it fades smoothly.
    """
    low, high = [4.5, TIP[0], 0.9], [12.5, TIP[1], 1.9]
    return ml.Lattice.box(low, high, (2, 3, 1), degree=2, freeze=["y-"], outside="extend")


def span_box() -> ml.Lattice:
    """Control points in one line: all that has the same y moves alike."""
    low, high = [-1.0, 0.0, -0.5], [0.0, TIP[1], 0.5]
    return ml.Lattice.box(low, high, (1, ROWS, 1), outside="extend")


class Curve(NamedTuple):
    """A beam's deflection by the lattice.

    Attributes
    ----------
    rows
        Motion of each row of control points for a tip deflection of 1.
    miss
        Largest distance of the lattice's curve from the beam's, by the tip's deflection.
    """

    rows: np.ndarray
    miss: float


def beam(chord: Any, power: float, places: int = 4001) -> tuple[np.ndarray, np.ndarray]:
    """Deflection of a cantilever under an elliptic load, at fractions of its length.

    E I w'' = M, with w = w' = 0 at the root and E I proportional to a power of the chord. Under
    the load q0 sqrt(1 - s^2) the moment is, by q0 L^2,

    M(s) = (1 - s^2)^(3/2) / 3 - s (acos(s) - s sqrt(1 - s^2)) / 2.

    Integrated twice by Simpson's rule; the result is w E I0 / (q0 L^4).

    Source: Euler and Bernoulli's beam, as in Megson, Aircraft Structures for Engineering Students,
    and the elliptic distribution of lift as in Anderson, Fundamentals of Aerodynamics.
    """
    s = np.sin(np.linspace(0, np.pi / 2, places))  # fine at the tip, where the root has no slope
    left = np.sqrt(1 - s**2)
    moment = left**3 / 3 - s / 2 * (np.arccos(s) - s * left)
    bent = moment / chord(s) ** power
    slope = cumulative_simpson(bent, x=s, initial=0.0)
    return s, cumulative_simpson(slope, x=s, initial=0.0)


def fitted_curve() -> Curve:
    """Rows of the lattice that come nearest to the beam's curve; straight on beyond the tip."""
    stations = np.array([0.0, *SPAN])
    share = stations / SPAN[-1]
    s, bent = beam(lambda s: np.interp(s, share, np.array(CHORD) / CHORD[0]), POWER)
    bent = bent / bent[-1]
    slope = (bent[-1] - bent[-2]) / (s[-1] - s[-2])
    y = np.linspace(0, TIP[1], 721)
    wanted = np.where(
        y < SPAN[-1], np.interp(y / SPAN[-1], s, bent), 1 + slope * (y / SPAN[-1] - 1)
    )
    box = span_box()
    link = ml.links.camber(box, along="y", axis="z")
    places = np.stack([0 * y, y, 0 * y], axis=1)
    columns = [box.bind(places)(link(row))[:, 2] for row in np.eye(ROWS)[2:]]
    matrix = np.stack(columns, axis=1)  # the first two rows stay: no motion and slope at the root
    rows, *_ = np.linalg.lstsq(matrix, wanted, rcond=None)
    miss = np.abs(matrix @ rows - wanted)[y <= SPAN[-1]].max()
    return Curve(np.concatenate([np.zeros(2), rows.round(12)]), float(miss))


class Match(NamedTuple):
    """What the optimiser found.

    Attributes
    ----------
    x
        All numbers.
    history
        The objective, sum over all points of |v - v*|^2 [m^2], at each step.
    rank
        Of the Jacobian: how many directions of the numbers the shape shows.
    off
        The largest distance of a point from its target, by the root's chord.
    """

    x: np.ndarray
    history: list[float]
    rank: int
    off: float


def matched(case: ml.Pipeline) -> Match:
    """Find a hidden shape by all numbers, by Levenberg and Marquardt with the exact Jacobian.

    Twelve directions do not show in the shape, as a section's thickness and camber are factors on
    its coefficients: so the numbers found need not be those hidden, but the shape is.
    """
    ends = np.cumsum([variable.size for variable in case.variables.values()])[:-1]
    start = np.concatenate([variable.value for variable in case.variables.values()])
    spread = np.concatenate([[OFF[n]] * v.size for n, v in case.variables.items()])
    hidden = start + spread * np.random.default_rng(0).uniform(-1, 1, len(start))

    def points(x: Any) -> Any:
        return case.points(dict(zip(case.variables, jnp.split(x, ends), strict=True))).ravel()

    target = np.asarray(points(hidden))
    value, slopes = jax.jit(points), jax.jit(jax.jacfwd(points))
    history: list[float] = []

    def jacobian(x: np.ndarray) -> np.ndarray:
        history.append(float(np.sum((value(x) - target) ** 2)))
        return np.asarray(slopes(x))

    found = least_squares(
        lambda x: np.asarray(value(x)) - target,
        start,
        jacobian,
        method="lm",
        x_scale=spread,
        ftol=1e-15,
        gtol=1e-15,
        xtol=1e-15,
    )
    miss = np.linalg.norm(np.asarray(value(found.x) - target).reshape(-1, 3), axis=1)
    history.append(float(np.sum(miss**2)))
    rank = np.linalg.matrix_rank(np.asarray(slopes(start)) * spread)
    return Match(found.x, history, int(rank), float(miss.max() / CHORD[0]))


def told(found: Match, curve: Curve, gap: float) -> list[str]:
    """What was found, as lines."""
    rows = {
        "bent shape": f"off by {curve.miss:.1e} of the tip's deflection, with {ROWS - 2} rows",
        "numbers": f"{len(found.x)}, of which the shape shows {found.rank}",
        "objective": " ".join(f"{value:.1e}" for value in found.history) + " m2",
        "shape": f"off by {found.off:.1e} of the root's chord at most",
        "case file": f"the same points to {gap:.1e} of the span",
    }
    kinds = "_steps.png", ".png", "_chart.png", "_match.png", ".tri"
    files = [f"wing_pipeline{kind}" for kind in kinds]
    return [
        *(f"{name:12} {value}" for name, value in rows.items()),
        f"wrote {', '.join(f'{OUT.name}/{file}' for file in files)}",
    ]


def steps_picture(case: ml.Pipeline) -> Figure:
    """The pipeline step by step: undeformed, behind the tip's lattice, behind the bend."""
    shapes = [np.asarray(case.source(DESIGN))]
    for step in case.steps(DESIGN):
        shapes.append(np.asarray(step.after(shapes[0], shapes[-1])))
    drawn = nets(case, DESIGN)
    reach = np.concatenate([*shapes, *(places for net in drawn for places in net[1:3])])
    titles = ["modeler", "tip: parabolic sweep", "bend: tapered beam, elliptic load"]
    figure = blank(13, 7)
    panels = figure.subplots(2, 3, height_ratios=[3.5, 1])
    for number, (shape, title) in enumerate(zip(shapes, titles, strict=True)):
        for axes, view in zip(panels[:, number], ("top", "rear"), strict=True):
            ml.plot.draw_surface(axes, shape, case.geometry.faces, view=view)
            for net in drawn[max(number - 1, 0) : number]:
                ml.plot.draw_net(axes, net.lines, net.rest, net.moved, view=view)
            axes.update_datalim(ml.plot.View.of(view).project(reach)[:, :2])
            axes.autoscale_view()
        panels[0, number].set_title(title, fontsize=13)
    return figure


def final_picture(case: ml.Pipeline) -> Figure:
    """The wing with both deformations and their control points, over the modeler's."""
    figure = blank(11, 6)
    axes = figure.subplots()
    ml.plot.draw_surface(axes, case.points(DESIGN), case.geometry.faces, view=VIEW)
    for net in nets(case, DESIGN):
        ml.plot.draw_net(axes, net.lines, net.rest, net.moved, view=VIEW)
    axes.set_title("A modeler's wing with parabolic sweep and its bent shape", fontsize=14)
    return figure


def history_picture(found: Match) -> Figure:
    """The objective, step by step."""
    figure = blank(7, 4)
    axes = figure.subplots()
    axes.semilogy(found.history, "o-", color="#1f5fa8")
    axes.set(xlabel="step", ylabel="sum of |v - v*|² [m²]")
    axes.set_title(f"{len(found.x)} numbers of modeler and lattices together")
    axes.grid(alpha=0.3)
    return figure


if __name__ == "__main__":
    main()
