from __future__ import annotations

import numpy as np
import pytest

from safefilter.backends.dense_pattern import full_matrix, upper_identity, upper_values


@pytest.mark.parametrize(("num_rows", "num_columns"), [(0, 2), (1, 1), (5, 3), (80, 12)])
def test_a_full_matrix_takes_any_values_column_by_column(num_rows: int, num_columns: int) -> None:
    values = np.random.default_rng(1).normal(size=(num_rows, num_columns))
    values[values < 0.0] = 0.0
    matrix = full_matrix(num_rows, num_columns)
    assert matrix.nnz == values.size
    matrix.data[:] = np.ravel(values, order="F")
    np.testing.assert_array_equal(matrix.toarray(), values)


@pytest.mark.parametrize("size", [1, 2, 3, 12])
def test_an_upper_identity_takes_the_upper_triangle_of_any_symmetric_matrix(size: int) -> None:
    values = np.random.default_rng(2).normal(size=(size, size))
    values += values.T
    matrix = upper_identity(size)
    np.testing.assert_array_equal(matrix.toarray(), np.eye(size))
    matrix.data[:] = upper_values(values)
    np.testing.assert_array_equal(matrix.toarray(), np.triu(values))
