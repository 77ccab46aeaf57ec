from functools import partial

import numpy as np
import pytest
from hypothesis import given

import safefilter as sf
from safefilter.testing.policies import (
    OVERSPEED,
    GoalSeeking,
    Mixed,
    NotFinite,
    Policy,
    Ramming,
    UniformRandom,
    at_speed,
)
from safefilter.testing.strategies import scenes

DT = 0.2


line_scene = partial(
    sf.Scene.from_world, [[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]], np.zeros((3, 2)), 0.2
)


def test_ramming_goes_full_speed_at_the_nearest_robot() -> None:
    wanted = Ramming().act(line_scene(), np.array([0.5, 1.0, 2.0]), np.random.default_rng(0))
    assert wanted.tolist() == [[0.5, 0.0], [-1.0, 0.0], [-2.0, 0.0]]


def test_ramming_stands_still_where_there_is_nobody() -> None:
    alone = line_scene(world=[0, 1, 2])
    wanted = Ramming().act(alone, np.ones(3), np.random.default_rng(0))
    assert wanted.tolist() == [[0.0, 0.0]] * 3


def test_goal_seeking_arrives_and_stays() -> None:
    scene = line_scene()
    policy = GoalSeeking(((0.0, 3.0), (1.0, 0.05), (4.0, 0.0)), DT)
    wanted = policy.act(scene, np.ones(3), np.random.default_rng(0))
    assert wanted == pytest.approx(np.array([[0.0, 1.0], [0.0, 0.25], [0.0, 0.0]]))


def test_robots_that_go_across_meet_in_the_middle_of_their_own_world() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [2.0, 0.0], [10.0, 0.0], [10.0, 4.0]],
        np.zeros((4, 2)),
        0.2,
        world=[5, 5, 7, 7],
    )
    assert GoalSeeking.across(scene, DT).goal == ((2.0, 0.0), (0.0, 0.0), (10.0, 4.0), (10.0, 0.0))


@given(scenes())
def test_random_policies_ask_for_more_than_robots_can_do_but_not_much(scene: sf.Scene) -> None:
    v_max = np.full(scene.num_robots, 0.5)
    wanted = UniformRandom().act(scene, v_max, np.random.default_rng(0))
    assert wanted.shape == (scene.num_robots, 2)
    assert np.hypot(*wanted.T).max() <= OVERSPEED * 0.5 + 1e-12


def test_random_policies_exceed_top_speed_at_times() -> None:
    scene = sf.Scene.from_world(10.0 * np.eye(100, 2), np.zeros((100, 2)), 0.1)
    wanted = UniformRandom().act(scene, np.ones(100), np.random.default_rng(0))
    assert np.hypot(*wanted.T).max() > 1.0


@given(scenes())
def test_the_same_chance_gives_the_same_velocities(scene: sf.Scene) -> None:
    v_max = np.ones(scene.num_robots)
    policies: tuple[Policy, ...] = (UniformRandom(), Ramming(), GoalSeeking.across(scene, DT))
    for policy in (*policies, Mixed(policies)):
        once, twice = (policy.act(scene, v_max, np.random.default_rng(3)) for _ in range(2))
        assert np.array_equal(once, twice)


def test_robots_of_a_mix_take_turns() -> None:
    scene = line_scene()
    mixed = Mixed((Ramming(), GoalSeeking(((9.0, 9.0), (1.0, 9.0), (9.0, 9.0)), DT)))
    wanted = mixed.act(scene, np.ones(3), np.random.default_rng(0))
    assert wanted == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]))


def test_no_direction_means_no_speed() -> None:
    assert at_speed(np.zeros((1, 2)), np.ones(1)).tolist() == [[0.0, 0.0]]


@given(scenes())
def test_a_policy_is_written_as_the_code_that_makes_it(scene: sf.Scene) -> None:
    across = GoalSeeking.across(scene, DT)
    for policy in (across, Mixed((UniformRandom(), NotFinite(Ramming()), across))):
        assert eval(repr(policy)) == policy


def test_what_makes_no_sense_is_asked_for_at_times() -> None:
    scene = sf.Scene.from_world(10.0 * np.eye(100, 2), np.zeros((100, 2)), 0.1)
    wanted = NotFinite(UniformRandom()).act(scene, np.ones(100), np.random.default_rng(0))
    senseless = ~(np.abs(wanted) <= OVERSPEED).all(axis=1)
    assert 20 <= senseless.sum() <= 40
    assert np.isnan(wanted).any()
    assert np.isposinf(wanted).any()
    assert np.isneginf(wanted).any()
    assert (wanted == 1e30).any()
