"""Products of a batch of small matrices and vectors, on any device.

Letters: B systems, k rows, n variables.
"""

from __future__ import annotations

import torch
from torch import Tensor

# Up to this many numbers, a sum over columns is faster than torch's own.
FEW = 4


def times(rows: Tensor, vector: Tensor) -> Tensor:
    """Inner product of each row, shape (B, k, n), with the vector of its system, shape (B, n): shape (B, k)."""
    return torch.bmm(rows, vector[:, :, None])[:, :, 0]


def combined(weights: Tensor, rows: Tensor) -> Tensor:
    """Sum of rows, shape (B, k, n), with weights, shape (B, k): shape (B, n)."""
    return torch.bmm(weights[:, None], rows)[:, 0]


def lengths(vectors: Tensor) -> Tensor:
    """Length of each vector, shape (..., n)."""
    if vectors.shape[-1] > FEW:
        length: Tensor = torch.linalg.vector_norm(vectors, dim=-1)
        return length
    first, *rest = vectors.unbind(-1)
    square = first * first
    for column in rest:
        square = square + column * column
    return square.sqrt()


def picked_rows(rows: Tensor, place: Tensor) -> Tensor:
    """Rows, shape (B, k, n), at some places of each system, shape (B, s): shape (B, s, n)."""
    return rows.gather(1, place[:, :, None].expand(*place.shape, rows.shape[2]))
