"""What a union refuses, and how it says so."""

import jax
import numpy as np
import pytest
from overlapping import body, box, sphere, wing

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.modelers.union import Union

ONE = box([0, 0, 0], [1, 1, 1], 2)
NAMES = ["wing", "body"]


def refused(*parts, match, names=NAMES, **options):
    with pytest.raises(GeometryError, match=match):
        Union(**options).bind(*parts, names=names)


def test_a_part_alone_is_refused():
    with pytest.raises(GeometryError, match="two surfaces or more, got 1"):
        Union().bind(ONE)


def test_what_is_no_surface_is_refused():
    with pytest.raises(GeometryError, match="geometry 2 of a union is a Cloud"):
        Union().bind(ONE, ml.Cloud(np.zeros((3, 3))))


def test_traced_points_are_refused():
    def bound(p):
        Union().bind(ONE.moved(p), box([0.5, 0.4, 0.3], [2, 2, 2]))
        return p.sum()

    with pytest.raises(GeometryError, match="known points"):
        jax.grad(bound)(np.asarray(ONE.points))


def test_as_many_names_as_surfaces():
    with pytest.raises(ParameterError, match="2 surfaces need as many names"):
        Union().bind(ONE, box([0.5, 0.4, 0.3], [2, 2, 2]), names=["a"])


def test_options_are_checked():
    with pytest.raises(ParameterError, match="symmetry is one of None, 'x', 'y', 'z', got 'w'"):
        Union(symmetry="w")
    with pytest.raises(ParameterError, match="slivers is one of"):
        Union(slivers="remove")
    with pytest.raises(ParameterError, match="tolerance is a length"):
        Union(tolerance=-1.0)
    with pytest.raises(ParameterError, match="altitude is a part of"):
        Union(altitude=2.0)


def test_an_open_part_is_refused_with_its_place():
    refused(
        wing(closed_root=False),
        body(),
        match=r"wing: 24 edges belong to one face only, so it is open, first near .*symmetry=\"y\"",
    )


def test_a_part_inside_out_is_refused():
    turned = ml.Surface(ONE.points, np.asarray(ONE.faces)[:, ::-1])
    refused(
        box([0.5, 0.4, 0.3], [2, 2, 2]), turned, match="body: it is inside out, its volume is -1"
    )


def test_faces_that_show_different_sides_are_refused():
    faces = np.array(ONE.faces)
    faces[5] = faces[5, ::-1]
    refused(ml.Surface(ONE.points, faces), wing(), match="wing: 3 edges separate faces that show")


def test_three_faces_at_an_edge_are_refused():
    # two boxes that have one edge in common
    other = box([1, 1, 0], [2, 2, 1], 2)
    points = np.concatenate([ONE.points, other.points])
    unique, index = np.unique(points, axis=0, return_inverse=True)
    faces = index.ravel()[np.concatenate([ONE.faces, other.faces + len(ONE.points)])]
    refused(
        ml.Surface(unique, faces),
        box([0.3, 0.4, 0.5], [0.6, 0.7, 3]),
        match="wing: 2 edges belong to more than two faces",
    )


def test_a_part_that_runs_through_itself_is_refused_but_may_be_allowed():
    other = sphere([0.9, 0.9, 0.9], 0.4)
    both = ml.Surface(
        np.concatenate([ONE.points, other.points]),
        np.concatenate([ONE.faces, other.faces + len(ONE.points)]),
    )
    third = box([-0.5, 0.2, 0.3], [0.5, 0.6, 0.7])
    refused(both, third, match=r"wing: \d+ pairs of its faces run through each other, first near")
    assert Union(crossings="allow").bind(both, third).report.points > 0


def test_parts_apart_are_refused_with_their_distance():
    far = box([1.25, 0.2, 0.3], [2, 0.8, 0.9])
    refused(
        ONE,
        far,
        match=r"wing crosses no other component: the nearest is body, 0\.25 away near \(1, .*apart",
    )


def test_a_part_inside_another_is_refused():
    refused(ONE, sphere([0.5, 0.5, 0.5], 0.3), match="body lies wholly inside wing")


def test_parts_apart_may_be_allowed():
    far = box([1.25, 0.2, 0.3], [2, 0.8, 0.9])
    made = Union(apart="allow").bind(ONE, far, sphere([0.5, 0.5, 0.5], 0.3), names=["a", "b", "c"])
    assert made.report.pieces == 2
    assert made.report.volume == pytest.approx(1 + 0.75 * 0.6 * 0.6, rel=1e-13)
    assert made.report.components["c"] == 0
    told = " ".join(made.report.sentences())
    assert "c lies wholly inside a" in told and "b crosses no other component" in told
    assert made.holds(*(s.points for s in (ONE, far, sphere([0.5, 0.5, 0.5], 0.3))))


def test_two_groups_are_refused():
    a, b = box([0, 0, 0], [1, 1, 1]), box([0.5, 0.4, 0.3], [1.5, 1.3, 1.2])
    c, d = (s.moved(np.asarray(s.points) + [10, 0, 0]) for s in (a, b))
    refused(a, b, c, d, names=list("abcd"), match="a, b, c, d cross in 2 groups")


def test_touching_in_a_face_is_refused_with_place_and_area():
    beside = box([1, 0.25, 0.25], [2, 0.75, 0.75])
    refused(ONE, beside, match=r"wing and body touch in a face: .* overlap by 0\.25 m² .*near \(1,")
    flush = box([0.5, 0.25, 0.3], [2, 0.75, 1.0])
    refused(ONE, flush, match=r"overlap by 0\.25 m²")


def test_touching_in_a_point_or_an_edge_is_refused():
    ball = sphere([0.5, 0.5, 0.5], 0.3)
    height = 1 - np.asarray(ball.points)[:, 2].min()
    on_top = ball.moved(np.asarray(ball.points) + [0, 0, height])
    refused(ONE, on_top, match="wing touches body in a point or an edge only, near")
    corner = box([1, 1, 0.2], [2, 2, 0.7])
    refused(ONE, corner, match="wing touches body in a point or an edge only, near")
    # turned by 45 degrees, an edge of it lies in a side of the other
    size = np.sqrt(0.5)
    turn = size * np.array([[1, 1, 0], [-1, 1, 0], [0, 0, 1]])
    edge = box([0, 0, 0], [1, 1, 1])
    edge = edge.moved((np.asarray(edge.points) - 0.5) @ turn * 0.5 + [1 + 0.5 * size, 0.5, 0.5])
    refused(ONE, edge, match="touches .* in a point or an edge only, near|crosses no other")


def test_points_that_are_no_numbers_are_refused():
    points = np.array(ONE.points)
    points[3, 1] = np.nan
    refused(ml.Surface(points, ONE.faces), wing(), match="wing: has points that are no finite")


def test_names_are_kept_or_told_apart():
    one = ml.Surface(ONE.points, ONE.faces, ONE.faces[:, 0] * 0, ("skin",))
    other = box([0.5, 0.4, 0.3], [2, 2, 2])
    both = Union().bind(one, other, names=["left", "right"])
    assert both.geometry.components == ("skin", "right")
    same = ml.Surface(other.points, other.faces, None, ("skin",))
    both = Union().bind(one, same, names=["left", "right"])
    assert both.geometry.components == ("left.skin", "right.skin")
    assert Union().bind(ONE, other).geometry.components == ("1", "2")


def test_data_of_faces_comes_along_where_all_have_it():
    other = box([0.5, 0.4, 0.3], [2, 2, 2])
    one = ml.Surface(ONE.points, ONE.faces, face_data={"cp": np.arange(len(ONE.faces))})
    two = ml.Surface(
        other.points, other.faces, face_data={"cp": -np.arange(len(other.faces)), "x": np.ones(12)}
    )
    made = Union().bind(one, two)
    assert set(made.geometry.face_data) == {"cp"}
    cp = np.asarray(made.geometry.face_data["cp"])
    assert np.all((cp <= 0) == ((made.geometry.tags == 1) | (cp == 0)))
