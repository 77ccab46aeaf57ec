import math

import numpy as np
import pytest

from envs import Fleet, Outcome, World
from envs.metrics import Metrics, summarise
from safefilter.decision import Case, Decision


def outcome(clearance: list[list[float]], num_contacts: int = 0) -> Outcome:
    made = Outcome.empty(1, len(clearance[0]))
    made.clearance[...], made.wall_clearance[...] = clearance, np.inf
    made.flags[...], made.num_contacts[...] = False, num_contacts
    return made


def decision(index: list[int], case: list[Case], correction: list[float]) -> Decision:
    size = len(index)
    certified = np.ones(size, dtype=np.bool_)
    certified[-1] = False
    return Decision(
        action=np.zeros((size, 2)),
        wanted=np.zeros((size, 2)),
        velocity=np.zeros((size, 2)),
        case=np.array(case, dtype=np.int8),
        certified=certified,
        optimal=certified,
        capped=~certified,
        correction=np.array(correction),
        violation=np.zeros(size),
        active=np.zeros((size, 2, 2), dtype=np.int64),
        multipliers=np.zeros((size, 2)),
        proof=np.zeros((size, 3, 2), dtype=np.int64),
        proof_multipliers=np.zeros((size, 3)),
        fault=np.zeros(size, dtype=np.int8),
        index=np.array(index),
        backend="planar",
        build_time=0.0,
        solve_time=0.0,
    )


def finished() -> World:
    """Two worlds of two robots: one arrives after 10 s, one after 20 s but was hit, one collided, one wandered."""
    world = World.empty(2, Fleet.of(2))
    world.present[...] = True
    world.arrived[...] = [[True, True], [False, False]]
    world.collided[...] = [[False, True], [True, False]]
    world.arrival_time[0] = [10.0, 20.0]
    return world


def test_success_is_to_arrive_and_never_collide() -> None:
    summary = summarise(Metrics.empty(2, 2), finished())
    assert summary.num_robots == 4
    assert summary.success_rate == 0.25
    assert summary.num_collided == 2
    assert summary.mean_time == 10.0


def test_without_success_and_without_a_filter_there_are_no_means() -> None:
    summary = summarise(Metrics.empty(1, 2), World.empty(1, Fleet.of(2)))
    assert math.isnan(summary.mean_time)
    assert math.isnan(summary.intervention_rate)
    assert all(math.isnan(rate) for rate in summary.case_rates)
    assert summary.min_clearance == math.inf


def test_least_clearance_of_all_steps_is_kept_and_contacts_add_up() -> None:
    metrics = Metrics.empty(1, 2)
    metrics.record(outcome([[0.3, 0.2]], num_contacts=1))
    metrics.record(outcome([[0.1, 0.5]], num_contacts=2))
    np.testing.assert_array_equal(metrics.min_clearance, [[0.1, 0.2]])
    summary = summarise(metrics, World.empty(1, Fleet.of(2)))
    assert summary.min_clearance == 0.1
    assert summary.num_contacts == 3


def test_decisions_are_counted_for_robots_under_way_only() -> None:
    metrics = Metrics.empty(2, 2)
    under_way = np.array([[True, True], [False, True]])
    cases = [Case.SAFE, Case.PROJECTED, Case.LEAST_VIOLATION]
    metrics.record_decision(decision([0, 2, 3], cases, [0.0, 0.1, 0.1]), under_way)
    np.testing.assert_array_equal(metrics.decisions, [[1, 0], [0, 1]])
    np.testing.assert_array_equal(metrics.interventions, [[0, 0], [0, 1]])
    np.testing.assert_array_equal(metrics.cases[0, 0], [1, 0, 0])
    np.testing.assert_array_equal(metrics.cases[1, 1], [0, 0, 1])
    summary = summarise(metrics, World.empty(2, Fleet.of(2)))
    assert summary.intervention_rate == 0.5
    assert summary.case_rates == pytest.approx((0.5, 0.0, 0.5))


def test_missing_certificates_are_counted_for_everyone() -> None:
    metrics = Metrics.empty(1, 2)
    nobody = np.zeros((1, 2), dtype=np.bool_)
    metrics.record_decision(decision([0, 1], [Case.SAFE, Case.SAFE], [0.0, 0.0]), nobody)
    assert summarise(metrics, World.empty(1, Fleet.of(2))).num_uncertified == 1


def test_hits_of_robots_and_of_walls_are_counted_apart() -> None:
    metrics = Metrics.empty(1, 2)
    by_robot, by_wall = outcome([[-0.1, -0.1]], 1), outcome([[0.1, 0.1]])
    by_robot.hit_robot[...] = True
    by_wall.hit_wall[...], by_wall.wall_clearance[...] = [[True, False]], [[-0.02, 0.3]]
    metrics.record(by_robot)
    metrics.record(by_wall)
    summary = summarise(metrics, World.empty(1, Fleet.of(2)))
    assert (summary.num_robot_hits, summary.num_wall_hits) == (2, 1)
    assert summary.min_wall_clearance == -0.02
