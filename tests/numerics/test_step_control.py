"""Noise is measured, steps suit it, and the error that is told is right."""

import numpy as np
import pytest

from moldline.numerics.noise import noise_level
from moldline.numerics.step_control import Line, StepControl


def curve(t):
    return np.concatenate([np.sin(3 * t + np.arange(50)), np.exp(t) * np.arange(1, 6)])


def slope(t):
    return np.concatenate([3 * np.cos(3 * t + np.arange(50)), np.exp(t) * np.arange(1, 6)])


def evaluated(function, at=0.2, counted=None):
    def evaluate(probes):
        if counted is not None:
            counted.extend(probes)
        return [function(at + probe.offset) for probe in probes]

    return evaluate


def noisy(level):
    generator = np.random.default_rng(1)
    return lambda t: curve(t) + level * generator.standard_normal(55)


@pytest.mark.parametrize("level", [1e-10, 1e-6, 1e-3])
def test_the_level_of_noise_is_found_within_half_of_it(level):
    function = noisy(level)
    values = np.stack([function(0.2 + 1e-5 * k) for k in range(7)])
    assert noise_level(values) == pytest.approx(level, rel=0.5)


def test_what_is_exact_has_the_noise_of_rounding():
    values = np.stack([curve(0.2 + 1e-5 * k) for k in range(7)])
    assert 1e-16 < noise_level(values) < 5e-15
    assert noise_level(np.ones((7, 3))) == np.finfo(float).eps


@pytest.mark.parametrize(
    ("function", "promised"),
    [(curve, 1e-8), (noisy(1e-10), 1e-5), (noisy(1e-6), 3e-3),
     (lambda t: np.round(curve(t), 6), 3e-3), (lambda t: curve(t).astype(np.float32), 1e-3)],
    ids=["exact", "noise 1e-10", "noise 1e-6", "six decimals", "single precision"],
)  # fmt: skip
def test_the_derivative_is_as_right_as_is_told(function, promised):
    control = StepControl()
    (found,) = control.slopes(evaluated(function), function(0.2), [Line("t", None, 0.1)])
    worst = np.abs(found.column - slope(0.2)).max()
    assert worst <= 2 * found.error
    assert found.error <= promised
    assert found.error <= 200 * worst


def test_noise_is_no_less_than_whoever_rounds_says():
    still = np.float32(1 / 3) * np.ones(55)  # nothing moves along the first line, so none is seen
    lines = [Line("still", None, 0.1), Line("t", None, 0.1)]

    def evaluate(probes):
        return [
            still + (curve(0.2 + offset) - curve(0.2)).astype(np.float32) * (line.name == "t")
            for line, offset in probes
        ]

    control = StepControl(least=1e-7)
    _, found = control.slopes(evaluate, still, lines)
    assert control.noise == 1e-7
    assert np.abs(found.column - slope(0.2)).max() <= 2 * found.error <= 2e-3


def test_later_derivatives_take_two_evaluations():
    control, counted = StepControl(), []
    line = Line("t", None, 0.1)
    control.slopes(evaluated(curve, counted=counted), curve(0.2), [line])
    assert len(counted) == 6 + 4 + 2
    counted.clear()
    (found,) = control.slopes(evaluated(curve, 0.5, counted), curve(0.5), [line])
    assert len(counted) == 2
    np.testing.assert_allclose(found.column, slope(0.5), atol=1e-8)


@pytest.mark.parametrize(("below", "above"), [(0.0, 1.0), (1.0, 0.0), (0.01, 0.02)])
def test_differences_stay_within_their_room(below, above):
    counted = []
    line = Line("t", None, 0.1, below, above)
    (found,) = StepControl().slopes(evaluated(curve, counted=counted), curve(0.2), [line])
    assert all(-below <= probe.offset <= above for probe in counted)
    assert np.abs(found.column - slope(0.2)).max() <= 2 * found.error <= 1e-7


def test_a_fixed_step_is_taken_as_it_is():
    counted = []
    control = StepControl(is_fixed=True)
    (found,) = control.slopes(
        evaluated(curve, counted=counted), curve(0.2), [Line("t", None, 1e-5)]
    )
    assert [probe.offset for probe in counted] == [-1e-5, 1e-5]
    np.testing.assert_allclose(found.column, slope(0.2), atol=1e-8)


def test_what_is_linear_keeps_the_trial_step():
    linear = evaluated(lambda t: np.arange(3.0) * t)
    (found,) = StepControl().slopes(linear, np.arange(3.0) * 0.2, [Line("t", None, 0.1)])
    assert found.step == 0.1
    np.testing.assert_allclose(found.column, np.arange(3.0), atol=1e-14)
