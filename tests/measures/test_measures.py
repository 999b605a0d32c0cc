"""Measures: known values on simple shapes, and exact derivatives."""

import math

import numpy as np
import pytest

import moldline as ml
from moldline.deformers.contract import prove
from moldline.errors import ParameterError
from moldline.measures.angle import Incidence, Opening
from moldline.measures.area import Area, ProjectedArea
from moldline.measures.camber import Camber
from moldline.measures.centroid import Centroid
from moldline.measures.circularity import Circularity, EdgeRadius
from moldline.measures.cross_section import CrossSection
from moldline.measures.distance import Distance
from moldline.measures.monotonicity import Monotonicity
from moldline.measures.position import Position
from moldline.measures.regions import Fixed, Rigid, Symmetry
from moldline.measures.separation import Separation
from moldline.measures.bending_energy import BendingEnergy
from moldline.measures.spot import Spot
from moldline.measures.straightness import Linearity, Planarity
from moldline.measures.ray_thickness import RayThickness
from moldline.measures.thickness import Thickness
from moldline.measures.volume import Volume

V = Spot.vertex

BOX = np.array([[x, y, z] for x in (0, 4) for y in (0, 2) for z in (0, 1)], float)
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
"""A box of 4 x 2 x 1, its faces looking outwards."""


def numbers(measure, points=BOX):
    found = np.asarray(measure(points))
    assert found.shape == (measure.size,)
    return found


def test_a_box_has_the_volume_area_and_middle_of_a_box():
    moved = BOX + np.array([3.0, -1.0, 7.0])
    assert numbers(Volume(SIDES), moved) == pytest.approx([8.0])
    assert numbers(Area(SIDES), moved) == pytest.approx([2 * (8 + 4 + 2)])
    assert numbers(Centroid(SIDES), moved) == pytest.approx([5.0, 0.0, 7.5])
    assert numbers(Centroid(SIDES, "zx"), moved) == pytest.approx([7.5, 5.0])


def test_its_shadow_is_its_planform_and_its_front():
    assert numbers(ProjectedArea(SIDES, "z")) == pytest.approx([8.0])
    assert numbers(ProjectedArea(SIDES, "x")) == pytest.approx([2.0])
    slanted = 8 * 0.6 + 2 * 0.8
    assert numbers(ProjectedArea(SIDES, (0.8, 0.0, 0.6))) == pytest.approx([slanted])


def test_a_section_has_the_area_that_the_plane_cuts_out(ball):
    assert numbers(CrossSection(SIDES, "x", [0.5, 3.9, 5.0])) == pytest.approx([2.0, 2.0, 0.0])
    assert numbers(CrossSection(SIDES, (1.0, 0.0, 1.0), 2.5 / math.sqrt(2))) == pytest.approx(
        [2 * math.sqrt(2)]
    )
    at = np.array([0.0123, 0.5])
    round_ones = math.pi * (1 - at**2)
    found = numbers(CrossSection(ball.faces, "z", at), ball.points)
    assert found == pytest.approx(round_ones, rel=0.02)


def test_places_and_what_lies_between_them():
    middle = Spot.within([0, 7], [0.5, 0.5])
    assert numbers(Position(middle)) == pytest.approx([2.0, 1.0, 0.5])
    assert numbers(Position(middle, "zx")) == pytest.approx([0.5, 2.0])
    assert numbers(Position(middle, (0, 3, 4))) == pytest.approx([1.0])
    assert numbers(Separation(V(0), V(7))) == pytest.approx([4.0, 2.0, 1.0])
    assert numbers(Separation(V(7), V(0), "y")) == pytest.approx([-2.0])
    assert numbers(Distance(V(0), V(7))) == pytest.approx([math.sqrt(21)])
    assert np.array_equal(middle.of(BOX), [2.0, 1.0, 0.5])


def test_angles_are_positive_nose_up():
    points = np.array([[0.0, 0.0, 0.1], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    assert numbers(Incidence(V(0), V(1)), points) == pytest.approx([math.atan(0.1)])
    assert numbers(Opening(V(1), V(0), V(2)), points) == pytest.approx([math.atan2(1, 0.1)])


def test_toothpicks_are_absolute_or_parts_of_the_chord():
    lower, upper = [V(0), V(2)], [V(1), V(3)]
    assert numbers(Thickness(lower, upper)) == pytest.approx([1.0, 1.0])
    relative = Thickness(lower, upper, "z", chord=(V(0), V(4)))
    assert numbers(relative) == pytest.approx([0.25, 0.25])
    assert Thickness(lower, upper).is_affine and not relative.is_affine


def test_rays_measure_what_lies_within(ball):
    rays = RayThickness(SIDES, [[1.3, 0.4, -5], [3.9, 1.9, 9], [5, 1, 0]], "z")
    assert numbers(rays) == pytest.approx([1.0, 1.0, 0.0])
    assert numbers(RayThickness(SIDES, [[-9, 0.4, 0.3]], "x")) == pytest.approx([4.0])
    two = np.concatenate([ball.points, ball.points + np.array([0, 0, 3.0])])
    faces = np.concatenate([ball.faces, ball.faces + len(ball.points)])
    through = numbers(RayThickness(faces, [[0.011, 0.017, 0]]), two)
    assert through == pytest.approx([4.0], abs=0.01)


def test_a_nose_radius_is_that_of_the_circle():
    angle = np.radians([80, 130, 180, 220, 275])
    points = np.stack([0.3 * np.cos(angle) + 9, 0 * angle, 0.3 * np.sin(angle) + 70], axis=1)
    spots = [V(i) for i in range(5)]
    assert numbers(EdgeRadius(spots), points) == pytest.approx([0.3], rel=1e-9)
    assert numbers(Circularity(spots, "y"), points) == pytest.approx(np.zeros(5), abs=1e-12)
    points[2, 0] -= 0.01
    assert abs(numbers(Circularity(spots, "y"), points)).max() > 1e-3


def test_the_nose_of_naca_0012_has_the_known_radius(data):
    foil = ml.read(data("naca0012.dat"))
    points = np.asarray(foil.points)
    nose = int(points[:, 0].argmin())
    near = np.flatnonzero(np.linalg.norm(points - points[nose], axis=1) < 0.012)
    radius = numbers(EdgeRadius([V(i) for i in near], "z"), points)
    # NACA report 460: 1.1019 t^2, the radius at the very nose, which grows from there
    assert radius == pytest.approx([1.1019 * 0.12**2], rel=0.15)


def test_camber_is_the_middles_height_over_the_chord():
    points = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0.5], [1, 0, -0.1]], float)
    measure = Camber(V(3), V(2), (V(0), V(1)))
    assert numbers(measure, points) == pytest.approx([0.1])
    turned = points @ np.array([[0.6, 0, -0.8], [0, 1, 0], [0.8, 0, 0.6]])
    assert numbers(measure, 3 * turned + 1) == pytest.approx([0.1])


def test_straight_edges_and_flat_regions_miss_by_nothing():
    share = np.array([0.0, 0.2, 0.7, 1.0])
    line = np.outer(share, [3.0, 1.0, 2.0]) + 1.0
    spots = [V(i) for i in range(4)]
    measure = Linearity(line, spots)
    assert numbers(measure, line) == pytest.approx(np.zeros(4), abs=1e-14)
    assert numbers(measure, line @ np.diag([2.0, -1.0, 5.0])) == pytest.approx(0, abs=1e-13)
    bent = line + np.outer(share * (1 - share), [0.0, 0.0, 1.0])
    assert np.linalg.norm(numbers(measure, bent)) > 0.1
    flat = Planarity([V(i) for i in (0, 1, 2, 3, 5)])
    assert numbers(flat) == pytest.approx([0.0, -4.0], abs=1e-12)


def test_rows_rise_where_they_are_monotone():
    assert numbers(Monotonicity([V(0), V(1), V(3)], "z")) == pytest.approx([1.0, 0.0])


def test_a_rigid_group_may_turn_but_not_bend(ball):
    group = np.arange(0, 642, 41)
    points = np.asarray(ball.points)
    measure = Rigid(points, group)
    assert measure.size == 3 * len(group) - 6
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert numbers(measure, points @ turn + 5) == pytest.approx(0, abs=1e-12)
    assert np.abs(numbers(measure, points * np.array([1.1, 1, 1]))).max() > 0.01
    fixed = Fixed(points, group)
    assert np.array_equal(numbers(fixed, points), np.zeros(3 * len(group)))
    assert numbers(fixed, points + np.array([0, 0, 2.0]))[2] == pytest.approx(2.0)


def test_bending_energy_is_zero_for_flat_motions_and_grows_as_the_square(ball):
    points = np.asarray(ball.points)
    x, y = np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 1, 11), indexing="ij")
    sheet = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    a = (np.arange(10)[:, None] * 11 + np.arange(10)).ravel()
    faces = np.concatenate([np.stack([a, a + 11, a + 12], 1), np.stack([a, a + 12, a + 1], 1)])
    measure = BendingEnergy(sheet, faces)
    inner = sheet * np.array([1.0, 1.0, 0.0])
    assert numbers(measure, sheet) == 0.0
    wave = np.sin(math.pi * inner[:, :1]) * np.sin(math.pi * inner[:, 1:2]) * [0, 0, 1.0]
    once, twice = numbers(measure, sheet + wave), numbers(measure, sheet + 2 * wave)
    assert twice == pytest.approx(4 * once)
    # (2 pi^2)^2 / 4 for the wave, but for its rows at the border
    assert once == pytest.approx((2 * math.pi**2) ** 2 / 4, rel=0.25)
    assert numbers(BendingEnergy(points, ball.faces), points + 1.0) == pytest.approx(0, abs=1e-20)


def test_symmetry_pairs_points_and_refuses_those_without_partner(ball):
    points = np.asarray(ball.points)
    assert numbers(Symmetry(points, "y"), points) == pytest.approx(0, abs=1e-12)
    with pytest.raises(ParameterError, match=r"the point at .* has no mirror image across y = 0"):
        Symmetry(points + np.array([0, 0.1, 0]), "y")


MANY = [
    lambda p, f: Incidence(V(3), V(400)),
    lambda p, f: Opening(V(3), V(40), V(400)),
    lambda p, f: Volume(f),
    lambda p, f: Area(f),
    lambda p, f: ProjectedArea(f, (1.0, 0.2, 0.3)),
    lambda p, f: Centroid(f),
    lambda p, f: CrossSection(f, "x", [0.0123, 0.31]),
    lambda p, f: BendingEnergy(p, f),
    lambda p, f: Distance(V(3), V(400)),
    lambda p, f: Thickness([V(3)], [V(40)], "z", (V(5), V(60))),
    lambda p, f: RayThickness(f, [[0.0123, 0.1231, 0]]),
    lambda p, f: Circularity([V(i) for i in (1, 99, 200, 401)]),
    lambda p, f: Planarity([V(i) for i in (1, 99, 200, 401)]),
    lambda p, f: Rigid(p, range(0, 600, 53)),
    lambda p, f: Camber(V(1), V(5), (V(99), V(200))),
    lambda p, f: Separation(V(3), Spot.within([1, 2, 7], [0.2, 0.3, 0.5])),
]


@pytest.mark.parametrize("make", MANY)
def test_derivatives_are_exact(make, ball):
    rng = np.random.default_rng(1)
    points = np.asarray(ball.points) + 0.005 * rng.normal(size=ball.points.shape)
    prove(make(points, np.asarray(ball.faces)), points, 1e-3 * rng.normal(size=points.shape))


def test_what_cannot_be_measured_is_refused():
    with pytest.raises(ParameterError, match="directions are of x, y and z"):
        Position(V(0), "xw")
    with pytest.raises(ParameterError, match="length above zero"):
        Position(V(0), (0.0, 0.0, 0.0))
    with pytest.raises(ParameterError, match="must sum to one"):
        Spot.within([0, 1], [0.5, 0.6])
    with pytest.raises(ParameterError, match="on one line"):
        Rigid(np.outer(np.arange(4.0), [1, 2, 3]), range(4))
    with pytest.raises(ParameterError, match="three spots or more, got 2"):
        EdgeRadius([V(0), V(1)])
