"""Neighbours in space: everyone within reach, nobody else, once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.neighbours import ALL_PAIRS_LIMIT
from safefilter.neighbours_in_space import find_neighbours_in_space

MANY = 4 * ALL_PAIRS_LIMIT


def expected(position: FloatArray, world: IntArray, reach: float) -> list[list[int]]:
    distance_squared = ((position[:, None] - position) ** 2).sum(axis=2)
    sees = (distance_squared <= reach**2) & (world[:, None] == world)
    np.fill_diagonal(sees, val=False)
    return [np.flatnonzero(row).tolist() for row in sees]


def found(position: FloatArray, world: IntArray, reach: float) -> list[list[int]]:
    start, neighbours = find_neighbours_in_space(position, world, reach)
    lists = np.split(neighbours, start[1:-1]) if len(position) else []
    return [sorted(part.tolist()) for part in lists]


@given(
    seed=st.integers(0, 999),
    size=st.sampled_from((1, 2, 10, ALL_PAIRS_LIMIT, MANY)),
    reach=st.sampled_from((0.05, 0.3, 1.0, 10.0)),
    worlds=st.sampled_from((1, 3)),
    spread=st.sampled_from((1.0, 30.0)),
)
def test_they_are_those_within_reach(
    seed: int, size: int, reach: float, worlds: int, spread: float
) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-1.0, 1.0, (size, 3)) * [1.0, spread, spread]
    world = rng.integers(0, worlds, size)
    assert found(position, world, reach) == expected(position, world, reach)


@pytest.mark.parametrize("size", [10, MANY])
def test_robots_exactly_at_the_end_of_the_reach_are_seen(size: int) -> None:
    # A stack of robots, each seeing the next one up and down.
    position = np.zeros((size, 3))
    position[:, 2] = np.arange(size)
    world = np.zeros(size, dtype=np.int64)
    lists = found(position, world, 1.0)
    assert lists[0] == [1]
    assert lists[5] == [4, 6]
    assert lists == expected(position, world, 1.0)


def test_without_a_reach_everyone_sees_everyone_of_the_same_world() -> None:
    rng = np.random.default_rng(0)
    position, world = rng.normal(size=(MANY, 3)), rng.integers(0, 2, MANY)
    assert found(position, world, math.inf) == expected(position, world, math.inf)


def test_places_far_out_share_the_last_floor() -> None:
    rng = np.random.default_rng(0)
    position = rng.uniform(-0.1, 0.1, (MANY, 3))
    position[::2, 2] = 1e90
    position[1::4, 2] = -1e90
    world = np.zeros(MANY, dtype=np.int64)
    assert found(position, world, 0.1) == expected(position, world, 0.1)


def test_one_floor_full_of_robots_needs_more_room_than_guessed() -> None:
    position = np.random.default_rng(0).uniform(0.0, 0.05, (MANY, 3))
    world = np.zeros(MANY, dtype=np.int64)
    assert found(position, world, 0.1) == expected(position, world, 0.1)


def test_nobody_sees_nobody() -> None:
    start, neighbours = find_neighbours_in_space(np.empty((0, 3)), np.empty(0, np.int64), 1.0)
    assert start.tolist() == [0]
    assert neighbours.tolist() == []
