"""Distance fields: by hand, symmetric, between the straight distance and a graph's, and infinite behind walls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from envs.distance_field import Grid, fill_field, length_at, upwind
from safefilter.arrays import BoolArray, FloatArray

SPACING = 0.1
GRID = Grid(0.0, 0.0, SPACING)
SIZE = 21


def filled(is_free: BoolArray, goal: tuple[float, float]) -> FloatArray:
    field = np.empty(is_free.shape)
    fill_field(is_free, GRID, *goal, field)
    return field


def all_free() -> BoolArray:
    return np.ones((SIZE, SIZE), dtype=np.bool_)


def straight(goal: tuple[float, float]) -> FloatArray:
    along = SPACING * np.arange(SIZE)
    found: FloatArray = np.hypot(along - goal[0], along[:, np.newaxis] - goal[1])
    return found


def test_upwind_by_hand() -> None:
    # From equal distances the front runs along the diagonal, from one side alone straight on.
    assert upwind(1.0, 1.0, 0.1) == pytest.approx(1.0 + 0.1 / math.sqrt(2.0))
    assert upwind(1.0, 1.2, 0.1) == pytest.approx(1.1)
    assert upwind(math.inf, 2.0, 0.1) == pytest.approx(2.1)
    assert upwind(2.0, math.inf, 0.1) == pytest.approx(2.1)


@given(near=st.floats(0.0, 10.0), more=st.floats(0.0, 0.1), spacing=st.floats(0.01, 0.1))
def test_upwind_solves_the_eikonal_equation(near: float, more: float, spacing: float) -> None:
    length = upwind(near, near + min(more, 0.99 * spacing), spacing)
    slope = math.hypot(length - near, length - near - min(more, 0.99 * spacing)) / spacing
    assert slope == pytest.approx(1.0, abs=1e-6)


def test_without_walls_the_way_is_straight_to_a_part_of_a_step() -> None:
    goal = (1.0, 0.7)
    field, expected = filled(all_free(), goal), straight(goal)
    assert (field >= expected - 1e-9).all()
    assert (field <= expected + 0.8 * SPACING).all()
    # Along the axes through a goal on a point nothing is added.
    np.testing.assert_allclose(field[7, :], expected[7, :], atol=1e-9)


def test_a_wall_is_gone_round() -> None:
    is_free = all_free()
    is_free[10, :18] = False
    field = filled(is_free, (0.0, 0.5))
    # To a point behind the wall, by its end at (1.8, 1.0).
    around = math.hypot(1.8, 0.5) + math.hypot(1.8, 0.5)
    assert field[15, 0] == pytest.approx(around, rel=0.06)
    assert field[15, 0] > 3.0 * straight((0.0, 0.5))[15, 0]


def test_what_is_shut_off_has_no_way_and_walls_have_a_rim() -> None:
    is_free = all_free()
    is_free[8:14] = False
    field = filled(is_free, (1.0, 0.3))
    assert (field[14:] == math.inf).all()
    np.testing.assert_allclose(field[8, 1:-1], SPACING + worst_of_three(field[7]))
    assert (field[9:14] == math.inf).all()


def test_the_short_way_behind_a_thin_wall_does_not_shine_through() -> None:
    is_free = all_free()
    is_free[10, :18] = False
    field = filled(is_free, (0.0, 0.5))
    # Points in the wall belong to the long way round for robots on either side.
    assert (field[10, 1:16] > field[11, 1:16]).all()


@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.4))
def test_between_straight_ways_and_those_of_a_graph(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    is_free = rng.uniform(size=(SIZE, SIZE)) >= share
    goal = rng.integers(SIZE, size=2)
    is_free[goal[0], goal[1]] = True
    field = filled(is_free, (SPACING * goal[1], SPACING * goal[0]))
    steps = graph_lengths(is_free, int(goal[0]), int(goal[1]))
    is_reached = is_free & np.isfinite(steps)
    bird = straight((SPACING * goal[1], SPACING * goal[0]))
    assert (field[is_reached] <= steps[is_reached] + 1e-3).all()
    assert (field[is_reached] >= bird[is_reached] - 1e-9).all()


@given(seed=st.integers(0, 2**32 - 1))
def test_mirrored_walls_have_mirrored_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    is_free = rng.uniform(size=(SIZE, SIZE)) >= 0.2
    field = filled(is_free, (0.5, 0.8))
    mirrored = filled(np.ascontiguousarray(is_free[:, ::-1]), (SPACING * (SIZE - 1) - 0.5, 0.8))
    np.testing.assert_allclose(mirrored[:, ::-1], field, atol=1e-3)


def test_lengths_between_points_are_between_theirs() -> None:
    field = filled(all_free(), (0.0, 0.0))
    assert length_at(field, GRID, 1.3, 0.4) == pytest.approx(field[4, 13])
    assert length_at(field, GRID, 1.35, 0.4) == pytest.approx((field[4, 13] + field[4, 14]) / 2.0)
    assert length_at(field, GRID, 2.0, 2.0) == pytest.approx(field[20, 20])
    assert length_at(field, GRID, 2.01, 1.0) == math.inf
    assert length_at(field, GRID, -0.01, 1.0) == math.inf


def test_next_to_points_without_a_length_there_is_none() -> None:
    field = np.full((3, 3), math.inf)
    field[0] = 1.0
    assert length_at(field, GRID, 0.05, 0.05) == math.inf
    assert length_at(field, GRID, 0.0, 0.0) == math.inf


def worst_of_three(row: FloatArray) -> FloatArray:
    found: FloatArray = np.max([row[:-2], row[1:-1], row[2:]], axis=0)
    return found


def graph_lengths(is_free: BoolArray, row: int, column: int) -> FloatArray:
    """Lengths of ways that go along the axes only."""
    number = np.arange(is_free.size).reshape(is_free.shape)
    pairs = [
        (number[:, :-1], number[:, 1:], is_free[:, :-1] & is_free[:, 1:]),
        (number[:-1], number[1:], is_free[:-1] & is_free[1:]),
    ]
    first = np.concatenate([a[both] for a, _, both in pairs])
    second = np.concatenate([b[both] for _, b, both in pairs])
    size = is_free.size
    graph = coo_array((np.full(len(first), SPACING), (first, second)), shape=(size, size))
    found: FloatArray = dijkstra(graph.tocsr(), directed=False, indices=number[row, column])
    return found.reshape(is_free.shape)
