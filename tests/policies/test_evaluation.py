from dataclasses import fields

import numpy as np
import pytest

from envs import Navigation
from envs.robot_results import RobotResults
from envs.scenarios import Crossroad, load_scenario
from policies import Policy, StraightToGoal
from policies.evaluation import evaluate_policy, run_episodes
from policies.filtering import LITERAL, OFF, OURS, OURS_WITH_MAP
from policies.lateness import Lateness
from policies.nh_orca import NHORCA
from safefilter.errors import OutOfRange


def straight(_: Navigation) -> Policy:
    return StraightToGoal()


def nh_orca(navigation: Navigation) -> Policy:
    return NHORCA(navigation.scenes, navigation.rules.dt)


def assert_same(first: RobotResults, second: RobotResults) -> None:
    for field in fields(first):
        np.testing.assert_array_equal(
            getattr(first, field.name), getattr(second, field.name), field.name
        )


def test_episodes_do_not_depend_on_how_many_are_driven_at_once() -> None:
    scenario = load_scenario("passing")
    whole, parts = (
        run_episodes(nh_orca, scenario, OURS_WITH_MAP, episodes=7, seed=3, batch=batch)
        for batch in (7, 3)
    )
    assert_same(whole, parts)


def test_seeds_are_other_episodes() -> None:
    scenario = load_scenario("overtaking")
    first, second = (
        run_episodes(nh_orca, scenario, OURS_WITH_MAP, episodes=2, seed=seed) for seed in (0, 1)
    )
    assert (first.time != second.time).any()


def test_a_row_counts_the_episodes_asked_for() -> None:
    row = evaluate_policy(
        nh_orca, load_scenario("overtaking"), OURS_WITH_MAP, episodes=3, seed=0, method="NH-ORCA"
    )
    assert (row.scenario, row.method) == ("overtaking", "NH-ORCA")
    assert (row.num_episodes, row.num_robots) == (3, 6)
    assert row.success_rate == 1.0
    assert row.collision_robot_rate == row.collision_obstacle_rate == 0.0
    assert 0.0 < row.intervention_rate < 1.0


def test_without_a_filter_the_same_policy_collides() -> None:
    scenario = Crossroad(is_walled=True)
    bare = evaluate_policy(straight, scenario, OFF, episodes=4, seed=0)
    ours = evaluate_policy(straight, scenario, OURS_WITH_MAP, episodes=4, seed=0)
    assert bare.collision_robot_rate > 0.3
    assert ours.collision_robot_rate == ours.collision_obstacle_rate == 0.0


def test_answers_that_come_late_are_no_guarantee_unless_they_expire() -> None:
    scenario = Crossroad(is_walled=True)
    hits = {
        lateness: run_episodes(
            straight, scenario, OURS_WITH_MAP, episodes=8, seed=0, lateness=lateness
        )
        for lateness in (Lateness(steps=3), Lateness(share=0.4))
    }
    delayed, expired = (results.min_clearance.min() for results in hits.values())
    assert delayed < 0.0
    assert expired > 0.0


def test_without_separation_the_literal_filter_lets_robots_touch() -> None:
    scenario = load_scenario("crossroad_dense")
    literal = evaluate_policy(straight, scenario, LITERAL, episodes=3, seed=0)
    assert literal.collision_robot_rate + literal.collision_obstacle_rate > 0.0


def test_walls_from_lidar_alone_are_not_hit() -> None:
    row = evaluate_policy(straight, load_scenario("passing"), OURS, episodes=2, seed=0)
    assert row.collision_obstacle_rate == 0.0
    assert row.min_wall_clearance > 0.0


def test_nothing_to_drive_is_refused() -> None:
    with pytest.raises(OutOfRange, match="episodes: expected 1 or more, got 0"):
        run_episodes(straight, Crossroad(), OFF, episodes=0, seed=0)
    with pytest.raises(OutOfRange, match="batch: expected 1 or more, got -1"):
        run_episodes(straight, Crossroad(), OFF, episodes=1, seed=0, batch=-1)
