"""Hinges: control surfaces that turn, with a sharp or a smooth gap."""

import math

import jax
import numpy as np
import pytest

from moldline.deformers.contract import check, prove
from moldline.deformers.hinge import Hinge
from moldline.errors import ParameterError

START, END = (0.7, 1.0, 0.0), (0.9, 3.0, 0.1)


@pytest.fixture(scope="module")
def cloud():
    """About the hinge, some in the blends, none near where a sharp one jumps."""
    return np.random.default_rng(0).uniform([-0.5, 0.2, -0.3], [2, 3.8, 0.3], (80, 3))


def clear(hinge, points, gap=0.12):
    along, behind, _ = ((points - hinge.start) @ hinge.inverse).T
    away = np.minimum(np.abs(along), np.abs(along - hinge.length))
    return points[np.minimum(away, np.abs(behind)) > gap]


def test_a_smooth_hinge_keeps_the_contract(cloud):
    check(Hinge(START, END, blend_width=0.4), cloud)


def test_a_sharp_hinge_keeps_the_contract(cloud):
    hinge = Hinge(START, END, gap="sharp")
    check(hinge, clear(hinge, cloud))


@pytest.mark.parametrize("angle", [0.0, math.pi / 2])
def test_derivatives_are_exact_at_rest_and_at_right_angles(angle, cloud):
    hinge = Hinge(START, END, blend_width=0.4, end_width=0.3)
    prove(lambda c: hinge(cloud, c), np.array([angle]), np.array([0.1]))
    prove(lambda p: hinge(p, np.array([angle])), cloud, 0.02 * np.sin(37 * cloud[:, ::-1]))


@pytest.mark.parametrize("gap", [{"gap": "sharp"}, {"blend_width": 0.2, "end_width": 0.1}])
def test_behind_the_line_all_turns_as_one_and_the_rest_stays(gap, cloud):
    hinge = Hinge(START, END, **gap)
    share = np.asarray(hinge.share(cloud))
    moved = np.asarray(hinge.bind(cloud)(np.array([math.pi / 2])))
    whole, none = share == 1, share == 0
    assert whole.sum() > 10 < none.sum()
    assert np.array_equal(moved[none], cloud[none])
    assert np.all(cloud[whole, 0] > 0.7)
    pairs = np.linalg.norm(moved[whole][:, None] - moved[whole], axis=2)
    known = np.linalg.norm(cloud[whole][:, None] - cloud[whole], axis=2)
    np.testing.assert_allclose(pairs, known, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("start", "end"), [(START, END), (END, START)])
def test_a_positive_angle_lowers_the_trailing_edge_whichever_end_comes_first(start, end):
    hinge = Hinge((0.7, start[1], 0), (0.7, end[1], 0), gap="sharp")
    moved = np.asarray(hinge(np.array([[1.0, 2.0, 0.0]]), np.array([math.pi / 6])))
    known = [[0.7 + 0.3 * math.cos(math.pi / 6), 2.0, -0.15]]
    np.testing.assert_allclose(moved, known, rtol=0, atol=1e-15)


def test_a_rudder_turns_from_up():
    hinge = Hinge((0.7, 0, 0), (0.7, 0, 2), up=(0, 1, 0), gap="sharp")
    moved = np.asarray(hinge(np.array([[1.0, 0.0, 1.0]]), np.array([0.1])))
    assert moved[0, 1] == pytest.approx(-0.3 * math.sin(0.1))


def test_the_hinge_line_itself_stays(cloud):
    hinge = Hinge(START, END, blend_width=0.4)
    line = np.linspace(START, END, 9)
    np.testing.assert_allclose(hinge(line, np.array([1.0])), line, rtol=0, atol=2e-16)


def test_the_ends_run_streamwise_also_on_a_swept_line():
    hinge = Hinge((0, 0, 0), (1, 1, 0), gap="sharp")
    inside = np.array([[x, y, 0.0] for x, y in [(3, 0.01), (3, 0.99), (1.01, 0.99)]])
    outside = np.array([[x, y, 0.0] for x, y in [(3, -0.01), (3, 1.01), (0.97, 0.99)]])
    assert np.all(np.asarray(hinge.share(inside)) == 1)
    assert np.all(np.asarray(hinge.share(outside)) == 0)


def test_a_smooth_gap_has_no_kink_where_the_blend_begins_and_ends():
    """The slope of the share is continuous along the chord and along the span."""
    hinge = Hinge((0.5, 0, 0), (0.5, 2, 0), blend_width=0.2, end_width=0.3)
    slope = jax.vmap(jax.grad(lambda p: hinge.share(p[None])[0]))
    for line in (
        np.linspace([0.3, 1, 0], [0.8, 1, 0], 5001), np.linspace([0.9, -1, 0], [0.9, 3, 0], 5001)
    ):  # fmt: skip
        slopes = np.asarray(slope(line))
        assert np.abs(slopes).max() > 5
        assert np.abs(np.diff(slopes, axis=0)).max() < 0.1


def test_a_narrow_blend_folds_where_the_docstring_says():
    """Below the line by h, when 15/8 h times the angle exceeds the width."""
    h, width = 0.05, 0.1
    hinge = Hinge((0, 0, 0), (0, 2, 0), blend_width=width, end_width=0.0)
    line = np.linspace([-0.1, 1, -h], [0.1, 1, -h], 2001)
    limit = width / (15 / 8 * h)
    for angle, is_folded in ((0.98 * limit, False), (1.1 * limit, True)):
        growth = np.asarray(
            jax.vmap(jax.jacfwd(lambda p, a=angle: hinge(p[None], np.array([a]))[0]))(line)
        )
        assert (np.linalg.det(growth).min() < 0) == is_folded


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"end": START}, "start and end are both"),
        ({"start": (0, 0)}, r"start must be three finite numbers, got \(0, 0\)"),
        ({"aft": (0.2, 2.0, 0.1)}, "aft must not run along the hinge line"),
        ({"aft": (0, 0, 0)}, "aft must have a direction"),
        ({"start": (0, 0, 0), "end": (0, 0, 1)}, r"for a rudder say up = \(0, 1, 0\)"),
        ({"gap": "wide"}, "gap must be sharp or smooth, got 'wide'"),
        ({"blend_width": None}, "needs a blend_width above 0"),
        ({"blend_width": math.nan}, "needs a blend_width above 0"),
        ({"end_width": -1.0}, "an end_width not below it"),
        ({"gap": "sharp"}, "a sharp gap has no width"),
    ],
)
def test_what_is_no_hinge_is_refused(options, said):
    with pytest.raises(ParameterError, match=said):
        Hinge(**({"start": START, "end": END, "blend_width": 0.1} | options))


def test_a_hinge_is_built_by_a_case_files_options(ball):
    hinge = Hinge.build(ball, start=START, end=END, gap="sharp")
    assert hinge.parameters == {"angle": np.array([0])}
    assert set(Hinge.options()) == {"start", "end", "aft", "up", "gap", "blend_width", "end_width"}
