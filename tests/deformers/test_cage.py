"""Cages: what they move exactly, what they refuse, and what they keep."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numerics.cages import box, elbow, inside, pair, turned, wing

import moldline as ml
from moldline.deformers import cage_embedding, contract
from moldline.deformers.contract import check, prove
from moldline.deformers.table import DenseTable, SparseTable
from moldline.errors import GeometryError, ParameterError
from moldline.numerics.mean_value import MeanValue
from moldline.numerics.nearest import nearest
from moldline.numerics.winding import winding, winding_in_jax

POINTS, FACES = box((3, 3, 3), (1.0, 0.6, 0.4))
KINDS = ("harmonic", "mean value")


def cage(kind="harmonic", **options):
    cells = 10 if kind == "harmonic" else None
    return ml.Cage(POINTS, FACES, coordinates=kind, cells=cells, **options)


def long(**options):
    return ml.Cage(*box((2, 90, 2), (0.4, 60.0, 0.4)), cells=(6, 120, 6), **options)


@pytest.fixture(scope="module")
def places():
    middle = POINTS.mean(axis=0)
    return middle + 0.85 * (inside(POINTS, FACES, 300) - middle)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cage_keeps_the_contract(kind, places):
    small = ml.Cage(*box((2, 2, 2), (2.0, 2.0, 2.0)), coordinates=kind, cells=6)
    check(small, np.random.default_rng(0).uniform(-0.8, 0.8, (24, 3)) + [0.0, 1.0, 0.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [elbow, pair, wing])
def test_affine_motions_of_a_cage_are_those_of_the_geometry(kind, make):
    points, faces = make()
    places = inside(points, faces, 200)
    binding = ml.Cage(points, faces, coordinates=kind).bind(places)
    turn = np.eye(3) + 0.3 * np.random.default_rng(1).normal(size=(3, 3))
    size = np.ptp(points, axis=0).max()
    moved = np.asarray(binding((points @ turn + 0.2 - points).ravel()))
    np.testing.assert_allclose(moved, places @ turn + 0.2, rtol=0, atol=1e-10 * size)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_exact_and_the_transpose(kind, places):
    binding = cage(kind).bind(places)
    rng = np.random.default_rng(0)
    prove(binding, 0.1 * rng.normal(size=binding.net.size), 0.1 * rng.normal(size=binding.net.size))
    slopes = binding.jacobian()
    along = rng.normal(size=binding.net.size)
    np.testing.assert_allclose(
        slopes @ along, (np.asarray(binding(along)) - places).ravel(), atol=1e-13
    )


def table(kind, precision):
    """A small cage's binding with all weights, or a long one's with those that are not far."""
    made = cage(precision=precision) if kind == "dense" else long(precision=precision)
    binding = made.bind(inside(made.rest, made.shape.faces, 400))
    assert isinstance(binding.embedding, DenseTable if kind == "dense" else SparseTable)
    return binding


@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_weights_in_single_precision_cost_no_more_than_their_rounding(kind):
    """Theirs is 6e-8 of each; the sum's is that of the weights' sizes, which sum to one."""
    single, double = table(kind, "single"), table(kind, "double")
    weights = single.embedding.matrix()
    assert np.array_equal(weights.data, weights.data.astype(np.float32))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=1e-7)
    moves = np.random.default_rng(0).uniform(-1, 1, single.net.size)
    off = np.linalg.norm(np.asarray(single(moves)) - double(moves), axis=1).max()
    assert 1e-9 < off / np.linalg.norm(moves.reshape(-1, 3), axis=1).max() < 1e-7


@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_derivatives_in_single_precision_are_those_of_the_kept_weights(kind):
    """To rounding of doubles: a product with the weights as they are kept, and its transpose."""
    binding = table(kind, "single")
    points, size = binding.embedding.points, binding.net.size
    assert np.array_equal(binding(np.zeros(size)), points)
    rng = np.random.default_rng(0)
    controls, along, vectors = (rng.normal(size=s) for s in (size, size, points.shape))
    weights = binding.embedding.matrix()
    moved, pushed = jax.jvp(binding, (controls,), (along,))
    (pulled,) = jax.vjp(binding, controls)[1](vectors)
    np.testing.assert_allclose(moved - points, weights @ controls.reshape(-1, 3), atol=1e-13)
    np.testing.assert_allclose(pushed, weights @ along.reshape(-1, 3), rtol=0, atol=1e-14)
    np.testing.assert_allclose(pulled.reshape(-1, 3), weights.T @ vectors, rtol=0, atol=1e-12)
    prove(binding, controls, along)
    prove(jax.jit(lambda c: binding(c)), controls, along)


@pytest.mark.parametrize("kind", KINDS)
def test_single_precision_keeps_the_contract_but_for_the_definition(kind):
    """The definition has double weights, so a binding agrees with it to the rounding of its own."""
    points, faces = box((2, 2, 2), (2.0, 2.0, 2.0))
    small = ml.Cage(points, faces, coordinates=kind, cells=6, precision="single")
    places = np.random.default_rng(0).uniform(-0.8, 0.8, (24, 3)) + [0.0, 1.0, 0.0]
    slow = contract.derivatives_by_points_are_right  # takes no kept weights; proved for double ones
    for clause in contract.CLAUSES:
        if clause not in (contract.the_binding_agrees_with_the_definition, slow):
            clause(small, places)
    controls = np.random.default_rng(1).uniform(-1, 1, small.size)
    np.testing.assert_allclose(
        small.bind(places)(controls), small(places, controls), rtol=0, atol=1e-7
    )


def test_far_vertices_of_a_long_cage_have_no_entries_and_move_the_same(monkeypatch):
    thin = long()
    places = inside(thin.rest, thin.shape.faces, 400)
    sparse = thin.bind(places)
    assert isinstance(sparse.embedding, SparseTable)
    monkeypatch.setattr(cage_embedding, "SPARSE", 0.0)
    dense = thin.bind(places)
    assert isinstance(dense.embedding, DenseTable)
    rng = np.random.default_rng(0)
    controls = rng.normal(size=thin.size)
    np.testing.assert_allclose(sparse(controls), dense(controls), rtol=0, atol=1e-14)
    vectors = rng.normal(size=places.shape)
    np.testing.assert_allclose(
        sparse.embedding.gathered(vectors), dense.embedding.gathered(vectors), atol=1e-12
    )
    np.testing.assert_allclose(
        sparse.embedding.field(jnp.asarray(controls.reshape(-1, 3))),
        dense.embedding.field(jnp.asarray(controls.reshape(-1, 3))),
        atol=1e-13,
    )


def test_polygons_are_cut_the_same_way_every_time():
    corners = np.array([[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    one, other = (ml.Cage(corners, q) for q in (quads, [np.roll(q, 2).tolist() for q in quads]))
    assert len(one.lines) == 12 and len(one.shape.faces) == 12
    key = [sorted(map(tuple, np.sort(c.shape.faces, axis=1).tolist())) for c in (one, other)]
    assert key[0] == key[1]
    angle = 2 * np.pi * np.arange(6) / 6
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    sides = [[i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i] for i in range(6)]
    prism = np.concatenate([ring, ring + [0, 0, 1]])
    hexagons = [list(range(5, -1, -1)), list(range(6, 12))]
    assert len(ml.Cage(prism, sides + hexagons).shape.faces) == 12 + 8


def test_polygons_of_a_file_make_the_cage_that_they_make_in_python(tmp_path):
    """An L whose caps are no fans from their first corner."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    points = np.concatenate([np.c_[outline, np.full(6, z)] for z in (0.0, 1.0)])
    cap = [1, 2, 3, 4, 5, 0]
    faces = [cap[::-1], [i + 6 for i in cap]]
    faces += [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    (tmp_path / "cage.obj").write_text("\n".join(lines))
    places = np.random.default_rng(0).uniform([0.1, 0.1, 0.1], [1.9, 0.9, 0.9], (50, 3))
    one, other = ml.Cage.read(tmp_path / "cage.obj"), ml.Cage(points, faces)
    moves = np.random.default_rng(1).normal(size=36)
    for axis in range(3):  # an affine motion of each component
        moves[axis::3] = points @ moves[:3]
    np.testing.assert_allclose(one.bind(places)(moves), other.bind(places)(moves), atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 4), st.sampled_from(KINDS))
def test_hostile_cages_are_cages_or_refused(seed, changes, kind):
    """Faces left out, doubled, turned or wrong; points moved together, far away or nowhere."""
    rng = np.random.default_rng(seed)
    points, faces = box((3, 3, 2), (1.0, 0.7, 0.4))
    for change in rng.integers(0, 8, changes).tolist():
        face, point = rng.integers(len(faces)), rng.integers(len(points))
        if change == 0:
            faces = np.delete(faces, face, axis=0)
        elif change == 1:
            faces = np.append(faces, faces[face : face + 1], axis=0)
        elif change == 2:
            faces[face] = faces[face, ::-1]
        elif change == 3:
            faces[face, rng.integers(3)] = rng.integers(-2, len(points) + 2)
        elif change == 4:
            points[point] = points[rng.integers(len(points))]
        elif change == 5:
            points[point] += rng.normal(size=3)
        elif change == 6:
            points[point] = rng.choice([np.nan, np.inf, 1e300, 0.0])
        else:
            points[point] *= 1e-9
    places = np.array([[0.0, 0.3, 0.0], [0.1, 0.4, 0.05], [0.4, 0.6, -0.1]])
    try:
        cage = ml.Cage(points, faces, coordinates=kind, cells=8 if kind == "harmonic" else None)
        moved = np.asarray(cage.bind(places)(np.tile([0.1, 0.2, 0.3], len(cage.rest))))
    except (GeometryError, ParameterError):
        return
    np.testing.assert_allclose(moved, places + [0.1, 0.2, 0.3], rtol=0, atol=1e-6)


def test_a_cage_inside_out_is_turned(places):
    turned_over = ml.Cage(POINTS, FACES[:, ::-1], cells=10)
    controls = np.random.default_rng(0).normal(size=turned_over.size)
    np.testing.assert_allclose(
        turned_over.bind(places)(controls), cage().bind(places)(controls), atol=1e-12
    )


def test_frozen_vertices_stay(places):
    held = cage(freeze=[0, 5])
    controls = np.zeros(held.size)
    controls[[0, 15]] = 1.0
    assert np.array_equal(held.bind(places)(controls), places)


def test_a_finer_cage_begins_with_the_same_shape(places):
    coarse = ml.Cage(POINTS, FACES, cells=12, freeze=[0])
    fine, transfer = coarse.refined()
    assert len(fine.rest) > 3 * len(coarse.rest)
    controls = 0.2 * np.random.default_rng(0).normal(size=coarse.size)
    np.testing.assert_allclose(
        fine.bind(places)(transfer @ controls), coarse.bind(places)(controls), rtol=0, atol=1e-10
    )


@pytest.mark.parametrize("make", [elbow, wing, lambda: box((3, 5, 3), (1.0, 2.0, 0.4))])
def test_a_cage_with_its_own_cells_is_refined_twice(make):
    """Lines of its grid pass through middles of edges, which are corners of the finer cages."""
    points, faces = make()
    coarse = ml.Cage(points, faces, cells=(12, 24, 8))
    fine, once = coarse.refined()
    finer, twice = fine.refined()
    places = inside(points, faces, 300)
    controls = 0.1 * np.random.default_rng(0).normal(size=coarse.size)
    expected = coarse.bind(places)(controls)
    for cage, moves in ((fine, once @ controls), (finer, twice @ (once @ controls))):
        np.testing.assert_allclose(cage.bind(places)(moves), expected, rtol=0, atol=1e-12)


BROKEN = {
    "open": (lambda: (POINTS, FACES[1:]), "the cage is open at 3 edges, near"),
    "crossing": (
        lambda: (
            np.concatenate([POINTS, POINTS + [0.1, 0.07, 0.05]]),
            np.concatenate([FACES, FACES + len(POINTS)]),
        ),
        "the cage runs through itself in .* pairs of faces, near",
    ),
    "twice": (
        lambda: (POINTS, np.concatenate([FACES, FACES[:1]])),
        "the cage has edges of more than two faces",
    ),
    "loose": (lambda: (np.append(POINTS, [[9.0, 9, 9]], axis=0), FACES), "is in no face"),
    "wrong": (lambda: (POINTS, [[0, 1, 99]]), r"face 0 of the cage is \[0, 1, 99\]"),
    "none": (lambda: (POINTS, []), "needs faces, got none"),
    "nan": (lambda: (POINTS * np.nan, FACES), "must be finite"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_cage_is_told_with_its_place(name):
    make, message = BROKEN[name]
    with pytest.raises(GeometryError, match=message):
        ml.Cage(*make())


def test_points_outside_or_on_a_harmonic_cage_are_named(places):
    out = np.append(places, [[2.0, 0.3, 0.0]], axis=0)
    with pytest.raises(GeometryError, match=r"1 of 301 .* outside the cage: point 300 at \(2, 0.3"):
        cage().bind(out)
    on = np.append(places, [[0.5, 0.3, 0.05]], axis=0)
    with pytest.raises(GeometryError, match=r"lie on the cage: point 300 .* move the cage away"):
        cage().bind(on)
    controls = np.ones(cage().size)
    moved = np.asarray(cage("mean value").bind(out)(controls))
    np.testing.assert_allclose(moved, out + 1.0, rtol=0, atol=1e-12)


def test_wrong_options_are_refused():
    with pytest.raises(ParameterError, match="harmonic, mean value, got 'green'"):
        ml.Cage(POINTS, FACES, coordinates="green")
    with pytest.raises(ParameterError, match="numbers of a cage of 26 points, got"):
        ml.Cage(POINTS, FACES, freeze=[26])
    with pytest.raises(ParameterError, match="precision must be one of double, single, got 'half'"):
        ml.Cage(POINTS, FACES, precision="half")


def test_weights_are_found_once_and_kept(tmp_path, places, monkeypatch):
    kept = cage(store=tmp_path / "store")
    first = kept.bind(places)
    (file,) = (tmp_path / "store").iterdir()

    def never(*_):
        raise AssertionError("found anew")

    monkeypatch.setattr(cage_embedding, "_weights", never)
    controls = np.random.default_rng(0).normal(size=kept.size)
    again = cage(store=tmp_path / "store").bind(places)
    assert np.array_equal(again(controls), first(controls))
    with pytest.raises(AssertionError, match="found anew"):
        cage(store=tmp_path / "store").bind(places[1:])
    monkeypatch.undo()
    file.write_bytes(file.read_bytes()[:1000])  # damaged: made anew
    assert np.array_equal(cage(store=tmp_path / "store").bind(places)(controls), first(controls))
    assert file.stat().st_size > 1000


def test_each_precision_keeps_weights_of_its_own(tmp_path, places):
    controls = np.random.default_rng(0).normal(size=cage().size)
    for precision in ("double", "single"):
        first, again = (
            cage(store=tmp_path, precision=precision).bind(places)(controls) for _ in range(2)
        )
        assert np.array_equal(first, again)
    sizes = sorted(file.stat().st_size for file in tmp_path.iterdir())
    assert len(sizes) == 2 and sizes[0] < 0.6 * sizes[1]
    assert cage(precision="single").refined()[0].precision == "single"


def test_a_store_that_cannot_be_written_to_is_done_without(tmp_path, places):
    (tmp_path / "store").write_text("a file")
    cage(store=tmp_path / "store").bind(places)


def test_a_cage_in_a_case_file(tmp_path, places):
    ml.write(tmp_path / "cage.obj", ml.Surface(POINTS, FACES))
    body = ml.Surface(places, np.array([[0, 1, 2]]))
    ml.write(tmp_path / "body.tri", body)
    (tmp_path / "case.toml").write_text(
        """moldline = 1
[geometry.body]
file = "body.tri"
[variable.up]
value = [0.1, 0.2]
[[stage]]
deformer = "cage"
file = "cage.obj"
cells = 10
precision = "single"
[[stage.link]]
variable = "up"
link = "groups"
direction = [0, 0, 1]
index = [[[0], [1]], [[2]]]
"""
    )
    case = ml.load(tmp_path / "case.toml")
    moved = np.asarray(case.pipeline.points())
    expected = np.zeros((26, 3))
    expected[[0, 1], 2], expected[2, 2] = 0.1, 0.2
    direct = cage().bind(np.asarray(case.pipeline.geometry.points))(expected.ravel())
    np.testing.assert_allclose(moved, direct, rtol=0, atol=2e-8)  # weights in single precision
    assert case.pipeline.stages[0].deformer.precision == "single"
    assert list((tmp_path / ".moldline").iterdir())


def test_a_cage_behind_a_lattice_follows_it_and_keeps_what_left_it_still(places):
    lattice = ml.Lattice.around(places, (3, 2, 2), margin=0.2)
    move, push = ml.variable("move", size=lattice.size), ml.variable("push", size=78)
    late = cage()
    stages = [
        ml.Stage(lattice, {move: ml.links.controls(lattice)}),
        ml.Stage(late, {push: ml.links.controls(late)}),
    ]
    case = ml.Pipeline(ml.Cloud(places), stages)
    rng = np.random.default_rng(0)
    values = {"move": 0.01 * rng.normal(size=lattice.size), "push": 0.05 * rng.normal(size=78)}
    prove(lambda v: case.points(v), values, {k: 0.2 * v for k, v in values.items()})
    far = places + 5.0
    assert np.array_equal(late.follow(far, values["push"]), far)
    assert np.array_equal(late(jnp.asarray(far), values["push"]), far)


def test_mean_value_weights_reproduce_every_place_inside_outside_and_on():
    points, faces = elbow()
    low, high = points.min(axis=0) - 1, points.max(axis=0) + 1
    places = np.random.default_rng(0).uniform(low, high, (500, 3))
    on = points[faces].mean(axis=1)
    for where in (places, on, points):
        weights = MeanValue(points, faces).weights(where)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=1e-10)
        np.testing.assert_allclose(weights @ points, where, rtol=0, atol=1e-8)
    formula = np.asarray(MeanValue(points, faces).evaluated(places))
    np.testing.assert_allclose(formula, MeanValue(points, faces).weights(places), atol=1e-9)


def test_winding_numbers_tell_inside_from_outside():
    points, faces = pair()
    places = inside(points, faces, 100)
    assert np.allclose(winding(places, points, faces), 1.0)
    assert np.allclose(winding(places + 50.0, points, faces), 0.0)
    np.testing.assert_allclose(
        winding_in_jax(jnp.asarray(places), points, faces),
        winding(places, points, faces),
        atol=1e-12,
    )


def test_the_nearest_point_of_triangles_is_found(ball):
    rng = np.random.default_rng(0)
    places = rng.normal(size=(200, 3))
    found = nearest(places, np.asarray(ball.points), np.asarray(ball.faces))
    np.testing.assert_allclose(
        found.distances, np.abs(np.linalg.norm(places, axis=1) - 1), rtol=0, atol=0.02
    )
    foot = np.einsum("nc,ncd->nd", found.weights, ball.points[ball.faces[found.faces]])
    np.testing.assert_allclose(np.linalg.norm(places - foot, axis=1), found.distances, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(2, 4), st.integers(2, 4), st.integers(0, 2**31), st.sampled_from(KINDS),
    st.floats(1e-3, 1e3), st.floats(-1e4, 1e4),
)  # fmt: skip
def test_any_box_moves_what_is_inside_affinely(nx, ny, seed, kind, size, offset):
    points, faces = box((nx, ny, 2), (1.0, 0.7, 0.3))
    points = size * turned(points) + offset
    places = inside(points, faces, 20, seed)
    turn = np.eye(3) + 0.2 * np.random.default_rng(seed).normal(size=(3, 3))
    moves = (points - offset) @ turn - (points - offset)
    moved = np.asarray(
        ml.Cage(points, faces, coordinates=kind, cells=6).bind(places)(moves.ravel())
    )
    expected = (places - offset) @ turn + offset
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-9 * (size + abs(offset)))
