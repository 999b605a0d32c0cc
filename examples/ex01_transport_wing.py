"""Deform a transport wing by two overlaid lattices and differentiate every vertex.

Figure 5's idea on a wing: a coarse lattice for large-scale change, a local one for detail at the
leading edge. Writes the deformed surface, its sensitivities and pictures into out/.
"""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import moldline as ml
from moldline.pipeline import examine

HERE = Path(__file__).parent
OUT = HERE.parent / "out"


def main() -> dict[str, float]:
    """Run the case file's job; returns the numbers that the test pins."""
    case = ml.load(HERE / "transport_wing.toml")
    wing, values = case.pipeline, case.values()
    OUT.mkdir(exist_ok=True)

    shape = wing(values)
    ml.write(OUT / "transport_wing.tri", shape)
    columns = {
        label: column
        for name in wing.variables
        for label, column in wing.labelled_sensitivity(values, name).items()
    }
    ml.write_sensitivities(OUT / "transport_wing.vtp", shape, columns)

    towards = np.asarray(shape.points) - np.asarray(wing.geometry.points)
    gradient = wing.pullback(values, towards)
    proof = examine.proof(wing, values)
    order = proof.forward.order
    rows = {
        "vertices": f"{len(shape.points):,}",
        "lattice controls": ", ".join(
            f"{stage.deformer.size // 3} ({stage.name})" for stage in wing.stages
        ),
        "design variables": f"{sum(v.size for v in wing.variables.values())}",
        "one deformation": f"{1e3 * seconds(lambda: wing(values)):.2f} ms",
        "one gradient": f"{1e3 * seconds(lambda: wing.pullback(values, towards)):.2f} ms",
        "largest motion": f"{np.linalg.norm(towards, axis=1).max():.3f} m",
        "derivative check": f"Taylor remainder of order {order:.3f} (2 is right), "
        f"forward - reverse {proof.mismatch:.0e}",
    }
    print("\n".join(f"{name:18} {value}" for name, value in rows.items()))

    pictures = {
        "before_and_after.png": ml.plot.of_deformation(wing, values, title="Two overlaid lattices"),
        "sensitivity.png": ml.plot.of_sensitivity(
            wing, values, "droop[1]", title="Sensitivity to one leading-edge control row"
        ),
        "sections.png": ml.plot.of_cuts(wing, values, [5.0, 15.0, 20.0, 25.0]),
    }
    for name, figure in pictures.items():
        ml.plot.save(figure, OUT / name)
    for path in ("transport_wing.tri", "transport_wing.vtp", *pictures):
        print(f"wrote {OUT.name}/{path}")
    return {
        "motion": float(np.linalg.norm(towards)),
        "gradient": float(np.linalg.norm(np.concatenate([*gradient.values()]))),
        "order": order,
    }


def seconds(call: Callable[[], object], repeats: int = 11) -> float:
    """Median time of a call, after one that is not counted."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


if __name__ == "__main__":
    main()
