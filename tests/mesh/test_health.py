"""What is wrong with a surface, counted and told."""

import json

import numpy as np
import pytest
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
        (CUBE_POINTS, CUBE[1:], "3 edges belong to one face only; .* (first: 0 and 2)"),
        (CUBE_POINTS, CUBE[:, ::-1], "the faces look inward: the volume is -1"),
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
