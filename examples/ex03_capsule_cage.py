"""Reshape the nose of a re-entry capsule by a cage (Figure 3's idea).

A cage is made around the capsule, denser at its nose; the vertices there move along the axis.
Writes the capsule, its reflection lines and its sensitivity to one vertex into out/.
"""

from pathlib import Path

import numpy as np
from bodies import capsule

import moldline as ml

OUT = Path(__file__).parent.parent / "out"
NOSE = 0.3
"""Vertices ahead of this x are the nose's [m]."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    body = capsule(around=180, along=40)
    cage = ml.Cage.around(body, faces=160, offset=0.06, denser=[((0.0, 0.0, 0.0), 2.2, 1.6)])
    nose = np.flatnonzero(cage.rest[:, 0] < NOSE)
    off_axis = np.linalg.norm(cage.rest[nose, 1:], axis=1)
    blunter = 0.5 * np.minimum((off_axis / off_axis.max()) ** 2, 1.0) - 0.55
    variable = ml.variable("nose", value=blunter.tolist(), bounds=(-1, 1), unit="m")
    link = ml.links.each(cage, "x", index=nose[:, None].tolist())
    case = ml.Pipeline(body, [ml.Stage(cage, {variable: link})])
    pointed = case()

    OUT.mkdir(exist_ok=True)
    ml.write(OUT / "capsule.tri", pointed)
    upper = int(np.argmin(np.linalg.norm(cage.rest[nose] - np.array([0.0, 0.7, 0.5]), axis=1)))
    pictures = {
        "capsule.png": ml.plot.of_deformation(case, title="A capsule's nose, moved by a cage"),
        "capsule_sensitivity.png": ml.plot.of_sensitivity(
            case, None, f"nose[{upper}]", title="Sensitivity to one vertex of the cage"
        ),
        "capsule_reflections.png": ml.plot.of_reflections(
            pointed, title="Lamps reflected in the moved nose"
        ),
    }
    for name, figure in pictures.items():
        ml.plot.save(figure, OUT / name)

    slope = np.asarray(case.sensitivity(None, "nose"))[..., upper]
    size = np.linalg.norm(slope, axis=1)
    top = np.asarray(body.points)[size.argmax()]
    far = np.linalg.norm(np.asarray(body.points) - top, axis=1) > 1.5
    print(f"cage of {len(cage.rest)} vertices, {len(nose)} of them at the nose")
    print(f"sensitivity to one vertex  {size.max():.3f} next to it, {size[far].max():.4f} afar")
    print("wrote " + ", ".join(f"{OUT.name}/{name}" for name in ("capsule.tri", *pictures)))
    motion = np.asarray(pointed.points) - np.asarray(body.points)
    return {
        "length": float(np.ptp(np.asarray(pointed.points)[:, 0])),
        "motion": float(np.linalg.norm(motion)),
        "decay": float(size[far].max() / size.max()),
    }


if __name__ == "__main__":
    main()
