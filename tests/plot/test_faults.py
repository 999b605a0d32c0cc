"""The picture of what is wrong with a surface."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgb
from mesh.shapes import CUBE, CUBE_POINTS, cube, two_cubes

from moldline.errors import GeometryError
from moldline.mesh import Surface
from moldline.plot import of_faults
from moldline.plot.faults import _LOOKS, MOST_MARKED


def drawn(figure, kind):
    return [found for found in figure.axes[0].collections if isinstance(found, kind)]


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_of_a_sound_surface_the_title_says_so():
    figure = of_faults(cube(), title="cube")
    assert figure.axes[0].get_title() == "cube: nothing wrong was found"
    assert not figure.legends


def test_the_surface_is_pale():
    (polygons,) = drawn(of_faults(cube()), PolyCollection)
    assert polygons.get_facecolor()[:, :3].min() > 0.6


def test_open_edges_are_drawn_as_lines_and_counted():
    figure = of_faults(Surface(CUBE_POINTS, CUBE[1:]), view="top")
    (lines,) = drawn(figure, LineCollection)
    assert len(lines.get_segments()) == 3
    np.testing.assert_allclose(lines.get_color()[0, :3], to_rgb(_LOOKS["open_edges"].colour))
    assert legend(figure) == ["3 open edges"]
    assert figure.axes[0].get_title() == ""


def test_faces_that_cross_are_outlined_and_marked_where_they_do():
    points = np.vstack([CUBE_POINTS, CUBE_POINTS + np.array([0.5, 0.25, 0.125])])
    figure = of_faults(Surface(points, two_cubes([])), view="top")
    _, outlined = drawn(figure, PolyCollection)
    assert len(outlined.get_paths()) == 12
    (marks,) = drawn(figure, PathCollection)
    assert len(marks.get_offsets()) == 14
    assert legend(figure) == ["14 pairs of faces that cross or overlap"]


def test_of_very_many_places_only_some_are_marked():
    random = np.random.default_rng(0)
    figure = of_faults(Surface(random.random((300, 3)), np.arange(300).reshape(-1, 3)))
    assert MOST_MARKED in [len(marks.get_offsets()) for marks in drawn(figure, PathCollection)]


def test_every_kind_of_fault_has_a_look_of_its_own():
    from moldline.mesh.health import _FAULTS, _REMARKS

    assert set(_LOOKS) == {*_FAULTS, *_REMARKS}
    marks = [(look.colour, look.mark) for look in _LOOKS.values()]
    assert len(set(marks)) == len(marks)


def test_points_that_are_not_finite_are_left_out_of_the_picture():
    points = np.vstack([CUBE_POINTS, [[np.nan, 0, 0]]])
    faces = np.vstack([CUBE, [[0, 1, 8]]])
    figure = of_faults(Surface(points, faces))
    assert "1 points that are not finite, not drawn" in legend(figure)
    assert np.isfinite(figure.axes[0].dataLim.get_points()).all()
    with pytest.raises(GeometryError, match="none of 1 points has finite coordinates"):
        of_faults(Surface([[np.nan] * 3], np.empty((0, 3), int)))
