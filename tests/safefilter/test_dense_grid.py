"""The dense grid lists whom the hashed one lists, in the same order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter import neighbours
from safefilter.arrays import FloatArray, IntArray
from safefilter.dense_grid import (
    CELLS_PER_ROBOT,
    Box,
    box_of,
    fill_dense_grid,
    fits_densely,
    list_at_once,
    list_densely,
)

REACH = 2.0
CELL = REACH * neighbours.CELL_MARGIN


def cells_of(position: FloatArray) -> IntArray:
    return np.floor(position.T / CELL).astype(np.int64)


def by_hash(position: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """What `find_neighbours` gives of a crowd with someone in another world, who is left out again."""
    stranger = np.append(np.zeros(len(position), np.int64), 1)
    everyone = np.concatenate([position, position[:1]])
    start, found = neighbours.find_neighbours(everyone, stranger, reach)
    return start[:-1], found


@st.composite
def crowds(draw: st.DrawFn) -> FloatArray:
    """From everyone in one place to two robots a cell, anywhere, on a lattice of half the reach or not."""
    num_robots = draw(st.sampled_from((49, 60, 300)))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    spread = REACH * math.sqrt(num_robots) * draw(st.sampled_from((0.0, 0.1, 0.5)))
    centre = draw(st.sampled_from((0.0, -3.0, 1e3, 1e9)))
    position: FloatArray = centre + rng.uniform(-spread, spread, (num_robots, 2))
    return np.round(position) if draw(st.booleans()) else position


@given(position=crowds())
def test_lists_are_those_of_the_hashed_grid_in_the_same_order(position: FloatArray) -> None:
    cells = cells_of(position)
    expected_start, expected = by_hash(position, REACH)
    for make_lists in (list_densely, list_at_once):
        start, found = make_lists(position, cells, box_of(cells), REACH)
        np.testing.assert_array_equal(start, expected_start)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("num_robots", [100, neighbours.AT_ONCE_LIMIT + 1])
def test_crowds_of_any_size_are_listed_in_that_order(num_robots: int) -> None:
    spread = REACH * math.sqrt(num_robots)
    position = np.random.default_rng(0).uniform(0.0, spread, (num_robots, 2))
    world = np.zeros(num_robots, np.int64)
    for wanted, found in zip(
        by_hash(position, REACH),
        neighbours.find_neighbours(position, world, REACH),
        strict=True,
    ):
        np.testing.assert_array_equal(found, wanted)


def test_box_by_hand() -> None:
    # Columns 3 to 5 and cells 7 to 7 of each, and a border around.
    assert box_of(np.array([[5, 3], [7, 7]])) == Box(2, 6, 5, 3)


@pytest.mark.parametrize("columns", [1, 2**37 + 3])
def test_a_box_much_larger_than_its_crowd_is_refused(columns: int) -> None:
    assert fits_densely(Box(0, 0, columns, CELLS_PER_ROBOT * 10), 10) == (columns == 1)
    assert not fits_densely(Box(0, 0, 2**37, 2**37), 10**6)


def test_robots_are_sorted_by_cell_and_keep_their_order() -> None:
    position = np.array([[5.0, 0.0], [0.5, 0.5], [0.2, 0.1], [0.5, 3.0]])
    cells = cells_of(position)
    grid = fill_dense_grid(position, cells, box_of(cells))
    assert grid.order.tolist() == [1, 2, 3, 0]
    np.testing.assert_array_equal(grid.position, position[grid.order].T)
    assert grid.cell_start[-1] == 4
    for place, cell in enumerate(grid.cell.tolist()):
        assert grid.cell_start[cell] <= place < grid.cell_start[cell + 1]


def test_exactly_at_the_reach_is_within() -> None:
    position = np.array([[0.0, 0.0], [REACH, 0.0], [math.nextafter(2.0 * REACH, 9.0), 0.0]])
    cells = cells_of(position)
    start, found = list_densely(position, cells, box_of(cells), REACH)
    assert start.tolist() == [0, 1, 2, 2]
    assert found.tolist() == [1, 0]
