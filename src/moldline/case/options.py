"""Options of deformers and links, checked against the signatures of what they are passed to."""

import inspect
import reprlib
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from ..deformers.base import AbstractDeformer
from ..measures.base import AbstractMeasure
from ..modelers.base import AbstractModeler
from ..parameters.links import chosen_controls

Numbers = float | list[Any]
Pair = tuple[float, float]


DEFORMS, MAKES = "<deforms>", "<makes>"
"""What the two kinds of stages are called among the places of errors, and nowhere else."""


class DeformerTable(BaseModel):
    """A deformer within another one's options; further keys are its own."""

    model_config = ConfigDict(extra="allow")
    deformer: str


class MeasureTable(BaseModel):
    """A measure, with bounds where it is a constraint; further keys are its own."""

    model_config = ConfigDict(extra="allow")
    measure: str
    bounds: Pair | list[Pair] | None = Field(None, description="lower and upper, SI; or inf")
    weight: float = Field(1.0, gt=0, description="in least squares of what contradicts itself")


_SHORT = reprlib.Repr()
_SHORT.maxstring = 120


class _Closed(BaseModel):
    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)


def model_of(name: str, parameters: Mapping[str, inspect.Parameter]) -> type[BaseModel]:
    """A model with one field per parameter."""
    fields: dict[str, Any] = {
        key: (_plain(p.annotation), ... if p.default is p.empty else p.default)
        for key, p in parameters.items()
    }
    return create_model(name, __base__=_Closed, **fields)


Kind = type[AbstractDeformer | AbstractMeasure | AbstractModeler]


def of_class(name: str, cls: Kind) -> type[BaseModel]:
    """What a case file may say to build a deformer, a measure or a modeler."""
    return model_of(name, cls.options())


def paths(cls: Kind) -> dict[str, Any]:
    """Options that are paths, and what they are where a case file does not say."""
    kinds = (Path, Path | None, list[Path] | None)
    found = {k: o for k, o in cls.options().items() if o.annotation in kinds}
    return {k: o.default for k, o in found.items()}


def classes_of_link(function: Callable[..., Any]) -> tuple[type, ...]:
    """What a link is for: some deformers, and modelers perhaps."""
    first, *_ = inspect.signature(function, eval_str=True).parameters.values()
    return typing.get_args(first.annotation) or (first.annotation,)


def of_link(name: str, function: Callable[..., Any]) -> type[BaseModel]:
    """What a case file may say to make a link, for what it turns given already."""
    parameters = dict(inspect.signature(function).parameters)
    parameters.pop(next(iter(parameters)))
    if any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        where = dict(inspect.signature(chosen_controls).parameters)
        where.pop("net")
        parameters = {k: p for k, p in parameters.items() if p.kind is not p.VAR_KEYWORD} | where
    return model_of(name, parameters)


def _plain(annotation: Any) -> Any:
    """The type of a TOML value for an annotation: arrays are lists of numbers."""
    if annotation is inspect.Parameter.empty:
        return Any
    if _holds(annotation, AbstractMeasure):
        return dict[str, MeasureTable] | None
    if _holds(annotation, AbstractDeformer):
        return DeformerTable | list[DeformerTable] | None
    if _is_array(annotation):
        return Numbers
    return annotation


def _holds(annotation: Any, base: type) -> bool:
    if parts := typing.get_args(annotation):
        return any(_holds(part, base) for part in parts)
    return isinstance(annotation, type) and issubclass(annotation, base)


def _is_array(annotation: Any) -> bool:
    parts = typing.get_args(annotation) or (annotation,)
    return any(
        hasattr(part, "dim_str") or getattr(part, "__module__", "").startswith(("jax", "numpy"))
        for part in parts
    )


def problems(error: ValidationError, where: str, given: Any) -> list[str]:
    """One sentence for each key that a model found wrong: what was expected, and what it holds."""
    expected: dict[tuple[str | int, ...], list[str]] = {}
    held: dict[tuple[str | int, ...], str] = {}
    for problem in error.errors():
        key, value = _found(given, problem["loc"])
        if problem["type"] == "missing" and isinstance(problem["loc"][-1], str):
            key, said = _own(problem["loc"]), "it must be there"
        elif problem["type"] == "missing":
            said = "too few entries"
        elif problem["type"] == "extra_forbidden":
            said = "there is no such key"
        else:
            said = problem["msg"].lower()
        expected.setdefault(key, []).append(said)
        is_absent = problem["type"] == "missing" and key == _own(problem["loc"])
        held[key] = "" if is_absent else _SHORT.repr(value)
    return [
        ".".join(map(str, filter(lambda part: part != "", (where, *key))))
        + f": {' or '.join(dict.fromkeys(said))}"
        + (f", got {held[key]}" if held[key] else "")
        for key, said in expected.items()
    ]


def _own(place: tuple[str | int, ...]) -> tuple[str | int, ...]:
    return tuple(part for part in place if part not in (DEFORMS, MAKES))


def _found(given: Any, place: tuple[str | int, ...]) -> tuple[tuple[str | int, ...], Any]:
    """The part of a place that the given tables really have (models add names of types)."""
    key: list[str | int] = []
    for part in _own(place):
        try:
            given = given[part]
        except (KeyError, IndexError, TypeError):
            break
        key.append(part)
    return tuple(key), given
