"""Surfaces fitted to patches: how far they are from the points, and what CAD reads back."""

import re
import sys

import numpy as np
import pytest

import moldline as ml
from moldline.errors import FileError, GeometryError, ParameterError
from moldline.mesh import Grid
from moldline.mesh.fit import fitted, lofted
from moldline.mesh.io import read, step, write

WING = {"wing": [*range(3, 7), *range(9, 13), 17, 18], "body": [1, 2, 7, 8, *range(13, 17)]}


@pytest.fixture(scope="module")
def occ():
    pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    import OCP.OCP

    return OCP.OCP


def patch(height, u=(0, 1, 30), v=(0, 1, 20)):
    """A patch over the x-y plane, its points denser on one side."""
    x, y = np.meshgrid(np.linspace(*u) ** 1.3, np.linspace(*v), indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1)
    return points.transpose(1, 0, 2).reshape(-1, 3), (u[2], v[2], 1)


def waves(x, y):
    return 0.2 * np.sin(3 * x) * np.cos(2 * y)


def two_patches():
    """Neighbours along x = 1, the second with its rows and columns swapped and one reversed."""
    first, shape = patch(waves)
    second, _ = patch(lambda x, y: waves(2 - x, y))
    second[:, 0] = 2 - second[:, 0]
    turned = second.reshape(20, 30, 3)[::-1].transpose(1, 0, 2).reshape(-1, 3)
    return Grid(np.concatenate([first, turned]), (shape, (20, 30, 1)))


def faces_in(occ, path):
    """B-spline surfaces of a file, in mm."""
    reader = occ.STEPControl.STEPControl_Reader()
    assert reader.ReadFile(str(path)) == occ.IFSelect.IFSelect_ReturnStatus.IFSelect_RetDone
    reader.TransferRoots()
    shape = reader.OneShape()
    assert occ.BRepCheck.BRepCheck_Analyzer(shape).IsValid()
    face = occ.TopAbs.TopAbs_ShapeEnum.TopAbs_FACE
    explorer, faces = occ.TopExp.TopExp_Explorer(shape, face), []
    while explorer.More():
        faces.append(occ.TopoDS.TopoDS.Face(explorer.Current()))
        explorer.Next()
    return shape, faces


def distances(occ, face, points):
    """From points to the nearest place of a face's surface, by projection."""
    surface = occ.BRep.BRep_Tool.Surface_s(face)
    return [
        occ.GeomAPI.GeomAPI_ProjectPointOnSurf(occ.gp.gp_Pnt(*p), surface).LowerDistance()
        for p in points.tolist()
    ]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-6, 1e-12])
def test_a_fit_is_as_near_as_it_says_and_needs_no_more_than_a_pole_per_point(tolerance):
    points, shape = patch(waves)
    (fit,) = fitted(Grid(points, (shape,)), tolerance)
    assert fit.deviation <= tolerance
    assert fit.degrees == (3, 3)
    assert fit.poles.shape[0] <= 30 and fit.poles.shape[1] <= 20
    dense = fit(np.linspace(0, 1, 200), np.linspace(0, 1, 200)).reshape(-1, 3)
    x, y, z = dense.T
    assert np.abs(z - waves(x, y)).max() < 3 * tolerance + 2e-5  # between the points as well


def test_a_coarser_tolerance_needs_fewer_poles():
    points, shape = patch(waves)
    sizes = [fitted(Grid(points, (shape,)), t)[0].poles.size for t in (1e-2, 1e-4, 1e-8)]
    assert sizes[0] < sizes[1] < sizes[2]


def test_a_cubic_is_met_by_one_piece():
    x, y = np.meshgrid(np.linspace(0, 1, 25), np.linspace(0, 1, 12))
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    (fit,) = fitted(Grid(points, ((25, 12, 1),)), 1e-10)
    assert fit.poles.shape == (4, 4, 3)


def test_neighbours_have_the_same_curve_on_their_border():
    for tolerance in (1e-2, 1e-5):
        one, other = fitted(two_patches(), tolerance)
        t = np.linspace(0, 1, 101)
        sides = [fit(np.array([e]), t)[0] for fit in (one, other) for e in (0.0, 1.0)]
        sides += [fit(t, np.array([e]))[:, 0] for fit in (one, other) for e in (0.0, 1.0)]
        shared = [side for side in sides if np.abs(side[:, 0] - 1).max() < 1e-9]
        assert len(shared) == 2
        gap = min(np.abs(shared[0] - shared[1]).max(), np.abs(shared[0] - shared[1][::-1]).max())
        assert gap < 1e-13


@pytest.mark.parametrize(("n", "k"), [(2, 2), (3, 5), (4, 2)])
def test_few_points_get_a_lower_degree_and_are_met(n, k):
    points, shape = patch(waves, (0, 1, n), (0, 1, k))
    (fit,) = fitted(Grid(points, (shape,)), 1e-10)
    assert fit.degrees == (min(3, n - 1), min(3, k - 1))
    assert fit.deviation < 1e-14


def test_sections_are_lofted():
    turn = np.linspace(0, 2 * np.pi, 61)
    sections = [
        np.stack([(1 - 0.1 * y) * np.cos(turn), 0 * turn + y, np.sin(turn)], axis=1)
        for y in np.linspace(0, 3, 9)
    ]
    grid = lofted(sections)
    np.testing.assert_array_equal(grid.block(0)[:, 4, 0], sections[4])
    (fit,) = fitted(grid, 1e-5)
    x, y, z = fit(np.linspace(0, 1, 300), np.linspace(0, 1, 50)).reshape(-1, 3).T
    assert np.abs(np.hypot(x / (1 - 0.1 * y), z) - 1).max() < 2e-5
    with pytest.raises(GeometryError, match=r"one shape \(n, 3\), got 2 of \(60, 3\), \(61, 3\)"):
        lofted([sections[0], sections[1][1:]])


@pytest.mark.parametrize(
    ("grid", "tolerance", "error", "message"),
    [
        (two_patches(), 0.0, ParameterError, "a length above 0, got 0.0"),
        (two_patches(), 1e-19, GeometryError, r"block 1 cannot be met within 1e-19, the best is"),
        (Grid(np.zeros((8, 3)), ((2, 2, 2),)), 1.0, GeometryError, "expected a surface patch"),
        (Grid(np.zeros((4, 3)), ((2, 2, 1),)), 1.0, GeometryError, "block 1 has no extent along"),
        (
            Grid([[0, 0, 0], [1, 0, 0]] * 2 + [[0, 1, 0], [1, 1, 0]], ((2, 3, 1),)),
            1.0,
            GeometryError,
            r"block 1 repeats a whole row of points \(0 and 1\)",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused(grid, tolerance, error, message):
    with pytest.raises(error, match=message):
        fitted(grid, tolerance)


@pytest.mark.parametrize(("unit", "size"), [("m", 1e3), ("mm", 1.0), ("in", 25.4), ("ft", 304.8)])
def test_cad_reads_back_surfaces_within_the_tolerance(occ, tmp_path, capfd, unit, size):
    grid = two_patches()
    patches = step.write(tmp_path / "a.step", grid, unit, 1e-3, {"lid": [2]})
    assert capfd.readouterr().out == ""
    text = (tmp_path / "a.step").read_text()
    assert re.findall(r"ADVANCED_FACE\('(.*?)'", text) == ["1", "lid 2"]
    shape, faces = faces_in(occ, tmp_path / "a.step")
    assert shape.ShapeType() == occ.TopAbs.TopAbs_ShapeEnum.TopAbs_SHELL  # sewn
    told = max(patch.deviation for patch in patches)
    assert 1e-5 < told <= 1e-3
    for number, face in enumerate(faces):
        points = grid.block(number).reshape(-1, 3)[::7] * size
        assert max(distances(occ, face, points)) <= told * size * (1 + 1e-6)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.step"]


def test_writing_by_name_states_the_unit(occ, tmp_path):
    grid = two_patches()
    write(tmp_path / "a.stp", grid, units="mm", tolerance=1.0)  # of metres, so that 1 is 1 mm
    _, faces = faces_in(occ, tmp_path / "a.stp")
    points = grid.block(0).reshape(-1, 3)[::20] * 1000
    assert max(distances(occ, faces[0], points)) <= 1.0
    assert "SI_UNIT(.MILLI.,.METRE.)" in (tmp_path / "a.stp").read_text()
    with pytest.raises(ParameterError, match="states its unit of length, got None; name one of m"):
        ml.write(tmp_path / "b.stp", grid)
    with pytest.raises(FileError, match="STEP is only written"):
        ml.read(tmp_path / "a.stp")


def test_a_failure_leaves_the_old_file(occ, tmp_path):
    (tmp_path / "a.step").write_text("old")
    with pytest.raises(GeometryError, match="cannot be met"):
        step.write(tmp_path / "a.step", two_patches(), "m", 1e-19)
    assert (tmp_path / "a.step").read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_without_opencascade_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP.OCP", None)
    with pytest.raises(FileError, match=r"a\.step: STEP needs .*: pip install 'moldline\[step\]'"):
        step.write(tmp_path / "a.step", two_patches(), "m")


def test_closed_patches_and_poles_are_read_back(occ, tmp_path):
    turn, up = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, np.pi, 21), indexing="ij")
    ball = np.stack([np.sin(up) * np.cos(turn), np.sin(up) * np.sin(turn), np.cos(up)], axis=-1)
    grid = Grid(ball.transpose(1, 0, 2).reshape(-1, 3), ((41, 21, 1),))
    step.write(tmp_path / "ball.step", grid, "m", 1e-4)
    _, faces = faces_in(occ, tmp_path / "ball.step")
    surface = occ.BRep.BRep_Tool.Surface_s(faces[0])
    place = surface.Value(0.33, 0.61)
    assert np.hypot(np.hypot(place.X(), place.Y()), place.Z()) == pytest.approx(1000, abs=0.3)


def test_the_crm_becomes_one_shell_of_named_faces(occ, data, tmp_path):
    grid = read(data("crm_wing_body_patches.xyz.gz"), units="in")
    bent = grid.moved(grid.points + np.outer(1e-3 * grid.points[:, 1] ** 2, [0, 0, 1]))
    patches = step.write(tmp_path / "crm.step", bent, "m", 1e-3, WING)
    assert max(patch.deviation for patch in patches) <= 1e-3
    text = (tmp_path / "crm.step").read_text()
    names = re.findall(r"ADVANCED_FACE\('(.*?)'", text)  # sewing changes their order
    assert sorted(names) == sorted(f"{name} {k}" for name, blocks in WING.items() for k in blocks)
    shape, faces = faces_in(occ, tmp_path / "crm.step")
    assert shape.ShapeType() == occ.TopAbs.TopAbs_ShapeEnum.TopAbs_SHELL
    for name in ("wing 4", "wing 11", "body 2"):
        points = bent.block(int(name[5:]) - 1).reshape(-1, 3)[::37] * 1000
        assert max(distances(occ, faces[names.index(name)], points)) < 1.0
