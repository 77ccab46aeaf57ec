import numpy as np

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


def test_worlds_that_are_over_start_anew() -> None:
    navigation = Case(Circle(2), 2).started()
    drive(navigation, make_filter(), 100)
    assert (navigation.world.step_count < 100).all()
