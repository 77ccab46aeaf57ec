"""Search in any number of dimensions, on any device, in torch alone: Case-1, Case-2 and Case-3 of a whole batch.

It runs on CUDA; the CPU has compiled searches, and tests hold them to this one.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.backends.planar_kernel import CONTRADICTION, ROUNDING, SOLVED, VIOLATED_PART
from safefilter.decision import Case
from safefilter.differentiable.dense_least_violation import Relaxed, least_violation, relaxed
from safefilter.differentiable.dense_steps import project
from safefilter.differentiable.found import NO_ROW, Found, TensorRows
from safefilter.differentiable.given_rows import PROOF_RADIUS
from safefilter.differentiable.orthonormal import Orthonormal
from safefilter.differentiable.products import combined, lengths, picked_rows, times


def dense_search(action: Tensor, rows: TensorRows, tolerance: float) -> Found:
    """Decide a batch.

    Args:
        action: Wanted actions, shape (B, n), float64 and finite.
        rows: Rows of unit length; M may be 0.
        tolerance: In the unit of the action; also delta, the slack of Case-3's second stage.
    """
    found = Found.unchanged(action)
    if rows.offsets.shape[1] == 0:
        return found
    rows = rows._replace(offsets=torch.where(rows.present, rows.offsets, -torch.inf))
    worst = (rows.offsets - times(rows.normals, action)).amax(1)
    index = torch.nonzero(~(worst <= tolerance))[:, 0]
    if len(index) > 0:
        answer = _decide(action[index], rows.part(index), tolerance)
        for whole, own in zip(found, answer, strict=True):
            whole[index] = own
    return found


def _decide(action: Tensor, rows: TensorRows, tolerance: float) -> Found:
    """Case-2, and Case-3 where rows contradict each other."""
    slack = action.new_full((len(action),), VIOLATED_PART * tolerance)
    answer = Relaxed.by_nothing(project(rows.normals, rows.offsets, action, slack))
    index = torch.nonzero(answer.projected.status == CONTRADICTION)[:, 0]
    if len(index) > 0:
        part = answer.part(index)
        least_violation(part, action[index], rows.part(index), tolerance)
        answer.write(index, part)
    is_third = answer.least > tolerance
    polished = _polished(action, rows, answer, tolerance)
    is_proof = _is_proof(rows, answer, tolerance)
    return Found(
        point=polished.point,
        case=torch.where(is_third, int(Case.LEAST_VIOLATION), int(Case.PROJECTED)).to(torch.int8),
        active=answer.projected.active[:, :-1],
        multipliers=polished.multipliers,
        proof=torch.where(is_third[:, None], answer.proof, NO_ROW),
        weights=torch.where(is_third[:, None], answer.weights, 0.0),
        is_proved=(answer.projected.status == SOLVED)
        & polished.is_nearest
        & (is_proof | ~is_third),
    )


class _Polished(NamedTuple):
    point: Tensor  # (B, n)
    multipliers: Tensor  # (B, n)
    is_nearest: Tensor  # (B,)


def _polished(action: Tensor, rows: TensorRows, answer: Relaxed, tolerance: float) -> _Polished:
    """Point and multipliers solved afresh on the rows held, and whether they prove each other.

    The conditions are those of `safefilter.backends.planar_kernel_checks.is_nearest`.
    """
    offsets = relaxed(rows, answer.relaxation)
    active = answer.projected.active[:, :-1]
    is_held, place = active >= 0, active.clamp(min=0)
    normal = picked_rows(rows.normals, place) * is_held[:, :, None]
    bound = torch.where(is_held, offsets.gather(1, place), 0.0)
    held = Orthonormal.of(normal)
    point = action + held.onto(bound - times(normal, action))
    point = point + held.onto(bound - times(normal, point))
    multipliers = held.multipliers(held.along(point - action)) * is_held
    allowed = tolerance * (1.0 + action.abs().sum(1))
    rest = point - action - combined(multipliers, normal)
    is_nearest = (
        ((offsets - times(rows.normals, point)).amax(1) <= allowed)
        & ((bound - times(normal, point)).abs().amax(1) <= allowed)
        & (multipliers >= -allowed[:, None]).all(1)
        & (rest.abs().amax(1) <= allowed + ROUNDING * multipliers.sum(1))
    )
    return _Polished(point, multipliers.clamp(min=0.0), is_nearest)


def _is_proof(rows: TensorRows, answer: Relaxed, tolerance: float) -> Tensor:
    """Do the weights prove t*? The conditions of `safefilter.backends.planar_kernel_checks.is_proof`."""
    is_used, place = answer.proof >= 0, answer.proof.clamp(min=0)
    offset = torch.where(is_used, rows.offsets.gather(1, place), 0.0)
    rest = lengths(combined(answer.weights, picked_rows(rows.normals, place)))
    longest = torch.where(rows.present, rows.offsets, 0.0).abs().amax(1)
    radius = PROOF_RADIUS * (1.0 + longest)
    proved = (answer.weights * offset).sum(1) - rest * radius
    is_tight = answer.relaxation <= answer.least + 2.0 * tolerance
    return is_tight & (proved >= answer.least - tolerance)
