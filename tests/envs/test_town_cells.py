import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from envs.scenarios.town_cells import (
    EAST,
    NORTH,
    PITCH,
    SOUTH,
    WEST,
    cell_beside,
    cell_centres,
    sides_of_cells,
    squares_of_cells,
)

sizes = st.integers(2, 9)


def test_nine_cells_by_hand() -> None:
    assert cell_centres(np.array([0, 4, 8]), 3).tolist() == [
        [-PITCH, -PITCH],
        [0, 0],
        [PITCH, PITCH],
    ]
    assert [cell_beside(4, quarter, 3) for quarter in (EAST, NORTH, WEST, SOUTH)] == [5, 7, 3, 1]
    assert [cell_beside(2, quarter, 3) for quarter in (EAST, NORTH, WEST, SOUTH)] == [
        None,
        5,
        1,
        None,
    ]
    assert squares_of_cells(2).tolist() == [[0, 1, 2, 3]]


@given(sizes, st.integers(0, 80), st.integers(0, 3))
def test_cells_beside_are_a_pitch_away_and_back_again(size: int, cell: int, quarter: int) -> None:
    cell %= size * size
    other = cell_beside(cell, quarter, size)
    if other is None:
        return
    angle = 0.5 * np.pi * quarter
    step = np.subtract(*cell_centres(np.array([other, cell]), size))
    np.testing.assert_allclose(step, PITCH * np.array([np.cos(angle), np.sin(angle)]), atol=1e-12)
    assert cell_beside(other, (quarter + 2) % 4, size) == cell


@given(sizes)
def test_sides_are_between_cells_beside_each_other(size: int) -> None:
    sides = sides_of_cells(size)
    assert len(sides) == 2 * size * (size - 1)
    assert len({tuple(side) for side in sides.tolist()}) == len(sides)
    offset = np.abs(np.subtract(*np.moveaxis(cell_centres(sides, size), 1, 0)))
    np.testing.assert_allclose(
        np.sort(offset, axis=1), np.tile([0.0, PITCH], (len(sides), 1)), atol=1e-12
    )


@given(sizes)
def test_squares_share_a_corner(size: int) -> None:
    squares = squares_of_cells(size)
    assert len(squares) == (size - 1) ** 2
    centres = cell_centres(squares, size)
    offset = centres - centres.mean(axis=1, keepdims=True)
    signs = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
    np.testing.assert_allclose(offset, np.broadcast_to(signs * PITCH / 2, offset.shape), atol=1e-12)
