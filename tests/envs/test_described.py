import math
from typing import Any

import numpy as np
import pytest

from envs import Navigation
from envs.crowd import Crowded, Motion
from envs.fleet import MAX_SPEED
from envs.rules import AfterArrival, Rules
from envs.scenarios.described import DescribedScenario
from envs.scenarios.schema import Specification

ROBOT = {"start": [1.0, 0.0], "goal": [3.0, 0.0]}


def scenario(**said: Any) -> DescribedScenario:
    content = {"name": "mine", "about": "an example", "robots": [ROBOT], **said}
    return DescribedScenario.of(Specification.model_validate(content))


def test_groups_are_laid_out_one_after_the_other_and_copy_after_copy() -> None:
    grid = {"first": [1.0, 0.0], "step": [1.0, 0.0], "columns": 2}
    made = scenario(robots=[ROBOT, {"start": grid, "goal": [5.0, 0.0], "count": 2, "turns": 2}])
    placement = made.place(np.random.default_rng(0))
    assert made.num_robots == 5
    assert placement.start.tolist() == [[1, 0], [1, 0], [2, 0], [-1, 0], [-2, 0]]
    assert placement.goal.tolist() == [[3, 0], [5, 0], [5, 0], [-5, 0], [-5, 0]]


def test_what_a_file_leaves_out_is_left_to_the_fleet() -> None:
    placement = scenario().place(np.random.default_rng(0))
    assert placement.v_max is None
    assert placement.priority is None
    assert placement.heading is None
    assert len(placement.walls) == 0


def test_speeds_and_priorities_are_drawn_within_their_spans() -> None:
    span = {"low": 0.1, "high": 10.0}
    made = scenario(
        robots=[{**ROBOT, "turns": 200, "priority": span, "v_max": span}, {**ROBOT, "v_max": 0.15}]
    )
    placement = made.place(np.random.default_rng(0))
    assert placement.v_max is not None
    assert placement.priority is not None
    assert placement.v_max[-1] == 0.15
    assert placement.priority[-1] == 1.0
    for drawn in (placement.v_max[:-1], placement.priority[:-1]):
        assert drawn.min() >= 0.1
        assert drawn.max() <= 10.0
    # Half of the speeds are below the mean of the span, half of the priorities below its geometric mean.
    assert 0.4 < (placement.v_max[:-1] < 5.05).mean() < 0.6
    assert 0.4 < (placement.priority[:-1] < 1.0).mean() < 0.6


def test_a_group_without_speed_beside_one_with_has_the_paper_s() -> None:
    placement = scenario(robots=[ROBOT, {**ROBOT, "v_max": 0.1}]).place(np.random.default_rng(0))
    assert placement.v_max is not None
    assert placement.v_max.tolist() == [MAX_SPEED, 0.1]


def test_headings_turn_with_the_copies_and_others_face_their_goals() -> None:
    made = scenario(robots=[{**ROBOT, "heading": 90.0, "turns": 2}, {**ROBOT, "goal": [1.0, -2.0]}])
    heading = made.place(np.random.default_rng(0)).heading
    assert heading is not None
    np.testing.assert_allclose(heading, [math.pi / 2, 3 * math.pi / 2, -math.pi / 2])


@pytest.mark.parametrize(
    ("wall", "num_segments"),
    [
        ({"box": [[2.0, 2.0], [3.0, 3.0]]}, 4),
        ({"room": [[-4.0, -4.0], [4.0, 4.0]]}, 4),
        ({"polygon": [[2.0, 2.0], [3.0, 2.0], [2.0, 3.0]]}, 3),
        ({"path": [[2.0, 2.0], [3.0, 2.0], [2.0, 3.0]]}, 2),
        ({"path": [[2.0, 2.0], [3.0, 2.0]]}, 1),
        ({"u_shape": {"at": [2.0, 2.0], "opens": 90, "width": 1.0, "depth": 1.0}}, 8),
        ({"crossing": {"road_width": 1.0, "arm_length": 4.0}}, 12),
        ({"corridor": {"ends": [[0.0, 0.0], [4.0, 0.0]], "width": 1.0}}, 8),
        ({"box": [[2.0, 2.0], [3.0, 3.0]], "turns": 4}, 16),
    ],
)
def test_every_shape_becomes_segments_on_which_worlds_run(
    wall: dict[str, Any], num_segments: int
) -> None:
    made = scenario(walls=[wall])
    assert made.walls.shape == (num_segments, 2, 2)
    assert np.abs(made.walls).max() <= made.half_extent
    navigation = Navigation(made)
    navigation.reset(0)
    np.testing.assert_array_equal(navigation.world.walls_of(0), made.walls)


def test_lengths_are_scaled_and_speeds_are_not() -> None:
    made = scenario(
        scale=0.5,
        walls=[{"box": [[2.0, 2.0], [4.0, 4.0]]}],
        waypoints=[[2.0, 6.0]],
        robots=[{**ROBOT, "v_max": 0.2}],
    )
    placement = made.place(np.random.default_rng(0))
    assert placement.goal.tolist() == [[1.5, 0.0]]
    assert made.walls.max() == 2.0
    assert made.waypoints.tolist() == [[1.0, 3.0]]
    assert placement.v_max is not None
    assert placement.v_max.tolist() == [0.2]
    assert made.half_extent == 2.0


def test_rules_are_recommended_where_the_file_says_so() -> None:
    assert scenario().rules == Rules()
    made = scenario(rules={"after_arrival": "vanish", "time_limit": 30})
    assert made.rules == Rules(after_arrival=AfterArrival.VANISH, time_limit=30.0)


def test_people_are_told_apart_and_move_as_the_file_says() -> None:
    walker = {**ROBOT, "start": [0.0, 1.0], "goal": [4.0, 1.0], "people": True, "turns": 2}
    made = scenario(
        robots=[ROBOT, walker], crowd={"motion": "constant velocity", "turn_radius": 0.5}
    )
    assert isinstance(made, Crowded)
    assert made.crowd.people.tolist() == [1, 2]
    assert made.crowd.motion is Motion.CONSTANT_VELOCITY
    assert made.crowd.turn_radius == 0.5
    navigation = Navigation(made)
    navigation.reset(0)
    before = navigation.world.position.copy()
    navigation.step(np.zeros((1, 3, 2)))
    moved = np.linalg.norm(navigation.world.position - before, axis=-1)[0]
    np.testing.assert_allclose(moved, [0.0, 0.04, 0.04])


def test_scenarios_without_people_have_no_crowd() -> None:
    assert not isinstance(scenario(), Crowded)
