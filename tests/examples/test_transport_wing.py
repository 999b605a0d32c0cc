"""The example wing against the published figures of the Common Research Model."""

import runpy
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


def test_span_area_and_chord_come_near_the_reference_values(tmp_path):
    """The reference wing is a trapezoid that leaves out part of the trailing-edge break."""
    numbers = runpy.run_path(str(EXAMPLES / "make_transport_wing.py"))["main"](
        ["-o", str(tmp_path / "wing.tri"), "--chordwise", "4", "--spanwise", "4"]
    )
    # AIAA 2008-6919: area 594720 in², semispan 1156.75 in, mean aerodynamic chord 275.8 in
    assert numbers["semispan"] == pytest.approx(1156.75 * INCH, rel=1e-5)
    assert numbers["area"] == pytest.approx(594720 * INCH**2, rel=0.08)
    assert numbers["mean_chord"] == pytest.approx(275.8 * INCH, rel=0.12)


def test_the_wing_is_closed_and_looks_outward(wing):
    # a wing fills some 0.6 of the box of its sections: volume = 0.6 integral of t/c chord² dy
    assert quality.signed_volume(wing) == pytest.approx(142.4, abs=0.1)  # our own number [m³]


def test_the_cap_lies_in_the_symmetry_plane_and_nothing_else_does(wing):
    cap = wing.faces[wing.tags == 1]
    assert np.all(wing.points[cap][..., 1] == 0.0)
    assert np.all(wing.points[wing.faces[wing.tags == 0]][..., 1].max(axis=1) > 0.0)
