"""`moldline check`."""

import argparse
from typing import TYPE_CHECKING, Any

from . import in_steps, show, values

if TYPE_CHECKING:
    from ..mesh import Geometry
    from ..pipeline.pipeline import Pipeline

HELP = "Check a case: health of its mesh, folds and tears of its deformation, its derivatives."
EXAMPLE = """\
  moldline check examples/transport_wing.toml
  moldline check wing.stl                      (a geometry file: its health alone)"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it; 0 only if all is sound."""
    from ..case import load
    from ..mesh.io import read

    if given.case.suffix.lower() != ".toml":
        report, lines, is_sound = _mesh(read(given.case))
        show({"mesh": report, "is_sound": is_sound}, given.json, lines)
        return 0 if is_sound else 1
    case = load(given.case)
    chosen = values.chosen(case, given)
    mesh, mesh_lines, is_mesh_sound = _mesh(case.pipeline.geometry)
    moved, moved_lines, is_moved_sound = _deformation(case.pipeline, chosen)
    is_sound = is_mesh_sound and is_moved_sound
    show(
        {"mesh": mesh, **moved, "is_sound": is_sound},
        given.json,
        [*mesh_lines, *moved_lines, "sound" if is_sound else "NOT sound: see above"],
    )
    return 0 if is_sound else 1


def _mesh(geometry: "Geometry") -> tuple[dict[str, Any], list[str], bool]:
    from ..mesh import Surface, VolumeMesh
    from ..mesh.health import health
    from ..mesh.quality import inverted_cells

    title = f"mesh         {type(geometry).__name__.lower()} of {len(geometry.points)} points"
    if isinstance(geometry, VolumeMesh):
        bad = inverted_cells(geometry)
        line = f"  {len(bad)} inverted cells" + (f", the first is {bad[0]}" if len(bad) else "")
        return {"inverted_cells": bad.tolist()}, [title, line], not len(bad)
    if not isinstance(geometry, Surface):
        return {"points": len(geometry.points)}, [title], True
    found = health(geometry)
    facts = [
        f"  {found.faces} faces, {found.pieces} pieces, components: {', '.join(found.components)}",
        f"  {'closed' if found.is_closed else 'open'}, "
        f"{'manifold' if found.is_manifold else 'not manifold'}, "
        f"{'consistently oriented' if found.is_oriented else 'not consistently oriented'}",
        f"  area {found.area:.6g}, volume "
        + ("unknown" if found.volume is None else f"{found.volume:.6g}"),
    ]
    complaints = [f"  ! {sentence}" for sentence in found.sentences()]
    return found.as_dict(), [title, *facts, *complaints], found.is_sound


def _deformation(
    pipeline: "Pipeline", chosen: dict[str, Any]
) -> tuple[dict[str, Any], list[str], bool]:
    from dataclasses import asdict

    from ..pipeline import examine

    embedded, fold, torn, turned, inverted, proof = in_steps(
        embedding=lambda: examine.embedded(pipeline),
        folds=lambda: examine.folding(pipeline, chosen),
        tears=lambda: examine.tears(pipeline, chosen),
        turned_faces=lambda: examine.turned_faces(pipeline, chosen),
        inverted_cells=lambda: examine.inverted_cells(pipeline, chosen),
        derivatives=lambda: examine.proof(pipeline, chosen),
    )
    x, y, z = fold.place
    order = "linear, remainder at rounding" if proof.forward.is_linear else (
        f"order {proof.forward.order:.3f} of the Taylor remainder (2 is right)"
    )  # fmt: skip
    lines = [
        *(f"embedding    {one}" for one in embedded),
        f"deformation  smallest Jacobian determinant {fold.smallest:.4g} at "
        f"({x:.4g}, {y:.4g}, {z:.4g}), {fold.at_points:.4g} on the mesh; "
        f"{fold.samples} places looked at",
        f"  {'! space folds over' if fold.folds else 'space does not fold over there'}",
        f"  {'! ' if len(turned) else ''}{len(turned)} faces turned by more than 90 degrees"
        f"{f', ! {len(inverted)} cells turned inside out' if len(inverted) else ''}",
        *(f"  ! {tear}" for tear in torn),
        f"derivatives  {proof.method}: {order}; forward and reverse differ by {proof.mismatch:.1e}",
    ]
    report = {
        "embedding": [{**vars(one), "outside": one.outside.tolist()} for one in embedded],
        "folding": {**asdict(fold), "folds": fold.folds},
        "turned_faces": [int(face) for face in turned[:10]],
        "inverted_cells": [int(cell) for cell in inverted[:10]],
        "tears": [asdict(tear) for tear in torn],
        "derivatives": {
            "method": proof.method,
            "order": None if proof.forward.is_linear else proof.forward.order,
            "is_linear": proof.forward.is_linear,
            "remainders": list(proof.forward.sizes),
            "steps": list(proof.forward.steps),
            "mismatch": proof.mismatch,
            "is_right": proof.is_right,
        },
    }
    is_sound = not (fold.folds or torn or len(turned) or len(inverted)) and proof.is_right
    return report, lines, is_sound
