"""Bodies: closed, round at their poles, differentiable in every number."""

from pathlib import Path

import jax
import numpy as np
import pytest

from moldline.case.options import model_of
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import quality
from moldline.mesh.health import health
from moldline.modelers.base import shaped
from moldline.modelers.body import Body
from moldline.numerics.taylor import remainder

SMALL = {"along": 16, "around": 24}
FUSELAGE = {
    "length": [5.0, 12.0, 20.0, 30.0],
    "width": [0, 4.0, 4.2, 4.0, 0],
    "height": [0, 3.0, 4.0, 3.0, 0],
    "lift": [-0.5, 0.0, 0.0, 0.3, 1.0],
    "exponent": [2.0, 2.5, 4.0, 3.0, 2.0],
    "lower_exponent": [2.0, 2.0, 3.0, 2.0, 2.0],
}


@pytest.mark.parametrize("loft", ["linear", "cubic", "bspline"])
@pytest.mark.parametrize("ends", [("round", "pointed"), ("pointed", "round"), ("flat", "flat")])
def test_a_body_is_sound(loft, ends):
    given = dict(FUSELAGE)
    if ends[0] == "flat":
        given |= {"width": 4.0, "height": [1, 3.0, 4.0, 3.0, 2]}
        ends = ("round", "round")
    found = health(Body(**given, loft=loft, nose=ends[0], tail=ends[1], along=40).geometry)
    assert not found.sentences()
    assert found.pieces == 1
    assert found.volume > 0
    assert np.degrees(found.smallest_angle) > 4


@pytest.mark.parametrize("seed", range(4))
def test_bodies_of_any_shape_are_sound(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 7))
    ends = [0.0, 0.0] if seed % 2 else [0.0, 1.0]
    size = [[ends[0], *rng.uniform(1, 3, count - 2), ends[1]] for _ in range(2)]
    body = Body(
        np.cumsum(rng.uniform(3, 8, count - 1)).tolist(),
        width=size[0],
        height=size[1],
        lift=rng.uniform(-1, 1, count).tolist(),
        exponent=rng.uniform(1.5, 5, count).tolist(),
        tail=("round", "pointed")[seed // 2],
        along=40,
        around=36,
    )
    assert not health(body.geometry).sentences()


def test_an_ellipsoid_is_one_to_rounding_and_its_volume_converges():
    errors = []
    for fine in (1, 2, 4):
        body = Body(
            [3.0, 6.0], width=[0, 2, 0], height=[0, 4, 0], along=32 * fine, around=48 * fine
        )
        surface = body.geometry
        x, y, z = np.asarray(surface.points).T
        np.testing.assert_allclose(((x - 3) / 3) ** 2 + y**2 + (z / 2) ** 2, 1.0, atol=1e-13)
        errors.append(1 - quality.signed_volume(surface) / (4 / 3 * np.pi * 3 * 1 * 2))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.1)


def test_cylinder_and_frustum_hold_what_their_polygons_do():
    around = 60
    polygon = around / 2 * np.sin(2 * np.pi / around)  # of the unit circle
    cylinder = Body(10.0, 1.5, around=around).geometry
    np.testing.assert_allclose(quality.signed_volume(cylinder), polygon * 1.5**2 * 10, rtol=1e-13)
    frustum = Body(10.0, [1.0, 0.5], around=around).geometry
    exact = polygon * 10 / 3 * (1 + 0.5 + 0.25)
    np.testing.assert_allclose(quality.signed_volume(frustum), exact, rtol=1e-13)


def test_a_box_is_what_a_large_exponent_comes_to():
    body = Body(2.0, width=3.0, height=1.0, exponent=200.0, around=400, along=8).geometry
    np.testing.assert_allclose(quality.signed_volume(body), 6.0, rtol=0.01)
    np.testing.assert_allclose(np.ptp(body.points, axis=0), [2.0, 3.0, 1.0], rtol=1e-15)


def test_a_cubic_loft_meets_an_ellipsoid_to_the_fourth_order():
    errors = []
    for count in (9, 17, 33):
        turn = np.linspace(0, np.pi, count)
        radius = np.sin(turn)
        radius[[0, -1]] = 0.0
        body = Body((2 * (1 - np.cos(turn)))[1:].tolist(), radius.tolist(), loft="cubic", along=300)
        x, y, z = np.asarray(body.geometry.points).T
        errors.append(np.abs(((x - 2) / 2) ** 2 + y**2 + z**2 - 1).max())
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 3.9)


def test_a_round_nose_has_the_radius_of_its_ellipse():
    points = np.asarray(Body([4.0, 8.0], [0, 1.0, 0], along=400).geometry.points)
    x, radius = points[:, 0], np.hypot(points[:, 1], points[:, 2])
    near = (x > 0) & (x < 1e-2)
    np.testing.assert_allclose(radius[near] ** 2 / (2 * x[near]), 1.0**2 / 4.0, rtol=2e-3)


def test_a_pole_is_one_point_with_six_triangles():
    surface = Body([3.0, 6.0], [0, 2.0, 0], around=64).geometry
    points = np.asarray(surface.points)
    for end in (points[:, 0].min(), points[:, 0].max()):
        pole = np.flatnonzero(points[:, 0] == end)
        assert len(pole) == 1
        assert np.sum(np.asarray(surface.faces) == pole[0]) == 6
    assert np.degrees(quality.smallest_angles(surface)).min() > 25


@pytest.mark.parametrize("loft", ["linear", "cubic", "bspline"])
def test_derivatives_by_every_parameter_are_finite_and_right(loft):
    body = Body(**FUSELAGE, loft=loft, tail="pointed", **SMALL)
    jacobian = np.asarray(jax.jacfwd(lambda p: shaped(body, p))(body.values))
    assert np.isfinite(jacobian).all()
    inner = [k for k in range(body.size) if not _is_of_a_pole(body, k)]
    assert np.abs(jacobian).max(axis=(0, 1))[inner].min() > 1e-3
    rng = np.random.default_rng(0)
    for name, rows in body.parameters.items():
        along = np.zeros(body.size)
        along[rows] = 0.05 * rng.normal(size=len(rows))
        assert remainder(lambda p: shaped(body, p), body.values, along).is_right, name


def _is_of_a_pole(body, number):
    """Whether a parameter is the exponent at a point, where it shows little."""
    rows = [body.parameters[name][[0, -1]] for name in ("exponent", "lower_exponent")]
    return number in np.concatenate(rows)


def test_connectivity_is_the_same_for_other_parameters_and_the_shape_stays_sound():
    body = Body(**FUSELAGE, loft="cubic", along=40)
    other = body.values.copy()
    for name, factor in {"length": 1.2, "width": 0.9, "height": 1.1, "lift": 2.0}.items():
        other[body.parameters[name]] *= factor
    assert not health(body.geometry.moved(np.asarray(body.bind()(other)))).sentences()


def test_half_a_body_is_open_in_its_plane_to_the_bit_whatever_the_parameters():
    body = Body(**FUSELAGE, half=True, **SMALL)
    found = health(body.geometry)
    assert len(found.holes) == 1
    assert len(body.parameters["origin"]) == 2
    moved = np.asarray(body.bind()(body.values * 1.1))
    assert np.all(moved[found.holes[0], 1] == 0.0)
    assert moved[:, 1].min() == 0.0


def test_a_whole_body_is_symmetric_to_the_bit():
    points = np.asarray(Body(**FUSELAGE, **SMALL).geometry.points)
    one, other = (np.unique(points * [1, side, 1] + 0.0, axis=0) for side in (1, -1))
    np.testing.assert_array_equal(one, other)


def test_sizes_of_nothing_are_no_parameters():
    body = Body([5.0, 20.0, 30.0], [0, 2.0, 2.0, 0.5], **SMALL)
    assert {k: len(v) for k, v in body.parameters.items()} == {
        "length": 3, "radius": 3, "lift": 1, "exponent": 1, "origin": 3,
    }  # fmt: skip
    np.testing.assert_array_equal(body.values[body.parameters["radius"]], [2.0, 2.0, 0.5])


def test_a_case_file_can_say_all_of_it():
    said = {"length": [5, 20.0, 30], "radius": [0, 2, 2.0, 0], "tail": "pointed", "half": True}
    said |= {"lift": [0, 0, 0.0, 1], "exponent": 2.5, "loft": "cubic", "around": 24, "name": "f"}
    model_of("body", Body.options()).model_validate(said)
    assert Body.build(Path(), **said).geometry.components == ("f",)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"length": [20.0, 5.0, 30.0]}, "distances of stations from the first one, ascending"),
        ({"length": -1.0}, r"length must be above 0 \[m\]"),
        ({"radius": [0, -2.0, 2.0, 0]}, "radius between the ends must be above 0"),
        ({"radius": [0, 2.0, 0.0, 0]}, "radius between the ends must be above 0"),
        ({"radius": [0, 2.0, 0]}, "radius for 3, length for 4"),
        ({"radius": None}, "takes radius, or width and height"),
        ({"radius": None, "width": 2.0}, "takes radius, or width and height"),
        ({"width": 2.0}, "takes radius, or width and height"),
        (
            {"radius": None, "width": [0, 2, 2, 1], "height": [0, 2, 2, 0]},
            "width and height are both 0",
        ),
        ({"exponent": 0.5}, "exponent must be 1 or more"),
        ({"around": 25}, "around must be an even number"),
        ({"half": True, "origin": [0.0, 1.0, 0.0]}, "half a body begins at y = 0"),
    ],
)
def test_what_cannot_be_built_says_why(options, message):
    with pytest.raises(ParameterError, match=message):
        Body(**({"length": [5.0, 20.0, 30.0], "radius": [0, 2.0, 2.0, 0]} | options))


def test_a_cubic_that_falls_below_nothing_is_refused():
    with pytest.raises(GeometryError, match="falls below 0 between them; use more stations"):
        Body([1.0, 2.0, 10.0, 11.0, 20.0], [0, 5.0, 0.1, 0.1, 5.0, 0], loft="cubic")
