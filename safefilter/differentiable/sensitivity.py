"""How the answer moves when the question does: the derivative of a projection, from the rows that hold it.

Let N v = c be the rows that hold the point v nearest to the action a, and m >= 0 their multipliers. The optimality
conditions ``v = a + N' m`` and ``N v = c`` are differentiated as they stand (the implicit function theorem; Amos and
Kolter, OptNet, 2017, written out for a projection). For a gradient g with respect to v::

    w = g less its part in the span of the rows     with respect to a
    y = (N N')^-1 N g                               with respect to c
    m_i w - y_i v                                   with respect to the normal of row i

so Case-1 (no row held) passes g on, and a corner (as many rows as variables) lets none of it through to the action.

In Case-3 soft rows are relaxed by t*, so that c = offset - t*, and t* = sum of weights_j (offset_j - normal_j . v) over
the rows that contradict each other: its derivative has these weights (Danskin). What reaches t*, from the rows that
hold v and from whoever uses t* itself, goes on to the rows of the proof.

Last, rows were divided by their length: ``normal / |normal|``, ``offset / |normal|``.

Letters: B decisions, M rows, n variables, S = 2 n + 1 slots: rows that hold the point, then those of the proof.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from safefilter.differentiable.orthonormal import Orthonormal
from safefilter.differentiable.products import lengths, picked_rows, times


class Answered(NamedTuple):
    """A question and its answer.

    Attributes:
        action: Shape (B, n).
        normals: Of any length, shape (B, M, n).
        offsets: Shape (B, M).
        hard: Shape (B, M).
        point: Shape (B, n).
        active: Shape (B, n).
        proof: Shape (B, n + 1).
        weights: Shape (B, n + 1).
    """

    action: Tensor
    normals: Tensor
    offsets: Tensor
    hard: Tensor
    point: Tensor
    active: Tensor
    proof: Tensor
    weights: Tensor


def gradients(given: Answered, of_point: Tensor, of_least: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients with respect to the action, the normals and the offsets.

    Args:
        given: Question and answer.
        of_point: Gradient with respect to the point, shape (B, n).
        of_least: Gradient with respect to t*, shape (B,).

    Returns:
        Shapes (B, n), (B, M, n), (B, M).
    """
    size = given.action.shape[1]
    if given.normals.shape[1] == 0:
        return of_point.clone(), torch.zeros_like(given.normals), torch.zeros_like(given.offsets)
    # Outside of Case-3 there is nothing in the slots of proofs.
    num_proof = size + 1 if bool((given.proof >= 0).any()) else 0
    slots = _Slots.of(given, torch.cat([given.active, given.proof[:, :num_proof]], dim=1))
    held = Orthonormal.of(slots.normal[:, :size])
    along = held.along(of_point)
    of_action = of_point - held.combine(along)
    pull = held.multipliers(along)
    multipliers = held.multipliers(held.along(given.point - given.action))
    reaches_least = of_least - (pull * slots.is_soft[:, :size]).sum(1)
    weights = given.weights[:, :num_proof]
    of_offset = torch.cat([pull, reaches_least[:, None] * weights], dim=1)
    # Of w and of v, slot by slot.
    shares = torch.stack([nn.functional.pad(multipliers, (0, num_proof)), -of_offset], dim=2)
    of_normal = torch.bmm(shares, torch.stack([of_action, given.point], dim=1))
    # Through the division by the length. Since w is across the rows held, that leaves of a normal's own direction:
    radial = of_offset * (slots.offset - slots.along(given.point))
    of_normal = (of_normal - radial[:, :, None] * slots.normal) / slots.length[:, :, None]
    normals, offsets = torch.zeros_like(given.normals), torch.zeros_like(given.offsets)
    normals.scatter_add_(1, slots.place[:, :, None].expand_as(of_normal), of_normal)
    offsets.scatter_add_(1, slots.place, of_offset / slots.length)
    return of_action, normals, offsets


def least_violation_of(given: Answered) -> Tensor:
    """t*, shape (B,): what the weights of the proof prove, taken from the point so that rounding stays small."""
    if not bool((given.proof >= 0).any()):
        return torch.zeros_like(given.action[:, 0])
    slots = _Slots.of(given, given.proof)
    return (given.weights * (slots.offset - slots.along(given.point))).sum(1)


class _Slots(NamedTuple):
    """Rows in slots; empty slots have zeros for a row, and its length is one."""

    place: Tensor  # index of the row, 0 where there is none, (B, S)
    is_soft: Tensor  # (B, S)
    length: Tensor  # (B, S)
    normal: Tensor  # of length one, (B, S, n)
    offset: Tensor  # in the unit of the action, (B, S)

    @classmethod
    def of(cls, given: Answered, rows: Tensor) -> _Slots:
        is_used, place = rows >= 0, rows.clamp(min=0)
        normal = picked_rows(given.normals, place)
        length = torch.where(is_used, lengths(normal), 1.0)
        scale = is_used / length
        return cls(
            place=place,
            is_soft=is_used & ~given.hard.gather(1, place),
            length=length,
            normal=normal * scale[:, :, None],
            offset=given.offsets.gather(1, place) * scale,
        )

    def along(self, vector: Tensor) -> Tensor:
        """Normals times a vector, shape (B, n)."""
        return times(self.normal, vector)
