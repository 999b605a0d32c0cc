"""STEP files as geometries: our own, and those with names, colours and units."""

from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.errors import FileError
from moldline.mesh import Grid, quality
from moldline.mesh.health import health
from moldline.mesh.io import step
from moldline.modelers.cad import Cad


@pytest.fixture(scope="module")
def occ():
    pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    import OCP.OCP

    return OCP.OCP


def ball():
    """A sphere as one closed patch with poles."""
    turn, up = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, np.pi, 21), indexing="ij")
    points = np.stack([np.sin(up) * np.cos(turn), np.sin(up) * np.sin(turn), np.cos(up)], axis=-1)
    return Grid(points.transpose(1, 0, 2).reshape(-1, 3), ((41, 21, 1),))


def halves():
    """Two patches that share an edge, named."""
    x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 15))
    first = np.stack([x, y, 0.1 * np.sin(3 * x)], axis=-1).reshape(-1, 3)
    second = np.stack([1 + x, y, 0.1 * np.sin(3 * (1 + x))], axis=-1).reshape(-1, 3)
    return Grid(np.concatenate([first, second]), ((20, 15, 1), (20, 15, 1)))


@pytest.mark.parametrize("unit", ["m", "in"])
def test_our_own_sphere_is_read_closed_and_in_metres(occ, tmp_path, unit):
    step.write(tmp_path / "ball.step", ball(), unit, 1e-5)
    cad = Cad(file=tmp_path / "ball.step", sag=1e-3 * step.UNITS[unit][1] / 1e3)
    radius = step.UNITS[unit][1] / 1e3
    points = np.asarray(cad.geometry.points)
    assert cad.size == 0 and cad.values.shape == (0,)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), radius, rtol=2e-5)
    assert not health(cad.geometry).sentences()
    volume = float(quality.signed_volume(cad.geometry))
    np.testing.assert_allclose(volume, 4 / 3 * np.pi * radius**3, rtol=6e-3)


def test_patches_that_share_an_edge_are_joined_and_named(occ, tmp_path):
    step.write(tmp_path / "halves.step", halves(), "m", 1e-5, {"lid": [2]})
    cad = Cad(file=tmp_path / "halves.step", max_edge=0.2)
    assert cad.geometry.components == ("1", "lid 2")
    assert cad.open_edges == 6
    both = np.intersect1d(*(cad.geometry.component(n) for n in cad.geometry.components))
    np.testing.assert_allclose(np.asarray(cad.geometry.points)[both, 0], 1.0, atol=1e-9)
    found = health(cad.geometry)
    assert len(found.holes) == 1 and len(both) > 4


def test_colours_and_solids_are_components(occ, tmp_path):
    box = occ.BRepPrimAPI.BRepPrimAPI_MakeBox(1000.0, 2000.0, 3000.0).Shape()
    document = occ.TDocStd.TDocStd_Document(occ.TCollection.TCollection_ExtendedString("t"))
    occ.XCAFApp.XCAFApp_Application.GetApplication_s().InitDocument(document)
    tools = occ.XCAFDoc.XCAFDoc_DocumentTool
    tools.ShapeTool_s(document.Main()).AddShape(box, False)
    face = occ.TopExp.TopExp_Explorer(box, occ.TopAbs.TopAbs_ShapeEnum.TopAbs_FACE).Current()
    kind = occ.Quantity.Quantity_TypeOfColor.Quantity_TOC_RGB
    red = occ.Quantity.Quantity_Color(1.0, 0.0, 0.0, kind)
    surface = occ.XCAFDoc.XCAFDoc_ColorType.XCAFDoc_ColorSurf
    tools.ColorTool_s(document.Main()).SetColor(face, red, surface)
    writer = occ.STEPCAFControl.STEPCAFControl_Writer()
    path = tmp_path / "box.step"
    writer.Transfer(document, occ.STEPControl.STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    cad = Cad(file=path, components="colours")
    assert cad.geometry.components == ("#ff0000", "no colour")
    np.testing.assert_allclose(float(quality.signed_volume(cad.geometry)), 6.0, rtol=1e-14)
    assert Cad(file=path).geometry.components == ("solid 1",)
    assert Cad(file=path, components="one", groups={"lid": [1]}).geometry.components == (
        "lid",
        "cad",
    )


def test_a_fixed_shape_is_a_stage_without_parameters(occ, tmp_path):
    step.write(tmp_path / "ball.step", ball(), "m", 1e-4)
    cad = Cad.build(tmp_path, file=Path("ball.step"), sag=0.01)
    case = ml.Pipeline({}, [ml.Construction(cad, to="ball")])
    np.testing.assert_array_equal(case().points, cad.geometry.points)


def test_what_is_no_step_file_is_told(occ, tmp_path, capfd):
    (tmp_path / "a.step").write_text("solid\n")
    with pytest.raises(FileError, match=r"a\.step: OpenCascade cannot read it as STEP"):
        Cad(file=tmp_path / "a.step")
    capfd.readouterr()


def test_reading_prints_nothing(occ, tmp_path, capfd):
    step.write(tmp_path / "ball.step", ball(), "m", 1e-4)
    Cad(file=tmp_path / "ball.step", sag=0.01)
    assert capfd.readouterr() == ("", "")
