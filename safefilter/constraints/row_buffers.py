"""Where kernels write rows, and how a batch of them becomes `HalfSpaces`.

Letters: B decisions, M rows, d dimensions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import array_formula, formula


class RowLabels(NamedTuple):
    """Rows and what they are against.

    Attributes:
        array: Shape (d + 1, capacity): the normal, and last the offset. With a leading axis B for a batch.
        label: Shape (2, capacity): number of the source, and what the row is against; a leading axis B for a batch.
    """

    array: FloatArray
    label: IntArray


class Sections(NamedTuple):
    """Where each kind of row ends.

    Attributes:
        num_sides: Sides of the allowed set.
        num_separated: One-step separation: budgets for every instant of the step.
        num_budgets: Other hard rows that standing still keeps: walls over a horizon, the user's.
        num_hard: Hard rows of the user's that standing still breaks.
        num_rows: Soft rows.
    """

    num_sides: int
    num_separated: int
    num_budgets: int
    num_hard: int
    num_rows: int


@array_formula
def row_buffers(num_decisions: int, capacity: int, dimension: int = 2) -> RowLabels:
    """Allocate zeroed buffers for a batch."""
    return RowLabels(
        np.zeros((num_decisions, dimension + 1, capacity)),
        np.zeros((num_decisions, 2, capacity), dtype=np.int64),
    )


@formula
def label_rows(rows: RowLabels, first: int, last: int, source: int, other: int) -> None:
    """Label rows [first, last)."""
    for k in range(first, last):
        rows.label[0, k] = source
        rows.label[1, k] = other


def half_spaces_from_rows(
    array: FloatArray,
    label: IntArray,
    num_rows: IntArray,
    num_hard: IntArray,
    sources: tuple[str, ...],
) -> HalfSpaces:
    """View kernel rows as `HalfSpaces`.

    Args:
        array: Shape (B, d + 1, M).
        label: Shape (B, 2, M).
        num_rows: Rows present for each decision, shape (B,).
        num_hard: How many of the first of them are hard, shape (B,).
        sources: Names of the constraints.
    """
    place = np.arange(array.shape[2])
    return HalfSpaces(
        normals=np.ascontiguousarray(np.moveaxis(array[:, :-1], 1, 2)),
        offsets=array[:, -1].copy(),
        hard=place < num_hard[:, None],
        present=place < num_rows[:, None],
        labels=np.ascontiguousarray(np.moveaxis(label, 1, 2)),
        sources=sources,
    )
