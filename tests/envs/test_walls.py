import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.arcs import Segment, point_distance_squared
from envs.walls import (
    CELL_SIZE,
    FEW_WALLS,
    KEPT_MAPS,
    MAX_CELLS_ALONG,
    WallMap,
    cells_within,
    entries_of_row,
    most_entries,
)
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, ShapeError


def random_walls(seed: int, num_walls: int, spread: float = 6.0) -> FloatArray:
    rng = np.random.default_rng([seed, num_walls])
    start = rng.uniform(-spread, spread, (num_walls, 2))
    # Some along the axes, and one that is a point: what grids get wrong first.
    along = rng.uniform(-3.0, 3.0, (num_walls, 2)) * rng.choice([0.0, 1.0], (num_walls, 2))
    return np.stack([start, start + along], axis=1)


def found_near(walls: WallMap, world: int, place: FloatArray, reach: float) -> set[int]:
    """Walls listed in the cells within reach of a place."""
    arrays = walls.arrays
    m = int(arrays.map_of[world])
    left, right, bottom, top = cells_within(arrays, m, place[0], place[1], reach)
    found: set[int] = set()
    for row in range(bottom, top + 1):
        first, end = entries_of_row(arrays, m, row, left, right)
        found |= set((arrays.entry[first:end] - arrays.first_wall[m]).tolist())
    return found


@given(st.integers(0, 999), st.sampled_from([1, FEW_WALLS, FEW_WALLS + 1, 120]))
def test_cells_hold_every_wall_within_reach(seed: int, num_walls: int) -> None:
    segments = random_walls(seed, num_walls)
    walls = WallMap.everywhere(segments, 1)
    rng = np.random.default_rng(seed)
    for place in rng.uniform(-12.0, 12.0, (20, 2)):
        reach = rng.uniform(0.0, 4.0)
        near = {
            s
            for s, segment in enumerate(segments)
            if point_distance_squared(Segment(*segment.ravel()), *place) <= reach * reach
        }
        assert near <= found_near(walls, 0, place, reach)


def test_what_is_found_does_not_grow_with_what_is_far_away() -> None:
    near = random_walls(0, 50)
    far = random_walls(1, 500) + np.array([30.0, 0.0])
    place = np.zeros(2)
    few = found_near(WallMap.everywhere(near, 1), 0, place, 1.0)
    many = found_near(WallMap.everywhere(np.concatenate([near, far]), 1), 0, place, 1.0)
    assert many <= set(range(50))
    assert len(many) <= 2 * len(few) + 10


def test_maps_of_kilometres_have_larger_cells() -> None:
    walls = WallMap.everywhere(random_walls(0, 100, 1000.0), 1)
    arrays, m = walls.arrays, walls.arrays.map_of[0]
    assert arrays.cell_size[m] > CELL_SIZE
    assert (arrays.cells_along <= MAX_CELLS_ALONG + 1).all()


def test_each_world_has_its_own_walls_and_number_of_them() -> None:
    walls = WallMap(3)
    first, second = random_walls(0, 40), random_walls(1, 3)
    walls.replace({0: first})
    walls.replace({2: second})
    np.testing.assert_array_equal(walls.of(0), first)
    assert walls.of(1).shape == (0, 2, 2)
    np.testing.assert_array_equal(walls.of(2), second)
    walls.replace({0: second})
    np.testing.assert_array_equal(walls.of(0), second)
    assert found_near(walls, 0, np.zeros(2), 50.0) == {0, 1, 2}


def test_worlds_with_the_same_walls_share_a_map() -> None:
    first, second = random_walls(0, 40), random_walls(1, 30)
    walls = WallMap.everywhere(first, 3)
    size = len(walls.arrays.segment)
    walls.replace({1: second})
    walls.replace({1: first.copy(), 2: second.copy()})
    assert walls.arrays.map_of[0] == walls.arrays.map_of[1] != walls.arrays.map_of[2]
    assert len(walls.arrays.segment) == size + len(second)


def test_maps_that_no_world_has_are_forgotten_in_the_end() -> None:
    walls = WallMap(2)
    kept = random_walls(0, 30)
    walls.replace({0: kept})
    for seed in range(1, 2 * KEPT_MAPS):
        walls.replace({1: random_walls(seed, 2)})
        assert len(walls.arrays.num_walls) <= KEPT_MAPS + 1
    np.testing.assert_array_equal(walls.of(0), kept)
    np.testing.assert_array_equal(walls.of(1), random_walls(2 * KEPT_MAPS - 1, 2))
    assert found_near(walls, 0, np.zeros(2), 50.0) == set(range(30))


def test_entries_of_the_fullest_map_are_counted() -> None:
    walls = WallMap(3)
    walls.replace({0: random_walls(0, 3), 1: random_walls(1, 200), 2: random_walls(2, 40)})
    alone = WallMap.everywhere(random_walls(1, 200), 1)
    assert most_entries(walls.arrays) == most_entries(alone.arrays) == len(alone.arrays.entry) > 200


def test_who_holds_the_arrays_keeps_their_moment() -> None:
    walls = WallMap.everywhere(random_walls(0, 4), 2)
    before = walls.arrays
    kept = before.segment.copy()
    walls.replace({1: random_walls(1, 4)})
    np.testing.assert_array_equal(before.segment, kept)
    same = walls.arrays
    walls.replace({1: random_walls(1, 4)})
    assert walls.arrays is same


def test_walls_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"walls of world 1: expected shape \(S, 2, 2\)"):
        WallMap(2).replace({1: np.zeros((3, 4))})
    with pytest.raises(NotFinite, match="walls of world 0"):
        WallMap(2).replace({0: np.full((1, 2, 2), np.nan)})
