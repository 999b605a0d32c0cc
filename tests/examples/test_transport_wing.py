"""The example wing against the published figures of the Common Research Model."""

from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.mesh import quality
from moldline.plot import cut

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
INCH = 0.0254


@pytest.fixture(scope="module")
def table():
    return np.genfromtxt(EXAMPLES / "data/crm_wing.csv", delimiter=",", names=True, skip_header=5)


@pytest.fixture(scope="module")
def wing():
    return ml.read(EXAMPLES / "data/transport_wing.tri")


@pytest.mark.parametrize("eta", [0.1, 0.37, 0.6, 0.95])
def test_a_section_has_the_published_place_chord_and_thickness(wing, table, eta):
    row = table[table["eta"] == eta][0]
    (section,) = cut(wing.points, wing.faces, "y", row["y"] * INCH - 1e-4)
    nose, tail = section[:, 0].min(), section[:, 0].max()
    # 0.03 in: sections lie a little inboard, and a twisted one reaches before its nose
    assert nose == pytest.approx(row["x"] * INCH, abs=0.03 * INCH + 0.004 * (tail - nose))
    assert tail - nose == pytest.approx(row["chord"] * INCH, rel=0.005)
    edge = section[section[:, 0].argmax()]
    twist = np.arctan2(row["z"] * INCH - edge[2], tail - row["x"] * INCH)
    assert np.degrees(twist) == pytest.approx(row["twist"], abs=0.01)
    along, up = section[:, 0] - row["x"] * INCH, section[:, 2] - row["z"] * INCH
    height = up * np.cos(twist) + along * np.sin(twist)
    chord = (tail - row["x"] * INCH) / np.cos(twist)
    camber = row["camber"] * chord
    # both sides are highest at different places where there is camber
    assert np.ptp(height) == pytest.approx(
        row["thickness"] * chord, abs=0.6 * camber + 1e-3 * chord
    )


def test_span_and_mean_chord_are_the_reference_values(wing, table):
    """The published mean chord is that of the outer panel continued to the symmetry plane."""
    assert wing.points[:, 1].max() == pytest.approx(1156.75 * INCH, abs=1e-4)
    inner, outer = table[table["eta"] == 0.4][0], table[table["eta"] == 0.95][0]
    ends = [cut(wing.points, wing.faces, "y", row["y"] * INCH - 1e-4) for row in (inner, outer)]
    chords = [np.ptp(section[:, 0]) for (section,) in ends]
    slope = (chords[1] - chords[0]) / (outer["y"] - inner["y"])
    root, tip = (chords[0] + slope * (y - inner["y"]) for y in (0.0, 1156.75))
    taper = tip / root
    mean = 2 / 3 * root * (1 + taper + taper**2) / (1 + taper)
    assert taper == pytest.approx(0.275, abs=0.001)
    assert mean == pytest.approx(275.8 * INCH, rel=1e-3)


def test_the_reference_area_lies_between_the_planform_and_its_trapezoid(table):
    """594720 in² count the trailing-edge break in part."""
    planform = 2 * np.trapezoid(table["chord"], table["y"])
    chord, tip, y = table["chord"][7], table["chord"][-1], table["y"][7]  # at the break
    root = chord + (chord - tip) / (1156.75 - y) * y
    assert (root + tip) * 1156.75 < 594720 < planform


def test_the_wing_looks_outward(wing):
    assert quality.signed_volume(wing) == pytest.approx(142.4, abs=0.1)  # our own number [m³]


def test_the_cap_lies_in_the_symmetry_plane_and_nothing_else_does(wing):
    cap = wing.faces[wing.tags == 1]
    assert np.all(wing.points[cap][..., 1] == 0.0)
    assert np.all(wing.points[wing.faces[wing.tags == 0]][..., 1].max(axis=1) > 0.0)
