import json
import math

import numpy as np
import pytest

from envs.intervals import wilson
from envs.robot_results import Fate, RobotResults
from envs.table_row import TableRow

NAN = math.nan


def example() -> RobotResults:
    """Two episodes of three robots."""
    fate = np.array([[Fate.SUCCESS] * 3, [Fate.SUCCESS, Fate.HIT_ROBOT, Fate.ROTATED]])
    return RobotResults(
        fate=fate.astype(np.int64),
        time=np.array([[10.0, 20.0, 30.0], [40.0, NAN, NAN]]),
        passings=np.array([[1, 1, 0], [2, 1, 0]]),
        passings_on_right=np.array([[1, 1, 0], [1, 0, 0]]),
        overtakings=np.array([[1, 0, 0], [0, 0, 0]]),
        overtakings_on_left=np.array([[1, 0, 0], [0, 0, 0]]),
        detour=np.array([[1.0, 1.1, 1.2], [1.3, 9.0, NAN]]),
        min_clearance=np.array([[0.3, 0.2, 0.5], [0.1, -0.02, 0.4]]),
        min_wall_clearance=np.full((2, 3), np.inf),
        decisions=np.array([[10, 10, 10], [10, 0, 0]]),
        interventions=np.array([[1, 2, 3], [4, 0, 0]]),
        action_variation=np.array([[0.1, 0.2, 0.3], [0.4, NAN, NAN]]),
    )


def test_row_by_hand() -> None:
    row = TableRow.of("1-Passing", "NH-ORCA", example())
    assert (row.scenario, row.method, row.num_episodes, row.num_robots) == (
        "1-Passing",
        "NH-ORCA",
        2,
        6,
    )
    assert row.success_rate == pytest.approx(4 / 6)
    assert row.success_interval == wilson(4, 6)
    assert row.collision_robot_rate == pytest.approx(1 / 6)
    assert row.rotate_in_place_rate == pytest.approx(1 / 6)
    assert row.collision_obstacle_rate == row.timeout_rate == 0.0
    assert row.mean_time == 25.0
    assert (row.episode_success_rate, row.episode_success_interval) == (0.5, wilson(1, 2))
    # Three successful robots met somebody, two of them on the right side only.
    assert row.social_success_rate == pytest.approx(2 / 3)
    assert row.social_success_interval == wilson(2, 3)
    assert row.passing_right_rate == pytest.approx(3 / 5)
    assert row.overtaking_left_rate == 1.0
    assert row.num_encounters == 6
    assert row.detour == pytest.approx(1.15)
    assert row.min_clearance == -0.02
    assert row.min_wall_clearance == math.inf
    assert row.intervention_rate == pytest.approx(10 / 40)
    assert row.action_variation == pytest.approx(0.25)


def test_the_fates_sum_to_one() -> None:
    row = TableRow.of("a", "b", example())
    collided = row.collision_robot_rate + row.collision_obstacle_rate
    stuck = row.timeout_rate + row.rotate_in_place_rate
    assert row.success_rate + collided + stuck == pytest.approx(1.0)


def test_row_goes_through_json_without_nan() -> None:
    row = TableRow.of("a", "b", example()).to_dict()
    again = json.loads(json.dumps(row, allow_nan=False))
    assert again == row
    assert again["min_wall_clearance"] is None
    assert again["success_interval_low"] < again["success_rate"] < again["success_interval_high"]
    wanted = {
        "scenario", "method", "success_rate", "social_success_rate", "collision_robot_rate",
        "collision_obstacle_rate", "timeout_rate", "rotate_in_place_rate", "mean_time",
    }  # fmt: skip
    assert wanted <= set(again)


def test_order_of_episodes_and_of_robots_does_not_matter() -> None:
    given = example()
    swapped = RobotResults(**{
        name: getattr(given, name)[::-1, ::-1].copy() for name in given.__slots__
    })
    assert TableRow.of("a", "b", swapped).to_dict() == pytest.approx(
        TableRow.of("a", "b", given).to_dict()
    )


def test_without_successes_encounters_and_decisions_there_are_no_rates() -> None:
    given = example()
    lost = RobotResults(
        **{
            name: np.zeros_like(getattr(given, name))
            for name in given.__slots__
            if name not in {"fate", "time"}
        }
        | {"fate": np.full((2, 3), Fate.TIMED_OUT, dtype=np.int64), "time": np.full((2, 3), NAN)}
    )
    row = TableRow.of("a", "b", lost)
    assert row.timeout_rate == 1.0
    for value in (
        row.mean_time,
        row.social_success_rate,
        row.passing_right_rate,
        row.intervention_rate,
    ):
        assert math.isnan(value)


def test_people_are_not_counted() -> None:
    given = example()
    fate = np.column_stack([given.fate, [Fate.PERSON, Fate.PERSON]])
    crowded = RobotResults(
        **{
            name: np.column_stack([
                getattr(given, name),
                np.full(2, -9.0 if name == "min_clearance" else 0),
            ]).astype(getattr(given, name).dtype)
            for name in given.__slots__
            if name != "fate"
        }
        | {"fate": fate}
    )
    assert TableRow.of("a", "b", crowded).to_dict() == TableRow.of("a", "b", given).to_dict()
