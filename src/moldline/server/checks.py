"""Whether a shape is sound, in a few words and numbers."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..mesh import Surface
from ..mesh.health import health
from ..pipeline import examine
from ..pipeline.holding import holding
from ..pipeline.pipeline import Pipeline

FACES = ("self_intersections", "folded_faces", "duplicate_faces", "back_to_back_faces",
         "degenerate_faces")  # fmt: skip
"""Faults of a surface that are told by the faces that have them."""


def checked(
    pipeline: Pipeline, values: dict[str, Any], deep: bool = False
) -> tuple[dict[str, Any], Int[np.ndarray, "b"]]:
    """Health of a pipeline's shape at some values, and numbers of the faces that are not sound.

    With `deep`, also health of space and derivatives.
    """
    shape = pipeline(values)
    report: dict[str, Any] = {}
    sentences, is_sound = [], True
    bad: list[np.ndarray] = []
    if isinstance(shape, Surface):
        found = health(shape)
        report["mesh"] = found.as_dict()
        sentences += found.sentences()
        is_sound = found.is_sound
        bad += [getattr(found, name) for name in FACES]
    turned, inverted = (f(pipeline, values) for f in (examine.turned_faces, examine.inverted_cells))
    torn, held = examine.tears(pipeline, values), holding(pipeline, values)
    report |= {"turned_faces": len(turned), "inverted_cells": len(inverted)}
    report |= {"tears": [asdict(one) for one in torn], "pilots": [one.as_dict() for one in held]}
    sentences += [f"{len(turned)} faces turned by more than 90 degrees"] * (len(turned) > 0)
    sentences += [f"{len(inverted)} cells turned inside out"] * (len(inverted) > 0)
    sentences += [str(one) for one in torn]
    sentences += [line for one in held if not one.is_met for line in one.sentences()]
    is_sound = is_sound and not (len(turned) or len(inverted) or torn)
    is_sound = is_sound and all(one.is_met for one in held)
    if deep:
        folding, proof = examine.folding(pipeline, values), examine.proof(pipeline, values)
        report |= {"folds": bool(folding.folds), "folding": asdict(folding)}
        report["derivatives"] = {"method": proof.method, "is_right": bool(proof.is_right)}
        sentences += ["space folds over"] * bool(folding.folds)
        is_sound = is_sound and bool(proof.is_right) and not folding.folds
    numbers = np.concatenate([np.zeros(0), turned, *map(np.ravel, bad)]).astype(np.int64)
    told = json_able({**report, "sentences": sentences, "is_sound": bool(is_sound)})
    return told, np.unique(numbers)


def point_normals(surface: Surface) -> Float[np.ndarray, "n 3"]:
    """Outward unit normals at the points, faces counted by their areas; zero at lone points."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    a, b, c = (points[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    found = np.stack(
        [
            np.bincount(faces.ravel(), np.repeat(across[:, axis], 3), len(points))
            for axis in range(3)
        ],
        axis=1,
    )
    lengths = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(lengths > 0, lengths, 1.0)


def json_able(found: Any) -> Any:
    """Plain numbers, lists and objects; what is not finite is None."""
    if isinstance(found, dict):
        return {str(name): json_able(one) for name, one in found.items()}
    if isinstance(found, list | tuple):
        return [json_able(one) for one in found]
    if isinstance(found, bool | np.bool_):
        return bool(found)
    if isinstance(found, int | np.integer):
        return int(found)
    if isinstance(found, float | np.floating):
        return float(found) if math.isfinite(found) else None
    if hasattr(found, "tolist"):
        return json_able(np.asarray(found).tolist())
    return found
