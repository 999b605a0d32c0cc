"""Somebody else's program before and behind our stages, with derivatives of every kind."""

import tomllib
from pathlib import Path

import foreign_program
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline import links
from moldline.case import load
from moldline.errors import CaseError, GeometryError, ParameterError, TaskError
from moldline.modelers.program import Program
from moldline.numerics.taylor import remainder
from moldline.workers import Processes

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
P = np.array([2.0, 0.3, -0.2])
START = np.ones((foreign_program.COUNT, 3))


def program(cache, mode="", input="", **options):
    given = {
        "command": ["{python}", "foreign_program.py", mode],
        "output": "out.trix" if mode == "linearised" else "out.tri",
        "parameters": {"length": P[0], "rise": [P[1], P[2]]},
        "files": [HERE / "foreign_program.py"],
        "input": input,
        "cache": cache,
    }
    if mode in ("complex", "linearised"):
        given["derivatives"] = mode
    return Program(**(given | options))


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """Shared, so that what tests have in common runs once."""
    return tmp_path_factory.mktemp("cache")


def expected(p, start=START):
    return foreign_program.shape(p[0], p[1:], start)


def column(name, p=P, start=START):
    return foreign_program.slopes(p[0], p[1:], start)[name]


def runs(cache):
    return len([p for p in (cache / "programs").iterdir() if p.name not in ("running", "failed")])


def test_it_makes_what_the_program_says(cache):
    maker = program(cache)
    making = maker.bind()
    assert maker.takes == (0, 0) and list(maker.parameters) == ["length", "rise"]
    np.testing.assert_array_equal(making.geometry.points, expected(P))
    other = np.array([2.5, 0.1, 0.4])
    np.testing.assert_array_equal(making(other), expected(other))


def test_nothing_runs_twice_and_files_decide(tmp_path):
    program(tmp_path).bind()(np.array([2.5, 0.1, 0.4]))
    assert runs(tmp_path) == 2
    program(tmp_path).bind()(np.array([2.5, 0.1, 0.4]))
    assert runs(tmp_path) == 2
    changed = tmp_path / "foreign_program.py"
    changed.write_text((HERE / "foreign_program.py").read_text() + "\n# changed\n")
    program(tmp_path, files=[changed]).bind()
    assert runs(tmp_path) == 3


TOLERANCE = {"": 1e-8, "digits": 3e-3, "complex": 1e-15, "linearised": 1e-14}


@pytest.mark.parametrize("mode", TOLERANCE)
def test_derivatives_by_parameters_are_as_right_as_their_kind_allows(cache, mode):
    making = program(cache, mode).bind()
    for j, name in enumerate(["length", "rise[0]", "rise[1]"]):
        motion = jax.jvp(making, (P,), (np.eye(3)[j],))[1]
        np.testing.assert_allclose(motion, column(name), rtol=0, atol=TOLERANCE[mode])
        if mode in ("", "digits"):
            worst = np.abs(motion - column(name)).max()
            assert worst <= 2 * making.accuracy[name].error <= 20 * TOLERANCE[mode]
    cotangent = np.random.default_rng(0).standard_normal(START.shape)
    gradient = jax.vjp(making, P)[1](cotangent)[0]
    rows = [np.sum(cotangent * column(n)) for n in ["length", "rise[0]", "rise[1]"]]
    np.testing.assert_allclose(gradient, rows, atol=20 * TOLERANCE[mode])


def test_derivatives_are_of_order_two_in_the_remainder(cache):
    making = program(cache, "complex").bind()
    proof = remainder(making, P, np.array([0.3, 0.2, -0.1]))
    assert proof.order == pytest.approx(2.0, abs=0.05)


def test_it_works_under_jit_and_in_both_modes(cache):
    making = program(cache, "complex").bind()
    np.testing.assert_array_equal(jax.jit(lambda p: making(p))(P), expected(P))
    gradient = jax.jit(jax.grad(lambda p: jnp.sum(making(p) ** 2)))(P)
    rows = [2 * np.sum(expected(P) * column(n)) for n in ["length", "rise[0]", "rise[1]"]]
    np.testing.assert_allclose(gradient, rows, rtol=1e-13)


@pytest.mark.parametrize("mode", ["", "complex", "linearised"])
def test_behind_a_geometry_it_is_differentiated_along_motions_of_it(cache, mode):
    random = np.random.default_rng(1)
    start = 1 + 0.3 * random.standard_normal(START.shape)
    given = ml.Surface(start, foreign_program.faces())
    making = program(cache, mode, input="in.tri").bind(given)
    np.testing.assert_array_equal(making.geometry.points, expected(P, start))
    moves, h = random.standard_normal(start.shape), 1e-30
    exact = foreign_program.shape(P[0], P[1:], start + 1j * h * moves).imag / h
    exact += 0.7 * column("rise[1]", start=start)
    motion = jax.jvp(making, (P, start), (np.array([0, 0, 0.7]), moves))[1]
    tolerance = 1e-14 if mode == "complex" else 1e-7
    np.testing.assert_allclose(motion, exact, rtol=0, atol=tolerance)


def chain(cache, mode=""):
    """A plate bent by ours, put through the program, and bent again."""
    plate = ml.Surface(START + 0.1 * np.arange(36).reshape(12, 3), foreign_program.faces())
    box = ml.Lattice.box((0, 0, 0), (6, 6, 6), (2, 2, 2))
    maker = program(cache, mode, input="in.tri")
    bend = ml.variable("bend", size=2, typical=0.1)
    rise = ml.variable("rise", value=[0.3], typical=0.1)
    swell = ml.variable("swell", size=2, typical=0.1)
    return ml.Pipeline(
        {"plate": plate},
        [
            ml.Stage(box, {bend: links.camber(box, "x", "z")}, on="plate"),
            ml.Construction(maker, {rise: links.named(maker, "rise", [0], True)}, "strip",
                            of=["plate"]),
            ml.Stage(box, {swell: links.thickness(box, "y", "z")}, on="strip"),
        ],
    )  # fmt: skip


VALUES = {"bend": [0.1, -0.2], "rise": [0.4], "swell": [0.05, 0.1]}


def test_a_pipeline_through_a_program_has_the_same_gradient_in_both_modes(cache):
    case = chain(cache, "complex")
    values = case.values(VALUES)
    along = {"bend": [1.0, 0.5], "rise": [0.3], "swell": [-0.5, 1.0]}
    proof = remainder(case.points, values, {k: jnp.array(v) for k, v in along.items()})
    assert proof.order == pytest.approx(2.0, abs=0.05)
    cotangent = np.random.default_rng(2).standard_normal(START.shape)
    gradient = case.pullback(values, cotangent)
    forward = np.sum(case.pushforward(values, along) * cotangent)
    both = sum(np.sum(gradient[name] * np.array(along[name])) for name in along)
    assert both == pytest.approx(float(forward), rel=1e-12)
    columns = case.sensitivity(values, "bend")
    np.testing.assert_allclose(
        gradient["bend"], np.einsum("ncv,nc->v", columns, cotangent), atol=1e-12
    )


def test_a_measure_behind_a_program_has_its_slopes(cache):
    case = chain(cache)
    measured = ml.Measurements(case, {"place": ml.measures.Centroid(foreign_program.faces())})
    slopes = measured.jacobian(VALUES)["place"]
    for name in ("bend", "rise"):
        h, values = 1e-5, {k: np.array(v, float) for k, v in VALUES.items()}
        ends = []
        for sign in (1, -1):
            moved = values | {name: values[name] + sign * h * np.eye(len(values[name]))[0]}
            ends.append(measured(moved)["place"])
        np.testing.assert_allclose(slopes[name][:, 0], (ends[0] - ends[1]) / (2 * h), atol=1e-6)


def test_reverse_mode_by_the_points_of_the_file_in_is_refused_with_the_way_out(cache):
    given = ml.Surface(START, foreign_program.faces())
    making = program(cache, input="in.tri").bind(given)
    with pytest.raises(ParameterError, match=r"known by directions only.*`Pipeline\.pullback`"):
        jax.vjp(making, P, START)[1](START)


def test_a_changed_connectivity_is_told(cache):
    making = program(cache, "counts").bind()
    with pytest.raises(GeometryError, match="makes 3 points for these values, and 12 for its own"):
        making(np.array([2.5, 0.3, -0.2]))


def test_a_failed_run_is_told_with_its_place_and_last_words(cache):
    making = program(cache, "fails").bind()
    with pytest.raises(
        TaskError,
        match=r"(?s)length \+ .*ended with status 1; its directory: .*"
        "length is beyond what I can do",
    ):
        jax.jvp(making, (P,), (np.eye(3)[0],))


def test_what_takes_too_long_is_told(cache):
    with pytest.raises(TaskError, match=r"longer than its limit of 0\.5 s"):
        program(cache, "slow", limit=0.5).bind()


def test_a_template_is_filled_in_and_too_few_digits_are_told(tmp_path):
    script = "import json; d = dict(l.split() for l in open('a.in')); x = float(d['length'])\n"
    script += "open('o.tri', 'w').write(f'3 1\\n0 0 0\\n{x} 0 0\\n0 1 0\\n1 2 3\\n1\\n')"
    (tmp_path / "make.py").write_text(script)
    (tmp_path / "a.in.template").write_text("length {length:.2f}\nother {braces}\n")
    maker = Program(
        "{python} make.py", "o.tri", parameters={"length": 2.0}, files=[Path("make.py")],
        template=Path("a.in.template"), folder=tmp_path,
    )  # fmt: skip
    making = maker.bind()
    assert making.geometry.points[1, 0] == 2.0
    assert maker.recipe.parameter_text(np.ones(1), np.zeros(1)) == "length 1.00\nother {braces}\n"
    with pytest.raises(ParameterError, match=r"too few digits.*\{length:\.17g\}"):
        jax.jvp(making, (np.array([2.0]),), (np.ones(1),))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"command": []}, "command is empty"),
        ({"output": "../out.tri"}, r"output is a file in its own directory, got '\.\./out\.tri'"),
        ({"steps": {"width": 1.0}}, "steps name 'width', which is none of its parameters: length"),
        ({"steps": {"length": 0.0}}, "'length' needs a step above 0"),
        ({"bounds": {"length": (3.0, 1.0)}}, "a lower bound below the upper one"),
        ({"parameters": {"length": float("nan")}}, "'length' is a finite number or a list"),
        ({"limit": 0.0}, "limit is a time above 0"),
        ({"linearised": "x.trix"}, "only read with derivatives"),
    ],
)
def test_what_makes_no_sense_is_told(cache, options, message):
    with pytest.raises(ParameterError, match=message):
        program(cache, **options)


def test_a_linearisation_that_lacks_a_parameter_is_told(cache):
    maker = program(cache, "linearised", parameters={"length": 2.0, "rise": [0.3, -0.2], "w": 1.0})
    with pytest.raises(ml.errors.FileError, match="wrote no derivative by 'w', only by length"):
        jax.jvp(maker.bind(), (maker.values,), (np.eye(4)[0],))


def test_another_executor_gives_the_same(tmp_path):
    executor = Processes(2)
    making = program(tmp_path, "complex", executor=executor).bind()
    motion = jax.jvp(making, (P,), (np.eye(3)[0],))[1]
    executor.close()
    np.testing.assert_allclose(motion, column("length"), rtol=0, atol=1e-15)


CASE = """
moldline = 1
[variable.length]
value = 2.0
bounds = [1.0, 3.0]
[[stage]]
modeler = "program"
to = "strip"
command = ["{python}", "foreign_program.py"]
files = ["foreign_program.py"]
output = "out.tri"
cache = "kept"
[stage.parameters]
length = 2.0
rise = [0.3, -0.2]
[[stage.link]]
variable = "length"
link = "named"
parameter = "length"
absolute = true
"""


def test_a_case_file_says_it_and_is_saved_elsewhere(tmp_path):
    (tmp_path / "foreign_program.py").write_text((HERE / "foreign_program.py").read_text())
    (tmp_path / "case.toml").write_text(CASE)
    case = load(tmp_path / "case.toml")
    assert (tmp_path / "kept/programs").is_dir()
    np.testing.assert_array_equal(case.pipeline({"length": 2.5}).points, expected([2.5, 0.3, -0.2]))
    (tmp_path / "elsewhere").mkdir()
    case.save(tmp_path / "elsewhere/case.toml", {"length": 2.5})
    table = tomllib.loads((tmp_path / "elsewhere/case.toml").read_text())["stage"][0]
    assert table["files"] == [str(tmp_path / "foreign_program.py")]
    assert table["output"] == "out.tri"
    other = load(tmp_path / "elsewhere/case.toml")
    np.testing.assert_array_equal(other.pipeline().points, case.pipeline({"length": 2.5}).points)
    (tmp_path / "case.toml").write_text(CASE.replace("2.0\nrise", '"two"\nrise'))
    with pytest.raises(CaseError, match=r"stage\.0\.parameters\.length"):
        load(tmp_path / "case.toml")
