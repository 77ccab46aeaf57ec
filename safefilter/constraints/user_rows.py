"""Rows of constraints that the kernels do not know, laid out as the kernels read them.

Letters: B decisions, E rows of the user's a decision, d dimensions.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, IntArray
from safefilter.constraints.constraint import Constraint
from safefilter.errors import ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene


class UserRows(NamedTuple):
    """Rows of the user's own constraints: budgets first, then other hard rows, then soft ones.

    A hard row that permits standing still (offset <= 0) is a budget: like those of `Separation`, the last word keeps it
    exactly, after the cast.

    Attributes:
        array: Shape (B, d + 1, E): the normal, and last the offset.
        label: Shape (B, 2, E): number of the source, and what the row is against.
        count: Shape (B, 3): number of budgets, of hard rows, and of all rows.
    """

    array: FloatArray
    label: IntArray
    count: IntArray  # type: ignore[assignment]  # hides tuple.count, which nobody calls


# Whatever the batch: where there is room for no row, kernels look at no decision.
NO_USER_ROWS = UserRows(
    np.empty((0, 3, 0)), np.empty((0, 2, 0), dtype=np.int64), np.empty((0, 3), dtype=np.int64)
)


def user_rows(
    constraints: Mapping[int, Constraint], scene: Scene, wanted: FloatArray, index: IntArray
) -> UserRows:
    """Ask constraints for their rows.

    Args:
        constraints: Constraints by their number in labels.
        scene: What the robots know.
        wanted: Wanted velocities, shape (B, d), in m/s.
        index: Robots, shape (B,).

    Returns:
        The rows, or `NO_USER_ROWS` without a constraint.

    Raises:
        InvalidInput: If a constraint makes something else.
        ShapeError: If it makes rows for another number of decisions or dimensions.
    """
    batch = len(index)
    if not constraints:
        return NO_USER_ROWS
    parts = []
    for number, constraint in constraints.items():
        part = constraint.half_spaces(scene, wanted.copy(), index.copy())
        require_kind(part, f"{constraint.name}: rows", HalfSpaces)
        if (part.num_decisions, part.dimension) != wanted.shape:
            raise ShapeError(
                f"{constraint.name}: expected rows for {batch} decisions in {wanted.shape[1]} dimensions, "
                f"got {part.num_decisions} in {part.dimension}"
            )
        parts.append((number, part))
    return _packed(parts)


def _packed(parts: list[tuple[int, HalfSpaces]]) -> UserRows:
    # Stacking checks all rows again: not for a single part.
    rows = parts[0][1] if len(parts) == 1 else HalfSpaces.stacked([part for _, part in parts])
    source = np.concatenate(
        [np.full((part.num_decisions, part.num_rows), number) for number, part in parts], axis=1
    )
    hard = rows.present & rows.hard
    budget = hard & (rows.offsets <= 0.0)
    kind = np.where(budget, 0, np.where(hard, 1, np.where(rows.present, 2, 3)))
    order = np.argsort(kind, axis=1, kind="stable")
    array = np.concatenate([rows.normals.transpose(0, 2, 1), rows.offsets[:, None]], axis=1)
    label = np.stack([source, rows.labels[:, :, 1]], axis=1)
    return UserRows(
        np.take_along_axis(array, order[:, None], axis=2),
        np.take_along_axis(label, order[:, None], axis=2),
        np.stack([part.sum(axis=1) for part in (budget, hard, rows.present)], axis=1),
    )
