"""SU2 cases with FFD boxes become cases of ours and move points to the same places."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial import KDTree

import moldline as ml
from moldline.case.su2_config import convert
from moldline.cli import main
from moldline.errors import FileError, GeometryError
from moldline.mesh.io.su2_boxes import read_boxes

MESH = """\
NDIME= 2
NELEM= 4
5 0 1 4
5 1 2 4
5 2 3 4
5 3 0 4
NPOIN= 5
0.0 0.0
1.0 0.0
1.0 1.0
0.0 1.0
0.5 0.5
NMARK= 1
MARKER_TAG= wall
MARKER_ELEMS= 4
3 0 1
3 2 3
3 1 2
3 3 0
FFD_NBOX= 1
FFD_NLEVEL= 1
FFD_TAG= BOX
FFD_LEVEL= 0
FFD_DEGREE_I= 3
FFD_DEGREE_J= 1
FFD_BLENDING= BSPLINE_UNIFORM
BSPLINE_ORDER_I= 3
BSPLINE_ORDER_J= 2
FFD_PARENTS= 0
FFD_CHILDREN= 0
FFD_CORNER_POINTS= 4
-1 -1
2 -1
2 2
-1 2
FFD_CONTROL_POINTS= 16
{controls}
FFD_SURFACE_POINTS= 0
"""

CONFIG = """\
% what one optimises
MESH_FILENAME= mesh.su2
DV_KIND= FFD_CONTROL_POINT_2D, FFD_CONTROL_POINT_2D, FFD_CAMBER_2D, FFD_THICKNESS_2D
DV_MARKER= ( wall )
DV_PARAM= ( BOX, 1, 1, 0.0, 1.0 ); ( BOX, 2, -1, 0.5, 0.25 ); \\
          ( BOX, 1 ); ( BOX, 2 )
DV_VALUE= 0.1, -0.2, 0.05, 0.02
"""

MOVES = np.zeros((4, 2, 2, 3))
MOVES[1, 1, :, 1] += 0.1
MOVES[2, :, :] += -0.2 * np.array([0.5, 0.25, 0.0])
MOVES[1, :, :, 1] += 0.05
MOVES[2, 0, :, 1] -= 0.02
MOVES[2, 1, :, 1] += 0.02
"""What that configuration does to the control points, worked out by hand."""


def rows(points):
    """Control points as SU2 writes them."""
    return "\n".join(
        " ".join(map(repr, (*index, *points[index].tolist())))
        for index in np.ndindex(points.shape[:3])
    )


@pytest.fixture
def points():
    """A bent box around the unit square."""
    lines = [np.linspace(-1, 2, 4), np.linspace(-1, 2, 2), [-0.5, 0.5]]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    grid[..., 1] += 0.1 * grid[..., 0] ** 2
    return grid


@pytest.fixture
def folder(tmp_path, points):
    (tmp_path / "mesh.su2").write_text(MESH.format(controls=rows(points)))
    (tmp_path / "case.cfg").write_text(CONFIG)
    return tmp_path


def basis(count, degree, u):
    """Clamped uniform splines as SciPy has them; a Bezier curve has the degree count - 1."""
    inner = np.linspace(0, 1, count - degree + 1)[1:-1]
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return BSpline.design_matrix(u, knots, degree).toarray()


def place(box, points, u):
    """Where SU2's formula puts box coordinates."""
    w = [
        basis(n, p, u[:, i])
        for i, (n, p) in enumerate(zip(points.shape, box.degrees, strict=False))
    ]
    return np.einsum("ni,nj,nk,ijkd->nd", *w, points)


def test_a_case_moves_points_as_su2_would(folder, points):
    made = convert(folder / "case.cfg", folder / "case.toml")
    assert made.variables == 4
    case = ml.load(folder / "case.toml")
    rest = np.asarray(case.pipeline.geometry.points)
    (box,) = read_boxes(folder / "mesh.su2")
    u = ml.ControlVolume.read(folder / "mesh.su2").embedded(rest).u
    np.testing.assert_allclose(place(box, points, u), rest, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        case.pipeline.points(), place(box, points + MOVES, u), rtol=0, atol=1e-14
    )


def test_variables_keep_their_values_and_order(folder):
    convert(folder / "case.cfg", folder / "case.toml")
    values = {k: list(v.value) for k, v in ml.load(folder / "case.toml").pipeline.variables.items()}
    assert values == {
        "box_control_point_1": [0.1],
        "box_control_point_2": [-0.2],
        "box_camber": [0.05],
        "box_thickness": [0.02],
    }


def test_the_command_says_what_it_made(folder, capsys):
    with (folder / "case.cfg").open("a") as file:
        file.write("FFD_CONTINUITY= 2ND_DERIVATIVE\n")
    (folder / "out").mkdir()
    assert main(["convert", str(folder / "case.cfg"), str(folder / "out/case.toml")]) == 0
    told = capsys.readouterr().out
    assert "4 design variables, which move" in told
    assert "FFD_CONTINUITY" in told
    assert ml.load(folder / "out/case.toml").tables.stage[0].name == "BOX"


def test_definitions_of_variables_are_understood(folder):
    entries = [f"( 19, 1.0 | wall | BOX, {i}, 1, 0.0, 1.0 )" for i in (1, 2)]
    text = f"MESH_FILENAME= mesh.su2\nDV_MARKER= wall\nDEFINITION_DV= {'; '.join(entries)}\n"
    (folder / "case.cfg").write_text(text)
    made = convert(folder / "case.cfg", folder / "case.toml")
    assert made.variables == 2
    assert "scales of DEFINITION_DV" in made.notes[0]
    assert ml.load(folder / "case.toml").pipeline.variables["box_control_point"].size == 2


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("BOX, 1, 1, 0.0, 1.0", "BIX, 1, 1, 0.0, 1.0", "no box named 'BIX'; the mesh has: BOX"),
        ("BOX, 1, 1, 0.0", "BOX, 9, 1, 0.0", "variable 0: index 9, expected -1 to 3"),
        ("BOX, 1, 1, 0.0", "BOX, x, 1, 0.0", "found 'x', expected a number"),
        ("( BOX, 1, 1, 0.0, 1.0 )", "( BOX, 1 )", "variable 0: 1 numbers, expected 4"),
        ("FFD_CAMBER_2D", "FFD_TWIST_2D", "of kind 'FFD_TWIST_2D'"),
        ("FFD_CAMBER_2D", "FFD_GULL", "in a mesh of 2 dimensions"),
        ("DV_VALUE= 0.1,", "DV_VALUE=", "4 kinds of variables, 4 parameters and 3 values"),
        ("DV_VALUE= 0.1,", "DV_VALUE= nan,", "found 'nan', expected a number"),
        ("( wall )", "( roof )", "no marker named 'roof'; the mesh has: wall"),
        ("MESH_FILENAME= mesh.su2", "", "MESH_FILENAME= is missing"),
        ("% what", "what", "line 1: found 'what one optimises', expected KEYWORD= value"),
        (
            "DV_VALUE",
            "FFD_COORD_SYSTEM= POLAR\nDV_VALUE",
            "FFD_COORD_SYSTEM= POLAR, expected CARTES",
        ),
    ],
)
def test_what_cannot_be_converted_is_said(folder, old, new, said):
    assert old in CONFIG
    (folder / "case.cfg").write_text(CONFIG.replace(old, new, 1))
    with pytest.raises((FileError, GeometryError)) as told:
        convert(folder / "case.cfg", folder / "case.toml")
    assert said in str(told.value)
    assert not (folder / "case.toml").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "FFD_DEGREE_I= 3",
            "FFD_DEGREE_I= 4",
            "16 control points, but degrees of 4 x 1 x 1 need 20",
        ),
        ("FFD_DEGREE_I= 3", "FFD_DEGREE_I= 3000000000", "x 1 x 1 need 12000000004"),
        ("0 0 0 -1.0", "0 0 1 -1.0", "two control points have the same indices"),
        ("0 0 0 -1.0", "7 0 0 -1.0", "refers to 7, expected a whole number from 0 to 3"),
        ("0 0 0 -1.0", "0 0 -1.0", "expected three indices and three coordinates"),
        ("BSPLINE_UNIFORM", "NURBS", "FFD_BLENDING= NURBS, expected BEZIER or BSPLINE_UNIFORM"),
        ("FFD_CONTROL_POINTS= 16", "FFD_OTHER= 16", "has no FFD_CONTROL_POINTS"),
        (
            "FFD_SURFACE_POINTS= 0",
            "FFD_SURFACE_POINTS= 1\nwall 0 0.5",
            "expected 1 rows of a marker",
        ),
        ("BSPLINE_ORDER_I= 3", "BSPLINE_ORDER_I= 0", "must be positive"),
        ("FFD_PARENTS= 0", "FFD_PARENTS= 1\nMAIN", "has parents"),
    ],
)
def test_damaged_boxes_are_refused(folder, old, new, said):
    text = (folder / "mesh.su2").read_text()
    assert old in text
    (folder / "mesh.su2").write_text(text.replace(old, new, 1))
    with pytest.raises(FileError) as told:
        convert(folder / "case.cfg", folder / "case.toml")
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("name", "kind", "entry"),
    [
        ("rae2822_turbulent_ffd", "FFD_CONTROL_POINT_2D", "({box}, {i}, {j}, 0.3, 1.0)"),
        ("brick_tets_ffd", "FFD_CONTROL_POINT", "({box}, {i}, {j}, 0, 0.1, 0.2, 1.0)"),
        ("brick_prism_ffd", "FFD_CONTROL_POINT", "({box}, {i}, {j}, 1, 0.0, 0.0, 1.0)"),
    ],
)
def test_real_cases_go_where_su2_s_own_coordinates_take_them(data, tmp_path, name, kind, entry):
    """By SU2's formula, at the box coordinates that SU2 stored in the mesh."""
    mesh = data(f"su2/{name}.su2")
    (box,) = read_boxes(mesh)
    rng = np.random.default_rng(0)
    places = [(1, 0), (1, 1), (3, 1), (2, 0)]
    values = 0.1 * rng.uniform(-1, 1, len(places))
    entries = "; ".join(entry.format(box=box.name, i=i, j=j) for i, j in places)
    markers = sorted(set(box.markers))
    (tmp_path / "case.cfg").write_text(
        f"MESH_FILENAME= {mesh.resolve()}\nDV_KIND= {', '.join([kind] * len(places))}\n"
        f"DV_MARKER= ( {', '.join(markers)} )\nDV_PARAM= {entries}\n"
        f"DV_VALUE= {', '.join(map(repr, values.tolist()))}\n"
    )
    convert(tmp_path / "case.cfg", tmp_path / "case.toml")
    pipeline = ml.load(tmp_path / "case.toml").pipeline
    moved = box.points.copy()
    along = [float(word) for word in entry.strip("()").split(",")[3 if "2D" in kind else 4 :]]
    for (i, j), value in zip(places, values, strict=True):
        layers = slice(None) if "2D" in kind else int(entry.split(",")[3])
        moved[i, j, layers] += value * np.array([*along, 0.0][:3])
    rest = np.asarray(ml.read(mesh).points)[box.nodes]
    distance, row = KDTree(pipeline.geometry.points).query(rest)
    assert distance.max() < 1e-14
    expected = place(box, moved, box.coordinates)
    ours = np.asarray(pipeline.points())[row]
    np.testing.assert_allclose(ours[:, :2], expected[:, :2], rtol=0, atol=2e-14)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=2e-14)
    assert np.abs(expected - rest).max() > 0.001
