"""Harmonic coordinates of cages."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numerics.cages import box, elbow, inside, pair, split, turned, wing

from moldline.deformers.contract import prove
from moldline.errors import GeometryError, ParameterError
from moldline.numerics.harmonic import Harmonic

CAGES = {
    "slab": box((3, 3, 3), (1.0, 0.6, 0.1)),
    "turned": (turned(box((3, 4, 3))[0]), box((3, 4, 3))[1]),
    "elbow": elbow(),
    "turned elbow": (turned(elbow()[0]), elbow()[1]),
    "pair": pair(),
    "wing": wing(),
}


@pytest.fixture(scope="module")
def solved():
    """Each cage's coordinates, by default cells, solved once."""
    return {name: Harmonic(*cage) for name, cage in CAGES.items()}


@pytest.mark.parametrize("name", CAGES)
def test_weights_sum_to_one_give_the_point_and_are_not_negative(solved, name):
    points, faces = CAGES[name]
    x = inside(points, faces, 3000)
    weights, kind = solved[name].traced(x)
    size = np.ptp(points, axis=0).max()
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=0, atol=1e-12)
    np.testing.assert_allclose(weights @ points, x, rtol=0, atol=1e-12 * size)
    assert weights.min() >= 0
    assert np.mean(kind == 1) > 0.05
    assert np.mean(kind == 2) < 1e-4


@pytest.mark.parametrize("name", CAGES)
def test_the_compiled_look_up_is_the_plain_one(solved, name):
    x = inside(*CAGES[name], 400, seed=1)
    plain = jax.jit(solved[name].evaluated)(x)
    np.testing.assert_allclose(plain, solved[name].weights(x), rtol=0, atol=2e-14)


def test_points_on_the_cage_itself_are_served(solved):
    points, faces = CAGES["wing"]
    shares = np.random.default_rng(0).dirichlet([1, 1, 1], len(faces))
    on = np.concatenate([points, np.einsum("tk,tkd->td", shares, points[faces])])
    weights = solved["wing"].weights(on)
    np.testing.assert_allclose(weights @ points, on, rtol=0, atol=1e-10)
    assert weights.min() >= 0
    np.testing.assert_allclose(solved["wing"].evaluated(on), weights, rtol=0, atol=1e-10)


def test_points_far_outside_are_not_numbers(solved):
    far = np.array([[50.0, 0, 0], [0, 0, -3.0]])
    assert np.all(np.isnan(solved["slab"].weights(far)))
    assert np.all(np.isnan(solved["slab"].evaluated(far)))


def test_components_do_not_feel_each_other(solved):
    points, faces = CAGES["pair"]
    x = inside(points, faces, 1000)
    weights = solved["pair"].weights(x)
    first = x[:, 0] < 0.6
    assert 0 < first.sum() < len(x)
    assert np.all(weights[first][:, 26:] == 0)
    assert np.all(weights[~first][:, :26] == 0)


def hat(x, terms=60):
    """Harmonic in the unit square, the hat function on the side y = 1 and zero on the others."""
    k = np.arange(1, 2 * terms, 2)
    height = 4 * (-1.0) ** ((k - 1) // 2) / (np.pi * k) ** 2
    u, v = x[:, :1], x[:, 1:2]
    decay = (np.exp(k * np.pi * (v - 1)) - np.exp(-k * np.pi * (v + 1))) / (
        1 - np.exp(-2 * k * np.pi)
    )
    return 2 * np.sum(height * np.sin(k * np.pi * u) * decay, axis=1)


def test_the_error_falls_with_the_square_of_the_cells():
    """Against a series, in a prism so long that its ends do not matter."""
    length = 9.0
    points, faces = box((3, 2, 2), (1.0, length, 1.0))
    values = ((points[:, 0] == 0) & (points[:, 2] > 0)).astype(float)
    x = np.random.default_rng(0).uniform(0.1, 0.7, (2000, 3))
    places = np.stack([x[:, 0] - 0.5, length / 2 + 0.1 * x[:, 1], x[:, 2] - 0.5], axis=1)
    coarse, fine = (
        np.abs(Harmonic(points, faces, (n, 36, n)).weights(places) @ values - hat(x[:, [0, 2]]))
        for n in (24, 48)
    )
    assert fine.max() < 1e-4
    assert np.log2(coarse.max() / fine.max()) == pytest.approx(2, abs=0.25)


@pytest.mark.parametrize(
    ("name", "start", "end"),
    [("turned", (0.0, 0.5, 0.0), (0.1, 0.8, 0.49)), ("elbow", (0.5, 0.5, 0.5), (1.95, 0.9, 0.9))],
)
def test_slopes_have_no_jumps(name, start, end):
    """Along a line into the border; linear interpolation between as many cells has jumps."""
    points, faces = CAGES[name]
    harmonic = Harmonic(points, faces, 16)
    start, end = (turned(np.array(p)) if name == "turned" else np.array(p) for p in (start, end))
    way = np.linspace(0, 1, 40001)[:, None]
    line = start + way * (end - start)
    kept = harmonic.traced(line)
    assert set(np.unique(kept[1])) == {0, 1}
    jumps = [
        np.abs(np.diff(np.diff(kept[0][::every], axis=0) / way[every], axis=0)).max()
        for every in (1, 2, 4000)
    ]
    assert jumps[0] < 0.6 * jumps[1]  # half: it is a curvature, not a jump
    assert jumps[0] < 0.01 * jumps[2]


def test_derivatives_by_points_are_exact(solved):
    points, faces = CAGES["turned elbow"]
    harmonic = solved["turned elbow"]
    x = inside(points, faces, 300, seed=2)
    x = x[_deep(points, faces, x)]
    assert np.mean(harmonic.traced(x)[1] == 1) > 0.1
    moves = jnp.asarray(np.random.default_rng(0).normal(size=(len(points), 3)))
    along = np.random.default_rng(1).normal(size=x.shape) * 1e-4 * np.ptp(points, axis=0)
    prove(jax.jit(lambda p: harmonic.evaluated(p) @ moves), x, along)


@pytest.mark.parametrize("name", ["elbow", "turned", "wing"])
def test_compiled_slopes_are_those_of_the_definition(solved, name):
    """From nodes alone, from the cage too, and in slivers, where only the cage encloses a point."""
    points, faces = CAGES[name]
    x = inside(points, faces, 1000, seed=3)
    if name == "wing":
        x = np.concatenate([x, _below(points, faces)])
    of = np.random.default_rng(0).normal(size=points.shape)
    slopes, kind = solved[name].slopes(x, of)
    assert {0, 1} <= set(kind.tolist()) and (name != "wing" or np.sum(kind == 2) > 20)
    for axis, along in enumerate(np.eye(3)):
        given = (jnp.asarray(x),), (jnp.broadcast_to(along, x.shape),)
        known = jax.jvp(lambda p: solved[name].evaluated(p, jnp.asarray(of)), *given)[1]
        np.testing.assert_allclose(
            slopes[..., axis], known, rtol=0, atol=1e-9 * np.abs(known).max()
        )


def _below(points, faces):
    """A millionth below the faces."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shares = np.random.default_rng(0).dirichlet([1, 1, 1], (40, len(faces)))
    return (np.einsum("stk,tkd->std", shares, points[faces]) - 1e-6 * normal).reshape(-1, 3)


def _deep(points, faces, x):
    """Those that are not within a hundredth of the cage's thickness of a face's plane."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    away = np.abs(np.einsum("ntd,td->nt", x[:, None] - a, normal)).min(axis=1)
    return away > 0.01 * np.ptp(points, axis=0).min()


def test_derivatives_in_slivers_are_exact(solved):
    """Where only the cage itself encloses a point."""
    points, faces = CAGES["wing"]
    x = _below(points, faces)
    slivers = x[solved["wing"].traced(x)[1] == 2]
    assert len(slivers) > 20
    plain = solved["wing"].evaluated(slivers)
    np.testing.assert_allclose(plain, solved["wing"].weights(slivers), rtol=0, atol=1e-12)
    along = np.random.default_rng(0).normal(size=slivers.shape)
    slope = jax.jvp(solved["wing"].evaluated, (slivers,), (along,))[1]
    np.testing.assert_allclose(slope @ points, along, rtol=0, atol=1e-6 * np.abs(along).max())


@pytest.mark.parametrize("name", ["slab", "turned", "elbow", "wing"])
def test_a_flat_subdivision_gives_the_same_shape(name):
    points, faces = CAGES[name]
    fine, fine_faces, matrix = split(points, faces)
    cells = (60, 40, 12) if name == "wing" else 12
    x = inside(points, faces, 1000)
    coarse = Harmonic(points, faces, cells).weights(x)
    np.testing.assert_allclose(
        Harmonic(fine, fine_faces, cells).weights(x) @ matrix, coarse, rtol=0, atol=1e-11
    )


def test_a_mirrored_cage_gives_mirrored_weights():
    points, faces = box((3, 4, 3), (1.0, 2.0, 0.4), taper=0.3)
    flip = np.array([-1.0, 1, 1])
    x = inside(points, faces, 500)
    one = Harmonic(points, faces).weights(x)
    other = Harmonic(points * flip, faces[:, ::-1]).weights(x * flip)
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-12)


def test_thin_cages_get_cells_across_by_default(solved):
    nx, _, nz = solved["wing"].report.cells
    tip_chord, tip_thickness = 3 * 0.4, 0.3 * 0.4
    assert tip_thickness / (0.3 / nz) > 6
    assert tip_chord / (np.ptp(CAGES["wing"][0][:, 0]) / nx) > 6
    assert 20_000 < solved["wing"].report.unknowns < 60_000


def test_the_report_proves_the_nodes(solved):
    report = solved["turned elbow"].report
    assert report.precision < 1e-12
    assert report.change < 1e-12
    assert 5 < report.cycles < 40


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (0, "at least 2, got 0"),
        ((8, 8), "or three"),
        ((4, 4, 2.5), "whole number"),
        (2000, "has more than 50,000,000 nodes"),
    ],
)
def test_cells_that_are_none_are_refused(cells, said):
    with pytest.raises(ParameterError, match=said):
        Harmonic(*box((2, 2, 2)), cells)


def test_a_cage_that_is_open_is_refused():
    points, faces = box((3, 3, 3))
    with pytest.raises(GeometryError, match="disagree on what is inside; a cage must be closed"):
        Harmonic(points, faces[1:])


def test_a_flat_cage_is_refused():
    points, faces = box((2, 2, 2))
    with pytest.raises(GeometryError, match="must extend along x, y and z"):
        Harmonic(points * [1, 1, 0], faces)


def test_a_grid_that_is_too_coarse_is_refused():
    points, faces = box((2, 2, 2), (0.1, 0.1, 0.1))
    points, faces = np.concatenate([points, points + 1]), np.concatenate([faces, faces + 8])
    with pytest.raises(GeometryError, match=r"no node of a grid of 2 x 2 x 2 cells.*give more"):
        Harmonic(points, faces, 2)


@pytest.mark.parametrize(
    ("name", "worst", "typical"),
    [("cage26_cube_p5", 0.008, 4e-4), ("cage26_slab_p6", 0.012, 5e-4)],
)
def test_blender_approximates_the_same(data, name, worst, typical):
    """Finer grids come nearer; what is left is Blender's own error, a cubic grid of 2^p + 2."""
    file = np.load(data(f"blender/{name}.npz"))
    cage, faces = file["cage"].astype(float), file["faces"]
    off = [
        np.abs(Harmonic(cage, faces, n).weights(file["points"]) - file["weights"])
        for n in (12, 24, 48)
    ]
    mean = [np.sqrt(np.mean(o**2)) for o in off]
    assert mean[0] > mean[1] > mean[2]
    assert off[2].max() < worst
    assert mean[2] < typical
