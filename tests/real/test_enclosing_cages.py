"""Cages made for real surfaces enclose them; of other files it is said that they have none."""

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.mesh.enclosure import clear_of
from moldline.mesh.stitch import stitched
from moldline.mesh.symmetric import is_half

SURFACES = ["pygeo/bwb.stl", "pygeo/c172.stl", "su2/onera_m6_surface.stl"]
PATCHES = "crm_wing_body_patches.xyz.gz"

OTHERS = {
    "pygeo/bwb.xyz": "Grid",
    "pygeo/c172.xyz": "Grid",
    "pygeo/bodyFFD.xyz": "Grid",
    PATCHES: "Grid",
    "su2/naca0012_inviscid.su2": "VolumeMesh",
    "su2/rae2822_turbulent_ffd.su2": "VolumeMesh",
    "su2/brick_tets_ffd.su2": "VolumeMesh",
    "su2/brick_prism_ffd.su2": "VolumeMesh",
    "naca0012.dat": "Section",
}
"""Files with no surface of triangles, and what they hold."""


def of(data, name):
    return stitched(ml.read(data(name)))[0] if name == PATCHES else ml.read(data(name))


def clearance(cage, surface):
    around = ml.Surface(cage.rest, cage.shape.faces)
    return clear_of(around, np.asarray(surface.points), np.asarray(surface.faces))


@pytest.mark.parametrize(
    ("name", "faces", "offset"),
    [(name, 200, 0.05) for name in (*SURFACES, PATCHES)] + [("pygeo/bwb.stl", 80, 0.02)],
)
def test_a_cage_encloses_a_real_surface(data, name, faces, offset):
    """Where as few as 80 faces cannot be so near to a wing there are more."""
    surface = of(data, name)
    cage = ml.Cage.around(surface, faces, offset, coordinates="mean value")
    assert clearance(cage, surface) > 0
    assert len(cage.shape.faces) <= 3 * faces
    few = np.asarray(surface.points)[:: len(surface.points) // 200 + 1]
    assert np.isfinite(np.asarray(cage.bind(few)(np.ones(cage.size)))).all()


@pytest.mark.parametrize("name", [*SURFACES, PATCHES])
def test_rings_enclose_a_real_body(data, name):
    surface = of(data, name)
    cage = ml.Cage.around_body(surface, stations=9)
    assert clearance(cage, surface) > 0


@pytest.mark.parametrize("name", ["pygeo/c172.stl", "su2/onera_m6_surface.stl", PATCHES])
@pytest.mark.parametrize(("stations", "chordwise"), [(5, 4), (9, 6)])
def test_rings_enclose_a_real_half_wing(data, name, stations, chordwise):
    """The light aircraft's half begins 2e-4 beyond y = 0, of 5327, as its file rounds it."""
    surface = of(data, name)
    if name.startswith("pygeo"):  # span along z
        surface = surface.moved(np.asarray(surface.points) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    cage = ml.Cage.around_wing(surface, stations, chordwise)
    assert clearance(cage, surface) > 0


@pytest.mark.parametrize("name", ["pygeo/c172.stl", "su2/onera_m6_surface.stl", PATCHES])
@pytest.mark.parametrize("maker", ["around", "around_wing", "around_body"])
def test_a_symmetric_cage_encloses_a_real_half_model(data, name, maker):
    surface = of(data, name)
    if name.startswith("pygeo"):  # span along z
        surface = surface.moved(np.asarray(surface.points) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert is_half(np.asarray(surface.points))
    cage = getattr(ml.Cage, maker)(surface, symmetric=True)
    assert clearance(cage, surface) > 0
    assert {*map(tuple, (cage.rest * [1, -1, 1]).tolist())} == {*map(tuple, cage.rest.tolist())}


def test_rings_around_a_whole_wing_are_refused(data):
    surface = ml.read(data("pygeo/bwb.stl"))
    whole = surface.moved(np.asarray(surface.points) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    with pytest.raises(ml.errors.GeometryError, match=r"reaches from y = -23.2545 to 23.2553"):
        ml.Cage.around_wing(whole)


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_without_a_surface_gets_no_cage_and_is_told(data, name, tmp_path, capsys):
    words = ["parameterise", str(data(name)), "--kind", "cage", "-o", str(tmp_path / "case.toml")]
    assert main(words) == 1
    assert f"a cage goes around a surface, got a {OTHERS[name]}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
