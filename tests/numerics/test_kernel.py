"""Kernels as JAX operations, on one that squares."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from moldline.numerics.kernel import AbstractKernel, empty, shared


class Square(AbstractKernel):
    """No derivative is given, so that of the plain form is taken; counts its compiled runs."""

    def __init__(self):
        self.runs = 0

    def run(self, array):
        self.runs += 1
        out = empty(array.shape)
        np.multiply(array, array, out=out)
        return (out,)

    def plain(self, array):
        return (array * array,)


X = np.array([1.0, -2.0, 3.0])


def test_the_compiled_form_runs_on_arrays_and_inside_a_jit():
    square = Square()
    np.testing.assert_array_equal(square(X)[0], X * X)
    assert square.runs == 1
    np.testing.assert_array_equal(jax.jit(square)(X)[0], X * X)
    assert square.runs == 2


def test_all_derivatives_come_from_the_plain_form():
    square = Square()
    np.testing.assert_array_equal(jax.grad(lambda x: square(x)[0].sum())(X), 2 * X)
    np.testing.assert_array_equal(jax.jvp(square, (X,), (X,))[1][0], 2 * X * X)
    np.testing.assert_array_equal(jax.hessian(lambda x: square(x)[0].sum())(X), 2 * np.eye(3))


def test_a_batch_is_mapped_along_any_axis():
    batch = np.stack([X, X + 1], axis=1)
    np.testing.assert_array_equal(jax.vmap(Square(), in_axes=1)(batch)[0], batch.T**2)


def test_a_kernel_that_is_not_linear_cannot_be_transposed():
    with pytest.raises(NotImplementedError, match="Square is not linear"):
        Square().transpose([X], [None])


def test_jax_takes_over_new_memory_without_a_copy():
    array = empty((100, 3))
    array[:] = 1.0
    assert array.ctypes.data % 64 == 0
    assert shared(array).unsafe_buffer_pointer() == array.ctypes.data
    assert float(jnp.sum(shared(array))) == 300.0
