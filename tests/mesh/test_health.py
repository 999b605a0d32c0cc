"""What is wrong with a surface, counted and told."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapes import CUBE, CUBE_POINTS, cube, two_cubes

from moldline.mesh import io
from moldline.mesh.health import health
from moldline.mesh.surface import Surface


def test_a_cube_is_sound():
    found = health(cube())
    assert found.is_sound and found.is_closed and found.is_manifold and found.is_oriented
    assert found.sentences() == []
    assert found.volume == pytest.approx(1.0)
    assert found.pieces == 1
    assert np.degrees(found.smallest_angle) == pytest.approx(45)
    assert found.box == ((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize(
    ("points", "faces", "sentence"),
    [
        (CUBE_POINTS, CUBE[1:], "3 edges belong to one face only; .* (first: 0 and 2) near (0.5"),
        (CUBE_POINTS, CUBE[:, ::-1], "1 closed piece looks inward (first: 0) near (1, 1, 0)"),
        (CUBE_POINTS, np.vstack([CUBE[:1, ::-1], CUBE[1:]]), "3 edges separate faces that show"),
        (CUBE_POINTS, np.vstack([CUBE, CUBE[:1]]), "1 face repeats an earlier one (first: 12)"),
        (CUBE_POINTS, np.vstack([CUBE, [[0, 0, 1]]]), "1 face has no area (first: 12)"),
        (np.vstack([CUBE_POINTS, [[9, 9, 9]]]), CUBE, "1 point belongs to no face (first: 8)"),
        (np.vstack([CUBE_POINTS, [[0, 0, 0]]]), CUBE, "1 point lies where an earlier one does"),
        (np.tile(CUBE_POINTS, (2, 1)), two_cubes([0]), "1 point joins fans of faces that share"),
        (np.tile(CUBE_POINTS, (2, 1)), two_cubes([0, 1]), "1 edge belongs to more than two faces"),
    ],
)
def test_each_fault_is_told_in_a_sentence(points, faces, sentence):
    found = health(Surface(points, faces))
    assert not found.is_sound
    words = [part.strip() for part in sentence.split(".*")]
    assert any(all(word in told for word in words) for told in found.sentences())


def test_cubes_that_run_into_each_other_are_told():
    points = np.vstack([CUBE_POINTS, CUBE_POINTS + np.array([0.5, 0.25, 0.125])])
    found = health(Surface(points, two_cubes([])))
    assert found.sentences() == [
        "14 pairs of faces cross or overlap (first: 2 and 17) near (0.75, 0.25, 1)"
    ]


def test_a_face_folded_over_is_told_but_a_sharp_edge_is_not():
    y, x = np.mgrid[0:4, 0:4]
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(float)
    start = (4 * np.arange(3)[:, None] + np.arange(3)).ravel()
    faces = np.vstack([start[:, None] + [0, 1, 5], start[:, None] + [0, 5, 4]])
    assert len(health(Surface(points, faces)).folded_faces) == 0
    points[5] = [1.6, 2.2, 0]  # across the edge from 9 to 10
    found = health(Surface(points, faces))
    assert found.folded_faces.tolist() == [13]
    assert "1 face lies folded over: all neighbours face the other way" in found.sentences()[-1]
    wedge = np.array([[0, 0, 0], [1, 0, 0.001], [1, 0, -0.001], [0, 1, 0]], float)
    sharp = Surface(wedge, [[0, 1, 3], [2, 0, 3], [0, 2, 1], [1, 2, 3]])
    assert len(health(sharp).folded_faces) == 0


def test_slivers_are_remarked_upon_but_are_no_fault():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.008, 0], [0.5, 0.01, 1]], float)
    for height, count in ((0.009, 0), (0.008, 2)):
        points[2, 1] = height
        flat = health(Surface(points, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
        assert flat.is_sound
        assert len(flat.slivers) == count // 2
    assert flat.remarks()[0].startswith("1 face has an angle below 1 degree (first: 0) near (0.5,")


def test_each_piece_and_component_has_its_area_and_volume():
    points = np.vstack([CUBE_POINTS, 2 * CUBE_POINTS + 5])
    tags = np.repeat([0, 1, 2], [4, 8, 12])
    found = health(Surface(points, two_cubes([]), tags, ("ends", "sides", "box")))
    small, large = found.by_piece
    assert (small.name, small.faces, small.is_closed) == ("0", 12, True)
    assert (small.area, small.volume) == (pytest.approx(6.0), pytest.approx(1.0))
    assert (large.area, large.volume) == (pytest.approx(24.0), pytest.approx(8.0))
    ends, sides, box = found.by_component
    assert (ends.name, ends.faces, ends.is_closed, ends.volume) == ("ends", 4, False, None)
    assert sides.area == pytest.approx(4.0) and not sides.is_closed
    assert box.is_closed and box.volume == pytest.approx(8.0)


def test_a_face_back_to_back_with_another_is_no_repetition():
    found = health(Surface(CUBE_POINTS, np.vstack([CUBE, CUBE[:1], CUBE[1:2, ::-1]])))
    assert found.duplicate_faces.tolist() == [12]
    assert found.back_to_back_faces.tolist() == [13]


def test_points_that_are_not_finite_are_told():
    points = CUBE_POINTS.copy()
    points[3], points[6, 0] = np.inf, np.nan
    found = health(Surface(points, CUBE))
    assert found.infinite_vertices.tolist() == [3, 6]


def test_where_all_is_tangled_the_count_is_a_least_one(monkeypatch):
    monkeypatch.setattr("moldline.mesh.health.MOST", 14)
    points = np.vstack([CUBE_POINTS, CUBE_POINTS + np.array([0.5, 0.25, 0.125])])
    assert health(Surface(points, two_cubes([]))).sentences()[0].startswith("at least 14 pairs")


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, (8, 3), elements=st.floats(width=64)),
    st.lists(st.tuples(*[st.integers(0, 7)] * 3), max_size=12),
)
def test_no_soup_makes_it_fail(points, faces):
    found = health(Surface(points, np.array(faces, int).reshape(-1, 3)))
    json.dumps(found.as_dict())
    assert all(found.sentences() + found.remarks())


def test_an_open_surface_has_no_volume_but_a_hole():
    found = health(Surface(CUBE_POINTS, CUBE[1:]))
    assert found.volume is None
    assert len(found.holes) == 1


def test_plain_values_go_through_json():
    plain = json.loads(json.dumps(health(Surface(CUBE_POINTS, CUBE[1:])).as_dict(places=2)))
    assert plain["counts"]["open_edges"] == 3
    assert plain["places"]["open_edges"] == [[0, 2], [0, 3]]
    assert plain["volume"] is None
    assert plain["is_closed"] is False


def test_a_real_wing_body_is_sound(data):
    found = health(io.read(data("pygeo/bwb.stl")))
    assert found.is_sound
    assert found.volume == pytest.approx(1103.57, rel=1e-5)  # our own number
