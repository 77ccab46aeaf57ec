"""What a search for the rows that hold a point returns, whoever searched.

Letters: B decisions, M rows, n dimensions.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.decision import Case

NO_ROW = -1


class TensorRows(NamedTuple):
    """Rows ``normals @ v >= offsets`` of a batch of decisions.

    Attributes:
        normals: Shape (B, M, n), float64.
        offsets: Shape (B, M), float64.
        hard: Shape (B, M), bool.
        present: Shape (B, M), bool.
    """

    normals: Tensor
    offsets: Tensor
    hard: Tensor
    present: Tensor

    def part(self, index: Tensor) -> TensorRows:
        """Rows of some of the decisions, a copy."""
        return TensorRows(*(field[index] for field in self))


class Found(NamedTuple):
    """Points, and the rows that prove them.

    Attributes:
        point: Shape (B, n), float64.
        case: Values of `Case`, shape (B,), int8.
        active: Rows that hold the point, shape (B, n), int64; `NO_ROW` for none.
        multipliers: Their multipliers, >= 0, shape (B, n), float64.
        proof: In Case-3 the rows that contradict each other, shape (B, n + 1), int64; `NO_ROW` for none.
        weights: Their weights, >= 0, those of soft rows summing to one, shape (B, n + 1), float64.
        is_proved: Do multipliers and weights prove the answer? Shape (B,), bool.
    """

    point: Tensor
    case: Tensor
    active: Tensor
    multipliers: Tensor
    proof: Tensor
    weights: Tensor
    is_proved: Tensor

    @classmethod
    def unchanged(cls, action: Tensor) -> Found:
        """Every action is its own answer: Case-1."""
        batch, size = action.shape
        return cls(
            point=action.clone(),
            case=action.new_full((batch,), int(Case.SAFE), dtype=torch.int8),
            active=action.new_full((batch, size), NO_ROW, dtype=torch.int64),
            multipliers=action.new_zeros((batch, size)),
            proof=action.new_full((batch, size + 1), NO_ROW, dtype=torch.int64),
            weights=action.new_zeros((batch, size + 1)),
            is_proved=action.new_ones((batch,), dtype=torch.bool),
        )
