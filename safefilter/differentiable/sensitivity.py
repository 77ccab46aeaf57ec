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

Last, rows were divided by their length, ``normal / |normal|`` and ``offset / |normal|``, which takes
``violation * (gradient of the offset)`` from the gradient along a normal: 0 for rows that hold exactly.

In torch, on any device: it runs on CUDA. The CPU has `sensitivity_kernel`, and tests hold it to this one.

Letters: B decisions, M rows, n variables, S slots for rows.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.differentiable.orthonormal import Orthonormal
from safefilter.differentiable.products import lengths, picked_rows, times


class Answered(NamedTuple):
    """A question and its answer.

    Attributes:
        normals: Of any length, shape (B, M, n).
        offsets: Shape (B, M).
        hard: Shape (B, M).
        point: Shape (B, n).
        active: Shape (B, n).
        multipliers: Shape (B, n).
        proof: Shape (B, n + 1).
        weights: Shape (B, n + 1).
    """

    normals: Tensor
    offsets: Tensor
    hard: Tensor
    point: Tensor
    active: Tensor
    multipliers: Tensor
    proof: Tensor
    weights: Tensor

    def part(self, index: Tensor) -> Answered:
        """Some of the decisions, a copy."""
        return Answered(*(field[index] for field in self))


class Gradients(NamedTuple):
    """Gradients with respect to the question.

    Attributes:
        action: Shape (B, n).
        normals: Shape (B, M, n).
        offsets: Shape (B, M).
    """

    action: Tensor
    normals: Tensor
    offsets: Tensor


def gradients(given: Answered, of_point: Tensor, of_least: Tensor) -> Gradients:
    """Gradients with respect to the action, the normals and the offsets.

    Args:
        given: Question and answer.
        of_point: Gradient with respect to the point, shape (B, n).
        of_least: Gradient with respect to t*, shape (B,).
    """
    out = Gradients(
        of_point.clone(), torch.zeros_like(given.normals), torch.zeros_like(given.offsets)
    )
    if given.normals.shape[1] == 0:
        return out
    held = _Slots.of(given, given.active)
    basis = Orthonormal.of(held.normal)
    along = basis.along(of_point)
    out.action.sub_(basis.combine(along))
    pull = basis.multipliers(along)
    shares = torch.stack([given.multipliers, -pull], dim=2)
    of_normal = torch.bmm(shares, torch.stack([out.action, given.point], dim=1))
    held.add(out, of_normal, pull)
    index = torch.nonzero((given.proof >= 0).any(1))[:, 0]
    if len(index) > 0:
        third = Gradients(*(field[index] for field in out))
        _add_through_least(third, given.part(index), pull[index], of_least[index])
        for whole, own in zip(out, third, strict=True):
            whole[index] = own
    return out


def least_violation_of(given: Answered) -> Tensor:
    """t*, shape (B,): what the weights of the proof prove, taken from the point so that rounding stays small."""
    least = torch.zeros_like(given.point[:, 0])
    is_third = given.proof >= 0
    if bool(is_third.any()):
        index = torch.nonzero(is_third.any(1))[:, 0]
        third = given.part(index)
        violation = _Slots.of(third, third.proof).violation(third)
        least[index] = (third.weights * violation).sum(1)
    return least


def _add_through_least(out: Gradients, given: Answered, pull: Tensor, of_least: Tensor) -> None:
    """Add what Case-3 is about: soft rows held are relaxed by t*, and t* hangs on the rows of its proof."""
    held, proof = _Slots.of(given, given.active), _Slots.of(given, given.proof)
    # Held at a distance, a row moves with its length as well, if that is divided by.
    radial = pull * held.violation(given)
    held.add(out, -radial[:, :, None] * held.normal, torch.zeros_like(pull))
    is_soft = (given.active >= 0) & ~given.hard.gather(1, held.place)
    reaches_least = of_least - (pull * is_soft).sum(1)
    of_offset = reaches_least[:, None] * given.weights
    radial = of_offset * proof.violation(given)
    of_normal = -of_offset[:, :, None] * given.point[:, None] - radial[:, :, None] * proof.normal
    proof.add(out, of_normal, of_offset)


class _Slots(NamedTuple):
    """Rows in slots; empty slots have zeros for a normal, and its length is one."""

    place: Tensor  # index of the row, 0 where there is none, (B, S)
    is_used: Tensor  # (B, S)
    length: Tensor  # (B, S)
    normal: Tensor  # of length one, (B, S, n)

    @classmethod
    def of(cls, given: Answered, rows: Tensor) -> _Slots:
        is_used, place = rows >= 0, rows.clamp(min=0)
        normal = picked_rows(given.normals, place)
        length = torch.where(is_used, lengths(normal), 1.0)
        return cls(place, is_used, length, normal * (is_used / length)[:, :, None])

    def violation(self, given: Answered) -> Tensor:
        """Distance of the point outside of each row, shape (B, S); 0 for empty slots."""
        offset = given.offsets.gather(1, self.place) * (self.is_used / self.length)
        return offset - times(self.normal, given.point)

    def add(self, out: Gradients, of_normal: Tensor, of_offset: Tensor) -> None:
        """Add gradients of unit rows to those of the rows as they were given; 0 for empty slots."""
        of_normal = of_normal / self.length[:, :, None]
        out.normals.scatter_add_(1, self.place[:, :, None].expand_as(of_normal), of_normal)
        out.offsets.scatter_add_(1, self.place, of_offset / self.length)
