"""Cages made for real surfaces enclose them."""

import numpy as np
import pytest

import moldline as ml
from moldline.mesh.enclosure import enclosure
from moldline.mesh.stitch import stitched

SURFACES = ["pygeo/bwb.stl", "pygeo/c172.stl", "su2/onera_m6_surface.stl"]


@pytest.mark.parametrize("name", SURFACES)
def test_a_cage_encloses_a_real_surface(data, name):
    surface = ml.read(data(name))
    found = enclosure(surface, 200)
    assert found.clearance > 0
    assert len(found.surface.faces) <= 400
    cage = ml.Cage.of(found.surface, coordinates="mean value")
    few = np.asarray(surface.points)[:: len(surface.points) // 200 + 1]
    assert np.isfinite(np.asarray(cage.bind(few)(np.ones(cage.size)))).all()


def test_a_cage_encloses_the_wing_body_of_patches(data):
    patches = ml.read(data("crm_wing_body_patches.xyz.gz"))
    surface, _ = stitched(patches)
    found = enclosure(surface, 300)
    assert found.clearance > 0
    assert len(found.surface.faces) <= 600
