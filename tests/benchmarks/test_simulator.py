import numpy as np
import pytest

from benchmarks.simulated_scenarios import NEAREST_FAR_WALL, Pairs, WithFarWalls
from benchmarks.simulator import Case, drive, make_filter
from envs import Circle, Crossroad


def test_what_is_timed_moves_robots_and_keeps_them_apart_with_the_filter() -> None:
    case = Case(Crossroad(is_walled=True), 3)
    assert case.num_robots == 24
    filtered, bare = case.started(), case.started()
    start = filtered.world.position.copy()
    drive(filtered, make_filter(), 50)
    drive(bare, None, 50)
    away = np.linalg.norm(filtered.world.position - start, axis=-1)
    assert (away > 0.5).all()
    assert not filtered.world.collided.any()
    assert bare.world.collided.any()


@pytest.mark.parametrize("num_robots", [2, 8, 50])
def test_robots_of_pairs_meet_one_other_and_nobody_else(num_robots: int) -> None:
    scenario = Pairs(num_robots)
    case = Case(scenario, 1)
    assert case.num_in_reach == 1.0
    navigation = case.started()
    assert np.abs(navigation.world.position).max() <= scenario.half_extent
    drive(navigation, None, 45)
    assert case.num_in_reach == 1.0
    assert not navigation.world.collided.any()
    assert np.linalg.norm(navigation.world.position - navigation.world.start, axis=-1).min() > 1.5


def test_worlds_that_are_over_start_anew() -> None:
    navigation = Case(Circle(2), 2).started()
    drive(navigation, make_filter(), 100)
    assert (navigation.world.step_count < 100).all()


@pytest.mark.parametrize("is_listed_around", [True, False])
def test_far_walls_are_beyond_every_sensor_and_change_nothing(*, is_listed_around: bool) -> None:
    far = WithFarWalls(300, is_listed_around=is_listed_around)
    runs = [Case(scenario, 2).started() for scenario in (WithFarWalls(0), far)]
    for navigation in runs:
        drive(navigation, make_filter(), 30)
    bare, among = (navigation.world for navigation in runs)
    assert len(among.walls_of(0)) == len(bare.walls_of(0)) + 300
    middles = among.walls_of(0)[len(bare.walls_of(0)) :].mean(axis=1)
    assert np.linalg.norm(middles, axis=1).min() >= NEAREST_FAR_WALL
    np.testing.assert_array_equal(bare.position, among.position)
    np.testing.assert_array_equal(runs[0].observe(), runs[1].observe())
