"""How the answer moves when the question does: the derivative of a projection, from the rows that hold it.

Let N v = c be the rows that hold the point v nearest to the action a, and m >= 0 their multipliers. The optimality
conditions ``v = a + N' m`` and ``N v = c`` are differentiated as they stand (the implicit function theorem; Amos and
Kolter, OptNet, 2017, written out for a projection). For a gradient g with respect to v::

    w = g less its part in the span of the rows     with respect to a
    y = (N N')^-1 N g                               with respect to c
    m_i w - y_i v                                   with respect to the normal of row i

so Case-1 (no row held) passes g on, and a corner (as many rows as variables) lets none of it through to the action.

In Case-3 soft rows are relaxed by t*, so that c = offset - t*, and t* = sum of weights_j (offset_j - normal_j . v) over
the rows that contradict each other: its derivative has these weights (Danskin). What reaches t*, from the rows that hold
v and from whoever uses t* itself, goes on to the rows of the proof.

Last, rows were divided by their length: ``normal / |normal|``, ``offset / |normal|``.

Letters: B decisions, M rows, n variables, S = 2 n + 1 slots: rows that hold the point, then those of the proof.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.differentiable.orthonormal import Orthonormal


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
    place, is_used = _places(given)
    length, normal, offset = _slots(given, place, is_used)
    is_soft = is_used & ~torch.gather(given.hard, 1, place)
    held = Orthonormal.of(normal[:, :size])
    along = held.along(of_point)
    of_action = of_point - torch.bmm(along[:, None], held.basis)[:, 0]
    pull = held.multipliers(along)
    multipliers = held.multipliers(held.along(given.point - given.action))
    reaches_least = of_least - (pull * is_soft[:, :size]).sum(1)
    of_offset = torch.cat([pull, reaches_least[:, None] * given.weights], dim=1)
    of_normal = -of_offset[:, :, None] * given.point[:, None]
    of_normal[:, :size] += multipliers[:, :, None] * of_action[:, None]
    # Through the division by the length: along the normal, only the offset is left to move.
    radial = (of_normal * normal).sum(2) + of_offset * offset
    of_normal = (of_normal - radial[:, :, None] * normal) / length[:, :, None]
    of_offset = of_offset / length
    normals, offsets = torch.zeros_like(given.normals), torch.zeros_like(given.offsets)
    normals.scatter_add_(1, place[:, :, None].expand_as(of_normal), of_normal)
    offsets.scatter_add_(1, place, of_offset)
    return of_action, normals, offsets


def least_violation_of(given: Answered) -> Tensor:
    """t*, shape (B,): what the weights of the proof prove, taken from the point so that rounding stays small."""
    size = given.action.shape[1]
    place, is_used = _places(given)
    _, normal, offset = _slots(given, place[:, size:], is_used[:, size:])
    distance = offset - torch.bmm(normal, given.point[:, :, None])[:, :, 0]
    return (given.weights * distance).sum(1)


def _places(given: Answered) -> tuple[Tensor, Tensor]:
    """Index of the row in each slot, 0 where there is none, and whether there is one."""
    slots = torch.cat([given.active, given.proof], dim=1)
    return slots.clamp(min=0), slots >= 0


def _slots(given: Answered, place: Tensor, is_used: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Lengths, unit normals and unit offsets of the rows in slots; empty ones are zero, of length one."""
    index = place[:, :, None].expand(*place.shape, given.action.shape[1])
    normal = torch.gather(given.normals, 1, index) * is_used[:, :, None]
    offset = torch.gather(given.offsets, 1, place) * is_used
    length = torch.linalg.vector_norm(normal, dim=2)
    length = torch.where(is_used, length, 1.0)
    return length, normal / length[:, :, None], offset / length
