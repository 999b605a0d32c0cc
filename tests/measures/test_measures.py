"""Measures: known values on simple shapes, and exact derivatives."""

import math

import jax
import numpy as np
import pytest
from measures.simple import BOX, SIDES
from wings import joined

import moldline as ml
from moldline.errors import ParameterError
from moldline.measures.angle import Incidence, Opening
from moldline.measures.area import Area, ProjectedArea
from moldline.measures.bending_energy import BendingEnergy
from moldline.measures.camber import Camber
from moldline.measures.centroid import Centroid
from moldline.measures.chord import Chord
from moldline.measures.circularity import Circularity, EdgeRadius
from moldline.measures.cross_section import CrossSection
from moldline.measures.curvature import Curvature
from moldline.measures.directions import direction
from moldline.measures.distance import Distance
from moldline.measures.monotonicity import Monotonicity
from moldline.measures.opposed import Opposed
from moldline.measures.position import Position
from moldline.measures.ray_thickness import RayThickness
from moldline.measures.regions import Fixed, Rigid, Symmetry
from moldline.measures.section_area import SectionArea
from moldline.measures.separation import Separation
from moldline.measures.spot import Spot
from moldline.measures.straightness import Linearity, Planarity
from moldline.measures.thickness import Thickness
from moldline.measures.volume import Volume

V = Spot.vertex


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


def test_a_sphere_of_any_size_has_a_curvature_of_four_pi(ball):
    measure = Curvature(np.asarray(ball.faces))
    points = np.asarray(ball.points)
    found = numbers(measure, 3 * points + 5)
    assert found == pytest.approx([4 * math.pi], rel=4e-3)
    assert numbers(measure, points * np.array([2.0, 1.0, 0.5])) > 1.2 * found


def test_a_cylinder_has_the_curvature_of_a_cylinder_and_a_sheet_none():
    """(1 / 2 r)2 times the area, 2 pi r h, but for its borders."""
    around, along = 400, 21
    angle, z = np.meshgrid(
        np.arange(around) * 2 * np.pi / around, np.linspace(0, 1, along), indexing="ij"
    )
    loop = np.stack([2 * np.cos(angle), 2 * np.sin(angle), z], axis=-1)
    surface = joined(loop.transpose(1, 0, 2))
    found = numbers(Curvature(surface.faces), surface.points)
    inner = (along - 2) / (along - 1)  # a border's points own a part of the area
    assert found == pytest.approx([np.pi / (2 * 2) * inner], rel=2e-3)
    flat = surface.points * np.array([1.0, 0.0, 1.0])
    assert numbers(Curvature(surface.faces[: 2 * 100]), flat) == pytest.approx(0, abs=1e-20)


def test_a_chord_is_the_distance_of_its_ends():
    assert numbers(Chord(V(0), Spot.middle([V(4), V(6)]))) == pytest.approx([math.hypot(4, 1)])


def test_opposed_edges_move_by_as_much_up_as_down():
    measure = Opposed(BOX, [(V(0), V(4)), (V(1), V(5))])
    moved = BOX + np.outer(2 - BOX[:, 0], [0, 0, 0.1])
    assert numbers(measure, moved) == pytest.approx([0, 0], abs=1e-15)
    moved[4, 2] += 0.3
    assert numbers(measure, moved) == pytest.approx([0.3, 0], abs=1e-15)


def test_a_loop_encloses_its_area():
    square = np.array([[1, 1, 0], [3, 1, 0], [3, 2, 0], [1, 2, 0]], float) + 1e6
    assert numbers(SectionArea(range(4)), square) == pytest.approx([2.0], rel=1e-12)
    assert numbers(SectionArea(range(3, -1, -1)), square) == pytest.approx([-2.0], rel=1e-12)
    angle = np.arange(1000) * 2 * np.pi / 1000
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    exact = 500 * math.sin(2 * math.pi / 1000)
    assert numbers(SectionArea(range(1000)), circle) == pytest.approx([exact], rel=1e-12)


def test_rays_through_a_section_measure_what_lies_within():
    square = ml.Section([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], is_closed=True)
    for foil in (square, ml.Section(square.points[::-1], is_closed=True)):
        up = RayThickness.build(foil, origins=[(0.3, 9.0, 0.0), (2.1, 0.0, 0.0), (1.9, 0.5, 0.0)])
        assert numbers(up, foil.points) == pytest.approx([1.0, 0.0, 1.0])
        ahead = RayThickness.build(foil, origins=[(0.3, 0.25, 0.0)], along="x")
        assert numbers(ahead, foil.points) == pytest.approx([2.0])
    with pytest.raises(ParameterError, match="run in its plane"):
        RayThickness.build(square, origins=[(0.0, 0.0, 0.0)], along="z")


@pytest.mark.parametrize("along", ["x", "y", "z", (1.0, 1.0, 0.0), (1.0, 1.0, 1.0)])
def test_a_ray_through_edges_and_corners_of_the_mesh_counts_each_side_once(along, ball):
    """Where it meets an edge, and where it meets a point."""
    points = np.asarray(ball.points)
    through = RayThickness(ball.faces, [[0.0, 0.0, 0.0]], along)
    assert numbers(through, points) == pytest.approx([2.0], abs=0.01)
    rng = np.random.default_rng(0)
    edges = points[np.asarray(ball.faces)[rng.integers(0, 2000, 30), :2]]
    on_edges, on_points = 0.9 * edges.mean(axis=1), 0.9 * edges[:, 0]
    unit = direction(along)
    for origins in (on_edges, on_points):
        found = numbers(RayThickness(ball.faces, origins, along), points)
        beside = np.linalg.norm(np.cross(origins, unit), axis=1)
        assert found == pytest.approx(2 * np.sqrt(1 - beside**2), abs=0.03)


def test_what_is_fixed_may_be_spots_and_may_slide():
    spots = [Spot.within([0, 4], [0.5, 0.5])]
    fixed = Fixed(BOX, [3], spots, "xz")
    assert fixed.size == 4
    moved = BOX + np.array([0.1, 5.0, 0.2])
    assert numbers(fixed, moved) == pytest.approx([0.1, 0.2, 0.1, 0.2])


def test_numbers_of_a_section_are_those_of_its_plane():
    """Others never change, and no control could reach them."""
    foil = ml.Section([[1, 0, 0], [0.5, 0.1, 0], [0, 0, 0], [0.5, -0.1, 0]], is_closed=True)
    rng = np.random.default_rng(0)
    for measure in (
        Rigid.build(foil, region={"vertices": [0, 1, 2, 3]}),
        Symmetry.build(foil),
        Fixed.build(foil, region={"vertices": [0, 1]}),
        Linearity.build(foil, spots=[{"vertex": 0}, {"vertex": 1}, {"vertex": 2}]),
        Position.build(foil, spot={"vertex": 1}),
        Separation.build(foil, start={"vertex": 1}, end={"vertex": 3}),
    ):
        slopes = np.asarray(jax.jacfwd(measure)(foil.points + 1e-3 * rng.normal(size=(4, 3))))
        assert np.abs(slopes).reshape(measure.size, -1).max(axis=1).min() > 0.1
    assert Rigid.build(foil, region={"vertices": [0, 1, 2, 3]}).size == 5
    assert Symmetry.build(foil).size == 2 + 1 + 1
    with pytest.raises(ParameterError, match="a section is flat"):
        Planarity.build(foil, region={"vertices": [0, 1, 2, 3]})


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
