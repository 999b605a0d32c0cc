"""`moldline parameterise`: a case file to begin with, that runs."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from bodies import fuselage

import moldline as ml
from moldline.cli import main

WING = Path(__file__).parents[2] / "examples/data/transport_wing.tri"


def made(tmp_path, capsys, *options, source=WING):
    shutil.copy(source, tmp_path)
    case = tmp_path / "case.toml"
    words = ["parameterise", str(tmp_path / source.name), "-o", str(case), *options]
    assert main(words) == 0, capsys.readouterr().err
    assert (tmp_path / "case.png").stat().st_size > 10_000
    return ml.load(case), capsys.readouterr().out


KINDS = {
    "lattice": (["--shape", "5x4x2"], 3 * 40, "5 x 4 x 2 control points: as asked for"),
    "wing-lattice": (["--shape", "5x4x2"], 40, "the wing's own box"),
    "cage": (["--faces", "80"], 24 + 17 + 24, "41 vertices and 78 triangles"),
    "wing-cage": (["--stations", "3"], 25 + 17 + 25, "42 vertices"),
    "wing-skeleton": (["--stations", "0,11,29"], 1 + 3 + 2 + 2 + 3, "11 numbers: 1 of span"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_writes_a_case_that_leaves_the_wing_as_it_is(kind, tmp_path, capsys):
    options, numbers, words = KINDS[kind]
    case, told = made(tmp_path, capsys, "--kind", kind, *options)
    assert sum(v.size for v in case.pipeline.variables.values()) == numbers
    assert words in told and str(tmp_path / "case.png") in told
    rest = np.asarray(case.pipeline.geometry.points)
    np.testing.assert_allclose(case.pipeline.points(), rest, rtol=0, atol=1e-9)
    text = (tmp_path / "case.toml").read_text()
    assert words.split(":")[0] in text  # a person reads why
    assert tomllib.loads(text)["geometry"]["transport_wing"]["file"] == "transport_wing.tri"


@pytest.mark.parametrize("kind", ["cage", "wing-cage"])
def test_a_half_model_stays_on_its_plane_of_symmetry(kind, tmp_path, capsys):
    case, told = made(tmp_path, capsys, "--kind", kind)
    assert "around the geometry and its mirror image; those at y < 0 follow the others" in told
    rest, rng = np.asarray(case.pipeline.geometry.points), np.random.default_rng(0)
    values = {n: rng.uniform(-1, 1, v.size) for n, v in case.pipeline.variables.items()}
    moved, on = np.asarray(case.pipeline.points(values)), rest[:, 1] == 0
    assert np.array_equal(moved[on, 1], rest[on, 1]) and on.sum() > 100
    assert np.abs(moved - rest)[on].max() > 0.1 and np.abs(moved - rest)[:, 1].max() > 0.05
    stage = case.pipeline.stages[0]
    cage, controls = stage.deformer, np.asarray(stage.controls(case.pipeline.values(values)))
    flip = np.array([1.0, -1.0, 1.0])  # the whole model keeps its symmetry
    there = np.asarray(cage.follow(rest * flip, controls))
    np.testing.assert_allclose(there, moved * flip, rtol=0, atol=1e-9)


def test_a_body_cut_at_its_plane_gets_a_symmetric_cage(tmp_path, capsys):
    body = fuselage(48, 81)
    points, faces = np.array(body.points), np.asarray(body.faces)
    points[np.abs(points[:, 1]) < 1e-9, 1] = 0.0
    half = ml.Surface(points, faces[np.all(points[faces, 1] >= 0, axis=1)])
    (tmp_path / "in").mkdir()
    ml.write(tmp_path / "in/half.tri", half)
    case, told = made(tmp_path, capsys, "--kind", "body-cage", source=tmp_path / "in/half.tri")
    assert "its mirror image" in told
    values = {n: np.full(v.size, 0.1) for n, v in case.pipeline.variables.items()}
    moved, rest = (
        np.asarray(case.pipeline.points(values)),
        np.asarray(case.pipeline.geometry.points),
    )
    assert np.all(moved[rest[:, 1] == 0, 1] == 0) and np.any(moved != rest)


def test_the_picture_shows_the_shape_once_with_its_control_points(tmp_path, capsys, monkeypatch):
    drawn = []
    monkeypatch.setattr("moldline.plot.save", lambda figure, path: drawn.append(figure))
    for kind in ("lattice", "wing-skeleton"):
        words = ["parameterise", str(WING), "--kind", kind, "--overwrite"]
        assert main([*words, "-o", str(tmp_path / "case.toml")]) == 0
        (axes,) = drawn.pop().axes
        assert [type(one).__name__ for one in axes.collections] == [
            "PolyCollection", "LineCollection", "PathCollection",
        ]  # fmt: skip


def test_a_wing_skeleton_turns_its_sections_on_request(tmp_path, capsys):
    places = ["--sweep-at", "0.25", "--twist-at", "0.25"]
    case, _ = made(tmp_path, capsys, "--kind", "wing-skeleton", "--sections", "turned", *places)
    stage = tomllib.loads((tmp_path / "case.toml").read_text())["stage"][0]
    assert (stage["sections"], stage["sweep_at"], stage["twist_at"]) == ("turned", 0.25, 0.25)
    skeleton = ml.WingSkeleton.fitted(case.pipeline.geometry, sections="turned", sweep_at=0.25)
    np.testing.assert_allclose(
        case.pipeline.variables["sweep"].value, np.degrees(skeleton.sweep), rtol=1e-12
    )


@pytest.mark.parametrize(
    ("kind", "need"),
    [
        ("cage", "a cage goes around a surface"),
        ("wing-cage", "a cage goes around a surface"),
        ("wing-lattice", "a wing's own box is fitted to a surface"),
        ("wing-skeleton", "a wing skeleton needs a surface of triangles"),
        ("body-skeleton", "a body skeleton needs a surface of triangles"),
    ],
)
def test_a_file_without_triangles_is_sent_to_convert(kind, need, tmp_path, capsys):
    np.savetxt(tmp_path / "foil.dat", [[1, 0], [0.5, 0.1], [0, 0], [0.5, -0.1], [1, 0]])
    words = ["parameterise", str(tmp_path / "foil.dat"), "--kind", kind]
    assert main([*words, "-o", str(tmp_path / "case.toml")]) == 1
    told = capsys.readouterr().err
    assert f"{need}, got a Section; write its boundary or stitched patches with moldline" in told
    assert [file.name for file in tmp_path.iterdir()] == ["foil.dat"]


def test_a_body_gets_a_skeleton_or_rings(tmp_path, capsys):
    ml.write(tmp_path / "body.stl", fuselage(48, 81))
    (tmp_path / "in").mkdir()
    body = tmp_path / "in/body.stl"
    shutil.move(tmp_path / "body.stl", body)
    case, _ = made(tmp_path, capsys, "--kind", "body-skeleton", source=body)
    assert "radius" in case.pipeline.variables
    case, _ = made(tmp_path, capsys, "--kind", "body-cage", "--overwrite", source=body)
    assert "move_x" in case.pipeline.variables


def test_an_airfoil_gets_thickness_and_camber(tmp_path, capsys):
    x = (1 + np.cos(np.linspace(0, 2 * np.pi, 60))) / 2
    foil = np.stack([x, 0.1 * np.sin(np.linspace(0, 2 * np.pi, 60))], axis=1)
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in/foil.dat", foil, header="foil", comments="")
    case, told = made(tmp_path, capsys, "--kind", "lattice", source=tmp_path / "in/foil.dat")
    assert set(case.pipeline.variables) == {"thickness", "camber"}
    assert "10 stations along the chord" in told


def test_what_is_there_is_not_written_over(tmp_path, capsys):
    (tmp_path / "case.toml").write_text("mine")
    words = ["parameterise", str(WING), "--kind", "lattice", "-o", str(tmp_path / "case.toml")]
    assert main(words) == 1
    assert "is there already; choose another name, or --overwrite" in capsys.readouterr().err
    assert (tmp_path / "case.toml").read_text() == "mine"
    assert main([*words, "--overwrite"]) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kind", "cage", "--shape", "3x3x3"], "cage takes no shape"),
        (["--kind", "body-skeleton", "--sections", "turned"], "body-skeleton takes no sections"),
        (["--kind", "wing-skeleton", "--sections", "turned"], "give sweep_at and twist_at alike"),
        (["--kind", "lattice", "--shape", "3,3,3"], "expected three counts, such as 7x4x2"),
        (["--kind", "lattice", "--region", "1,2,3"], "expected six numbers, x,y,z,x,y,z"),
        (["--kind", "cage", "--faces", "3"], "20 faces or more"),
        (["--kind", "wing-skeleton", "--stations", "500,600"], "no section at y = 500"),
    ],
)
def test_a_mistake_is_told_and_writes_nothing(options, message, tmp_path, capsys):
    words = ["parameterise", str(WING), *options, "-o", str(tmp_path / "case.toml")]
    assert main(words) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
