import numpy as np
import pytest

from envs.reward import (
    RewardWeights,
    dynamic_collision,
    moving_forward,
    passing_time,
    reaching_goal,
)


def test_weights_are_the_papers() -> None:
    weights = RewardWeights()
    assert (weights.forward, weights.collision, weights.time, weights.goal) == (3, -15, -0.25, 80)


def test_coming_nearer_pays_by_the_metre_and_going_away_costs_the_same() -> None:
    near, far, goal = np.array([[1.0, 0.0]]), np.array([[1.0, 2.0]]), np.array([[1.0, -1.0]])
    assert moving_forward(far, near, goal, 3.0) == pytest.approx([6.0])
    assert moving_forward(near, far, goal, 3.0) == pytest.approx([-6.0])


def test_going_round_the_goal_pays_nothing() -> None:
    goal = np.zeros((1, 2))
    turned = moving_forward(np.array([[0.0, 2.0]]), np.array([[2.0, 0.0]]), goal, 3.0)
    assert turned == pytest.approx([0.0])


def test_progress_telescopes_so_that_lingering_earns_nothing() -> None:
    way = np.random.default_rng(0).normal(size=(30, 2))
    goal = np.array([5.0, 5.0])
    total = moving_forward(way[:-1], way[1:], goal, 3.0).sum()
    assert total == pytest.approx(moving_forward(way[0], way[-1], goal, 3.0))


def test_events_pay_where_they_happen() -> None:
    flags = np.array([True, False])
    assert dynamic_collision(flags, -15.0).tolist() == [-15.0, 0.0]
    assert reaching_goal(flags, 80.0).tolist() == [80.0, 0.0]
    assert passing_time(flags, -0.25).tolist() == [-0.25, 0.0]
