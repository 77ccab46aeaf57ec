"""Search in any number of dimensions, on any device, in torch alone: Case-1, Case-2 and Case-3 of a whole batch.

Case-3 raises the relaxation t of the soft rows to the bound that each contradiction proves, until the rows meet: the
scheme of `safefilter.backends.planar_kernel.least_violation`, with `dense_steps.project` for the plane's projection.

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
    ROUNDING,
    SOLVED,
    VIOLATED_PART,
)
from safefilter.decision import Case
from safefilter.differentiable.dense_steps import Projected, project
from safefilter.differentiable.found import NO_ROW, Found, UnitRows
from safefilter.differentiable.orthonormal import Orthonormal


def dense_search(action: Tensor, rows: UnitRows, tolerance: float, radius: Tensor) -> Found:
    """Decide a batch.

    Args:
        action: Wanted actions, shape (B, n), float64 and finite.
        rows: Rows; M may be 0.
        tolerance: In the unit of the action; also delta, the slack of the second stage.
        radius: Bound on the length of points that proofs cover, shape (B,).
    """
    found = Found.unchanged(action)
    if rows.offsets.shape[1] == 0:
        return found
    offsets = torch.where(rows.present, rows.offsets, -torch.inf)
    worst = (offsets - _times(rows.normals, action)).amax(1)
    index = torch.nonzero(~(worst <= tolerance))[:, 0]
    if len(index) == 0:
        return found
    part = rows.part(index)
    answer = _decide(action[index], part, offsets[index], tolerance, radius[index])
    for whole, own in zip(found, answer, strict=True):
        whole[index] = own
    return found


def _decide(
    action: Tensor, rows: UnitRows, offsets: Tensor, tolerance: float, radius: Tensor
) -> Found:
    """Case-2, and Case-3 where rows contradict each other."""
    slack = torch.full_like(radius, VIOLATED_PART * tolerance)
    third = _Third.begin(project(rows.normals, offsets, action, slack))
    index = torch.nonzero(third.projected.status == CONTRADICTION)[:, 0]
    if len(index) > 0:
        part = third.part(index)
        _raise(part, action[index], rows.part(index), offsets[index], tolerance)
        third.write(index, part)
    is_third = third.least > tolerance
    proof = torch.where(is_third[:, None], third.proof, NO_ROW)
    weights = torch.where(is_third[:, None], third.weights, 0.0)
    size = action.shape[1]
    relaxed = _relaxed(offsets, rows.hard, third.relaxation)
    active = third.projected.active[:, :size]
    point, multipliers, is_nearest = _polished(action, rows.normals, relaxed, active, tolerance)
    return Found(
        point=point,
        case=torch.where(is_third, int(Case.LEAST_VIOLATION), int(Case.PROJECTED)).to(torch.int8),
        active=active,
        multipliers=multipliers,
        proof=proof,
        weights=weights,
        is_proved=(third.projected.status == SOLVED)
        & is_nearest
        & _is_proof(rows, third, point, radius, tolerance),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Third:
    """Case-3 on its way: tensors that are written in place."""

    projected: Projected
    least: Tensor  # t*, (B,)
    relaxation: Tensor  # of the soft rows, (B,)
    proof: Tensor  # rows that contradict each other, (B, n + 1)
    weights: Tensor  # theirs, those of soft rows summing to one, (B, n + 1)

    @classmethod
    def begin(cls, projected: Projected) -> _Third:
        zero = torch.zeros_like(projected.point[:, 0])
        return cls(
            projected,
            zero,
            zero.clone(),
            torch.full_like(projected.active, NO_ROW),
            torch.zeros_like(projected.multipliers),
        )

    @property
    def fields(self) -> tuple[Tensor, ...]:
        return (*self.projected, self.least, self.relaxation, self.proof, self.weights)

    def part(self, index: Tensor) -> _Third:
        status, point, active, multipliers, *rest = (field[index] for field in self.fields)
        return _Third(Projected(status, point, active, multipliers), *rest)

    def write(self, index: Tensor, part: _Third) -> None:
        for whole, own in zip(self.fields, part.fields, strict=True):
            whole[index] = own


def _raise(
    third: _Third, action: Tensor, rows: UnitRows, offsets: Tensor, tolerance: float
) -> None:
    """Raise t of every decision to what its contradiction proves, until its rows meet."""
    index = torch.arange(len(action), device=action.device)
    for attempt in range(MAX_ROUNDS):
        part, own, wanted, bounds = (
            third.part(index),
            rows.part(index),
            action[index],
            offsets[index],
        )
        is_exact = _bound(part, own, bounds) & (attempt < EXACT_ROUNDS)
        _project_again(part, own, wanted, bounds, is_exact, tolerance)
        # Where t* came out without any slack, the second stage has it.
        again = torch.nonzero(is_exact & (part.projected.status == SOLVED))[:, 0]
        if len(again) > 0:
            rest = part.part(again)
            is_none = torch.zeros_like(again, dtype=torch.bool)
            _project_again(
                rest, own.part(again), wanted[again], bounds[again], is_none, tolerance
            )
            part.write(again, rest)
        third.write(index, part)
        is_open = (part.projected.status == CONTRADICTION) & (_soft_weight(part, own) > 0.0)
        index = index[is_open]
        if len(index) == 0:
            break


def _soft_weight(third: _Third, rows: UnitRows) -> Tensor:
    place = third.projected.active
    is_soft = (place >= 0) & ~rows.hard.gather(1, place.clamp(min=0))
    return (third.projected.multipliers * is_soft).sum(1)


def _bound(third: _Third, rows: UnitRows, offsets: Tensor) -> Tensor:
    """Raise t* to what the contradiction proves; says where that was more than was known."""
    place, weights = third.projected.active, third.projected.multipliers
    is_used = place >= 0
    soft = _soft_weight(third, rows)
    scale = torch.where(soft > 0.0, soft, 1.0)
    relaxed = _relaxed(offsets, rows.hard, third.relaxation)
    violation = (relaxed - _times(rows.normals, third.projected.point)).gather(1, place.clamp(min=0))
    proved = (weights * torch.where(is_used, violation, 0.0)).sum(1) / scale
    bound = third.relaxation + proved
    is_raised = (soft > 0.0) & (bound > third.least)
    third.least.copy_(torch.where(is_raised, bound, third.least))
    third.proof.copy_(torch.where(is_raised[:, None], place, third.proof))
    third.weights.copy_(torch.where(is_raised[:, None], weights / scale[:, None], third.weights))
    return is_raised


def _project_again(
    third: _Third,
    rows: UnitRows,
    action: Tensor,
    offsets: Tensor,
    is_exact: Tensor,
    tolerance: float,
) -> None:
    """Project with soft rows relaxed: by t* alone, or with slack so that rounding cannot let it stand still."""
    slack = torch.maximum(third.least, third.relaxation) + tolerance
    third.relaxation.copy_(torch.where(is_exact, third.least, slack))
    threshold = torch.where(is_exact, 0.0, VIOLATED_PART * tolerance)
    relaxed = _relaxed(offsets, rows.hard, third.relaxation)
    projected = project(rows.normals, relaxed, action, threshold)
    for whole, own in zip(third.projected, projected, strict=True):
        whole.copy_(own)


def _polished(
    action: Tensor, normals: Tensor, offsets: Tensor, active: Tensor, tolerance: float
) -> tuple[Tensor, Tensor, Tensor]:
    """Point and multipliers solved afresh on the rows held, and whether they prove each other."""
    is_held = active >= 0
    index = active.clamp(min=0)
    normal = normals.gather(1, index[:, :, None].expand(-1, -1, action.shape[1]))
    normal = normal * is_held[:, :, None]
    bound = torch.where(is_held, offsets.gather(1, index), 0.0)
    held = Orthonormal.of(normal)
    point = action + held.onto(bound - _times(normal, action))
    point = point + held.onto(bound - _times(normal, point))
    multipliers = held.multipliers(held.along(point - action)) * is_held
    # As `planar_kernel_checks.is_nearest`.
    allowed = tolerance * (1.0 + action.abs().sum(1))
    violation = (offsets - _times(normals, point)).amax(1)
    slack = (_times(normal, point) - bound).abs().amax(1)
    rest = point - action - torch.bmm(multipliers[:, None], normal)[:, 0]
    rounding = ROUNDING * multipliers.sum(1)
    is_nearest = (
        (violation <= allowed)
        & (slack <= allowed)
        & (multipliers >= -allowed[:, None]).all(1)
        & (rest.abs().amax(1) <= allowed + rounding)
    )
    return point, multipliers.clamp(min=0.0), is_nearest


def _is_proof(
    rows: UnitRows, third: _Third, point: Tensor, radius: Tensor, tolerance: float
) -> Tensor:
    """Do the weights prove t*, where there is one? As `planar_kernel_checks.is_proof`."""
    is_used = third.proof >= 0
    index = third.proof.clamp(min=0)
    normal = rows.normals.gather(1, index[:, :, None].expand(-1, -1, point.shape[1]))
    offset = rows.offsets.gather(1, index)
    weights = third.weights * is_used
    rest = torch.linalg.vector_norm(torch.bmm(weights[:, None], normal)[:, 0], dim=1)
    proved = (weights * offset).sum(1) - rest * radius >= third.least - tolerance
    is_tight = third.relaxation <= third.least + 2.0 * tolerance
    return (third.least <= tolerance) | (proved & is_tight)


def _relaxed(offsets: Tensor, hard: Tensor, relaxation: Tensor) -> Tensor:
    return offsets - torch.where(hard, 0.0, relaxation[:, None])


def _times(rows: Tensor, vector: Tensor) -> Tensor:
    return torch.bmm(rows, vector[:, :, None])[:, :, 0]
