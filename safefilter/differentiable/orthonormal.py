"""Rows that hold a point as an orthonormal basis: points on them, multipliers, and what is left to move in.

Rows N, as many as there are variables, in slots that may be empty (all zeros). With ``N = lower @ basis``, basis
orthonormal and lower triangular, the projection of ``a`` onto ``N v = c`` is ``a + basis' (lower^-1 (c - N a))``, and
the multipliers ``m`` of a move ``d = N' m`` are ``lower'^-1 (basis d)``. For batches of small systems, on any device.

Letters: B systems, k slots, n variables.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.differentiable.products import combined, lengths, times

# A row that has less than this length left across the others depends on them, and its slot counts as empty.
DEPENDENT = 1e-13


class Orthonormal(NamedTuple):
    """Rows taken apart.

    Attributes:
        basis: Orthonormal rows, shape (B, k, n); zero for empty slots.
        lower: Lower triangular, shape (B, k, k), ones on the diagonal of empty slots.
    """

    basis: Tensor
    lower: Tensor

    @classmethod
    def of(cls, rows: Tensor) -> Orthonormal:
        """Take rows of length one or zero, shape (B, k, n), apart by Gram and Schmidt, twice for accuracy."""
        basis, lower = torch.zeros_like(rows), rows.new_zeros(*rows.shape[:2], rows.shape[1])
        basis[:, 0] = rows[:, 0]
        lower[:, 0, 0] = 1.0
        for i in range(1, rows.shape[1]):
            rest = rows[:, i]
            for _ in range(2):
                across = times(basis[:, :i], rest)
                rest = rest - combined(across, basis[:, :i])
                lower[:, i, :i] += across
            length = lengths(rest)
            is_used = length > DEPENDENT
            length = torch.where(is_used, length, 1.0)
            basis[:, i] = rest * (is_used / length)[:, None]
            lower[:, i, i] = length
        return cls(basis, lower)

    def along(self, vector: Tensor) -> Tensor:
        """Coordinates of a vector, shape (B, n), in the basis, shape (B, k)."""
        return times(self.basis, vector)

    def combine(self, along: Tensor) -> Tensor:
        """Vector of these coordinates in the basis, shape (B, n)."""
        return combined(along, self.basis)

    def multipliers(self, along: Tensor) -> Tensor:
        """Weights m with ``N' m`` equal to the vector of these coordinates: back substitution, shape (B, k)."""
        solved = [along[:, i] for i in range(along.shape[1])]
        for i in reversed(range(len(solved))):
            solved[i] = solved[i] / self.lower[:, i, i]
            for j in range(i):
                solved[j] = solved[j] - self.lower[:, i, j] * solved[i]
        return torch.stack(solved, dim=1)

    def onto(self, distance: Tensor) -> Tensor:
        """Shortest move that changes ``N v`` by these distances, shape (B, k): forward substitution."""
        solved: list[Tensor] = []
        for i in range(distance.shape[1]):
            left = distance[:, i]
            for j in range(i):
                left = left - self.lower[:, i, j] * solved[j]
            solved.append(left / self.lower[:, i, i])
        return combined(torch.stack(solved, dim=1), self.basis)
