from collections.abc import Callable

import numpy as np
import pytest

from envs.arcs import Segment, segment_distance
from envs.fleet import RADIUS
from envs.rules import Rules
from envs.scenarios import (
    Circle,
    Corridor,
    Crossroad,
    Doorway,
    Placement,
    Scenario,
    Town,
    UShape,
    load_scenario,
    recommended_rules,
)
from envs.scenarios.scenario import chain
from safefilter.errors import OutOfRange

SCENARIOS: list[Scenario] = [
    Crossroad(),
    Crossroad(is_walled=True),
    Circle(2),
    Circle(12),
    Circle(200),
    Circle(1000),
    Corridor(),
    Corridor(num_robots=12),
    Doorway(),
    Doorway(num_robots=8),
    UShape(),
    UShape(num_robots=5),
]


def place(scenario: Scenario, seed: int = 0) -> Placement:
    return scenario.place(np.random.default_rng(seed))


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("seed", range(5))
def test_starts_and_goals_are_inside_the_window_and_apart(scenario: Scenario, seed: int) -> None:
    placement = place(scenario, seed)
    for point in (placement.start, placement.goal):
        assert point.shape == (scenario.num_robots, 2)
        assert (np.abs(point) <= scenario.half_extent).all()
        distance = np.linalg.norm(point[:, np.newaxis] - point, axis=-1)
        distance[np.diag_indices(len(point))] = np.inf
        assert distance.min() > 2 * RADIUS


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_jitter_moves_every_start(scenario: Scenario) -> None:
    first, second = place(scenario, 0), place(scenario, 1)
    assert (first.start != second.start).any(axis=1).all()
    np.testing.assert_array_equal(first.goal, second.goal)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Crossroad(road_width=0.0), "road_width: expected a number above 0"),
        (lambda: Circle(1), "num_robots: expected 2 or more, got 1"),
        (lambda: Circle(spacing=-1.0), "spacing: expected a number above 0"),
    ],
)
def test_impossible_sizes_are_refused(build: Callable[[], Scenario], message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        build()


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("seed", range(3))
def test_starts_and_goals_are_clear_of_walls_which_are_in_the_window(
    scenario: Scenario, seed: int
) -> None:
    placement = place(scenario, seed)
    assert (np.abs(placement.walls) <= scenario.half_extent).all()
    for x, y in (*placement.start, *placement.goal):
        for wall in placement.walls:
            distance = segment_distance(x, y, x, y, Segment(*wall.ravel()))
            assert distance > RADIUS + 0.1


def test_chain_joins_points_one_after_the_other() -> None:
    walls = chain((0.0, 0.0), (1.0, 0.0), (1.0, 2.0))
    assert walls.tolist() == [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 2.0]]]


def test_rules_are_those_that_a_scenario_recommends_or_else_the_usual_ones() -> None:
    assert recommended_rules(Town(8)).time_limit > Rules().time_limit
    assert recommended_rules(load_scenario("rvo2_circle")).time_limit == 400.0
    assert recommended_rules(Circle(4)) == Rules()
