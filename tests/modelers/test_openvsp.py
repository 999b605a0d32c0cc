"""OpenVSP through a stand-in for its Python module, which behaves as its documentation says."""

import sys
import types
from pathlib import Path

import numpy as np
import pytest

from moldline.case.options import model_of
from moldline.errors import FileError, GeometryError, ParameterError
from moldline.mesh import Surface
from moldline.mesh.io import tri
from moldline.modelers.openvsp import OpenVsp
from moldline.numerics.taylor import remainder

WHERE = {"span": "MainWing/WingGeom/TotalSpan"}


@pytest.fixture
def vsp(monkeypatch):
    """A model with one geom whose TotalSpan stretches a tetrahedron, and whose Tess_U refines."""
    fake = types.ModuleType("openvsp")
    fake.SET_ALL, fake.EXPORT_CART3D, fake.calls, fake.values = 0, 10, [], {}
    fake.ClearVSPModel = lambda: fake.values.clear()
    fake.ReadVSPFile = lambda path: fake.values.update(span=1.0, tess=1.0)
    fake.FindGeomsWithName = lambda name: ["ABCDE"] if name == "MainWing" else []
    known = {("TotalSpan", "WingGeom"): "span", ("Tess_U", "Shape"): "tess"}
    fake.FindParm = lambda geom, parm, group: known.get((parm, group), "")
    fake.SetParmVal = lambda parm, value: fake.values.update({parm: value})
    fake.Update = lambda: fake.calls.append(dict(fake.values))

    def export(path, kept, kind):
        assert (kept, kind) == (fake.SET_ALL, fake.EXPORT_CART3D)
        points = np.array([[0, 0, 0], [1, 0, 0], [0, fake.values["span"], 0], [0, 0, 1.0]])
        faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        faces = faces[: int(3 + fake.values["tess"])]
        lines = [f"{len(points)} {len(faces)}"]
        lines += [" ".join(f"{x:16.10f}" for x in row) for row in points]
        lines += [" ".join(map(str, row + 1)) for row in faces] + ["1"] * len(faces)
        Path(path).write_text("\n".join(lines) + "\n")
        return "MESH"

    fake.ExportFile = export
    monkeypatch.setitem(sys.modules, "openvsp", fake)
    return fake


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "plane.vsp3"
    path.write_text("<Vsp_Geometry/>")
    return path


def test_parameters_are_set_and_the_surface_is_read_back(vsp, model):
    shape = OpenVsp(model, {"span": 2.0}, WHERE, unit="ft")
    assert isinstance(shape.geometry, Surface)
    np.testing.assert_allclose(np.asarray(shape.geometry.points)[2], [0, 2 * 0.3048, 0])
    np.testing.assert_allclose(shape(np.array([3.0]))[2], [0, 3 * 0.3048, 0])
    assert vsp.calls[-1]["span"] == 3.0


def test_derivatives_are_right_to_what_the_file_holds(vsp, model):
    shape = OpenVsp(model, {"span": 2.0}, WHERE, steps={"span": 0.1})
    jacobian = shape.differences().jacobian[..., 0]
    np.testing.assert_allclose(jacobian[2], [0, 1, 0], atol=1e-8)
    assert remainder(shape, shape.values, np.array([0.5]), accuracy=1e-8).is_linear


def test_a_name_may_say_where_it_is(vsp, model):
    shape = OpenVsp.build(
        model.parent, file=Path(model.name), parameters={"MainWing/WingGeom/TotalSpan": 2.0}
    )
    assert list(shape.parameters) == ["MainWing/WingGeom/TotalSpan"]
    model_of("openvsp", OpenVsp.options()).model_validate(
        {"file": "plane.vsp3", "parameters": {"span": 2.0}, "where": WHERE}
    )


@pytest.mark.parametrize(
    ("parameters", "where", "error", "message"),
    [
        ({"span": 1.0}, {}, ParameterError, "'span' is not said as geom/group/parm"),
        ({"span": 1.0}, {"x": "a/b/c"}, ParameterError, "where names x, no parameters"),
        ({"span": 1.0}, {"span": "Tail/WingGeom/TotalSpan"}, ParameterError, "0 geoms are named"),
        ({"span": 1.0}, {"span": "MainWing/XForm/TotalSpan"}, ParameterError, "has no parm"),
    ],
)
def test_what_the_model_lacks_is_told(vsp, model, parameters, where, error, message):
    with pytest.raises(error, match=message):
        OpenVsp(model, parameters, where)


def test_other_triangles_are_refused(vsp, model):
    shape = OpenVsp(model, {"MainWing/Shape/Tess_U": 1.0})
    with pytest.raises(GeometryError, match=r"other triangles \(3\) than at first \(4\)"):
        shape(np.array([0.0]))


def test_a_missing_file_or_module_is_told(vsp, model, monkeypatch):
    with pytest.raises(FileError, match="there is no such file"):
        OpenVsp(model.with_name("other.vsp3"))
    monkeypatch.setitem(sys.modules, "openvsp", None)
    with pytest.raises(ParameterError, match="OpenVSP's Python module is not installed"):
        OpenVsp(model, {"span": 2.0}, WHERE)


def test_the_stand_in_writes_what_the_reader_reads(vsp, tmp_path):
    vsp.ReadVSPFile("")
    vsp.ExportFile(str(tmp_path / "a.tri"), 0, 10)
    assert len(tri.read(tmp_path / "a.tri").faces) == 4
