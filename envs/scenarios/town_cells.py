"""Cells of towns: squares on a grid, numbered row by row from the south-west.

SI units; x points east, y north.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray, IntArray

PITCH = 1.3
"""Side of a cell, in m."""
EAST, NORTH, WEST, SOUTH = range(4)
"""Directions of streets, in quarter turns from the east."""


def cell_centres(cells: IntArray, size: int) -> FloatArray:
    """Centres of cells, shape (..., 2), in m; the town is centred at the origin.

    Args:
        cells: Numbers, shape (...).
        size: Cells along each side.
    """
    row, column = np.divmod(cells, size)
    return np.stack([column, row], axis=-1) * PITCH - (size - 1) * PITCH / 2.0


def cell_beside(cell: int, quarter: int, size: int) -> int | None:
    """The next cell in a direction; None outside the town.

    Args:
        cell: Number.
        quarter: `EAST`, `NORTH`, `WEST` or `SOUTH`.
        size: Cells along each side.
    """
    row, column = divmod(cell, size)
    row += (quarter == NORTH) - (quarter == SOUTH)
    column += (quarter == EAST) - (quarter == WEST)
    is_inside = 0 <= row < size and 0 <= column < size
    return row * size + column if is_inside else None


def sides_of_cells(size: int) -> IntArray:
    """Pairs of cells that share a side, the lower number first, shape (2 size (size - 1), 2).

    Args:
        size: Cells along each side.
    """
    number = np.arange(size * size).reshape(size, size)
    beside = np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)
    above = np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1)
    return np.concatenate([beside, above])


def squares_of_cells(size: int) -> IntArray:
    """Fours of cells around a corner that they share: south-west, south-east, north-west, north-east, shape (K, 4).

    Args:
        size: Cells along each side.
    """
    number = np.arange(size * size).reshape(size, size)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]]
    return np.stack(corners, axis=-1).reshape(-1, 4)
