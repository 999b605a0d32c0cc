"""Where variables are perturbed, and how accurate their differences are."""

import math

import pytest

from moldline.errors import ParameterError
from moldline.xddm.document import Document
from moldline.xddm.model import Design
from moldline.xddm.steps import stencil


def variable(attributes):
    return Design(Document(f'<M><Variable ID="x" {attributes}/></M>'.encode())).find("x")


@pytest.mark.parametrize(
    ("attributes", "changes"),
    [
        ('Value="1" FDstep="0.25"', (0.25, -0.25)),
        ('Value="1" TypicalSize="10"', (1e-3, -1e-3)),
        ('Value="30"', (3e-3, -3e-3)),
        ('Value="1" FDstep="0.25" Comment="oFD"', (0.25,)),
        ('Value="1" Max="1.1" FDstep="0.25" Comment="oFD"', (-0.25,)),
        ('Value="1" Min="0.9" Max="1.1" FDstep="0.25" Comment="oFD"', (0.1,)),
        ('Value="1" Max="1" FDstep="0.25"', (-0.25, -0.5)),
        ('Value="1" Min="1" FDstep="0.25"', (0.25, 0.5)),
        ('Value="1" Min="0.875" Max="1.25" FDstep="0.25"', (0.125, 0.25)),
    ],
)
def test_steps_stay_within_bounds(attributes, changes):
    assert stencil(variable(attributes)).changes == pytest.approx(changes, rel=1e-9)


@pytest.mark.parametrize(("bounds", "order"), [("", 2), ('Max="1"', 2), ('Comment="oFD"', 1)])
def test_differences_have_their_order(bounds, order):
    errors = []
    for step in (0.02, 0.01):
        found = stencil(variable(f'Value="1" FDstep="{step}" {bounds}'))
        pairs = zip(found.weights, found.changes, strict=True)
        slope = sum(w * (math.exp(1 + change) - math.e) for w, change in pairs)
        errors.append(abs(slope - math.e))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.05)


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ('Value="1" Min="1" Max="1"', "M__Variable__x = 1 has no room between Min and Max"),
        ('Value="1" Min="2"', "has no room"),
        ('Value="1e9" FDstep="1e-9"', "a step of 1e-09 changes nothing of 1e"),
        ('Value="-888888"', "M__Variable__x has no Value"),
    ],
)
def test_where_there_is_no_step_that_is_told(attributes, message):
    with pytest.raises(ParameterError, match=message):
        stencil(variable(attributes))
