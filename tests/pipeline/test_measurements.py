"""Measurements of a pipeline: numbers, bounds, derivatives, and what SciPy makes of them."""

import numpy as np
import pytest
from scipy.optimize import minimize

import moldline as ml
from moldline.errors import ParameterError


@pytest.fixture(scope="module")
def measured(ball):
    """Two variables of a lattice; volume, the place of a vertex, and a length with bounds."""
    box = ml.Lattice.around(ball, (3, 3, 3), margin=0.1)
    wide = ml.variable("wide", unit="cm", bounds=(-50, 50))
    high = ml.variable("high", size=3, bounds=(-0.5, 0.5))
    links = {
        wide: ml.links.each(box, "y", index=[[1, 2, 1]]),
        high: ml.links.thickness(box, along="x", axis="z"),
    }
    case = ml.Pipeline(ball, [ml.Stage(box, links)])
    spot = ml.Spot.vertex
    return ml.Measurements(
        case,
        {
            "volume": ml.measures.Volume(ball.faces),
            "top": ml.measures.Position(spot(2)),
            "span": ml.Constraint(ml.measures.Distance(spot(1), spot(4)), 1.9, 2.1),
        },
    )


VALUES = {"wide": 20.0, "high": [0.1, -0.2, 0.3]}


def test_numbers_are_those_of_the_deformed_shape(measured):
    shape = measured.pipeline(VALUES)
    found = measured(VALUES)
    assert list(found) == ["volume", "top", "span"]
    assert found["top"] == pytest.approx(np.asarray(shape.points)[2])
    assert found["volume"] == pytest.approx(
        np.asarray(ml.measures.Volume(shape.faces)(shape.points))
    )


def test_derivatives_are_exact_and_in_the_variables_units(measured):
    slopes = measured.jacobian(VALUES)
    assert slopes["top"]["high"].shape == (3, 3) and slopes["span"]["wide"].shape == (1, 1)
    along = {"wide": np.array([3.0]), "high": np.array([0.1, 0.05, -0.1])}
    for name in measured.constraints:
        pushed = sum(slopes[name][key] @ along[key] for key in along)
        step = 1e-3
        ahead, behind = (
            measured({k: np.asarray(VALUES[k]) + s * step * along[k] for k in along})[name]
            for s in (1, -1)
        )
        assert pushed == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=1e-12)


def test_what_is_beyond_its_bounds_is_told_by_how_much(measured):
    assert measured.beyond(measured()) == {}
    assert measured.beyond({**measured(), "span": np.array([2.3])})["span"] == pytest.approx([0.2])
    assert measured.beyond({**measured(), "span": np.array([1.7])})["span"] == pytest.approx([0.2])
    unknown = {name: np.full_like(own, np.nan) for name, own in measured().items()}
    assert list(measured.beyond(unknown)) == ["span"]


def test_an_optimiser_keeps_to_the_bounds(measured):
    """The widest shape of a given volume: it ends at the bound of its span."""
    (span,) = measured.bounded(["wide"])

    def narrow(x):
        return -float(measured(measured.split(x, ["wide"]))["span"][0])

    found = minimize(narrow, [0.0], constraints=[span], method="SLSQP", options={"ftol": 1e-12})
    assert found.success and -found.fun == pytest.approx(2.1, abs=1e-6)
    slope = measured.jacobian({"wide": 5.0})["span"]["wide"]
    assert span.jac(np.array([5.0])) == pytest.approx(slope)


def test_vectors_of_another_length_are_refused(measured):
    with pytest.raises(ParameterError, match="wide, high have 4 numbers, got 3"):
        measured.split(np.zeros(3))
    with pytest.raises(ParameterError, match="one bound or as many"):
        ml.Constraint(measured.constraints["top"].measure, [0.0, 1.0])
