import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs import Navigation
from envs.fleet import MAX_SPEED, RADIUS
from envs.scenarios.town import AVENUE_JITTER, PRIORITIES, SLOW_SHARE, SLOW_SPEED, Split, Town
from envs.scenarios.town_avenues import HALF_WIDTH
from envs.scenarios.town_cells import PITCH
from envs.scenarios.wall_kernel import wall_distances
from envs.scenarios.ways import shortest_ways
from safefilter.errors import InvalidInput, OutOfRange

TOWNS = [Town(2), Town(8, "held-out"), Town(24)]


def test_no_map_is_both_trained_in_and_tested_in() -> None:
    training, held_out = Town(8, "training"), Town(8, "held-out")
    numbers = [{town.map_number(draw) for draw in range(1000)} for town in (training, held_out)]
    assert not numbers[0] & numbers[1]
    walls = [
        {town.map(draw).walls.tobytes() for draw in range(80)} for town in (training, held_out)
    ]
    assert not walls[0] & walls[1]


@pytest.mark.parametrize("split", ["training", "held-out"])
def test_everybody_can_arrive_in_fifty_towns(split: Split) -> None:
    for seed in range(25):
        placement = Town(8, split).place(np.random.default_rng(seed))
        assert np.isfinite(shortest_ways(placement, RADIUS)).all(), seed


@pytest.mark.parametrize("town", TOWNS)
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**32))
def test_robots_start_apart_and_clear_of_walls(town: Town, seed: int) -> None:
    placement = town.place(np.random.default_rng(seed))
    for points in (placement.start, placement.goal):
        distance = np.linalg.norm(points[:, np.newaxis] - points, axis=-1)
        distance[np.diag_indices(len(distance))] = np.inf
        # On avenues robots start anywhere across the street.
        assert distance.min() > PITCH - 2.0 * AVENUE_JITTER - 1e-9
        assert wall_distances(points, placement.walls).min() > HALF_WIDTH[0] - AVENUE_JITTER - 1e-9
    least = PITCH - 2.0 * AVENUE_JITTER - 1e-9
    assert (np.linalg.norm(placement.goal - placement.start, axis=1) > least).all()
    assert np.abs(placement.walls).max() <= town.half_extent


def test_slow_robots_and_priorities_are_mixed() -> None:
    town, rng = Town(20), np.random.default_rng(0)
    slow, ratio = [], []
    for _ in range(100):
        placement = town.place(rng)
        assert placement.v_max is not None
        assert placement.priority is not None
        speeds = placement.v_max[placement.v_max < MAX_SPEED]
        assert SLOW_SPEED[0] <= speeds.min() <= speeds.max() <= SLOW_SPEED[1]
        slow.append(len(speeds) / 20)
        ratio.append(placement.priority.max() / placement.priority.min())
    assert SLOW_SHARE[0] <= np.mean(slow) <= SLOW_SHARE[1]
    assert 4.0 < np.median(ratio) <= PRIORITIES[1] / PRIORITIES[0]


def test_some_robots_meet_head_on_and_some_come_up_behind_slow_ones() -> None:
    rng = np.random.default_rng(0)
    head_on = overtaking = 0
    for _ in range(100):
        placement = Town(8).place(rng)
        assert placement.v_max is not None
        swapped = np.linalg.norm(placement.start[:, np.newaxis] - placement.goal, axis=-1) < 0.3
        head_on += int((swapped & swapped.T).any())
        # A slow robot that starts and ends a cell from a fast one's start and goal, on the way between them.
        near_start = np.linalg.norm(placement.start[:, np.newaxis] - placement.start, axis=-1) < 1.6
        near_goal = np.linalg.norm(placement.goal[:, np.newaxis] - placement.goal, axis=-1) < 1.6
        slower = placement.v_max[:, np.newaxis] < placement.v_max
        overtaking += int((near_start & near_goal & slower).any())
    assert head_on > 15
    assert overtaking > 15


def test_the_same_seed_gives_the_same_town() -> None:
    first, second = (Town(8).place(np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first.start, second.start)
    np.testing.assert_array_equal(first.walls, second.walls)
    np.testing.assert_array_equal(first.v_max, second.v_max)


def test_every_world_has_a_map_of_its_own() -> None:
    navigation = Navigation(Town(4), num_worlds=3)
    navigation.reset(0)
    maps = {navigation.world.walls_of(number).tobytes() for number in range(3)}
    assert len(maps) == 3


def test_impossible_towns_are_refused() -> None:
    with pytest.raises(OutOfRange, match="num_robots: expected 2 or more, got 1"):
        Town(1)
    with pytest.raises(OutOfRange, match="num_maps: expected 1 or more, got 0"):
        Town(num_maps=0)
    with pytest.raises(InvalidInput, match="split: expected one of training, held-out, got 'test'"):
        Town(split="test")  # type: ignore[arg-type]  # the point of this test
