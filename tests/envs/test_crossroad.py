import numpy as np

from envs.fleet import MAX_SPEED
from envs.rules import Rules
from envs.scenarios import Crossroad, Placement, Scenario


def place(scenario: Scenario, seed: int = 0) -> Placement:
    return scenario.place(np.random.default_rng(seed))


def test_straight_travel_over_the_crossroad_takes_as_long_as_the_papers_times_imply() -> None:
    placement = place(Crossroad(jitter_radius=1e-9))
    way = np.linalg.norm(placement.goal - placement.start, axis=1)
    np.testing.assert_allclose((way - Rules().goal_radius) / MAX_SPEED, 23.9, atol=1e-6)


def test_crossroad_has_two_robots_abreast_in_each_of_four_arms() -> None:
    scenario = Crossroad(jitter_radius=1e-9)
    placement = place(scenario)
    travel = placement.goal - placement.start
    directions = np.round(travel / np.linalg.norm(travel, axis=1, keepdims=True)).astype(int)
    assert directions[::2].tolist() == [[1, 0], [0, 1], [-1, 0], [0, -1]]
    np.testing.assert_array_equal(directions[::2], directions[1::2])
    abreast = np.linalg.norm(placement.start[::2] - placement.start[1::2], axis=1)
    np.testing.assert_allclose(abreast, scenario.road_width / 2)


def test_even_robots_of_the_crossroad_drive_on_the_right() -> None:
    placement = place(Crossroad(jitter_radius=1e-9))
    travel = placement.goal - placement.start
    right = np.stack([travel[:, 1], -travel[:, 0]], axis=1)
    side = np.sign(np.einsum("nd,nd->n", right, placement.start))
    assert side.tolist() == [1.0, -1.0] * 4


def test_walls_are_the_outline_of_both_roads() -> None:
    scenario = Crossroad(is_walled=True)
    walls = scenario.walls
    assert walls.shape == (12, 2, 2)
    np.testing.assert_allclose(walls[:, 1], np.roll(walls[:, 0], -1, axis=0))
    ends = np.abs(walls).max(axis=1)
    near, far = scenario.road_width / 2, scenario.half_extent
    assert {tuple(corner) for corner in np.round(ends, 9)} == {(0.7, 2.8), (2.8, 0.7)}
    length = np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(length), [1.4] * 4 + [far - near] * 8)
    assert Crossroad().walls.shape == (0, 2, 2)
