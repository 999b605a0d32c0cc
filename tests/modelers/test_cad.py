"""CAD shapes: closed, right in size, and with derivatives at fixed owners."""

import logging
import runpy
import sys
from pathlib import Path

import cad_scripts as scripts
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline.case.options import model_of
from moldline.errors import FileError, GeometryError, ParameterError
from moldline.mesh import quality
from moldline.mesh.health import health
from moldline.modelers.cad import Cad
from moldline.numerics.taylor import remainder

WING = Path(__file__).parents[2] / "examples/cad/wing.py"
NUMBERS = {
    "span": 3.0,
    "chord": 1.0,
    "taper": 0.5,
    "sweep": 20.0,
    "twist": -3.0,
    "thickness": 0.12,
}


@pytest.fixture(scope="module")
def occ():
    pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    import OCP.OCP

    return OCP.OCP


@pytest.fixture
def script(occ, tmp_path):
    def written(text):
        path = tmp_path / "part.py"
        path.write_text(scripts.HEAD + text)
        return path

    return written


@pytest.fixture(scope="module")
def wing(occ):
    return Cad(script=WING, parameters=NUMBERS, max_edge=0.2, sag=2e-3)


def sizes(cad):
    return np.array([float(of(cad.geometry)) for of in (quality.signed_volume, quality.area)])


SHAPES = {
    "cylinder": (scripts.CYLINDER, {"radius": 1.0, "height": 2.0}, [2.0, 6.0]),
    "sphere": (scripts.SPHERE, {"radius": 1.0}, [4 / 3, 4.0]),
    "cone": (scripts.CONE, {"radius": 1.0, "height": 2.0}, [2 / 3, 1 + 5**0.5]),
    "torus": (scripts.TORUS, {"radius": 2.0, "tube": 0.5}, [np.pi, 4 * np.pi]),
    "box": (scripts.BOX, {"edges": [1.0, 2.0, 3.0]}, [6 / np.pi, 22 / np.pi]),
    "plate": (scripts.PLATE, {"x": 1.5, "radius": 0.5}, [3.875 / np.pi, 22 / np.pi]),
}
"""A script, its parameters, and volume and area by pi; of the plate π is in the volume."""
SHAPES["plate"][2][:] = [
    (4 - np.pi * 0.25 * 0.5) / np.pi,
    (22 - 2 * np.pi * 0.25 + 2 * np.pi * 0.5 * 0.5) / np.pi,
]


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_closed_and_its_size_converges_to_the_closed_form(script, name):
    text, parameters, exact = SHAPES[name]
    path, exact = script(text), np.pi * np.array(exact)
    errors = []
    for sag in (0.02, 0.005):
        cad = Cad(script=path, parameters=parameters, max_edge=40 * sag, sag=sag, angle=1.0)
        found = health(cad.geometry)
        assert cad.open_edges == 0
        assert not found.sentences()
        pairs = np.asarray(cad.geometry.points)[np.asarray(cad.geometry.faces)]
        lengths = np.linalg.norm(pairs - np.roll(pairs, 1, axis=1), axis=2)
        assert lengths.max() <= 40 * sag * (1 + 1e-9)
        errors.append(np.abs(sizes(cad) / exact - 1))
    if name == "box":
        assert np.max(errors) < 1e-14
    else:
        assert np.all(errors[1] < 0.4 * errors[0])
        assert np.all(errors[1] < 4 * 0.005 / 3 / 0.5)  # area within chords of the smallest circle


@pytest.mark.parametrize("sag", [3e-3, 3e-4])
def test_points_are_on_the_shape_and_triangles_within_the_sag(script, sag):
    cad = Cad(script=script(scripts.SPHERE), parameters={"radius": 2.0}, sag=sag, max_edge=1.0)
    points, faces = (np.asarray(a) for a in (cad.geometry.points, cad.geometry.faces))
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 2.0, rtol=1e-14)
    middles = (points[faces] + np.roll(points[faces], 1, axis=1)) / 2
    gaps = 2.0 - np.linalg.norm(middles, axis=2)
    # each side of a cell keeps the sag, so its diagonal has that of both
    assert gaps.max() < 2.2 * sag


def test_angle_limits_the_turn_where_sag_does_not(script):
    parameters = {"radius": 1.0, "height": 2.0}
    path = script(scripts.CYLINDER)
    coarse, fine = (
        Cad(script=path, parameters=parameters, sag=0.5, max_edge=9.0, angle=a, degrees=True)
        for a in (30, 10)
    )
    rims = [np.unique(np.round(c.geometry.points[:, :2], 9), axis=0) for c in (coarse, fine)]
    assert [len(rim) for rim in rims] == [12, 36]


def test_a_lofted_wing_has_the_size_of_its_sections(wing):
    assert not health(wing.geometry).sentences()
    fine = Cad(script=WING, parameters=NUMBERS, max_edge=0.2, sag=1e-4)
    x = (1 - np.cos(np.linspace(0, np.pi, 20001))) / 2
    half = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    area = 2 * np.trapezoid(half, x)
    exact = area * 3.0 * (1 + 0.5 + 0.25) / 3
    # chords cut off two thirds of the sag around the sections
    np.testing.assert_allclose(sizes(fine)[0], exact, rtol=2 / 3 * 1e-4 * 2 / 0.06)


@pytest.mark.parametrize("name", NUMBERS)
def test_derivatives_of_a_loft_are_right(wing, name):
    along = np.zeros(wing.size)
    along[wing.parameters[name]] = 0.05 * max(1.0, abs(NUMBERS[name]))
    assert remainder(wing, wing.values, along, accuracy=1e-9).is_right
    found = wing.differences()
    assert found.jacobian.shape == (len(wing.geometry.points), 3, 6)
    assert found.errors.max() < 1e-5


def test_derivatives_of_a_cylinder_are_those_of_its_formula(script):
    cad = Cad(script=script(scripts.CYLINDER), parameters={"radius": 2.0, "height": 3.0})
    points, jacobian = np.asarray(cad.geometry.points), cad.differences().jacobian
    rim = np.hypot(points[:, 0], points[:, 1]) > 1.999
    expected = points[rim] * [0.5, 0.5, 0.0]
    np.testing.assert_allclose(jacobian[rim, :, 0], expected, atol=1e-10)
    np.testing.assert_allclose(jacobian[..., 1], points * [0.0, 0.0, 1 / 3], atol=1e-10)
    # inside the caps points follow the rim in proportion
    np.testing.assert_allclose(jacobian[..., 0], points * [0.5, 0.5, 0.0], atol=1e-10)


def test_a_hole_moves_through_its_plate_smoothly_and_folds_nothing(script):
    cad = Cad(script=script(scripts.PLATE), parameters={"x": 1.5, "radius": 0.5}, max_edge=0.3)
    for along in ([0.2, 0.0], [0.0, 0.1]):
        assert remainder(cad, cad.values, np.array(along), accuracy=1e-8).is_right
    moved = cad.geometry.moved(np.asarray(cad(np.array([1.9, 0.6]))))
    assert not health(moved).sentences()
    exact = 4.0 - np.pi * 0.36 * 0.5
    np.testing.assert_allclose(float(quality.signed_volume(moved)), exact, rtol=3e-3)


def test_where_two_parts_cross_points_keep_their_share_of_the_line(script):
    """Booleans find the line of crossing to about 1e-6, and number its places anew each time."""
    parameters = {"radius": 1.0, "bore": 0.5, "height": 2.0}
    cad = Cad(script=script(scripts.BRANCH), parameters=parameters, max_edge=0.4, sag=0.01)
    assert not health(cad.geometry).sentences()
    found = cad.differences()
    assert found.errors.max() < 2e-3
    for along in np.eye(3) * 0.05:
        assert remainder(cad, cad.values, along, accuracy=1e-4).is_right
    points, jacobian = np.asarray(cad.geometry.points), found.jacobian
    radius = np.hypot(points[:, 1], points[:, 2])
    crossing = (np.abs(radius - 1) < 1e-6) & (np.abs(np.hypot(*points[:, :2].T) - 0.5) < 1e-6)
    assert crossing.sum() > 20
    outward = np.sum(jacobian[crossing, 1:, 0] * points[crossing, 1:], axis=1)
    np.testing.assert_allclose(outward, 1.0, atol=1e-4)


def test_triangles_that_fold_far_from_the_first_shape_are_warned_of(script, caplog):
    cad = Cad(script=script(scripts.PLATE), parameters={"x": 1.5, "radius": 0.5}, max_edge=0.3)
    with caplog.at_level(logging.WARNING):
        cad(np.array([1.7, 0.5]))
        assert not caplog.text
        cad(np.array([2.8, 0.7]))
    assert "triangles are folded over" in caplog.text


def test_gradients_work_in_reverse_and_compiled(wing):
    faces = np.asarray(wing.geometry.faces)

    def volume(values):
        a, b, c = (wing(values)[faces[:, k]] for k in range(3))
        return jnp.sum(a * jnp.cross(b, c)) / 6

    values = jnp.asarray(wing.values)
    plain, compiled = jax.grad(volume)(values), jax.jit(jax.grad(volume))(values)
    np.testing.assert_allclose(compiled, plain, rtol=1e-14)
    forward = jax.jacfwd(volume)(values)
    np.testing.assert_allclose(forward, plain, rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(plain[0], volume(values) / 3.0, rtol=1e-9)  # span
    np.testing.assert_allclose(plain[1], 2 * volume(values), rtol=1e-9)  # chord


def test_a_pipeline_turns_its_parameters(wing):
    sweep = ml.variable("sweep", value=20.0, bounds=(0, 40))
    link = ml.links.named(wing, "sweep", absolute=True)
    case = ml.Pipeline({}, [ml.Construction(wing, {sweep: link}, to="wing")])
    values = dict(NUMBERS, sweep=25.0)
    expected = wing(np.array(list(values.values())))
    np.testing.assert_allclose(case({"sweep": 25.0}).points, expected, atol=1e-15)
    moved = case.sensitivity({"sweep": 25.0}, "sweep")[..., 0]
    tip = np.asarray(expected)[:, 1] == 3.0
    rate = 3.0 * np.radians(1) / np.cos(np.radians(25)) ** 2
    np.testing.assert_allclose(moved[tip], np.tile([rate, 0, 0], (tip.sum(), 1)), atol=1e-9)


def test_a_case_file_can_say_all_of_it(occ):
    said = {
        "script": "wing.py",
        "parameters": NUMBERS,
        "steps": {"span": 1e-2},
        "max_edge": 0.5,
        "sag": 0.01,
        "angle": 20,
        "degrees": True,
        "components": "faces",
        "groups": {"skin": [1]},
    }
    model_of("cad", Cad.options()).model_validate(said)
    cad = Cad.build(WING.parent, **said)
    assert cad.geometry.components == ("skin", "face 2", "face 3")
    assert cad.program.steps[0] == 1e-2


def test_named_shapes_are_components(script):
    cad = Cad(script=script(scripts.PAIR), parameters={"x": 3.0})
    assert cad.geometry.components == ("case", "ball")
    ball = np.asarray(cad.geometry.points)[cad.geometry.component("ball")]
    np.testing.assert_allclose(np.linalg.norm(ball - [3, 0, 0], axis=1), 0.5, rtol=1e-14)
    still = cad.geometry.component("case")
    assert not cad.differences().jacobian[still].any()


def test_another_topology_is_told(script):
    cad = Cad(script=script(scripts.PLATE), parameters={"x": 1.5, "radius": 0.5})
    with pytest.raises(GeometryError, match=r"at x = 4\.0, .* the CAD shape has another"):
        cad(np.array([4.0, 0.5]))
    with pytest.raises(GeometryError, match="in place of"):
        cad.bind()(np.array([9.0, 0.5]))


def test_noise_in_a_script_is_warned_of(script, caplog):
    cad = Cad(script=script(scripts.ROUGH), parameters={"radius": 1.0}, steps={"radius": 1e-5})
    with caplog.at_level(logging.WARNING):
        found = cad.differences()
    assert found.errors[0] > 1e-3
    assert "give steps = {radius = ...}" in caplog.text


@pytest.mark.parametrize(
    ("text", "parameters", "error", "message"),
    [
        ("make = 3", {}, FileError, "has no function make"),
        ("import nothing_of_that_name", {}, FileError, "cannot be run: ModuleNotFoundError"),
        ("def make(p): return 3", {}, GeometryError, "must return an OpenCascade shape"),
        (scripts.SPHERE, {}, GeometryError, "make fails at no parameters: KeyError"),
        (scripts.SPHERE, {"radius": -1.0}, GeometryError, "make fails at radius = -1.0"),
        (scripts.SPHERE, {"radius": float("nan")}, ParameterError, "radius must be finite"),
    ],
)
def test_a_bad_script_is_told(script, text, parameters, error, message):
    with pytest.raises(error, match=message):
        Cad(script=script(text), parameters=parameters)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "give a file or a script"),
        ({"script": WING, "file": WING}, "give a file or a script"),
        (
            {"file": Path("a.step"), "parameters": {"x": 1.0}},
            "has no parameters, got x",
        ),
        ({"file": Path("a.step"), "unit": "m"}, "a STEP file states its unit"),
        ({"file": Path("a.step")}, r"a\.step: there is no such file"),
        ({"script": Path("a.py")}, r"a\.py: there is no such file"),
        ({"max_edge": 0.0}, r"max_edge must be above 0 \[m\]"),
        ({"angle": 15.0}, "is it in degrees"),
        ({"components": "colours"}, "no face of the shape has one"),
        ({"groups": {"lid": [4]}}, "group 'lid' names face 4, the shape has faces 1 to 3"),
        ({"steps": {"width": 1.0}}, "steps of width, which are no parameters"),
        ({"steps": {"span": 0.0}}, "the step of span must be above 0"),
    ],
)
def test_bad_options_are_told(occ, options, message):
    plain = {} if {"file", "script"} & options.keys() or not options else {"script": WING}
    plain |= {"parameters": NUMBERS} if plain else {}
    with pytest.raises((ParameterError, FileError), match=message):
        Cad(**plain, **options)


def test_without_opencascade_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP.OCP", None)
    with pytest.raises(ParameterError, match=r"pip install 'moldline\[step\]'"):
        Cad(script=WING, parameters=NUMBERS)


def test_the_case_file_of_the_example_builds(occ, monkeypatch):
    monkeypatch.setattr("moldline.registry.modeler", lambda name: Cad)
    case = ml.load(WING.with_name("wing.toml")).pipeline
    assert case.geometry.components == ("skin", "root", "tip")
    assert not health(case({"sweep": 25.0})).sentences()


def test_the_example_tells_its_numbers(occ):
    numbers = runpy.run_path(str(WING.with_name("show.py")))["main"]()
    assert numbers["points"] == 1942
    assert numbers["volume"] == pytest.approx(0.142347, rel=1e-4)
    assert numbers["error"] < 1e-5
