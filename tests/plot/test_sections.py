"""Drawn sections."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from moldline.errors import ParameterError
from moldline.plot import Net, draw_section, section_picture
from moldline.plot.figure import blank


def test_a_section_that_is_not_there_is_told(ball):
    with pytest.raises(ParameterError, match="no section at x = 2; the surface reaches from -1 to"):
        section_picture(ball.points, ball.points, ball.faces, [2.0], axis="x")
    with pytest.raises(ParameterError, match="an axis is x, y or z, got 'w'"):
        section_picture(ball.points, ball.points, ball.faces, [0.0], axis="w")


def test_a_section_is_dashed_at_rest_and_solid_when_deformed():
    axes = blank().subplots()
    curve = np.array([[1, 0, 0], [0, 0.1, 0], [1, 0.1, 0]], float)
    up = np.array([0, 0.2, 0])
    draw_section(axes, curve, curve + up, [Net(np.array([[0, 1], [1, 2]]), curve, curve + up)])
    rest, moved = axes.lines
    assert rest.is_dashed() and not moved.is_dashed()
    np.testing.assert_allclose(moved.get_ydata(), curve[:, 1] + 0.2)
    assert axes.get_aspect() == 1.0
    assert len([c for c in axes.collections if isinstance(c, LineCollection)]) == 2


def test_a_picture_of_cuts_has_a_panel_per_station(ball):
    figure = section_picture(ball.points, 1.1 * ball.points, ball.faces, [0.0, 0.2, 0.4])
    assert [panel.get_title(loc="left") for panel in figure.axes] == ["y = 0", "y = 0.2", "y = 0.4"]
    assert all(len(panel.collections) == 2 for panel in figure.axes)
