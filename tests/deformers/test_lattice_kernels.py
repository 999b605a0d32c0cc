"""The compiled kernels of the lattice against their definitions."""

import jax
import numpy as np
import pytest

import moldline as ml

LATTICES = {
    "turned": ml.Lattice(
        (0.1, 0, 0), [[1, 0.2, 0], [-0.3, 2, 0], [0, 0.1, 0.5]], (5, 1, 4), outside="extend"
    ),
    "blender": ml.Lattice.box((0, 0, 0), (1, 2, 0.5), (3, 4, 2), ends="blender"),
}
COUNT = 130  # more than one stretch of moving points
POINTS = np.random.default_rng(0).uniform(-0.2, 1.2, (COUNT, 3)) * [1, 2, 0.5]


def kernels(lattice):
    """Each kernel, what it is called on, and the numbers of those arrays in which it is linear."""
    rng = np.random.default_rng(1)
    moves, change = 0.1 * rng.normal(size=(2, *lattice.shape, 3))
    motion, vectors = rng.normal(size=(2, COUNT, 3))
    embedding, following = lattice.bind(POINTS).embedding, lattice.following
    rows = moves.reshape(-1, 3)
    return {
        "displacement": (embedding.displace, (rows,), (0,)),
        "motion": (embedding.move, (rows,), ()),
        "gathering": (embedding.gather, (vectors,), (0,)),
        "following": (following, (POINTS, moves), ()),
        "push": (following.push, (POINTS, moves, motion, change), (2, 3)),
        "pull": (following.pull, (POINTS, moves, vectors), (2,)),
    }


CASES = [
    pytest.param(*parts, id=f"{name}-{kernel}")
    for name, lattice in LATTICES.items()
    for kernel, parts in kernels(lattice).items()
]


def assert_equal(ours, expected):
    for one, other in zip(ours, expected, strict=True):
        # sums over all points and over up to 64 weights round, relative to their largest term
        scale = max(1.0, float(np.abs(other).max()))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14 * scale)


@pytest.mark.parametrize(("kernel", "arrays", "linear"), CASES)
def test_the_compiled_form_is_the_definition(kernel, arrays, linear):
    assert_equal(kernel.run(*arrays), jax.jit(kernel.plain)(*arrays))


@pytest.mark.parametrize(("kernel", "arrays", "linear"), CASES)
def test_the_forward_derivative_is_that_of_the_definition(kernel, arrays, linear):
    rng = np.random.default_rng(2)
    tangents = tuple(rng.normal(size=array.shape) for array in arrays)

    def slope(form):
        return jax.jvp(form, arrays, tangents)[1]

    assert_equal(slope(kernel), jax.jit(lambda: slope(kernel.plain))())


@pytest.mark.parametrize(("kernel", "arrays", "linear"), [c for c in CASES if c.values[2]])
def test_a_linear_kernel_is_transposed_by_another_kernel(kernel, arrays, linear):
    results = kernel.run(*arrays)
    rng = np.random.default_rng(2)
    cotangents = [rng.normal(size=result.shape) for result in results]
    known = [None if i in linear else array for i, array in enumerate(arrays)]
    back = kernel.transpose(cotangents, known)
    assert all((part is None) != (i in linear) for i, part in enumerate(back))
    there = sum(np.vdot(c, r) for c, r in zip(cotangents, results, strict=True))
    again = sum(np.vdot(back[i], arrays[i]) for i in linear)
    size = sum(
        np.linalg.norm(c) * np.linalg.norm(r) for c, r in zip(cotangents, results, strict=True)
    )
    assert abs(there - again) < 1e-14 * size


def test_derivatives_of_any_order_and_mode_are_those_of_the_definition():
    lattice = LATTICES["blender"]
    points, controls = POINTS[:4], np.linspace(-0.1, 0.15, lattice.size)

    def third(form):
        def along(f):
            return lambda c: jax.grad(f)(c) @ controls

        def energy(c):
            return (form(form(points, c), c) ** 3).sum()

        return jax.jit(jax.grad(along(along(energy))))(controls)

    expected = third(lattice)
    np.testing.assert_allclose(
        third(lattice.follow), expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )
