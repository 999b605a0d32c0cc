"""Products of a constant sparse matrix with points."""

import jax
import numpy as np
import scipy.sparse

from moldline.numerics.sparse_product import THREAD_WORTH, SparseProduct


def test_product_and_transpose_are_the_matrix_in_each_form():
    """Enough rows for more than one thread, an empty one among them."""
    rng = np.random.default_rng(0)
    rows, columns = 2 * THREAD_WORTH + 5, 700
    entry = rng.integers([0, 0], [rows - 1, columns], (4 * rows, 2)).T
    matrix = scipy.sparse.csr_array((rng.normal(size=4 * rows), entry), shape=(rows, columns))
    points, vectors = rng.normal(size=(columns, 3)), rng.normal(size=(rows, 3))
    product = SparseProduct(matrix)
    known, back = matrix @ points, matrix.T @ vectors
    value, pull = jax.vjp(lambda p: product(p)[0], points)
    np.testing.assert_allclose(value, known, rtol=0, atol=1e-13)
    np.testing.assert_allclose(pull(vectors)[0], back, rtol=0, atol=1e-12)
    np.testing.assert_allclose(product.plain(points)[0], known, rtol=0, atol=1e-13)
    np.testing.assert_allclose(jax.jit(lambda p: product(p)[0])(points), known, atol=1e-13)
    _, slope = jax.jvp(lambda p: product(p)[0], (points,), (points,))
    np.testing.assert_array_equal(slope, value)
    assert product.other.other is product
    assert not np.asarray(value)[-1].any()
