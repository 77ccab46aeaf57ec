"""Sparse matrices in which every entry is stored, so that a workspace can take any new values without being rebuilt.

Letters: n columns, m rows. Values are stored column by column.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse

from safefilter.arrays import FloatArray


def full_matrix(num_rows: int, num_columns: int) -> scipy.sparse.csc_matrix:
    """Make a matrix that stores all its entries, each 1; new values are ``matrix.T.ravel()``."""
    return scipy.sparse.csc_matrix(
        (
            np.ones(num_rows * num_columns),
            np.tile(np.arange(num_rows), num_columns),
            np.arange(num_columns + 1) * num_rows,
        ),
        shape=(num_rows, num_columns),
    )


def upper_identity(size: int) -> scipy.sparse.csc_matrix:
    """Make an identity that stores all of its upper triangle; new values are `upper_values`."""
    column, row = np.tril_indices(size)
    first = np.arange(size + 1)
    return scipy.sparse.csc_matrix(
        ((row == column).astype(np.float64), row, first * (first + 1) // 2), shape=(size, size)
    )


def upper_values(matrix: FloatArray) -> FloatArray:
    """Values of the upper triangle of a symmetric matrix, in the order of `upper_identity`."""
    # The lower triangle row by row is the upper one column by column.
    return matrix[np.tril_indices(len(matrix))]
