"""Patches become closed triangulations with the right volume, area and names."""

from itertools import pairwise

import numpy as np
import pytest
from shapes import cube

from moldline.errors import GeometryError, ParameterError
from moldline.mesh import Grid, Section, Surface, VolumeMesh, quality, topology
from moldline.mesh.cap import capped, uncapped
from moldline.mesh.conversion import converted
from moldline.mesh.health import health
from moldline.mesh.io import read
from moldline.mesh.planar import loop_area, triangulated
from moldline.mesh.stitch import listed, stitched

WING, BODY = [*range(3, 7), *range(9, 13), 17, 18], [1, 2, 7, 8, *range(13, 17)]


def box(n=5, sides=range(6), half=False, noise=0.0):
    """A cube from -1 to 1 of six patches, every other one turned over; as a half, x from 0."""
    rng = np.random.default_rng(1)
    blocks, shapes = [], []
    for side in sides:
        axis, end = side % 3, 1.0 if side < 3 else -1.0
        u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
        patch = np.empty((*u.shape, 3))
        patch[..., axis] = end
        patch[..., (axis + 1) % 3], patch[..., (axis + 2) % 3] = u, v
        if half:
            patch[..., 0] = (patch[..., 0] + 1) / 2
        patch += noise * rng.uniform(-1, 1, patch.shape)
        flat = patch.transpose(1, 0, 2).reshape(-1, 3)
        blocks.append(flat)
        shapes.append([(n, n, 1), (n, 1, n), (1, n, n)][axis])
    return Grid(np.concatenate(blocks), tuple(shapes))


def ball(n=41):
    """A sphere of two patches, each with two poles and a seam in common with the other."""
    polar = np.linspace(0, np.pi, n)
    blocks = []
    for start in (0, np.pi):
        around = start + np.linspace(0, np.pi, n)
        ring = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
        blocks.append(
            np.sin(polar)[:, None, None] * ring + np.cos(polar)[:, None, None] * [0, 0, 1]
        )
    return Grid(np.concatenate(blocks).reshape(-1, 3), ((n, n, 1),) * 2)


def test_a_box_of_patches_with_mixed_sides_is_closed_and_has_its_volume():
    surface, report = stitched(box(n=5))
    assert health(surface).is_sound
    assert quality.signed_volume(surface) == pytest.approx(8.0, rel=1e-14)
    assert len(surface.points) == 5**3 - 3**3
    assert report.welded == 6 * 25 - len(surface.points)
    assert report.turned and len(report.turned) < 6
    assert report.loops == ()
    assert surface.components == ("1", "2", "3", "4", "5", "6")
    assert report.smooth == ((1,), (2,), (3,), (4,), (5,), (6,))


def test_a_ball_with_poles_has_its_volume_to_second_order():
    errors = []
    for n in (21, 41):
        surface, report = stitched(ball(n))
        assert health(surface).is_closed and health(surface).is_manifold
        assert report.dropped == 4 * (n - 1)
        assert report.smooth == ((1, 2),)
        errors.append(4 / 3 * np.pi - quality.signed_volume(surface))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.01)


def test_small_gaps_are_welded_and_large_ones_are_left():
    surface, report = stitched(box(noise=1e-5))
    assert health(surface).is_closed
    assert 0 < report.largest_gap < 4e-5
    surface, report = stitched(box(noise=1e-3))
    assert not health(surface).is_closed
    surface, _ = stitched(box(noise=1e-3), tolerance=0.02)
    assert health(surface).is_closed


def test_the_tolerance_follows_the_local_spacing():
    fine = Grid(box().points * 1e-4, box().shapes)
    gap = fine.points + np.repeat([[2e-6, 0, 0], *[[0, 0, 0]] * 5], 25, axis=0)
    both = Grid(np.concatenate([box().points, gap + 5]), box().shapes * 2)
    surface, _ = stitched(both)
    number, piece = topology.pieces(surface.faces)
    assert number == 3  # 2e-6 is nothing to the large box and 4 % of a cell to the small one
    assert np.bincount(piece).tolist() == [192, 32, 160]


def test_points_of_the_surface_are_those_of_the_grid():
    grid = box()
    surface, report = stitched(grid)
    np.testing.assert_array_equal(grid.points[report.origin], surface.points)
    moved = grid.points * [1.0, 2.0, 3.0]
    assert quality.signed_volume(surface.moved(moved[report.origin])) == pytest.approx(48.0)


def test_cells_are_cut_along_their_shorter_diagonal_inside_them():
    flat = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]], float)
    surface, _ = stitched(Grid(flat[[0, 1, 3, 2]], ((2, 2, 1),)))
    assert quality.area(surface) == pytest.approx(0.2)  # concave: the other diagonal gives 0.8
    skew = np.array([[0, 0, 0], [2, 0, 0], [1, 1, 0], [3, 1, 0]], float)
    surface, _ = stitched(Grid(skew, ((2, 2, 1),)))
    assert {1, 2} <= set.intersection(*map(set, surface.faces.tolist()))


def test_components_are_named_by_blocks():
    surface, _ = stitched(box(), {"ends": [1, 4], "top": [3]})
    assert surface.components == ("ends", "top", "2", "5", "6")
    assert np.bincount(surface.tags).tolist() == [64, 32, 32, 32, 32]
    assert np.abs(surface.points[surface.component("ends"), 0]).min() == 1.0


@pytest.mark.parametrize(
    ("components", "message"),
    [
        ({"wing": [7]}, "component 'wing' names block 7; the grid has blocks 1 to 6"),
        ({"wing": [0]}, "names block 0"),
        ({"wing": []}, "component 'wing' names no block"),
        ({"wing": [1], "body": [1]}, "block 1 belongs to 'wing' and 'body'; name it once"),
    ],
)
def test_blocks_that_cannot_be_named_are_refused(components, message):
    with pytest.raises(ParameterError, match=message):
        stitched(box(), components)


def test_what_is_no_patch_is_refused():
    with pytest.raises(GeometryError, match="block 2 has 2 x 2 x 2 points, expected a surface"):
        stitched(Grid(np.zeros((12, 3)), ((2, 2, 1), (2, 2, 2))))
    with pytest.raises(ParameterError, match=r"a part of a cell below 0.5, got 0.7"):
        stitched(box(), tolerance=0.7)


def test_an_open_half_looks_outward_and_is_capped_and_uncapped():
    half = box(n=6, sides=(0, 1, 2, 4, 5), half=True)
    surface, report = stitched(half)
    assert [len(loop) for loop in report.loops] == [20]
    closed, capping = capped(surface, plane="x")
    assert health(closed).is_sound
    assert quality.signed_volume(closed) == pytest.approx(4.0, rel=1e-14)
    assert closed.components[-1] == "symmetry"
    assert (capping.area, capping.off_plane, capping.left) == (pytest.approx(4.0), 0.0, 0)
    np.testing.assert_array_equal(closed.points, surface.points)
    again = uncapped(closed)
    assert again.components == surface.components
    np.testing.assert_array_equal(again.faces, surface.faces)


def test_capping_says_why_there_is_nothing_to_cap():
    with pytest.raises(GeometryError, match=r"y = 0 within .*: the surface is closed, so there"):
        capped(cube())
    faces = np.asarray(cube().faces)[2:]
    with pytest.raises(GeometryError, match="the nearest of 1 reaches 1 off it: give another"):
        capped(Surface(cube().points, faces))


def test_a_plane_must_be_one_of_three():
    with pytest.raises(ParameterError, match="a cap's plane is x, y or z, got 'q'"):
        capped(cube(), plane="q")


def test_a_cap_keeps_data_and_leaves_holes_open_that_lie_elsewhere():
    whole = cube()
    tube = Surface(whole.points, whole.faces[4:], face_data={"q": np.ones(8)})
    closed, report = capped(tube, "lid", "z", at=1.0)
    assert report.left == 1 and len(health(closed).holes) == 1
    assert closed.face_data["q"].tolist() == [1.0] * 8 + [0.0] * 2
    sound, _ = capped(closed, "lid", "z")
    assert sound.components == ("1", "lid")
    assert health(sound).is_sound and quality.signed_volume(sound) == pytest.approx(1.0)


def ring(middle, radius, n, sense=1):
    turn = sense * np.linspace(0, 2 * np.pi, n, endpoint=False)
    return np.array(middle) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def filled(*loops):
    """Points and triangles, which are checked to fit the loops edge by edge."""
    points = np.concatenate(loops)
    ends = np.cumsum([0, *map(len, loops)])
    numbers = [np.arange(a, b) for a, b in pairwise(ends)]
    faces = triangulated(points, numbers)
    a, b, c = (points[faces[:, k]] for k in range(3))
    areas = np.linalg.det(np.stack([b - a, c - a], axis=1)) / 2
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(sum(map(loop_area, loops)), rel=1e-12)
    sides = {frozenset(pair) for n in numbers for pair in zip(n, np.roll(n, -1), strict=True)}
    assert {frozenset(pair) for pair in topology.edges(faces).open.tolist()} == sides
    return points, faces


def square(n):
    s = np.arange(n) / n
    sides = [(s, 0 * s), (1 + 0 * s, s), (1 - s, 1 + 0 * s), (0 * s, 1 - s)]
    return np.concatenate([np.stack(side, axis=1) for side in sides])


def test_straight_runs_holes_and_islands_are_filled_edge_by_edge():
    for turn in (0.0, 0.3):  # turned, straight runs are straight up to rounding only
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        loops = [
            square(40),
            *(ring((x, 0.25), 0.1, 30, -1) for x in (0.25, 0.5, 0.75)),
            ring((0.5, 0.7), 0.2, 50, -1),
            ring((0.5, 0.7), 0.1, 12),
        ]
        filled(*(loop @ rotation for loop in loops))


def test_a_star_with_thousands_of_points_is_filled_by_delaunay_triangles():
    turn = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    star = ring((0, 0), 1, 2000) * (1 + 0.7 * np.sin(9 * turn))[:, None]
    points, faces = filled(star)
    near = topology.neighbours(faces)
    angle = {}
    for face in faces.tolist():
        for k in range(3):
            o, a, b = points[[face[k], face[k - 2], face[k - 1]]]
            cosine = np.dot(a - o, b - o) / np.linalg.norm(a - o) / np.linalg.norm(b - o)
            angle.setdefault(frozenset((face[k - 2], face[k - 1])), []).append(np.arccos(cosine))
    opposite = [sum(pair) for pair in angle.values() if len(pair) == 2]
    assert len(opposite) == len(near.one) and max(opposite) < np.pi + 1e-6


def test_outlines_that_cross_or_nest_wrongly_are_refused():
    with pytest.raises(GeometryError, match="crosses or touches itself, perhaps at"):
        corners = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 1.5], [3, 1], [1, 0.5]]
        triangulated(np.array(corners, float), [np.arange(7)])
    with pytest.raises(GeometryError, match=r"a hole near \(6, 5\) lies in no outline"):
        points = np.concatenate([square(4), ring((5, 5), 1, 9, -1)])
        triangulated(points, [np.arange(16), np.arange(16, 25)])


def test_kinds_are_made_into_others_where_that_is_natural():
    assert isinstance(converted(box(), Surface)[0], Surface)
    assert converted(box(), Grid)[0].shapes == box().shapes
    section = Section(np.zeros((3, 3)))
    assert converted(section, Surface) == (section, [])
    with pytest.raises(ParameterError, match="components name blocks of a grid, got a Section"):
        converted(section, Surface, {"wing": [1]})
    with pytest.raises(ParameterError, match="markers belong to a volume mesh, got a Grid"):
        converted(box(), Surface, markers=["wall"])


def test_the_boundary_of_a_real_volume_mesh_is_a_closed_surface(data):
    mesh = read(data("su2/brick_tets_ffd.su2"))
    assert isinstance(mesh, VolumeMesh)
    surface, _ = converted(mesh, Surface)
    assert health(surface).is_closed and surface.components == tuple(mesh.markers)


def test_the_crm_becomes_a_closed_outward_surface_of_wing_and_body(data):
    grid = read(data("crm_wing_body_patches.xyz.gz"), units="in")
    surface, report = stitched(grid, {"wing": WING, "body": BODY})
    assert report.smooth == (tuple(BODY), tuple(WING))
    assert (report.welded, report.largest_gap, len(surface.points)) == (1075, 0.0, 20475)
    assert [len(loop) for loop in report.loops] == [384]
    closed, capping = capped(surface)
    assert health(closed).is_sound
    assert capping.off_plane < 4e-7
    volume = quality.signed_volume(closed)
    assert volume == pytest.approx(874.7972463750, rel=1e-9)  # ours
    span = 58.763  # Vassberg et al., AIAA 2008-6919; the rounded tip is beyond
    assert closed.points[:, 1].max() == pytest.approx(span / 2, rel=0.005)
    wing = surface.points[surface.component("wing")]
    assert wing[:, 1].min() == pytest.approx(3.0, abs=0.1)  # the body's half width
    assert capping.area > 300


def test_runs_of_numbers_are_drawn_together():
    assert listed([7, 1, 2, 3, 9, 10]) == "1-3,7,9-10"
    assert listed([]) == ""
