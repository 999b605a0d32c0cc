"""Where a variable is perturbed for differences, and what they weigh."""

from collections.abc import Callable
from typing import NamedTuple

from ..errors import ParameterError
from .model import Value

CENTRAL, ONE_SIDED = 1e-4, 1e-6
"""Steps where no FDstep is given, by TypicalSize: errors fall with the square of a central one."""


class Stencil(NamedTuple):
    """Changes of a variable, in its unit, and the weights of what they change."""

    changes: tuple[float, ...]
    weights: tuple[float, ...]


def stencil(variable: Value) -> Stencil:
    """Differences within a variable's bounds.

    Central ones; at a bound two steps to the side where there is room, which are as accurate; one
    step to one side where the Comment oFD asks for that. FDstep is the step, in the variable's
    unit. Without it the step is a part of TypicalSize, or of the value if that is larger than 1.
    """
    if variable.value is None:
        raise ParameterError(f"{variable.name} has no Value, so there is nothing to differentiate")
    value = variable.value
    is_single = variable.differencing == "oFD"
    part = ONE_SIDED if is_single else CENTRAL
    step = variable.step or part * (variable.typical or max(abs(value), 1.0))
    above = float("inf") if variable.upper is None else variable.upper - value
    below = float("inf") if variable.lower is None else value - variable.lower
    if not (above >= 0 and below >= 0 and max(above, below) > 0):
        raise ParameterError(
            f"{variable.name} = {value:g} has no room between Min and Max for a difference; make "
            "it a Constant, or move its bounds"
        )
    side = 1.0 if above >= min(step, below) else -1.0
    room = above if side > 0 else below
    if is_single:
        return _checked(variable, [side * min(step, room)], lambda h: (1 / h,))
    if min(above, below) >= step:
        return _checked(variable, [step, -step], lambda h, k: (1 / (h - k), -1 / (h - k)))
    side = 1.0 if above >= below else -1.0
    step = min(step, max(above, below) / 2)
    return _checked(
        variable,
        [side * step, side * 2 * step],
        lambda h, k: (k / (h * (k - h)), -h / (k * (k - h))),
    )


def _checked(
    variable: Value, changes: list[float], weights: Callable[..., tuple[float, ...]]
) -> Stencil:
    """The changes that rounding leaves of the asked ones."""
    value = float(variable.value or 0.0)
    real = tuple(value + change - value for change in changes)
    if 0.0 in real or len(set(real)) < len(real):
        raise ParameterError(
            f"{variable.name}: a step of {abs(changes[0]):g} changes nothing of {value:g}; give a "
            "larger FDstep"
        )
    return Stencil(real, weights(*real))
