"""Rows of constraints that the kernels do not know, laid out as the kernels read them.

Letters: B decisions, E rows of the user's a decision, d dimensions.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, IntArray
from safefilter.constraints.constraint import Constraint
from safefilter.errors import OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene

# Kinds of rows. A hard row that permits standing still (offset <= 0) is a budget: like those of `Separation`, the last
# word keeps it exactly, after the cast.
BUDGET, HARD, SOFT, ABSENT = range(4)
# What is told of a row beside its normal and offset: its kind, the number of its source, and what it is against.
NUM_MARKS = 3

# Labels are told as floating-point numbers, which hold so large ones exactly.
LARGEST_LABEL = 2**53

# Whatever the batch: where there is room for no row, kernels look at no decision.
NO_USER_ROWS = np.empty((0, NUM_MARKS, 0))


def user_rows(
    constraints: Mapping[int, Constraint], scene: Scene, wanted: FloatArray, index: IntArray
) -> FloatArray:
    """Ask constraints for their rows.

    Args:
        constraints: Constraints by their number in labels, one or more.
        scene: What the robots know.
        wanted: Wanted velocities, shape (B, d), in m/s.
        index: Robots, shape (B,).

    Returns:
        The rows of all constraints, shape (B, d + 4, E): normal, offset, kind, number of the source, and what the row
        is against. In one array, because each that a kernel is handed costs.

    Raises:
        InvalidInput: If a constraint makes something else.
        ShapeError: If it makes rows for another number of decisions or dimensions.
        OutOfRange: If it labels a row with a number beyond 2^53.
    """
    batch = len(index)
    parts = []
    for number, constraint in constraints.items():
        part = constraint.half_spaces(scene, wanted.copy(), index.copy())
        require_kind(part, f"{constraint.name}: rows", HalfSpaces)
        if (part.num_decisions, part.dimension) != wanted.shape:
            raise ShapeError(
                f"{constraint.name}: expected rows for {batch} decisions in {wanted.shape[1]} dimensions, "
                f"got {part.num_decisions} in {part.dimension}"
            )
        against = part.labels[:, :, 1]
        too_large = (against > LARGEST_LABEL) | (against < -LARGEST_LABEL)
        if too_large.any():
            raise OutOfRange(
                f"{constraint.name}: labels: expected numbers up to 2^53, got {against[too_large][0]}"
            )
        parts.append((number, part))
    return _packed(parts)


def _packed(parts: list[tuple[int, HalfSpaces]]) -> FloatArray:
    # Stacking checks all rows again: not for a single part.
    rows = parts[0][1] if len(parts) == 1 else HalfSpaces.stacked([part for _, part in parts])
    source = np.concatenate(
        [np.full((part.num_decisions, part.num_rows), number) for number, part in parts], axis=1
    )
    is_hard, is_budget = rows.hard, rows.hard & (rows.offsets <= 0.0)
    present = np.where(is_budget, BUDGET, np.where(is_hard, HARD, SOFT))
    kind = np.where(rows.present, present, ABSENT)
    told = np.stack([rows.offsets, kind, source, rows.labels[:, :, 1]], axis=1)
    return np.concatenate([rows.normals.transpose(0, 2, 1), told], axis=1)
