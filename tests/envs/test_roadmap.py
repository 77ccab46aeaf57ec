import numpy as np
import pytest

from envs.fleet import RADIUS
from envs.scenarios import load_scenario
from envs.scenarios.roadmap import Roadmap
from envs.scenarios.shapes import box
from envs.scenarios.ways import shortest_ways
from envs.walls import NO_WALLS
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange, ShapeError

BLOCK = box((-1.0, -1.0), (1.0, 1.0))
CORNERS = np.array([[-1.2, -1.2], [1.2, -1.2], [1.2, 1.2], [-1.2, 1.2]])


def target(
    roadmap: Roadmap, position: tuple[float, float], goal: tuple[float, float]
) -> FloatArray:
    return np.asarray(roadmap.targets(np.array([position]), np.array([goal]))[0])


def test_a_goal_in_sight_is_headed_for() -> None:
    roadmap = Roadmap(CORNERS, BLOCK, clearance=0.1)
    assert target(roadmap, (-2.0, -1.5), (2.0, -1.5)).tolist() == [2.0, -1.5]


def test_a_goal_behind_a_block_is_headed_for_by_the_nearer_corner() -> None:
    roadmap = Roadmap(CORNERS, BLOCK, clearance=0.1)
    assert target(roadmap, (-3.0, -0.3), (3.0, -0.3)).tolist() == [-1.2, -1.2]
    assert target(roadmap, (-3.0, 0.3), (3.0, 0.3)).tolist() == [-1.2, 1.2]
    assert target(roadmap, (-1.2, 1.2), (3.0, 0.3)).tolist() == [1.2, 1.2]


def test_sight_lines_keep_their_clearance() -> None:
    near, far = (Roadmap(CORNERS, BLOCK, clearance) for clearance in (0.1, 0.3))
    # Past the block at 0.2 m.
    assert target(near, (-3.0, 1.2), (3.0, 1.2)).tolist() == [3.0, 1.2]
    assert target(far, (-3.0, 1.2), (3.0, 1.4)).tolist() == [3.0, 1.4]


def test_without_waypoints_or_a_way_everybody_heads_straight_for_the_goal() -> None:
    nowhere = Roadmap(np.zeros((0, 2)), BLOCK, clearance=0.1)
    walled_in = Roadmap(CORNERS, box((-1.5, -1.5), (1.5, 1.5)), clearance=0.1)
    in_the_open = Roadmap(CORNERS, NO_WALLS, clearance=0.1)
    for roadmap in (nowhere, walled_in, in_the_open):
        assert target(roadmap, (-3.0, 0.0), (3.0, 0.0)).tolist() == [3.0, 0.0]


def test_a_robot_on_a_waypoint_goes_on_and_a_goal_on_one_is_reached() -> None:
    roadmap = Roadmap(CORNERS, BLOCK, clearance=0.1)
    assert target(roadmap, (-1.2, -1.2), (1.2, 1.2)).tolist() in ([1.2, -1.2], [-1.2, 1.2])
    assert target(roadmap, (-3.0, -0.3), (1.2, 1.2)).tolist() == [-1.2, 1.2]


def test_ways_over_rvo2_s_waypoints_are_the_shortest() -> None:
    scenario = load_scenario("rvo2_roadmap")
    placement = scenario.place(np.random.default_rng(0))
    roadmap = Roadmap(scenario.waypoints, scenario.walls, clearance=0.9 * RADIUS)
    position, length = placement.start.copy(), np.zeros(scenario.num_robots)
    for _ in range(6):
        ahead = roadmap.targets(position, placement.goal)
        length += np.linalg.norm(ahead - position, axis=1)
        position = ahead
    np.testing.assert_array_equal(position, placement.goal)
    # The grid's ways are up to 8 % longer than the shortest; waypoints stand a little off the corners.
    on_grid = shortest_ways(placement, RADIUS)
    assert (length <= 1.03 * on_grid).all()
    assert (length >= on_grid / 1.09).all()


def test_what_is_no_roadmap_is_refused() -> None:
    with pytest.raises(ShapeError, match="waypoints: expected shape"):
        Roadmap(np.zeros(3), BLOCK, clearance=0.1)
    with pytest.raises(OutOfRange, match="clearance: expected a number above 0"):
        Roadmap(CORNERS, BLOCK, clearance=0.0)
