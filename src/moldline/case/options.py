"""Options of deformers and links, checked against the signatures of what they are passed to."""

import inspect
import typing
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from ..deformers.base import AbstractDeformer
from ..parameters.links import chosen_controls

Numbers = float | list[Any]


class _Closed(BaseModel):
    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)


def model_of(name: str, parameters: Mapping[str, inspect.Parameter]) -> type[BaseModel]:
    """A model with one field per parameter."""
    fields: dict[str, Any] = {
        key: (_plain(p.annotation), ... if p.default is p.empty else p.default)
        for key, p in parameters.items()
    }
    return create_model(name, __base__=_Closed, **fields)


def of_deformer(name: str, cls: type[AbstractDeformer]) -> type[BaseModel]:
    """What a case file may say to build a deformer."""
    return model_of(name, cls.options())


def of_link(name: str, function: Callable[..., Any]) -> type[BaseModel]:
    """What a case file may say to make a link, for a deformer given already."""
    parameters = dict(inspect.signature(function).parameters)
    parameters.pop(next(iter(parameters)))
    if any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        where = dict(inspect.signature(chosen_controls).parameters)
        where.pop("lattice")
        parameters = {k: p for k, p in parameters.items() if p.kind is not p.VAR_KEYWORD} | where
    return model_of(name, parameters)


def _plain(annotation: Any) -> Any:
    """The type of a TOML value for an annotation: arrays are lists of numbers."""
    if annotation is inspect.Parameter.empty:
        return Any
    if _is_array(annotation):
        return Numbers
    return annotation


def _is_array(annotation: Any) -> bool:
    parts = typing.get_args(annotation) or (annotation,)
    return any(
        hasattr(part, "dim_str") or getattr(part, "__module__", "").startswith(("jax", "numpy"))
        for part in parts
    )


def problems(error: ValidationError, where: str) -> list[str]:
    """One sentence for each thing that a model found wrong, naming key, value and expectation."""
    found = []
    for problem in error.errors():
        key = ".".join(map(str, (where, *problem["loc"]) if where else problem["loc"]))
        value = problem.get("input")
        said = "" if problem["type"] in ("missing", "extra_forbidden") else f", got {value!r}"
        found.append(f"{key}: {problem['msg'].lower()}{said}")
    return found
