"""Case-3 of a batch: the least violation t* of the soft rows with its proof, and the nearest point that has it.

The scheme of `safefilter.backends.planar_kernel.least_violation`: raise the relaxation t of soft rows to the bound that
each contradiction proves, first without slack, until the rows meet; with `dense_steps.project` for the projection.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from safefilter.backends.planar_kernel import (
    CONTRADICTION,
    EXACT_ROUNDS,
    MAX_ROUNDS,
    SOLVED,
    VIOLATED_PART,
)
from safefilter.differentiable.dense_steps import Projected, project
from safefilter.differentiable.found import NO_ROW, TensorRows
from safefilter.differentiable.products import times


@dataclass(frozen=True, slots=True, eq=False)
class Relaxed:
    """Projections onto relaxed rows; the tensors are written in place.

    Attributes:
        projected: The last projection.
        least: Greatest bound on t* that is proved, shape (B,).
        relaxation: By how much soft rows were relaxed, shape (B,).
        proof: Rows that prove the bound, shape (B, n + 1), `NO_ROW` for none.
        weights: Their weights, those of soft rows summing to one, shape (B, n + 1).
    """

    projected: Projected
    least: Tensor
    relaxation: Tensor
    proof: Tensor
    weights: Tensor

    @classmethod
    def by_nothing(cls, projected: Projected) -> Relaxed:
        """Start from a projection onto rows as they are."""
        zero = torch.zeros_like(projected.point[:, 0])
        proof = torch.full_like(projected.active, NO_ROW)
        weights = torch.zeros_like(projected.multipliers)
        return cls(projected, zero, zero.clone(), proof, weights)

    @property
    def fields(self) -> tuple[Tensor, ...]:
        """All tensors."""
        return (*self.projected, self.least, self.relaxation, self.proof, self.weights)

    def part(self, index: Tensor) -> Relaxed:
        """Some of the decisions, a copy."""
        status, point, active, multipliers, *rest = (field[index] for field in self.fields)
        return Relaxed(Projected(status, point, active, multipliers), *rest)

    def write(self, index: Tensor, part: Relaxed) -> None:
        """Put some of the decisions back."""
        for whole, own in zip(self.fields, part.fields, strict=True):
            whole[index] = own


def relaxed(rows: TensorRows, relaxation: Tensor) -> Tensor:
    """Offsets, soft rows relaxed by so much a decision, shape (B,)."""
    return rows.offsets - torch.where(rows.hard, 0.0, relaxation[:, None])


def least_violation(answer: Relaxed, action: Tensor, rows: TensorRows, tolerance: float) -> None:
    """Raise t, for decisions whose projection met a contradiction, until rows meet; hard ones that clash stay so.

    Args:
        answer: Projections that met a contradiction; written.
        action: Shape (B, n).
        rows: Of unit length; offsets of absent rows are -inf.
        tolerance: In the unit of the action; also the slack of the second stage.
    """
    index = torch.arange(len(action), device=action.device)
    for attempt in range(MAX_ROUNDS):
        part, own, wanted = answer.part(index), rows.part(index), action[index]
        is_exact = _raise_bound(part, own) & (attempt < EXACT_ROUNDS)
        _project_again(part, own, wanted, is_exact, tolerance)
        # Where t* came out without any slack, the second stage takes over.
        settled = torch.nonzero(is_exact & (part.projected.status == SOLVED))[:, 0]
        if len(settled) > 0:
            last = part.part(settled)
            with_slack = torch.zeros_like(settled, dtype=torch.bool)
            _project_again(last, own.part(settled), wanted[settled], with_slack, tolerance)
            part.write(settled, last)
        answer.write(index, part)
        is_open = (part.projected.status == CONTRADICTION) & (_soft_weight(part, own) > 0.0)
        index = index[is_open]
        if len(index) == 0:
            break


def _soft_weight(answer: Relaxed, rows: TensorRows) -> Tensor:
    place = answer.projected.active
    is_soft = (place >= 0) & ~rows.hard.gather(1, place.clamp(min=0))
    return (answer.projected.multipliers * is_soft).sum(1)


def _raise_bound(answer: Relaxed, rows: TensorRows) -> Tensor:
    """Raise the bound to what the contradiction proves; says where that is more than was known."""
    place, weights = answer.projected.active, answer.projected.multipliers
    soft = _soft_weight(answer, rows)
    scale = torch.where(soft > 0.0, soft, 1.0)
    violation = relaxed(rows, answer.relaxation) - times(rows.normals, answer.projected.point)
    violation = torch.where(place >= 0, violation.gather(1, place.clamp(min=0)), 0.0)
    bound = answer.relaxation + (weights * violation).sum(1) / scale
    is_raised = (soft > 0.0) & (bound > answer.least)
    answer.least.copy_(torch.where(is_raised, bound, answer.least))
    answer.proof.copy_(torch.where(is_raised[:, None], place, answer.proof))
    answer.weights.copy_(torch.where(is_raised[:, None], weights / scale[:, None], answer.weights))
    return is_raised


def _project_again(
    answer: Relaxed, rows: TensorRows, action: Tensor, is_exact: Tensor, tolerance: float
) -> None:
    """Project with soft rows relaxed: by t* alone, or with slack so that rounding cannot let it stand still."""
    slack = torch.maximum(answer.least, answer.relaxation) + tolerance
    answer.relaxation.copy_(torch.where(is_exact, answer.least, slack))
    threshold = torch.where(is_exact, 0.0, VIOLATED_PART * tolerance)
    projected = project(rows.normals, relaxed(rows, answer.relaxation), action, threshold)
    for whole, own in zip(answer.projected, projected, strict=True):
        whole.copy_(own)
