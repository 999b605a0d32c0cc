"""Cases that make their geometry, as a user runs them."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.errors import CaseError

ROOT = Path(__file__).parent.parent.parent
WING = ROOT / "examples/wing.toml"
CROSS = """
moldline = 1
[variable.height]
value = 0.0
bounds = [-0.5, 0.5]
unit = "m"
[variable.bend]
size = 3
bounds = [-1.0, 1.0]
unit = "m"
[[stage]]
modeler = "body"
to = "body"
ROOM
[[stage]]
modeler = "wing"
to = "wing"
span = 3.0
chord = 1.0
airfoil = "flat.dat"
origin = [1.5, 0.0, 0.0]
chordwise = 17
spanwise = 12
[[stage.link]]
variable = "height"
link = "named"
parameter = "origin"
index = [2]
absolute = true
[[stage]]
deformer = "lattice"
on = "wing"
shape = [1, 3, 1]
[[stage.link]]
variable = "bend"
link = "each"
axis = "z"
[[stage]]
modeler = "union"
name = "joined"
of = ["wing", "body"]
to = "all"
[measure.volume]
measure = "volume"
""".replace("ROOM", "length = 4.0\nradius = [0.2, 0.4, 0.2]\nalong = 24\naround = 24")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A case whose wing has an airfoil from a file."""
    place = tmp_path_factory.mktemp("build")
    ml.write(place / "flat.dat", ml.airfoil("naca 0010").geometry)
    (place / "cross.toml").write_text(CROSS)
    return place


def test_build_writes_what_the_values_make(tmp_path, capsys):
    target = tmp_path / "wing.tri"
    picture = tmp_path / "wing.png"
    asked = ["--set", "sweep=30,25", "-o", str(target), "--picture", str(picture), "--json"]
    assert main(["build", str(WING), *asked]) == 0
    report = json.loads(capsys.readouterr().out)
    wing = ml.read(target)
    assert report["points"] == len(wing.points) and report["unions"] == {}
    sweep = np.degrees(ml.planform(wing, [0.0, 6.5, 16.0]).sweep)
    np.testing.assert_allclose(
        sweep, [30, 25], atol=0.01
    )  # a turned nose is not its foremost point
    assert picture.stat().st_size > 10_000


def test_a_union_is_told_with_its_figures(folder, capsys):
    target = folder / "all.tri"
    assert main(["build", str(folder / "cross.toml"), "-o", str(target)]) == 0
    told = capsys.readouterr().out
    assert "wetted surface of" in told and "watertight" in told and "anew" not in told
    assert (
        main(["build", str(folder / "cross.toml"), "--set", "height=0.2", "-o", str(target)]) == 0
    )
    assert "all was made anew: parts cross in other places" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ('{"sweep": "abc"}', "sweep must be a number or a list of them, got 'abc'"),
        ('{"sweep": null}', "sweep must be a number or a list of them, got None"),
        ('{"sweep": [[1], [2, 3]]}', "sweep must be a number or a list of them"),
        ('{"sweep": 30}', "'sweep' has 2 numbers, got [30]"),
    ],
)
def test_values_of_a_file_that_are_no_numbers_are_told(tmp_path, capsys, said, message):
    values = tmp_path / "values.json"
    values.write_text(said)
    asked = ["--values", str(values), "--set", "sweep[1]=25", "-o", str(tmp_path / "wing.tri")]
    assert main(["build", str(WING), *asked]) == 1
    assert message in capsys.readouterr().err


def test_values_that_a_modeler_would_refuse_are_told(tmp_path, capsys):
    case = tmp_path / "wing.toml"
    case.write_text(WING.read_text().replace("bounds = [0.0, 45.0]\n", ""))
    assert main(["build", str(case), "--set", "sweep=95,0", "-o", str(tmp_path / "wing.tri")]) == 1
    assert "wing.toml: stage 'wing': sweep must lie within 80 degrees" in capsys.readouterr().err


def test_a_part_is_written_alone(folder, capsys):
    target = folder / "wing.stl"
    case = str(folder / "cross.toml")
    assert main(["build", case, "--geometry", "wing", "-o", str(target)]) == 0
    assert "wing.stl: wing, " in capsys.readouterr().out
    assert main(["build", case, "--geometry", "tail", "-o", str(target)]) == 1
    assert "nothing named 'tail'; there is: body, wing, all" in capsys.readouterr().err


def test_every_command_runs_on_a_case_that_makes_its_geometry(folder, capsys):
    case, values = str(folder / "cross.toml"), ["--set", "bend=0,0.02,0.05"]
    assert main(["deform", case, *values, "-o", str(folder / "new.tri")]) == 0
    assert main(["sensitivity", case, *values, "-o", str(folder / "new.vtp")]) == 0
    assert main(["measure", case, *values]) == 0
    assert "volume" in capsys.readouterr().out
    assert main(["check", case, *values]) == 0
    assert "derivatives  exact: order 2.0" in capsys.readouterr().out
    for extra in ([], ["--sensitivity", "bend[1]"], ["--cuts", "0.5,1.5"], ["--reflections"]):
        assert main(["plot", case, *values, *extra, "-o", str(folder / "new.png")]) == 0
    capsys.readouterr()
    assert main(["info", case, "-o", str(folder / "flow.png")]) == 0
    assert "joined of wing, body" in capsys.readouterr().out


def test_a_saved_case_finds_its_airfoil_from_elsewhere(folder, tmp_path):
    case = ml.load(folder / "cross.toml")
    case.save(tmp_path / "copy.toml", {"height": 0.1})
    copy = ml.load(tmp_path / "copy.toml")
    np.testing.assert_array_equal(copy.pipeline().points, case.pipeline({"height": 0.1}).points)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('to = "wing"', "", "stage.1.to: it must be there"),
        ("span = 3.0", "spam = 3.0", "stage.1.spam: there is no such key, got 3.0"),
        ('of = ["wing", "body"]', 'of = ["wing"]', "stage 'joined' takes 2 or more geometries"),
        ('of = ["wing", "body"]', 'of = ["wing", "tail"]', "stage.3: nothing named 'tail'"),
        ('on = "wing"', 'on = "fin"', "stage.2.on: got 'fin', expected one of body, wing"),
        ('parameter = "origin"', 'parameter = "place"', "no parameter 'place'; there is: span"),
        ('modeler = "wing"', 'modeler = "wings"', "no modelers named 'wings'; installed: blender"),
        ('airfoil = "flat.dat"', 'airfoil = "lost.dat"', "stage.1: .*lost.dat"),
        ('link = "each"\naxis = "z"', 'link = "named"\nparameter = "x"', "'named' is for a"),
        ("index = [2]", "index = [2]\nscale = -1.0", "stage.1.link.0.scale: got -1.0, expected 1"),
        ("origin = [1.5, 0.0, 0.0]", "origin = [1.5, 9.0, 0.0]", "stage 'joined': .*cross"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(folder, tmp_path, old, new, message):
    shutil.copy(folder / "flat.dat", tmp_path)
    assert old in CROSS
    (tmp_path / "case.toml").write_text(CROSS.replace(old, new))
    with pytest.raises(CaseError, match=f"(?s)case.toml: .*{message}"):
        ml.load(tmp_path / "case.toml")


def test_half_a_model_is_sound_and_its_components_have_the_geometries_names(capsys):
    case = str(ROOT / "examples/wing_body.toml")
    assert main(["check", case]) == 0
    told = capsys.readouterr().out
    assert "half a model: closed at y = 0 for what follows" in told
    assert "components: wing, wing tip, fuselage, symmetry plane" in told


def test_the_mesh_that_is_checked_is_that_of_the_values(capsys):
    assert main(["check", str(WING), "--set", "thickness=8,8,8", "--json"]) == 0
    thin = json.loads(capsys.readouterr().out)["mesh"]["volume"]
    assert main(["check", str(WING), "--json"]) == 0
    assert thin < 0.7 * json.loads(capsys.readouterr().out)["mesh"]["volume"]


def test_deform_tells_how_far_the_parts_of_a_union_move(folder, capsys):
    target = str(folder / "new.tri")
    assert main(["deform", str(folder / "cross.toml"), "--set", "height=0.3", "-o", target]) == 0
    assert "moved by up to 0.3," in capsys.readouterr().out


def test_a_case_that_makes_its_geometry_is_not_streamed(folder, capsys):
    assert main(["deform", str(folder / "cross.toml"), "--stream", "-o", "x.tri"]) == 1
    assert "a case that makes its geometry has no file to stream" in capsys.readouterr().err
