from pathlib import Path

import numpy as np
import pytest

from envs import Navigation
from envs.fleet import MAX_SPEED, RADIUS
from envs.rules import AfterArrival
from envs.scenarios import Crossroad, Doorway, Scenario, load_scenario, scenario_names
from envs.scenarios.library import UnknownScenario
from envs.scenarios.wall_kernel import wall_distances
from envs.scenarios.ways import shortest_ways
from safefilter.arrays import FloatArray
from safefilter.lidar import Lidar

LIDAR_RANGE = 3.5
NUM_BEAMS = 360


def sorted_ends(walls: FloatArray) -> list[list[list[float]]]:
    """Walls as sorted lists of sorted ends, to compare without order."""
    return sorted(sorted((np.round(wall, 9) + 0.0).tolist()) for wall in walls)


def mean_least_time(name: str) -> float:
    """Mean time of the straight way to the rim of the goal at each robot's greatest speed, in s."""
    scenario = load_scenario(name)
    times = []
    for seed in range(200):
        placement = scenario.place(np.random.default_rng(seed))
        way = np.linalg.norm(placement.goal - placement.start, axis=1) - scenario.rules.goal_radius
        times.append(np.mean(way / (MAX_SPEED if placement.v_max is None else placement.v_max)))
    return float(np.mean(times))


@pytest.mark.parametrize("name", scenario_names())
def test_starts_are_inside_apart_and_clear_of_walls(name: str) -> None:
    scenario = load_scenario(name)
    for seed in range(3):
        placement = scenario.place(np.random.default_rng(seed))
        assert placement.start.shape == placement.goal.shape == (scenario.num_robots, 2)
        distance = np.linalg.norm(placement.start[:, np.newaxis] - placement.start, axis=-1)
        distance[np.diag_indices(len(distance))] = np.inf
        assert distance.min() >= 2 * RADIUS + 0.05
        for points in (placement.start, placement.goal):
            assert np.abs(points).max() <= scenario.half_extent
            assert wall_distances(points, placement.walls).min() >= RADIUS + 0.04
        assert np.abs(placement.walls).max(initial=0.0) <= scenario.half_extent


@pytest.mark.parametrize("name", [name for name in scenario_names() if name != "rvo2_circle"])
def test_everybody_can_arrive(name: str) -> None:
    placement = load_scenario(name).place(np.random.default_rng(0))
    assert np.isfinite(shortest_ways(placement, RADIUS)).all()


@pytest.mark.parametrize("name", scenario_names())
def test_walls_are_thick_enough_for_a_lidar_alone(name: str) -> None:
    scan = Lidar.scan(np.full((1, NUM_BEAMS), LIDAR_RANGE))
    walls = load_scenario(name).walls
    length = np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1)
    assert length.min(initial=np.inf) >= scan.least_thickness(LIDAR_RANGE)
    # No wall has a free end: every end is another's beginning.
    starts, ends = (sorted(map(tuple, np.round(walls[:, end], 9) + 0.0)) for end in (0, 1))
    assert starts == ends


@pytest.mark.parametrize(
    ("name", "expected"),
    [("passing", 19.4), ("overtaking", 23.4), ("crossroad", 23.9), ("n_c_o_intersection", 26.8)],
)
def test_straight_travel_takes_what_the_papers_times_imply(name: str, expected: float) -> None:
    assert mean_least_time(name) == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize(
    ("name", "family"),
    [("crossroad", Crossroad(is_walled=True)), ("doorway", Doorway(num_robots=8))],
)
def test_layouts_that_have_a_family_are_of_it(name: str, family: Scenario) -> None:
    ours = load_scenario(name).place(np.random.default_rng(0))
    theirs = family.place(np.random.default_rng(0))
    assert sorted(map(tuple, np.round(ours.goal, 9))) == sorted(
        map(tuple, np.round(theirs.goal, 9))
    )
    from_start = np.linalg.norm(ours.start[:, np.newaxis] - theirs.start, axis=-1).min(axis=1)
    assert from_start.max() < 0.2
    if name == "crossroad":
        assert sorted_ends(ours.walls) == sorted_ends(theirs.walls)


def test_six_of_eight_robots_of_the_intersection_head_into_traps() -> None:
    scenario = load_scenario("n_c_o_intersection")
    placement = scenario.place(np.random.default_rng(0))
    way = placement.goal - placement.start
    turn = np.degrees(np.arctan2(way[:, 1], way[:, 0])) % 90.0
    assert np.sum((turn > 1.0) & (turn < 89.0)) == 2, "two turn right, six go straight on"
    # Where the straight way first meets a wall, are there walls on both sides of the robot within its reach?
    is_trapped = []
    for start, ahead in zip(placement.start, way, strict=True):
        along = start + np.linspace(0.0, 1.0, 2000)[:, np.newaxis] * ahead
        touching = along[np.argmax(wall_distances(along, placement.walls) < 0.01)]
        before = touching - 0.12 * ahead / np.linalg.norm(ahead)
        side = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
        reach = np.linspace(0.0, 0.8, 300)[:, np.newaxis]
        is_trapped.append(
            all(
                wall_distances(before + sign * reach * side, placement.walls).min() < 0.01
                for sign in (-1.0, 1.0)
            )
        )
    assert sum(is_trapped) == 6


def test_rvo2_s_examples_keep_its_proportions() -> None:
    circle, blocks = load_scenario("rvo2_circle"), load_scenario("rvo2_blocks")
    # Agents of radius 1.5 on a circle of radius 200; of radius 2 beside blocks of side 30.
    assert np.linalg.norm(
        circle.place(np.random.default_rng(0)).start, axis=1
    ) / RADIUS == pytest.approx(200 / 1.5)
    side = np.linalg.norm(blocks.walls[0, 1] - blocks.walls[0, 0])
    assert side / RADIUS == pytest.approx(30 / 2)
    assert (circle.num_robots, blocks.num_robots) == (250, 100)
    assert blocks.rules.after_arrival is AfterArrival.VANISH


def test_waypoints_of_the_roadmap_see_round_every_corner() -> None:
    roadmap = load_scenario("rvo2_roadmap")
    corners = roadmap.walls[:, 0]
    nearest = np.linalg.norm(corners[:, np.newaxis] - roadmap.waypoints, axis=-1)
    assert sorted(nearest.argmin(axis=1)) == list(range(16))
    np.testing.assert_allclose(nearest.min(axis=1), RADIUS * np.sqrt(2.0))


def test_a_file_of_one_s_own_makes_a_world(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("name: m\nabout: n\nrobots: [{start: [0, 0], goal: [1, 0], turns: 1}]\n")
    navigation = Navigation(load_scenario(path))
    navigation.reset(0)
    assert navigation.world.goal.tolist() == [[[1.0, 0.0]]]


def test_unknown_names_are_refused_with_those_that_exist() -> None:
    with pytest.raises(
        UnknownScenario, match=r"scenario 'crosroad': expected one of antipodal_circle"
    ):
        load_scenario("crosroad")
