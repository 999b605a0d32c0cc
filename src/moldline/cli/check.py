"""`moldline check`."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import in_steps, show, values

if TYPE_CHECKING:
    from ..mesh import Geometry, Surface
    from ..mesh.health import Health
    from ..mesh.parts import Part
    from ..pipeline.examine import Proof
    from ..pipeline.holding import Holding
    from ..pipeline.pipeline import Pipeline

MOST_PARTS = 10
"""Components or pieces that are told one by one."""

HELP = "Check a case: health of its mesh, folds and tears of its deformation, its derivatives."
EXAMPLE = """\
  moldline check examples/transport_wing.toml
  moldline check wing.stl                            (a geometry file: its health alone)
  moldline check wing.stl --picture faults.png       (a picture of its faults)
  moldline check wing.stl --fix mended.stl           (mend what can be mended without guessing)"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument("--json", action="store_true", help="report for a script")
    command.add_argument("--picture", type=Path, metavar="FILE", help="draw the surface's faults")
    command.add_argument("--view", default="iso", help="of the picture, as for `moldline plot`")
    command.add_argument(
        "--fix", type=Path, metavar="OUT", help="write the surface, mended, to another file"
    )
    command.add_argument(
        "--weld",
        type=float,
        metavar="LENGTH",
        help="with --fix, also join points within this distance, in the file's unit",
    )


def run(given: argparse.Namespace) -> int:
    """Do it; 0 only if all is sound, with `--fix` after the mending."""
    from ..case import load
    from ..errors import ParameterError
    from ..mesh.io import read
    from ..pipeline import examine

    if given.weld is not None and given.fix is None:
        raise ParameterError("--weld belongs to --fix OUT, which says where to write")
    if given.case.suffix.lower() != ".toml":
        geometry = read(given.case)
        report, lines, is_sound = _fixed(geometry, given) if given.fix else _mesh(geometry, given)
        show({**report, "is_sound": is_sound}, given.json, lines)
        return 0 if is_sound else 1
    if given.fix is not None:
        raise ParameterError("--fix mends a geometry file, not a case; give the geometry's file")
    case = load(given.case)
    chosen = values.chosen(case, given)
    rest, plane = examine.at_rest(case.pipeline, chosen)
    mesh, mesh_lines, is_mesh_sound = _mesh(rest, given)
    if plane is not None:
        mesh_lines.insert(1, f"  half a model: closed at {plane} = 0 for what follows")
    moved, moved_lines, is_moved_sound = _deformation(case.pipeline, chosen)
    is_sound = is_mesh_sound and is_moved_sound
    show(
        {**mesh, **moved, "is_sound": is_sound},
        given.json,
        [*mesh_lines, *moved_lines, "sound" if is_sound else "NOT sound: see above"],
    )
    return 0 if is_sound else 1


Told = tuple[dict[str, Any], list[str], bool]
"""A report for a script, one for a person, and whether all is sound."""


def _mesh(geometry: "Geometry", given: argparse.Namespace) -> Told:
    from ..errors import ParameterError
    from ..mesh import Surface, VolumeMesh
    from ..mesh.health import health
    from ..mesh.quality import inverted_cells

    kind = type(geometry).__name__
    title = f"mesh         {kind.lower()} of {len(geometry.points)} points"
    if isinstance(geometry, Surface):
        found = health(geometry)
        drawn = _picture(geometry, found, given)
        return {"mesh": found.as_dict()}, [title, *_facts(found), *drawn], found.is_sound
    if given.picture is not None:
        raise ParameterError(f"--picture draws the faults of a surface, this is a {kind}")
    if isinstance(geometry, VolumeMesh):
        bad = inverted_cells(geometry)
        line = f"  {len(bad)} inverted cells" + (f", the first is {bad[0]}" if len(bad) else "")
        return {"mesh": {"inverted_cells": bad.tolist()}}, [title, line], not len(bad)
    return {"mesh": {"points": len(geometry.points)}}, [title], True


def _fixed(geometry: "Geometry", given: argparse.Namespace) -> Told:
    """Mend, write, and tell the health of what was written."""
    from ..errors import ParameterError
    from ..mesh import Surface
    from ..mesh.io import write
    from ..mesh.mend import mended

    if given.fix.exists() and given.fix.samefile(given.case):
        raise ParameterError(f"--fix {given.fix}: is the file that is checked; give another name")
    if not isinstance(geometry, Surface):
        raise ParameterError(f"--fix mends a surface, this is a {type(geometry).__name__}")
    result, mending = mended(geometry, given.weld or 0.0)
    write(given.fix, result)
    report, lines, is_sound = _mesh(result, given)
    done = mending.sentences() or ["nothing to mend"]
    told = [f"mended       {given.fix}", *(f"  {line}" for line in done)]
    left = [f"  left: {line}" for line in mending.left()]
    mending_report = {"file": str(given.fix), **mending.as_dict()}
    return {"mending": mending_report, **report}, [*told, *left, *lines], is_sound


def _picture(surface: "Surface", found: "Health", given: argparse.Namespace) -> list[str]:
    if given.picture is None:
        return []
    from ..plot import of_faults, save

    title = given.case.stem.replace("_", " ")
    save(of_faults(surface, found, given.view, title), given.picture)
    return [f"  picture: {given.picture}"]


def _facts(found: "Health") -> list[str]:
    """What a surface is made of, then what is wrong with it."""
    return [
        f"  {found.faces} faces, {found.pieces} pieces, components: {', '.join(found.components)}",
        f"  {'closed' if found.is_closed else 'open'}, "
        f"{'manifold' if found.is_manifold else 'not manifold'}, "
        f"{'consistently oriented' if found.is_oriented else 'not consistently oriented'}",
        f"  area {found.area:.6g}, volume {_volume(found.volume)}, smallest angle "
        f"{math.degrees(found.smallest_angle):.3g} degrees",
        *_parts("component", found.by_component),
        *_parts("piece", found.by_piece),
        *(f"  ! {sentence}" for sentence in found.sentences()),
        *(f"  note: {sentence}" for sentence in found.remarks()),
    ]


def _parts(kind: str, parts: "tuple[Part, ...]") -> list[str]:
    """One line for each part where there are several; of many the largest."""
    largest = sorted(parts, key=lambda part: -part.area)[:MOST_PARTS]
    lines = [
        f"    {kind} {part.name}: {part.faces} faces, {'closed' if part.is_closed else 'open'}, "
        f"area {part.area:.6g}, volume {_volume(part.volume)}"
        for part in largest
    ]
    rest = len(parts) - len(largest)
    more = [f"    and {rest} smaller {kind}s" if rest > 1 else f"    and 1 smaller {kind}"]
    return [] if len(parts) < 2 else lines + more * (rest > 0)


def _volume(volume: float | None) -> str:
    return "unknown" if volume is None else f"{volume:.6g}"


def _deformation(pipeline: "Pipeline", chosen: dict[str, Any]) -> Told:
    """What a case does to space, to its mesh and to derivatives."""
    from dataclasses import asdict

    from ..pipeline import examine
    from ..pipeline.holding import holding

    embedded, held, fold, torn, turned, inverted, proof = in_steps(
        embedding=lambda: examine.embedded(pipeline),
        pilots=lambda: holding(pipeline, chosen),
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
        *_held(held),
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
        "pilots": [one.as_dict() for one in held],
        "folding": {**asdict(fold), "folds": fold.folds},
        "turned_faces": [int(face) for face in turned[:10]],
        "inverted_cells": [int(cell) for cell in inverted[:10]],
        "tears": [asdict(tear) for tear in torn],
        "derivatives": _proof(proof),
    }
    is_whole = not (fold.folds or torn or len(turned) or len(inverted))
    is_sound = is_whole and proof.is_right and all(one.is_met for one in held)
    return report, lines, is_sound


def _held(held: "list[Holding]") -> list[str]:
    lines = []
    for first, *more in (one.sentences() for one in held):
        lines += [f"pilots       {first}", *(f"  {line}" for line in more)]
    return lines


def _proof(proof: "Proof") -> dict[str, Any]:
    return {
        "method": proof.method,
        "order": None if proof.forward.is_linear else proof.forward.order,
        "is_linear": proof.forward.is_linear,
        "remainders": list(proof.forward.sizes),
        "steps": list(proof.forward.steps),
        "mismatch": proof.mismatch,
        "is_right": proof.is_right,
    }
