"""Reshape a transport wing by twenty points on it; its box, volume and leading edge are kept.

Four pilots at each of five stations move up and down, over the middle of the box and ahead of the
trailing edge. The spars do not move: their upper and lower edges, where the skin lies on the front
and the rear spar, are fixed in space, so that the box inboard of the skins can be built as it is.
Then a tank has to fit: an optimiser keeps it in, or the hidden control volume does. Writes the wing
and pictures into out/.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

import moldline as ml
from moldline.measures import Constraint, Controls, Enclosed, Fixed, Linearity, Position, Volume
from moldline.pipeline import examine

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
STATIONS = [1.0, 7.0, 14.0, 21.0, 28.0]
PLACES = [(0.4, "upper"), (0.4, "lower"), (0.85, "upper"), (0.85, "lower")]
"""Pilots of each station: parts of the chord, and sides."""

SPARS = (0.15, 0.65)
STRAIGHT = [12.0, 16.0, 20.0, 24.0, 28.5]
"""Stations of the leading edge outboard of the break; what is straight in plan there stays so."""

DESIGN = [
    [0.05, 0.02, 0.00, 0.04],
    [0.06, 0.02, 0.08, 0.18],
    [0.05, 0.01, 0.09, 0.14],
    [0.03, 0.01, 0.06, 0.09],
    [0.01, 0.00, 0.03, 0.04],
]
"""How far each pilot moves up [m], station by station: more lift aft, a fuller upper side."""

TANK = (0.25, 0.55), (7.5, 12.5)
"""Of the chord, and along y [m]."""

ROOM = 0.01
"""Between the tank and the skin [m]."""

THINNER = 0.1
"""What is then asked of the skins at 40 % chord and y = 14: each so much towards the other [m]."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    wing = ml.read(HERE / "data/transport_wing.tri")
    pilots = parameterised(wing)
    case = ml.Pipeline(wing, [ml.Stage(pilots, {moves(): ml.links.controls(pilots)})])
    design = {"moves": np.ravel(DESIGN)}
    shape = case(design)

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "wing_pilots.tri", shape)
    title = "Twenty pilots, spars and volume kept"
    before_after = ml.plot.of_deformation(case, design, view="top", title=title)
    ml.plot.save(before_after, OUT / "wing_pilots.png")
    ml.plot.save(cuts(case, design), OUT / "wing_pilots_cuts.png")

    rng = np.random.default_rng(0)
    tried = [design["moves"], *rng.uniform(-0.1, 0.1, (3, pilots.size))]
    kept = max(worst(case, pilots, changes) for changes in tried)
    proof = examine.proof(case, design)
    depths = kept_by_optimiser(case) | kept_by_projection(wing, pilots.net)
    motion = np.asarray(shape.points) - np.asarray(wing.points)
    slope = case.pullback(design, motion)["moves"]
    spars = between(case, design)
    rows = {
        "what is asked and kept": f"off by {kept:.1e} of the size, worst of {len(tried)} designs",
        "derivatives": f"Taylor remainder of order {proof.forward.order:.3f} (2 is right), "
        f"forward - reverse {proof.mismatch:.0e}",
        "spars, between stations": f"moved by up to {1e3 * spars:.1f} mm",
        "tank, as asked": f"{1e3 * depths['asked']:+.1f} mm of room",
        "tank, by the optimiser": f"{1e3 * depths['optimised']:+.1f} mm",
        "tank, two pilots": f"{1e3 * depths['free']:+.1f} mm of room",
        "tank, projected": f"{1e3 * depths['projected']:+.1f} mm",
    }
    print("\n".join(f"{name:24} {value}" for name, value in rows.items()))
    for name in ("wing_pilots.tri", "wing_pilots.png", "wing_pilots_cuts.png"):
        print(f"wrote {OUT.name}/{name}")
    return {
        "motion": float(np.linalg.norm(motion)),
        "gradient": float(np.linalg.norm(slope)),
        "order": proof.forward.order,
        "kept": kept,
        "mismatch": proof.mismatch,
        "spars": spars,
        **depths,
    }


def parameterised(wing: ml.Surface) -> ml.Pilots:
    """Pilots, what is kept, and behind them a lattice of 12 x 5 x 4 that follows the planform."""
    hidden = ml.ControlVolume.along_wing(wing, (12, 5, 4), margin=(0.05, 0.03, 0.1))
    return ml.Pilots(wing, moved(wing), kept_as_it_is(wing, hidden), hidden)


def moved(wing: ml.Surface) -> dict[str, Position]:
    """The pilots, by side, part of the chord and station: upper_40_7."""
    return {
        f"{side}_{100 * fraction:.0f}_{y:g}": Position(place(wing, fraction, side, y), "z")
        for y in STATIONS
        for fraction, side in PLACES
    }


def kept_as_it_is(wing: ml.Surface, hidden: ml.ControlVolume) -> dict[str, Any]:
    """What no pilot may change. The root stays in the plane of symmetry, to the bit."""
    row = hidden.numbers([[i, 0, k] for i in range(12) for k in range(4)])
    return {
        "root": Controls(3 * row + 1),  # along y, of those control points that reach the plane
        "spars": Fixed(wing.points, spots=spar_edges(wing)),
        "leading edge": Linearity.build(wing, at=STRAIGHT),
        "volume": Volume(wing.faces),
    }


def place(wing: ml.Surface, fraction: float, side: Any, y: float) -> ml.Spot:
    """A place on the wing."""
    return ml.Spot.at_chord(wing, fraction, side, y)


def spar_edges(wing: ml.Surface, stations: Any = STATIONS) -> list[ml.Spot]:
    """Where the skins lie on the spars, lower and upper side in turn."""
    return [place(wing, x, s, y) for y in stations for x in SPARS for s in ("lower", "upper")]


def moves() -> ml.Variable:
    """How far each pilot moves up."""
    return ml.variable("moves", len(STATIONS) * len(PLACES), bounds=(-0.3, 0.3), unit="m")


def worst(case: ml.Pipeline, pilots: ml.Pilots, changes: Any) -> float:
    """How far the shape is from what is asked and kept, of the wing's size and volume."""
    report = pilots.report(changes)
    if report.status != "met" or report.unmet or report.dependent:
        raise RuntimeError(f"a design is not met: {report}")
    rest, points = (np.asarray(p) for p in (case.geometry.points, case.points({"moves": changes})))

    def change(measure: Any) -> np.ndarray:
        return np.asarray(measure(points)) - np.asarray(measure(rest))

    volume = pilots.constraints["volume"]
    lengths = [
        np.concatenate([change(pilot) for pilot in pilots.pilots.values()]) - changes,
        change(pilots.constraints["spars"]),
        change(pilots.constraints["leading edge"]),
        points[rest[:, 1] == 0.0, 1],
    ]
    far = max(float(np.abs(length).max()) for length in lengths) / np.ptp(rest, axis=0).max()
    return float(max(far, abs(change(volume) / volume(rest))[0]))


def between(case: ml.Pipeline, values: Any) -> float:
    """The largest motion of the spars' edges halfway between the stations [m]."""
    rest, points = case.geometry.points, case.points(values)
    halfway = 0.5 * (np.array(STATIONS[1:]) + STATIONS[:-1])
    edges = spar_edges(case.geometry, halfway.tolist())
    return float(max(np.linalg.norm(edge.of(points) - edge.of(rest)) for edge in edges))


def cuts(case: ml.Pipeline, values: Any) -> Any:
    """Sections at three of the stations, with the spars."""
    stations, points = STATIONS[1:4], case.points(values)
    figure = ml.plot.of_cuts(case, values, stations)
    for axes, y in zip(figure.axes, stations, strict=True):
        spars = np.array([s.of(points) for s in spar_edges(case.geometry, [y])]).reshape(-1, 2, 3)
        for spar in spars:
            axes.plot(spar[:, 0], spar[:, 2], "o-", color="#1f5fa8", ms=5, lw=1.8)
        pilots = np.array([place(case.geometry, x, s, y).of(points) for x, s in PLACES])
        axes.plot(pilots[:, 0], pilots[:, 2], "o", color="#d62728", ms=5)
    return figure


def tank(wing: ml.Surface, samples: int = 4) -> Enclosed:
    """A tank of three quarters of the wing's height, swept as the wing is, by its eight corners.

    The skin is measured where it may come near, which is faster. The sides are sampled, so some
    room is asked for, and the result is looked at with more samples.
    """
    corners = []
    for fraction in TANK[0]:
        for y in TANK[1]:
            lower, upper = (place(wing, fraction, s, y).of(wing.points) for s in ("lower", "upper"))
            middle, half = (lower + upper) / 2, 0.75 * (upper - lower) / 2
            corners += [middle - half, middle + half]
    along = np.asarray(wing.points)[np.asarray(wing.faces), 1]
    is_near = (along.max(axis=1) > TANK[1][0] - 0.5) & (along.min(axis=1) < TANK[1][1] + 0.5)
    return Enclosed.box(np.asarray(wing.faces)[is_near], np.array(corners), samples)


def kept_by_optimiser(case: ml.Pipeline) -> dict[str, float]:
    """Of all designs in which the tank fits, the one nearest to what is asked: a thinner wing."""
    within = Constraint(tank(case.geometry), lower=ROOM)
    measured = ml.Measurements(case, {"tank": within})
    asked = np.zeros((len(STATIONS), len(PLACES)))
    asked[2, :2] = -THINNER, THINNER
    asked = asked.ravel()
    found = minimize(
        lambda x: 100 * np.sum((x - asked) ** 2),
        asked,
        jac=lambda x: 200 * (x - asked),
        method="SLSQP",
        constraints=measured.bounded(),
        options={"ftol": 1e-6},
    )
    return {
        "asked": room(case.geometry, case.points(measured.split(asked))),
        "optimised": room(case.geometry, case.points(measured.split(found.x))),
    }


def room(wing: ml.Surface, points: Any) -> float:
    """The least depth of the tank's sides below the skin, closely sampled [m]."""
    return float(np.min(tank(wing, samples=13)(points)))


def kept_by_projection(wing: ml.Surface, hidden: ml.ControlVolume) -> dict[str, float]:
    """Two pilots make the wing thinner outboard of the tank; the skin at the tank gives way."""
    pilots = {
        side: Position(place(wing, 0.4, side, STATIONS[2]), "z") for side in ("upper", "lower")
    }
    kept = kept_as_it_is(wing, hidden)
    kept = {name: kept[name] for name in ("root", "spars")}
    fits = {"tank": Constraint(tank(wing), lower=ROOM)}
    depths = {}
    for name, constraints in (("free", kept), ("projected", kept | fits)):
        held = ml.Pilots(wing, pilots, constraints, hidden)
        points = held.bind(wing.points)(np.array([-THINNER, THINNER]))
        depths[name] = room(wing, points)
    return depths


if __name__ == "__main__":
    main()
