"""Reshape an airfoil by points on it, with its spars' heights kept (Figure 12's parameterisation).

Twelve pilots on the two sides move up and down; upper and lower points at 30 % and 70 % of the
chord are linked, so that each pair shifts as a whole; both edges stay. A lattice of 12 x 5 obeys,
which nobody has to look at. Writes the airfoil and pictures into out/.
"""

from pathlib import Path
from typing import Any

import numpy as np
from bodies import naca_0012
from matplotlib.axes import Axes

import moldline as ml
from moldline.plot.figure import blank
from moldline.plot.pictures import nets

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
CHORD = [0.02, 0.08, 0.17, 0.45, 0.57, 0.85]
"""Where pilots are on each side, as parts of the chord."""

LINKED = {"front": 0.3, "rear": 0.7}
"""Where the upper and the lower point are linked."""

DESIGN = {
    "upper": [-0.004, -0.008, -0.008, 0.004, 0.008, 0.012],
    "lower": [-0.002, 0.002, 0.006, -0.004, 0.004, 0.018],
    "front": [0.01, -0.006],
    "rear": [-0.01, 0.012],
}
"""Parts of the chord: the front pair lower, the rear one higher, some loading aft."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    airfoil = naca_0012()
    pilots = parameterised(airfoil)
    case = ml.Pipeline(airfoil, [ml.Stage(pilots, links(pilots))])
    shape = case(DESIGN)

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "airfoil_pilots.dat", shape)
    ml.plot.save(picture(case), OUT / "airfoil_pilots.png")

    tried = [case.values(DESIGN), *random_designs(case, 20)]
    numbers = {name: max(worst(case, pilots, x)[name] for x in tried) for name in ("kept", "steps")}
    numbers["case"] = difference(case, ml.load(HERE / "airfoil_pilots.toml"), tried)
    slope = case.pullback(DESIGN, np.asarray(shape.points) - np.asarray(airfoil.points))
    print(f"{pilots.size} variables, {pilots.net.size // 3} control points behind them")
    print(f"steps of the solver for one design   {numbers['steps']:.0f} at most")
    print(f"thickness, edges and pilots are off  {numbers['kept']:.1e} of the chord at most")
    print(f"the case file's points are off       {numbers['case']:.1e}")
    print(f"wrote {OUT.name}/airfoil_pilots.dat, {OUT.name}/airfoil_pilots.png")
    motion = np.asarray(shape.points) - np.asarray(airfoil.points)
    return {
        "motion": float(np.linalg.norm(motion)),
        "gradient": float(np.linalg.norm(np.concatenate([*slope.values()]))),
        **numbers,
    }


def parameterised(airfoil: ml.Section) -> ml.Pilots:
    """The pilots, what is kept, and the lattice behind them."""

    def place(fraction: float, side: Any) -> ml.Spot:
        return ml.Spot.at_chord(airfoil, fraction, side)

    measures = ml.measures
    moved = {
        f"{side}_{number}": measures.Position(place(fraction, side), "y")
        for side in ("upper", "lower")
        for number, fraction in enumerate(CHORD)
    } | {name: measures.Position(place(x, "upper"), "xy") for name, x in LINKED.items()}
    kept = {
        f"{name} thickness": measures.Separation(place(x, "lower"), place(x, "upper"), "xy")
        for name, x in LINKED.items()
    } | {
        "leading edge": measures.Position(place(0.0, "upper"), "xy"),
        "trailing edge": measures.Position(place(1.0, "upper"), "xy"),
    }
    lattice = ml.Lattice.around(airfoil, (12, 5, 1), margin=0.05)
    return ml.Pilots(airfoil, moved, kept, lattice)


def links(pilots: ml.Pilots) -> dict[ml.Variable, ml.Link]:
    """A variable for each side, and one for each pair; parts of the chord."""
    count = len(CHORD)
    sides = {"upper": range(count), "lower": range(count, 2 * count)}
    return {
        ml.variable(name, count, bounds=(-0.02, 0.02)): ml.links.controls(pilots, numbers)
        for name, numbers in sides.items()
    } | {
        ml.variable(name, 2, bounds=(-0.03, 0.03)): ml.links.named(pilots, name) for name in LINKED
    }


def random_designs(case: ml.Pipeline, count: int) -> list[dict[str, Any]]:
    """Anywhere within the bounds."""
    rng = np.random.default_rng(0)
    return [
        {name: rng.uniform(v.lower, v.upper) for name, v in case.variables.items()}
        for _ in range(count)
    ]


def worst(case: ml.Pipeline, pilots: ml.Pilots, values: dict[str, Any]) -> dict[str, float]:
    """How far the shape is from what was asked, and what it took; read from the points."""
    changes = case.own_stages[0].controls(case.values(values))
    points = case.points(values)
    wanted = [*np.asarray(changes), *np.zeros(8)]
    found = np.concatenate([np.asarray(measure(points)) for measure in pilots.measures])
    return {
        "kept": float(np.abs(found - pilots.measured - wanted).max()),
        "steps": pilots.report(changes).iterations,
    }


def difference(one: ml.Pipeline, other: Any, designs: list[dict[str, Any]]) -> float:
    """The largest distance between what the two make of the same values."""
    gaps = [np.asarray(one.points(x)) - np.asarray(other.pipeline.points(x)) for x in designs]
    return float(np.abs(gaps).max())


def picture(case: ml.Pipeline) -> Any:
    """Above the airfoil with its pilots, below a design."""
    figure = blank(11.0, 5.6)
    above, below = figure.subplots(2, 1)
    rest = case.geometry.points
    for axes, values, title in ((above, None, "Parameterisation"), (below, DESIGN, "A design")):
        moved = case.points(values)
        if values is None:
            ml.plot.draw_section(axes, rest, nets=nets(case))
        else:
            ml.plot.draw_section(axes, rest, moved, nets(case, values))
        linked(axes, case, moved)
        axes.set_title(title, loc="left")
    below.legend(loc="upper right", frameon=False, ncols=2)
    return figure


def linked(axes: Axes, case: ml.Pipeline, points: Any) -> None:
    """Draw the linked pairs."""
    for fraction in LINKED.values():
        spots = [ml.Spot.at_chord(case.geometry, fraction, s) for s in ("lower", "upper")]
        pair = np.array([spot.of(points) for spot in spots])
        axes.plot(pair[:, 0], pair[:, 1], "o-", color="#1f5fa8", ms=6, lw=1.8, zorder=4)


if __name__ == "__main__":
    main()
