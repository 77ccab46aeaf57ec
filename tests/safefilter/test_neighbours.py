"""The grid finds whom looking at every pair finds."""

from __future__ import annotations

import math
from itertools import pairwise

import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import OutOfRange
from safefilter.neighbours import (
    ALL_PAIRS_LIMIT,
    CELL_MARGIN,
    MAX_CELL,
    UNLIMITED_LIMIT,
    blocks_of,
    bucket,
    cell_along,
    find_neighbours,
    is_within,
    longest_list,
)
from safefilter.threads import MIN_ITEMS

# Far from everyone else, so that a few robots of interest meet the grid and not the search of all pairs.
CROWD = np.stack([1e6 + 1e4 * np.arange(ALL_PAIRS_LIMIT), np.zeros(ALL_PAIRS_LIMIT)], axis=1)


def lists(position: FloatArray, world: IntArray, reach: float) -> list[list[int]]:
    start, neighbours = find_neighbours(position, world, reach)
    assert start[0] == 0
    assert start[-1] == len(neighbours)
    return [sorted(neighbours[a:b].tolist()) for a, b in pairwise(start.tolist())]


def brute_force(position: FloatArray, world: IntArray, reach: float) -> list[list[int]]:
    difference = position[None] - position[:, None]
    squared = difference[..., 0] ** 2 + difference[..., 1] ** 2
    near = (squared <= reach * reach) & (world[:, None] == world[None])
    np.fill_diagonal(near, val=False)
    return [np.flatnonzero(row).tolist() for row in near]


def in_crowd(position: list[list[float]], reach: float) -> list[list[int]]:
    """Neighbours of a few robots, as the grid finds them."""
    everyone = np.concatenate([np.array(position), CROWD])
    found = lists(everyone, np.zeros(len(everyone), dtype=np.int64), reach)
    return found[: len(position)]


@st.composite
def crowds(draw: st.DrawFn) -> tuple[FloatArray, IntArray, float]:
    """Robots at any density, anywhere up to 1e9 m from the origin, in up to three worlds; a reach."""
    num_robots = draw(st.sampled_from((0, 1, 2, ALL_PAIRS_LIMIT, ALL_PAIRS_LIMIT + 1, 90)))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    reach = 10.0 ** draw(st.floats(-1.0, 3.0))
    spread = reach * draw(st.sampled_from((0.0, 0.3, 3.0, 30.0)))
    centre = draw(st.sampled_from((0.0, -5.0, 1e3, 1e9, -1e9)))
    position = centre + rng.uniform(-spread, spread, (num_robots, 2))
    if draw(st.booleans()):
        # A lattice of half the reach: distances, and borders of cells, are met exactly.
        position = np.round(2.0 * position / reach) * (reach / 2.0)
    worlds = draw(st.sampled_from((1, 3)))
    world = rng.integers(0, worlds, num_robots)
    # Worlds one after the other are searched each for itself; so are small ones among them.
    return position, np.sort(world) if draw(st.booleans()) else world, reach


@given(crowd=crowds())
def test_grid_finds_whom_every_pair_finds(crowd: tuple[FloatArray, IntArray, float]) -> None:
    assert lists(*crowd) == brute_force(*crowd)


@given(crowd=crowds())
def test_whoever_sees_is_seen(crowd: tuple[FloatArray, IntArray, float]) -> None:
    found = lists(*crowd)
    for i, neighbours in enumerate(found):
        assert i not in neighbours
        assert all(i in found[j] for j in neighbours)


@given(crowd=crowds())
def test_infinite_reach_sees_the_whole_world(crowd: tuple[FloatArray, IntArray, float]) -> None:
    position, world, _ = crowd
    for i, neighbours in enumerate(lists(position, world, math.inf)):
        assert neighbours == [j for j in range(len(world)) if j != i and world[j] == world[i]]


@given(crowd=crowds(), seed=st.integers(0, 99))
def test_numbering_does_not_matter(crowd: tuple[FloatArray, IntArray, float], seed: int) -> None:
    position, world, reach = crowd
    order = np.random.default_rng(seed).permutation(len(world))
    found, shuffled = lists(position, world, reach), lists(position[order], world[order], reach)
    assert [sorted(order[shuffled[k]].tolist()) for k in range(len(world))] == [
        found[i] for i in order
    ]


def test_everyone_in_one_place_sees_everyone() -> None:
    position = np.full((70, 2), -3.5)
    for neighbours in lists(position, np.zeros(70, dtype=np.int64), 1e-3):
        assert len(neighbours) == 69


def test_worlds_that_share_a_bucket_stay_apart() -> None:
    # The hash of the second world differs by a multiple of the number of buckets.
    world = np.array([0, 2**20] * 35)
    position = np.full((70, 2), 0.5)
    assert bucket(0, 0, 0, 256) == bucket(0, 0, 2**20, 256)
    assert lists(position, world, 1.0) == brute_force(position, world, 1.0)


def test_exactly_at_the_reach_is_within() -> None:
    assert in_crowd([[0.0, 0.0], [3.0, 4.0]], 5.0) == [[1], [0]]
    assert in_crowd([[0.0, 0.0], [3.0, 4.0]], math.nextafter(5.0, 0.0)) == [[], []]


@pytest.mark.parametrize("reach", [0.1, 0.3, 5.0, 7.3])
@pytest.mark.parametrize("cell", [-3, -1, 0, 1, 3])
def test_rounding_at_the_border_of_a_cell_loses_nobody(reach: float, cell: int) -> None:
    # Hardly across a border of cells of one reach: two cells apart, but within reach.
    here = math.nextafter(cell * reach, -math.inf) if cell else -1e-20
    there = cell * reach + reach
    found = in_crowd([[here, 0.0], [there, 0.0]], reach)
    assert found == ([[1], [0]] if there - here <= reach else [[], []])


@pytest.mark.parametrize("far", [1e15, -1e18, 1e20, -1e20, 1e100])
@pytest.mark.parametrize("reach", [1e-3, 1.0])
def test_robots_in_one_place_see_each_other_however_far_out(far: float, reach: float) -> None:
    assert in_crowd([[far, -far], [far, -far], [-far, far]], reach) == [[1], [0], []]


@given(
    coordinate=st.floats(-1e100, 1e100),
    step=st.floats(0.0, 1.0),
    reach=st.floats(1e-3, 1e3),
)
@example(coordinate=1e100, step=1.0, reach=1e-3)
@example(coordinate=-1e-20, step=1.0, reach=0.3)
def test_robots_within_reach_are_at_most_one_cell_apart(
    coordinate: float, step: float, reach: float
) -> None:
    other = coordinate + step * reach
    if abs(other - coordinate) <= reach:
        size = CELL_MARGIN * reach
        assert cell_along(other, size) - cell_along(coordinate, size) in {0, 1}


@given(
    x=st.integers(-(2**36) - 1, 2**36 + 1),
    y=st.integers(-(2**36) - 1, 2**36 + 1),
    world=st.integers(-(2**31), 2**31),
    power=st.integers(0, 20),
)
def test_every_cell_has_its_bucket(x: int, y: int, world: int, power: int) -> None:
    assert MAX_CELL == 2.0**36
    assert 0 <= bucket(x, y, world, 2**power) < 2**power


def test_robots_are_not_their_own_neighbours() -> None:
    position, world = np.zeros((2, 2)), np.array([0, 1])
    assert not is_within(position, world, 0, 0, 1.0)
    assert not is_within(position, world, 0, 1, 1.0)
    assert is_within(position, np.zeros(2, dtype=np.int64), 0, 1, 0.0)


def test_dense_crowds_make_room_for_all_their_pairs() -> None:
    # Far more neighbours a robot than room is made for at first.
    rng = np.random.default_rng(0)
    position, world = rng.uniform(0.0, 1.0, (300, 2)), np.zeros(300, dtype=np.int64)
    assert lists(position, world, 0.7) == brute_force(position, world, 0.7)


@pytest.mark.parametrize("density", [1.0, 30.0])
def test_result_is_the_same_for_any_number_of_threads(density: float) -> None:
    num_robots = 3 * MIN_ITEMS
    rng = np.random.default_rng(1)
    position = rng.uniform(0.0, math.sqrt(num_robots / density), (num_robots, 2))
    world = rng.integers(0, 2, num_robots)
    results = []
    for num_threads in (1, 2, 5):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(numba, "get_num_threads", lambda number=num_threads: number)
            results.append(find_neighbours(position, world, 1.0))
    for start, neighbours in results[1:]:
        np.testing.assert_array_equal(start, results[0][0])
        np.testing.assert_array_equal(neighbours, results[0][1])


def test_order_is_always_the_same() -> None:
    position = np.random.default_rng(2).uniform(0.0, 5.0, (80, 2))
    world = np.zeros(80, dtype=np.int64)
    one, other = find_neighbours(position, world, 1.0), find_neighbours(position, world, 1.0)
    np.testing.assert_array_equal(one[1], other[1])


@given(st.lists(st.tuples(st.integers(1, 9), st.booleans()), min_size=1, max_size=30))
def test_blocks_are_cut_where_no_world_is(sizes: list[tuple[int, bool]]) -> None:
    # Worlds of some robots each, some of them with a robot of a world of its own among them.
    world, expected = [], [0]
    for number, (size, has_stray) in enumerate(sizes):
        world += [10 * number] * size + ([10 * number + 1, 10 * number] if has_stray else [])
        expected.append(len(world))
    assert blocks_of(np.array(world)).tolist() == expected


def test_nobody_makes_no_block() -> None:
    assert blocks_of(np.zeros(0, dtype=np.int64)).tolist() == [0]


@given(sizes=st.lists(st.integers(0, 9)))
def test_the_longest_list_is_found(sizes: list[int]) -> None:
    start = np.cumsum([0, *sizes])
    assert longest_list(start) == max(sizes, default=0)


def test_a_large_world_needs_a_reach() -> None:
    position, number = np.zeros((UNLIMITED_LIMIT + 1, 2)), np.zeros(UNLIMITED_LIMIT + 1, np.int64)
    with pytest.raises(OutOfRange, match=r"reach: 5001 robots of one world .* give a reach, in m"):
        find_neighbours(position, number, math.inf)


def test_many_small_worlds_need_none() -> None:
    number = np.repeat(np.arange(3000), 3)
    start, neighbours = find_neighbours(np.zeros((9000, 2)), number, math.inf)
    assert (np.diff(start) == 2).all()
    assert (number[neighbours] == np.repeat(number, 2)).all()
