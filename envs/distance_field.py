"""Distance fields: how far it is to a goal around walls, from every point of a grid, compiled.

The distance u of a robot that cannot leave free space solves |grad u| = 1 with u = 0 at the goal. It is solved on grid
points by fast sweeping: each takes the smallest value that its neighbours allow by the upwind difference, in four
orders in turn, until nothing changes. Source: H. Zhao, "A fast sweeping method for eikonal equations", 2005, Eq. (2.4).
First-order: lengths come out too long, by a part of a grid step where the way is straight.

Letters: R rows and C columns of a grid, K points, G goals. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import formula, kernel

EXACT_STEPS = 1.5
"""Points within so many grid steps of the goal have straight distances: upwind differences are least exact there."""
SMALLEST_CHANGE = 1e-5
"""In m: less is not worth another sweep."""


class Grid(NamedTuple):
    """Points corner + spacing (column, row).

    Attributes:
        x: Of the south-west corner, in m.
        y: Of the same.
        spacing: Between points, in m.
    """

    x: float
    y: float
    spacing: float


@formula
def upwind(across: float, along: float, spacing: float) -> float:
    """Distance at a point from the lesser ones beside it on each axis, Eq. (2.4) of Zhao; one may be infinite."""
    difference = abs(across - along)
    if not difference < spacing:
        return min(across, along) + spacing
    return 0.5 * (across + along + math.sqrt(2.0 * spacing * spacing - difference * difference))


@kernel
def fill_field(
    is_free: BoolArray, grid: Grid, goal_x: float, goal_y: float, field: FloatArray
) -> None:
    """Write distances to a goal.

    Args:
        is_free: Has a robot room at a point? Shape (R, C).
        grid: Where points are.
        goal_x: In m.
        goal_y: In m.
        field: Written to, shape (R, C), in m. Infinite where there is no way.
    """
    num_rows, num_columns = field.shape
    for row in range(num_rows):
        for column in range(num_columns):
            x, y = grid.x + grid.spacing * column, grid.y + grid.spacing * row
            distance = math.hypot(x - goal_x, y - goal_y)
            is_near = distance <= EXACT_STEPS * grid.spacing
            field[row, column] = distance if is_near else math.inf
    order = 0
    unchanged = 0
    while unchanged < 4:
        is_changed = _sweep(is_free, grid.spacing, order % 2 == 1, order // 2 % 2 == 1, field)
        unchanged = 0 if is_changed else unchanged + 1
        order += 1
    _widen(is_free, grid.spacing, field)


@kernel
def _sweep(
    is_free: BoolArray, spacing: float, is_southward: bool, is_westward: bool, field: FloatArray
) -> bool:
    """Go over all points once; tells whether anything changed."""
    num_rows, num_columns = field.shape
    is_changed = False
    for i in range(num_rows):
        row = num_rows - 1 - i if is_southward else i
        for j in range(num_columns):
            column = num_columns - 1 - j if is_westward else j
            if not is_free[row, column]:
                continue
            across = along = math.inf
            if column > 0:
                across = field[row, column - 1]
            if column < num_columns - 1:
                across = min(across, field[row, column + 1])
            if row > 0:
                along = field[row - 1, column]
            if row < num_rows - 1:
                along = min(along, field[row + 1, column])
            if across == math.inf and along == math.inf:
                continue
            length = upwind(across, along, spacing)
            if length < field[row, column] - SMALLEST_CHANGE:
                field[row, column] = length
                is_changed = True
    return is_changed


@kernel
def _widen(is_free: BoolArray, spacing: float, field: FloatArray) -> None:
    """Give points without room the length of the worst free point beside them, and a step: robots stand between both.

    The worst, so that behind a thin wall the shorter way of its other side does not shine through.
    """
    num_rows, num_columns = field.shape
    for row in range(num_rows):
        for column in range(num_columns):
            if is_free[row, column] or field[row, column] < math.inf:
                continue
            length = -1.0
            for down in range(max(row - 1, 0), min(row + 2, num_rows)):
                for right in range(max(column - 1, 0), min(column + 2, num_columns)):
                    if is_free[down, right] and field[down, right] < math.inf:
                        length = max(length, field[down, right])
            if length >= 0.0:
                field[row, column] = length + spacing


@formula
def length_at(field: FloatArray, grid: Grid, x: float, y: float) -> float:
    """Length at any place, between the points around it; infinite next to points without one, or outside."""
    column, row = (x - grid.x) / grid.spacing, (y - grid.y) / grid.spacing
    if not (0.0 <= column <= field.shape[1] - 1 and 0.0 <= row <= field.shape[0] - 1):
        return math.inf
    i, j = min(int(column), field.shape[1] - 2), min(int(row), field.shape[0] - 2)
    east, north = column - i, row - j
    south_side = (1.0 - east) * field[j, i] + east * field[j, i + 1]
    north_side = (1.0 - east) * field[j + 1, i] + east * field[j + 1, i + 1]
    length: float = (1.0 - north) * south_side + north * north_side
    # Nothing times infinity is not a number.
    return math.inf if math.isnan(length) else length
