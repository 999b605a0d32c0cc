"""Every registered measure: built as a case file builds it, with exact derivatives."""

import json

import jax
import numpy as np
import pytest
from measures.simple import naca0012, tapered

import moldline as ml
from moldline import registry
from moldline.case.options import model_of
from moldline.deformers.contract import prove
from moldline.errors import ParameterError

V = [{"vertex": n} for n in (3, 40, 99, 200, 401, 555)]
LEAD, TRAIL = ({"chord": c, "side": "upper", "at": 4.0} for c in (0.0, 1.0))
TOP = {"chord": 0.3, "side": "upper"}
CAP = {"near": [0, 0, 1], "radius": 0.5}

EXAMPLES = {
    "position": [
        ("ball", {"spot": {"near": [0.3, 0.5, 1.0]}, "along": "xz"}),
        ("foil", {"spot": TOP}),
    ],
    "separation": [("ball", {"start": V[0], "end": V[1]}), ("foil", {"start": V[0], "end": TOP})],
    "distance": [("ball", {"start": V[0], "end": V[4]})],
    "thickness": [
        ("wing", {"chord": [0.3, 0.7], "at": [3.0, 7.0], "relative": True}),
        ("foil", {"chord": 0.3}),
        ("ball", {"lower": V[:2], "upper": V[2:4], "along": [1, 0, 0.5]}),
    ],
    "ray_thickness": [
        ("wing", {"chord": [0.3, 0.7], "at": [3.03, 7.17], "relative": True}),
        ("foil", {"chord": [0.313, 0.71], "relative": True}),
        ("ball", {"origins": [[0.0123, 0.1231, 0], [0.31, -0.4, 3]]}),
    ],
    "incidence": [
        ("wing", {"at": 4.0}),
        ("foil", {}),
        ("ball", {"leading": V[0], "trailing": V[4], "ahead": [1, 0.1, 0]}),
    ],
    "opening": [
        ("wing", {"at": 4.0}),
        ("foil", {"length": 0.05}),
        ("ball", {"apex": V[0], "one": V[1], "other": V[4]}),
    ],
    "edge_radius": [("wing", {"at": 4.0}), ("foil", {"length": 0.02}), ("ball", {"spots": V})],
    "chord": [("wing", {"at": 4.0}), ("foil", {})],
    "camber": [("wing", {"chord": 0.4, "at": 4.0}), ("foil", {"chord": 0.7})],
    "volume": [("ball", {}), ("wing", {"component": "1"})],
    "area": [("ball", {}), ("wing", {"component": "1"})],
    "projected_area": [("ball", {"along": [1.0, 0.2, 0.3]}), ("wing", {})],
    "cross_section": [("ball", {"at": [0.0123, 0.31], "along": "x"}), ("wing", {"at": 3.3})],
    "centroid": [("ball", {}), ("ball", {"along": "x", "component": "1"})],
    "enclosed": [
        ("ball", {"points": [[0.5, 0.31, 0.1], [0.02, 0.03, 1.4]]}),
        ("ball", {"box": [[-0.5, -0.41, -0.3], [0.43, 0.52, 0.37]], "samples": 3}),
    ],
    "clearance": [("ball", {"other": "there.obj"}), ("ball", {"other": "into.obj"})],
    "bending_energy": [("ball", {}), ("wing", {"component": "1"})],
    "curvature": [("ball", {}), ("wing", {"component": "1"})],
    "linearity": [
        ("wing", {"at": [0.5, 3.0, 6.0, 9.5]}),
        ("wing", {"at": [0.5, 3.0, 9.5], "chord": 0.75, "side": "lower"}),
        ("foil", {"spots": V[:4]}),
    ],
    "planarity": [("ball", {"spots": V}), ("ball", {"region": CAP, "spots": V[:1]})],
    "circularity": [("ball", {"spots": V}), ("ball", {"region": CAP, "normal": "z"})],
    "monotonicity": [("ball", {"spots": V}), ("foil", {"spots": V[:3], "along": "x"})],
    "symmetry": [("ball", {}), ("foil", {}), ("ball", {"across": "z", "tolerance": 1e-9})],
    "rigid": [("ball", {"region": CAP}), ("foil", {"region": {"near": [0, 0, 0], "radius": 0.1}})],
    "fixed": [
        ("ball", {"region": CAP}),
        ("wing", {"spots": [LEAD, TRAIL], "along": "z"}),
        ("foil", {"spots": V[:2], "region": {"vertices": [7]}}),
    ],
    "opposed": [
        ("wing", {"at": [1.0, 4.0]}),
        ("foil", {}),
        ("ball", {"start": V[0], "end": V[1], "along": "x"}),
    ],
    "section_area": [("foil", {})],
    "controls": [("ball", {"numbers": [0, 2]})],
}
"""Options of each, as a case file has them, and what they are for."""

CASES = [
    pytest.param(name, kind, given, id=f"{name}-{number}-{kind}")
    for name, examples in EXAMPLES.items()
    for number, (kind, given) in enumerate(examples)
]


@pytest.fixture(scope="module")
def shapes(ball):
    return {
        "ball": ball,
        "wing": tapered(25, base=0.004, camber=0.02),
        "foil": naca0012(300, 0.002),
    }


@pytest.fixture(scope="module")
def there(ball, tmp_path_factory):
    """Two other bodies in files: one apart from the ball, one that runs into it."""
    folder = tmp_path_factory.mktemp("there")
    for name, place in (("there", [2.0, 0.7, 0.4]), ("into", [1.3, 0.31, 0.2])):
        ml.write(folder / f"{name}.obj", ball.moved(0.5 * ball.points + np.array(place)))
    return folder


def built(name, geometry, given, folder):
    """As a case file builds it: options through JSON and the model of the signature."""
    cls = registry.measure(name)
    model = model_of(name, cls.options()).model_validate(json.loads(json.dumps(given)))
    options = {key: getattr(model, key) for key in given}
    if name == "clearance":
        options["other"] = folder / options["other"]
    return cls.build(geometry, **options)


def test_every_measure_is_tried():
    ours = {
        n for n in registry.measures() if registry.measure(n).__module__.startswith("moldline.")
    }
    assert ours == set(EXAMPLES)
    assert {registry.measure(name).__name__ for name in ours} <= set(ml.measures.__all__)


@pytest.mark.parametrize(("name", "kind", "given"), CASES)
def test_a_measure_is_built_and_its_derivatives_are_exact(name, kind, given, shapes, there):
    geometry = shapes[kind]
    measure = built(name, geometry, given, there)
    rng = np.random.default_rng(1)
    noise, motion = rng.normal(size=(2, *geometry.points.shape))
    if kind == "foil":
        noise[:, 2], motion[:, 2] = 0, 0
    size = {"ball": 1e-3, "wing": 1e-4, "foil": 1e-5}[kind]
    points = np.asarray(geometry.points) + 5 * size * noise
    controls = np.array([0.1, 0.2, 0.3])
    found = np.asarray(measure.under(points[measure.reads], controls))
    assert found.shape == (measure.size,)
    assert np.all(np.isfinite(found))
    if name == "controls":
        return
    # numbers that are zero at rest are rounded as the coordinates are that they are made of
    shift = 1.0 if measure.is_affine else 0.0
    compiled = jax.jit(lambda p: measure(p) + shift)
    prove(compiled, points, size * motion)
    kept = measure(points) + shift
    np.testing.assert_allclose(compiled(points), kept, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("name", "kind", "given"), CASES)
def test_affine_measures_say_so_and_others_do_not(name, kind, given, shapes, there):
    measure = built(name, shapes[kind], given, there)
    if name == "controls":
        return
    rng = np.random.default_rng(2)
    at = np.asarray(shapes[kind].points)[measure.reads]
    along = 1e-2 * rng.normal(size=at.shape)
    values = [np.asarray(measure.of(at + h * along)) for h in (-1.0, 0.0, 1.0)]
    bend = np.abs(values[0] - 2 * values[1] + values[2]).max()
    change = np.abs(values[2] - values[0]).max()
    assert (bend <= 1e-9 * change + 1e-13) == measure.is_affine


def test_controls_are_read_from_the_deformer_only(shapes):
    measure = ml.measures.Controls([2, 0])
    controls = np.array([0.1, 0.2, 0.3])
    assert np.array_equal(measure.under(np.zeros((0, 3)), controls), [0.3, 0.1])
    with pytest.raises(ParameterError, match="not read from points"):
        measure(shapes["ball"].points)
    with pytest.raises(ParameterError, match="control 2 is not there; the deformer has 2"):
        measure.under(np.zeros((0, 3)), controls[:2])
    with pytest.raises(ParameterError, match="numbers from 0"):
        ml.measures.Controls([-1])
    with pytest.raises(ParameterError, match="numbers from 0"):
        ml.measures.Controls([])


def test_an_unknown_measure_is_told_with_what_there_is():
    with pytest.raises(ParameterError, match="no measures named 'volum'; installed: area, "):
        registry.measure("volum")


WHOLE = ["volume", "area", "projected_area", "centroid", "bending_energy", "curvature"]


@pytest.mark.parametrize("name", WHOLE)
def test_what_reads_faces_needs_a_surface_with_the_component(name, shapes):
    with pytest.raises(ParameterError, match="needs a surface of triangles, got a section"):
        registry.measure(name).build(shapes["foil"])
    with pytest.raises(ParameterError, match="needs a surface of triangles, got a cloud"):
        registry.measure(name).build(ml.Cloud(shapes["ball"].points))
    with pytest.raises(ParameterError, match="no component named 'fin'; the surface has: 1"):
        registry.measure(name).build(shapes["ball"], component="fin")


WRONG = {
    "position": [
        ({"spot": {}}, "a place is one of"),
        ({"spot": V[0], "along": "w"}, "x, y and z"),
        ({"spot": {"vertex": 10**6}}, "is not there"),
    ],
    "separation": [
        ({"start": V[0], "end": {}}, "a place is one of"),
        ({"start": V[0], "end": V[1], "along": ""}, "x, y and z"),
        ({"start": {"near": (9e9, 0, 0)}, "end": V[0]}, "nothing is near"),
    ],
    "distance": [
        ({"start": V[0], "end": {}}, "a place is one of"),
        ({"start": {"vertex": -1}, "end": V[0]}, "not there"),
        ({"start": {"chord": 0.1}, "end": V[0]}, "needs its side"),
    ],
    "thickness": [
        ({}, "by lower and upper spots, or by chord and at"),
        ({"chord": 0.3}, "say at which y"),
        ({"lower": V[:1], "upper": V[:2]}, "as many upper as lower"),
        ({"lower": V[:1], "upper": V[:1], "relative": True}, "by lower"),
    ],
    "ray_thickness": [
        ({}, "by origins, or by chord and at"),
        ({"chord": 1.5, "at": 3.0}, "lies in 0 to 1"),
        ({"origins": [(0.0, 0.0, 0.0)], "relative": True}, "by origins"),
    ],
    "incidence": [
        ({"leading": V[0]}, "needs leading and trailing"),
        ({}, "say at which y"),
        ({"at": 50.0}, "no chord at y = 50"),
    ],
    "opening": [
        ({"apex": V[0]}, "needs apex, one and other"),
        ({"at": 3.0, "length": 2.0}, "between 0 and 1"),
        ({}, "say at which y"),
    ],
    "edge_radius": [
        ({"spots": V[:2]}, "three spots or more"),
        ({}, "say at which y"),
        ({"at": 3.0, "length": 2.0}, "lies in 0 to 1"),
    ],
    "chord": [
        ({}, "a chord of a wing needs"),
        ({"at": -3.0}, "no chord at y = -3"),
        ({"at": 3.0, "component": "fin"}, "no component named"),
    ],
    "camber": [
        ({}, "a camber of a wing needs"),
        ({"at": 3.0, "chord": -0.1}, "lies in 0 to 1"),
        ({"at": 33.0}, "no chord at y = 33"),
    ],
    "projected_area": [
        ({"along": "xy"}, "one direction"),
        ({"along": (0.0, 0.0, 0.0)}, "above zero"),
        ({"component": ""}, "no component"),
    ],
    "cross_section": [
        ({"at": 1.0, "along": "xy"}, "one direction"),
        ({"at": 1.0, "component": "fin"}, "no component"),
        ({"at": 1.0, "along": ""}, "one direction"),
    ],
    "enclosed": [
        ({}, "by points, or by a box"),
        ({"box": [(0.0, 0.0, 0.0)]}, "two opposite corners, or eight, got 1"),
        ({"box": [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)], "samples": 1}, "two samples"),
        ({"points": []}, "three coordinates each"),
    ],
    "linearity": [
        ({}, "by spots, or by stations"),
        ({"spots": V[:2]}, "three spots or more"),
        ({"spots": [V[0], V[1], V[0]]}, "in one place"),
    ],
    "planarity": [
        ({}, "needs spots, or a region"),
        ({"spots": V[:3]}, "four spots or more"),
        ({"region": {"vertices": [1, 2]}}, "four spots or more"),
    ],
    "circularity": [
        ({}, "needs spots, or a region"),
        ({"spots": V[:2]}, "three spots or more"),
        ({"spots": V, "normal": "zz"}, "one direction"),
    ],
    "monotonicity": [
        ({"spots": V[:1]}, "two spots or more"),
        ({"spots": V, "along": "xz"}, "one direction"),
        ({"spots": [{}, {}]}, "a place is one of"),
    ],
    "symmetry": [
        ({"tolerance": 1e-12, "across": "z"}, "no mirror image across z = 0"),
        ({}, "no mirror image across y = 0"),
        ({"region": {}}, "no mirror image"),
    ],
    "rigid": [
        ({"region": {"vertices": [1, 2]}}, "three points or more"),
        ({"region": {}}, "a region is said by"),
        ({"region": {"radius": 1.0}}, "both near and radius"),
    ],
    "fixed": [
        ({}, "needs spots, or a region"),
        ({"spots": []}, "one point or spot"),
        ({"region": {"vertices": [-1]}}, "not there"),
    ],
    "opposed": [
        ({}, "say at which y"),
        ({"start": V[0]}, "start and end, or of edges"),
        ({"at": [1.0, 99.0]}, "no chord at y = 99"),
    ],
    "section_area": [({}, "needs a section, got a surface")],
}


@pytest.mark.parametrize(
    ("name", "given", "said"), [(n, g, s) for n, rows in WRONG.items() for g, s in rows]
)
def test_wrong_options_are_told(name, given, said, shapes):
    with pytest.raises(ParameterError, match=said):
        registry.measure(name).build(shapes["wing"], **given)
