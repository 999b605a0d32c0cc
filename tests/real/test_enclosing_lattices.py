"""Boxes made for real geometry enclose it, and refined ones give the shape of the coarse."""

import numpy as np
import pytest

import moldline as ml
from moldline.mesh.joined import joined_points

FILES = {
    "pygeo/bwb.stl": 3,
    "pygeo/c172.stl": 3,
    "su2/onera_m6_surface.stl": 3,
    "crm_wing_body_patches.xyz.gz": 3,
    "pygeo/bwb.xyz": 3,
    "pygeo/c172.xyz": 3,
    "pygeo/bodyFFD.xyz": 3,
    "su2/naca0012_inviscid.su2": 2,
    "su2/rae2822_turbulent_ffd.su2": 2,
    "su2/brick_tets_ffd.su2": 3,
    "su2/brick_prism_ffd.su2": 3,
    "naca0012.dat": 2,
}
"""Each file, and its dimensions."""


def shape(name):
    return (8, 8, 8) if FILES[name] == 3 else (8, 8, 1)


def is_inside(lattice, points):
    """Whether points are in the box, to rounding."""
    u = (points - lattice.origin) @ lattice.inverse
    free = np.array(lattice.shape) == 1
    return np.all(((u >= -1e-12) & (u <= 1 + 1e-12)) | free, axis=1)


@pytest.mark.parametrize("name", FILES)
def test_a_box_encloses_a_real_geometry(data, name):
    geometry = ml.read(data(name))
    points = np.asarray(geometry.points)
    for margin in (0.0, 0.02):
        for lattice in (
            ml.Lattice.around(geometry, shape(name), margin),
            ml.Lattice.over(geometry, shape(name), margin),
            ml.Lattice.over(geometry, shape(name), margin, align="principal"),
        ):
            assert is_inside(lattice, points).all()
            assert not lattice.frozen.any()


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("align", ["axes", "principal"])
def test_a_box_over_a_part_encloses_it_and_tears_nothing(data, name, align):
    geometry = ml.read(data(name))
    points = np.asarray(geometry.points)
    extent = np.ptp(points, axis=0)
    corner = np.full(3, -np.inf)
    along = extent.argmax()
    corner[along] = points[:, along].min() + 0.45 * extent[along]
    region = [corner, np.full(3, np.inf)]
    covered = np.all(points >= corner, axis=1)
    lattice = ml.Lattice.over(geometry, shape(name), region=region, align=align)
    assert is_inside(lattice, points[covered]).all()
    edges = joined_points(geometry)
    assert lattice.frozen.any() == bool(len(edges))  # of control boxes, nothing joins the points
    _, gaps = lattice.tears(points, edges, np.ones(lattice.size))
    assert gaps.max(initial=0.0) < 1e-12 * extent.max()


@pytest.mark.parametrize("name", FILES)
def test_a_finer_lattice_gives_the_coarse_shape_of_a_real_geometry(data, name):
    points = np.asarray(ml.read(data(name)).points)[::7]
    size = np.abs(points).max()
    lattice = ml.Lattice.around(points, shape(name), freeze=("x-",))
    controls = 0.05 * size * np.random.default_rng(0).normal(size=lattice.size)
    expected = np.asarray(lattice.bind(points)(controls))
    more = tuple(n + 3 if n > 1 else 1 for n in lattice.shape)
    for fine, transfer in (lattice.refined(more), lattice.elevated(4)):
        moved = np.asarray(fine.bind(points)(transfer @ controls))
        assert np.abs(moved - expected).max() < 1e-14 * size
        assert np.abs(expected - points).max() > 0.01 * size


@pytest.mark.parametrize("name", ["su2/onera_m6_surface.stl", "pygeo/bwb.stl", "pygeo/c172.stl"])
def test_a_box_along_a_real_wing_encloses_it(data, name):
    surface = ml.read(data(name))
    points = np.asarray(surface.points)
    if name.startswith("pygeo"):  # span along z
        points = points @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    wing = surface.moved(points)
    for shape in ((4, 2, 2), (6, 5, 2), (8, 12, 3)):
        for degree in (1, 3):
            volume = ml.ControlVolume.along_wing(wing, shape, degree=degree)
            volume.bind(points)  # refuses points outside
    box = volume.frame.boxes[0].points
    assert np.ptp(box[..., 1]) < 1.11 * np.ptp(points[:, 1])


def test_a_box_along_the_whole_wing_encloses_both_halves(data):
    half = ml.read(data("su2/onera_m6_surface.stl"))
    points, faces = np.asarray(half.points), np.asarray(half.faces)
    both = ml.Surface(
        np.concatenate([points, points * [1, -1, 1]]),
        np.concatenate([faces, faces[:, ::-1] + len(points)]),
    )
    ml.ControlVolume.along_wing(both, (6, 7, 2)).bind(both.points)
