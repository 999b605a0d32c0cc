"""Sweep a supersonic wing forward by a wing skeleton (Figure 4's idea).

The skeleton reads the wing's planform; sweep and twist are given as what they shall be. Reads the
planform of the moved wing back, and writes the wing and a picture into out/.
"""

from pathlib import Path

import numpy as np
from bodies import supersonic_wing

import moldline as ml

OUT = Path(__file__).parent.parent / "out"
STATIONS = [0.0, 3.5, 7.0]
SWEEP = [-20.0, -25.0]
TWIST = [0.0, -1.5, -3.0]
"""Washout: twist is positive nose up."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    wing = supersonic_wing()
    skeleton = ml.WingSkeleton.fitted(wing, stations=STATIONS)
    sweep = ml.variable("sweep", value=SWEEP, bounds=(-60, 60), unit="deg")
    twist = ml.variable("twist", value=TWIST, bounds=(-10, 10), unit="deg")
    links = {
        sweep: ml.links.named(skeleton, "sweep", absolute=True),
        twist: ml.links.named(skeleton, "twist", absolute=True),
    }
    case = ml.Pipeline(wing, [ml.Stage(skeleton, links)])
    swept = case()

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "forward_sweep.tri", swept)
    picture = ml.plot.of_deformation(case, view="iso", title="A supersonic wing swept forward")
    ml.plot.save(picture, OUT / "forward_sweep.png")

    found = ml.planform(swept, STATIONS)
    misses = np.abs(np.degrees(found.sweep) - SWEEP), np.abs(np.degrees(found.twist) - TWIST)
    print(f"sweep  {np.degrees(found.sweep).round(6)} deg, asked for {SWEEP}")
    print(f"twist  {np.degrees(found.twist).round(6)} deg, asked for {TWIST}")
    print(f"wrote {OUT.name}/forward_sweep.tri, {OUT.name}/forward_sweep.png")
    towards = np.asarray(swept.points) - np.asarray(wing.points)
    slope = case.pullback(None, towards)
    return {
        "motion": float(np.linalg.norm(towards)),
        "gradient": float(np.linalg.norm(np.concatenate([*slope.values()]))),
        "miss": float(max(miss.max() for miss in misses)),
    }


if __name__ == "__main__":
    main()
