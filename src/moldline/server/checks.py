"""Whether a shape is sound, in a few words and numbers."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from ..mesh import Surface
from ..mesh.health import health
from ..pipeline import examine
from ..pipeline.holding import holding
from ..pipeline.pipeline import Pipeline


def checked(pipeline: Pipeline, values: dict[str, Any], deep: bool = False) -> dict[str, Any]:
    """Health of a pipeline's shape at some values; with `deep`, also of space and derivatives."""
    shape = pipeline(values)
    report: dict[str, Any] = {}
    sentences, is_sound = [], True
    if isinstance(shape, Surface):
        found = health(shape)
        report["mesh"] = found.as_dict()
        sentences += found.sentences()
        is_sound = found.is_sound
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
    return json_able({**report, "sentences": sentences, "is_sound": bool(is_sound)})


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
