"""Projection onto half-spaces for a batch, in any number of dimensions and on any device: a dense active set.

The dual method of Goldfarb and Idnani (1983) for ``min 1/2 |v - a|^2``, all decisions of a batch in step: take the most
violated row in, drop rows whose multiplier would turn negative, until no row is violated (the multipliers prove the
point) or the rows held and the entering one contradict each other (Farkas). The rows held are kept with their
pseudo-inverse, changed by one rank a step; decisions that are done leave the batch.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from safefilter.backends.planar_kernel import CONTRADICTION, ROUNDING, SOLVED, STALLED
from safefilter.differentiable.found import NO_ROW
from safefilter.differentiable.products import combined, picked_rows, times

OPEN = -1
# A row with less than this length left across the rows held depends on them.
DEPENDENT = 1e-10
# A finite method on paper, of about as many steps as rows become active; rounding could make it cycle.
STEPS_PER_ROW = 5
LEAST_STEPS = 50


class Projected(NamedTuple):
    """Where the steps ended.

    Attributes:
        status: `SOLVED`, `CONTRADICTION` or `STALLED`, shape (B,), int64.
        point: Shape (B, n).
        active: Rows held, shape (B, n + 1), `NO_ROW` for none; with a contradiction the last one is that which entered.
        multipliers: Theirs, or the weights of the contradiction, shape (B, n + 1), >= 0.
    """

    status: Tensor
    point: Tensor
    active: Tensor
    multipliers: Tensor

    @classmethod
    def unfinished(cls, action: Tensor) -> Projected:
        """Room for results."""
        batch, size = action.shape
        return cls(
            action.new_full((batch,), STALLED, dtype=torch.int64),
            action.clone(),
            action.new_full((batch, size + 1), NO_ROW, dtype=torch.int64),
            action.new_zeros((batch, size + 1)),
        )


@dataclass(slots=True, eq=False)
class _Steps:
    """Decisions that are still open, or were when the batch was last made smaller; the fields change at each step."""

    place: Tensor  # where in the whole batch, (B,)
    normals: Tensor  # (B, M, n)
    offsets: Tensor  # (B, M); absent rows are -inf
    threshold: Tensor  # violation that counts as none, (B,)
    action: Tensor  # (B, n)
    point: Tensor  # (B, n)
    active: Tensor  # rows in slots, (B, n)
    held: Tensor  # their normals, (B, n, n); zero where there is none
    bounds: Tensor  # their offsets, (B, n)
    inverse: Tensor  # rows of the pseudo-inverse of `held`, (B, n, n)
    multipliers: Tensor  # (B, n)
    entering: Tensor  # row on its way in, (B,); NO_ROW for none
    pull: Tensor  # its multiplier, (B,)
    status: Tensor  # (B,)

    def part(self, index: Tensor) -> _Steps:
        return _Steps(*(getattr(self, name)[index] for name in self.__slots__))


def project(normals: Tensor, offsets: Tensor, action: Tensor, threshold: Tensor) -> Projected:
    """Project every action of a batch onto its rows.

    Args:
        normals: Of length one, shape (B, M, n), M >= 1.
        offsets: Shape (B, M), -inf for rows that are absent.
        action: Shape (B, n).
        threshold: Violation that counts as none, besides rounding, shape (B,).
    """
    out = Projected.unfinished(action)
    steps = _begin(normals, offsets, action, threshold)
    for _ in range(LEAST_STEPS + STEPS_PER_ROW * (normals.shape[1] + action.shape[1])):
        _step(steps)
        is_open = steps.status == OPEN
        num_open = int(is_open.sum())
        # Half of a batch is worth the copying.
        if 2 * num_open <= len(is_open):
            _write(steps, out)
            if num_open == 0:
                break
            steps = steps.part(torch.nonzero(is_open)[:, 0])
    return out


def _begin(normals: Tensor, offsets: Tensor, action: Tensor, threshold: Tensor) -> _Steps:
    batch, size = action.shape
    rows = action.new_full((batch, size), NO_ROW, dtype=torch.int64)
    return _Steps(
        place=torch.arange(batch, device=action.device),
        normals=normals,
        offsets=offsets,
        threshold=threshold,
        action=action,
        point=action.clone(),
        active=rows,
        held=action.new_zeros((batch, size, size)),
        bounds=action.new_zeros((batch, size)),
        inverse=action.new_zeros((batch, size, size)),
        multipliers=action.new_zeros((batch, size)),
        entering=rows[:, 0].clone(),
        pull=action.new_zeros((batch,)),
        status=rows[:, 0].clone().fill_(OPEN),
    )


def _step(steps: _Steps) -> None:
    """One step of every open decision: towards a row, until it holds or one of those held has to go."""
    violation = steps.offsets - times(steps.normals, steps.point)
    _enter(steps, violation)
    normal, left, shares = _split(steps)
    first, slot, full = _lengths(steps, violation, left, shares)
    is_open = steps.status == OPEN
    is_stuck = is_open & torch.isinf(first) & torch.isinf(full)
    steps.status = torch.where(is_stuck, CONTRADICTION, steps.status)
    # The normals held and the entering one add up to zero with these weights.
    weights = (-shares).clamp(min=0.0)
    is_moving = is_open & ~is_stuck
    length = torch.where(is_moving, torch.minimum(first, full), 0.0)
    moved = (steps.multipliers - length[:, None] * shares).clamp(min=0.0)
    steps.multipliers = torch.where(is_stuck[:, None], weights, moved)
    steps.pull = torch.where(is_stuck, 1.0, steps.pull + length)
    _drop(steps, slot, is_moving & (first < full))
    _add(steps, normal, left, shares, is_moving & ~(first < full))
    _settle(steps, normal, is_moving)


def _enter(steps: _Steps, violation: Tensor) -> None:
    """Choose the row to take in; where none is violated, the decision is done."""
    worst, row = violation.max(1)
    is_new = steps.entering < 0
    reach = steps.offsets.gather(1, row[:, None])[:, 0].abs() + steps.point.abs().sum(1)
    is_done = is_new & ~(worst > steps.threshold + ROUNDING * reach) & (steps.status == OPEN)
    steps.status = torch.where(is_done, SOLVED, steps.status)
    is_entering = is_new & (steps.status == OPEN)
    steps.entering = torch.where(is_entering, row, steps.entering)
    steps.pull = torch.where(is_entering, 0.0, steps.pull)


def _lengths(
    steps: _Steps, violation: Tensor, left: Tensor, shares: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """How far until a multiplier is zero, in which slot, and how far until the entering row holds."""
    is_held = steps.active >= 0
    ratio = torch.where(is_held & (shares > 0.0), steps.multipliers / shares, math.inf)
    first, slot = ratio.min(1)
    size = (left * left).sum(1)
    is_dependent = is_held.all(1) | (size <= DEPENDENT * DEPENDENT)
    index = steps.entering.clamp(min=0)[:, None]
    excess = violation.gather(1, index)[:, 0].clamp(min=0.0)
    return first, slot, torch.where(is_dependent, math.inf, excess / size)


def _split(steps: _Steps) -> tuple[Tensor, Tensor, Tensor]:
    """Normal of the entering row, what of it is across the rows held, and its shares of these."""
    normal = picked_rows(steps.normals, steps.entering.clamp(min=0)[:, None])[:, 0]
    shares = times(steps.inverse, normal)
    left = normal - combined(shares, steps.held)
    # Once more: what rounding has left along the rows held goes, too.
    rest = times(steps.inverse, left)
    return normal, left - combined(rest, steps.held), shares + rest


def _drop(steps: _Steps, slot: Tensor, is_dropped: Tensor) -> None:
    """Let go of the row in a slot, where one is to go, and move to where the step has led."""
    is_slot = _one_hot(steps, slot, is_dropped)
    gone = (steps.inverse * is_slot[:, :, None]).sum(1)
    size = torch.where(is_dropped, (gone * gone).sum(1), 1.0)
    along = times(steps.inverse, gone) / size[:, None]
    inverse = steps.inverse - along[:, :, None] * gone[:, None]
    steps.inverse = torch.where(is_slot[:, :, None], 0.0, inverse)
    steps.held = torch.where(is_slot[:, :, None], 0.0, steps.held)
    steps.active = torch.where(is_slot, NO_ROW, steps.active)
    steps.multipliers = torch.where(is_slot, 0.0, steps.multipliers)


def _add(steps: _Steps, normal: Tensor, left: Tensor, shares: Tensor, is_added: Tensor) -> None:
    """Hold the entering row in the first slot that is empty, where it has been reached."""
    slot = (steps.active < 0).to(torch.int8).argmax(1)
    is_slot = _one_hot(steps, slot, is_added)
    length = torch.where(is_added, (left * left).sum(1), 1.0)
    new = left / length[:, None] * is_added[:, None]
    steps.inverse = steps.inverse - shares[:, :, None] * new[:, None]
    steps.inverse = torch.where(is_slot[:, :, None], new[:, None], steps.inverse)
    steps.held = torch.where(is_slot[:, :, None], normal[:, None], steps.held)
    steps.bounds = torch.where(is_slot, _bound_of_entering(steps)[:, None], steps.bounds)
    steps.active = torch.where(is_slot, steps.entering[:, None], steps.active)
    steps.multipliers = torch.where(is_slot, steps.pull[:, None], steps.multipliers)
    steps.entering = torch.where(is_added, NO_ROW, steps.entering)


def _bound_of_entering(steps: _Steps) -> Tensor:
    return steps.offsets.gather(1, steps.entering.clamp(min=0)[:, None])[:, 0]


def _settle(steps: _Steps, normal: Tensor, is_moving: Tensor) -> None:
    """Point that belongs to the multipliers, moved onto the rows held: rounding does not add up."""
    pull = torch.where(steps.entering < 0, 0.0, steps.pull)
    point = steps.action + combined(steps.multipliers, steps.held) + pull[:, None] * normal
    is_held = steps.active >= 0
    off = torch.where(is_held, steps.bounds - times(steps.held, point), 0.0)
    move = combined(off, steps.inverse)
    multipliers = (steps.multipliers + times(steps.inverse, move)).clamp(min=0.0)
    steps.point = torch.where(is_moving[:, None], point + move, steps.point)
    steps.multipliers = torch.where(is_moving[:, None], multipliers, steps.multipliers)


def _one_hot(steps: _Steps, slot: Tensor, is_meant: Tensor) -> Tensor:
    places = torch.arange(steps.active.shape[1], device=slot.device)
    return (places == slot[:, None]) & is_meant[:, None]


def _write(steps: _Steps, out: Projected) -> None:
    """Write what is done to its place."""
    is_done = steps.status != OPEN
    done = steps.part(torch.nonzero(is_done)[:, 0])
    is_solved = done.status == SOLVED
    entering = torch.where(is_solved, NO_ROW, done.entering)
    pull = torch.where(is_solved, 0.0, done.pull)
    out.status[done.place] = done.status
    out.point[done.place] = done.point
    out.active[done.place] = torch.cat([done.active, entering[:, None]], dim=1)
    out.multipliers[done.place] = torch.cat([done.multipliers, pull[:, None]], dim=1)
