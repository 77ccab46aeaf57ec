from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from envs import AfterArrival, Circle, Crossroad, Fleet, Navigation, Rules
from envs.reward import TERMS, Reading, RewardWeights
from envs.reward_tracker import RewardTracker


def bare(**changes: Any) -> RewardWeights:
    """Nothing is paid but what is named."""
    return RewardWeights(**{**dict.fromkeys(TERMS, 0.0), **changes})


def test_progress_is_of_the_step_and_literally_since_the_reset_of_each_world() -> None:
    navigation = Navigation(Circle(4), num_worlds=2)
    navigation.reset(0)
    world = navigation.world
    working, literal = (
        RewardTracker(replace(bare(forward=3.0), progress=reading)) for reading in Reading
    )
    totals = []
    for number in range(6):
        if number == 3:
            navigation.reset(worlds=[False, True])
        for tracker in (working, literal):
            tracker.remember(world)
        outcome = navigation.step(world.preferred_velocity())
        assert working.reward(world, outcome).total == pytest.approx(3.0 * 0.04, abs=1e-6)
        totals.append(literal.reward(world, outcome).total[:, 0])
    steps = [[1, 1], [2, 2], [3, 3], [4, 1], [5, 2], [6, 3]]
    np.testing.assert_allclose(totals, 3.0 * 0.04 * np.array(steps), atol=1e-6)


def test_drives_face_along_their_heading_at_rest() -> None:
    navigation = Navigation(Circle(2), Fleet.of(2, kinematics="differential"))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(replace(bare(direction=1.0), course=Reading.LITERAL))
    tracker.remember(world)
    outcome = navigation.step(np.zeros((1, 2, 2)))
    assert tracker.reward(world, outcome).direction == pytest.approx(np.pi)


def test_holonomic_robots_face_where_they_went_last_and_nowhere_at_first() -> None:
    navigation = Navigation(Circle(2))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(replace(bare(direction=1.0), course=Reading.LITERAL))
    expected = [0.0, np.pi, np.pi]
    for speed, amount in zip((0.0, 1.0, 0.0), expected, strict=True):
        tracker.remember(world)
        outcome = navigation.step(speed * world.preferred_velocity())
        assert tracker.reward(world, outcome).direction == pytest.approx(amount, abs=1e-6)


def test_collision_is_paid_once_and_to_those_under_way() -> None:
    navigation = Navigation(Circle(2, least_radius=0.5))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(bare(dynamic_collision=-15.0))
    total = np.zeros((1, 2))
    for _ in range(30):
        tracker.remember(world)
        outcome = navigation.step(world.preferred_velocity())
        total += tracker.reward(world, outcome).total
    assert total.tolist() == [[-15.0, -15.0]]


def test_arrival_and_the_end_of_the_time_are_paid_once() -> None:
    navigation = Navigation(Circle(2, least_radius=0.5), rules=Rules(time_limit=6.0))
    navigation.reset(0)
    world = navigation.world
    world.position[0, 1] = [9.0, 9.0]
    tracker = RewardTracker(replace(bare(goal=80.0, time=-0.25), clock=Reading.LITERAL))
    total = 0.0
    for _ in range(navigation.rules.max_steps):
        tracker.remember(world)
        outcome = navigation.step(world.preferred_velocity())
        total += float(tracker.reward(world, outcome).total[0, 0])
    assert total == 80.0
    navigation.reset(0)
    world.position[0, 1] = [9.0, 9.0]
    total = 0.0
    for _ in range(navigation.rules.max_steps):
        tracker.remember(world)
        outcome = navigation.step(np.zeros((1, 2, 2)))
        total += float(tracker.reward(world, outcome).total[0, 0])
    assert total == -0.25


def test_walls_cost_more_than_robots() -> None:
    navigation = Navigation(Crossroad(is_walled=True))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(bare(static_collision=-40.0, dynamic_collision=-15.0))
    aside = np.stack([world.preferred_velocity()[..., 1], -world.preferred_velocity()[..., 0]], -1)
    lowest = 0.0
    for _ in range(60):
        tracker.remember(world)
        outcome = navigation.step(aside)
        found = tracker.reward(world, outcome)
        lowest = min(lowest, float(found.static_collision.min()))
        if outcome.collided.any():
            break
    assert lowest == -40.0


def test_corrections_are_charged() -> None:
    navigation = Navigation(Circle(2))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(bare(intervention=-2.0))
    tracker.remember(world)
    outcome = navigation.step(world.preferred_velocity())
    correction = np.array([[0.0, 0.1]])
    assert tracker.reward(world, outcome, correction).total.tolist() == [[0.0, -0.2]]
    assert tracker.reward(world, outcome).total.tolist() == [[0.0, 0.0]]


def test_being_reborn_costs_no_progress() -> None:
    rules = Rules(time_limit=40.0, after_arrival=AfterArrival.REBORN)
    navigation = Navigation(Circle(2, jitter_radius=1e-6), rules=rules)
    navigation.reset(0)
    world = navigation.world
    # Two parallel lanes, driven again and again.
    world.position[0] = world.start[0] = [[0.0, 0.0], [2.0, 0.4]]
    world.goal[0] = [[2.0, 0.0], [0.0, 0.4]]
    tracker = RewardTracker(bare(forward=1.0, goal=80.0))
    progress, goals = np.zeros((1, 2)), np.zeros((1, 2))
    for _ in range(rules.max_steps):
        tracker.remember(world)
        found = tracker.reward(world, navigation.step(world.preferred_velocity()))
        assert (found.forward >= 0.0).all()
        progress += found.forward
        goals += found.goal
    np.testing.assert_array_equal(goals, 80.0 * world.arrivals)
    assert (world.arrivals > 2).all()
    under_way = np.linalg.norm(world.position - world.start, axis=-1)
    np.testing.assert_allclose(progress, 2.0 * world.arrivals + under_way, atol=0.13)


def test_after_a_reset_holonomic_robots_face_nowhere_again() -> None:
    navigation = Navigation(Circle(2))
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(replace(bare(direction=1.0), course=Reading.LITERAL))
    tracker.remember(world)
    tracker.reward(world, navigation.step(world.preferred_velocity()))
    navigation.reset(1)
    tracker.remember(world)
    outcome = navigation.step(np.zeros((1, 2, 2)))
    assert tracker.reward(world, outcome).direction.tolist() == [[0.0, 0.0]]


def test_people_have_no_norm_area() -> None:
    norms = []
    for is_person in (False, True):
        navigation = Navigation(Circle(2), Fleet.of(2, kinematics="differential"))
        navigation.reset(0)
        world = navigation.world
        world.position[0] = [[0.0, 0.0], [0.22, 0.0]]
        world.person[0, 1] = is_person
        tracker = RewardTracker(bare(norm=-2.0))
        tracker.remember(world)
        outcome = navigation.step(np.zeros((1, 2, 2)))
        norms.append(tracker.reward(world, outcome).norm.tolist())
    assert norms == [[[-2.0, -2.0]], [[0.0, 0.0]]]
