"""Who is not asked about: and that asking would have changed nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import Fleet, Navigation
from envs.scenarios import load_scenario
from policies.evaluation import make_navigation
from policies.filtering import LITERAL, OURS_WITH_MAP, Filtering
from policies.nh_orca import NHORCA
from policies.resting import SLACK, find_resting
from policies.rollout import roll_out
from safefilter.arrays import FloatArray
from safefilter.decision import Case

RADIUS, SPEED, HORIZON = 0.1, 0.2, 2.0


def waiting(distance: float, *, scenario: str = "overtaking") -> tuple[Navigation, FloatArray]:
    """Robot 0 waits at its goal, and the other is under way so far from it, east."""
    found = load_scenario(scenario)
    fleet = Fleet.of(found.num_robots, radius=RADIUS, kinematics="differential")
    navigation = Navigation(found, fleet)
    navigation.reset(0)
    world = navigation.world
    world.v_max[...] = SPEED
    world.arrived[0, 0] = True
    world.position[0, 1] = world.position[0, 0] + [2.0 * RADIUS + distance, 0.0]
    return navigation, np.zeros((1, 2, 2))


def test_a_robot_at_its_goal_rests_unless_somebody_can_come_to_it_within_the_horizon() -> None:
    way = HORIZON * SPEED + SLACK
    assert find_resting(*waiting(way + 1e-6), HORIZON).tolist() == [[True, False]]
    assert find_resting(*waiting(way - 1e-6), HORIZON).tolist() == [[False, False]]


def test_who_moves_or_wants_to_or_is_under_way_or_does_not_cooperate_is_not_at_rest() -> None:
    for change in ("velocity", "wanted", "arrived", "cooperative", "present"):
        navigation, actions = waiting(2.0)
        world = navigation.world
        if change == "velocity":
            world.velocity[0, 0, 1] = 1e-9
        elif change == "wanted":
            actions[0, 0, 1] = 1e-9
        else:
            getattr(world, change)[0, 0] = False
        assert not find_resting(navigation, actions, HORIZON).any(), change


def test_who_is_gone_wakes_nobody() -> None:
    navigation, actions = waiting(0.1)
    navigation.world.present[0, 1] = False
    assert find_resting(navigation, actions, HORIZON)[0, 0]


@given(seed=st.integers(0, 2**32 - 1), filtering=st.sampled_from([OURS_WITH_MAP, LITERAL]))
def test_a_filter_lets_those_at_rest_stand_as_they_do(seed: int, filtering: Filtering) -> None:
    rng = np.random.default_rng(seed)
    distance = filtering.time_horizon * SPEED + SLACK + rng.choice([1e-9, 0.05, 1.0])
    navigation, actions = waiting(float(distance))
    world = navigation.world
    angle = rng.uniform(0.0, 2.0 * np.pi)
    ahead = np.array([np.cos(angle), np.sin(angle)])
    world.position[0, 1] = world.position[0, 0] + (2.0 * RADIUS + distance) * ahead
    # Straight at it, or anywhere, at full speed.
    aim = angle + np.pi if rng.random() < 0.5 else rng.uniform(0.0, 2.0 * np.pi)
    world.heading[0, 1] = aim
    world.velocity[0, 1] = SPEED * np.array([np.cos(aim), np.sin(aim)])
    actions[0, 1] = [SPEED, 0.0]
    assert find_resting(navigation, actions, filtering.time_horizon)[0, 0]
    safety_filter = filtering.build(world, navigation.rules.dt)
    assert safety_filter is not None
    decision = safety_filter.decide(navigation.scenes(actions), actions.reshape(-1, 2))
    assert decision.case[0] == Case.SAFE
    assert decision.certified[0]
    assert (decision.action[0] == 0.0).all()


@pytest.mark.stress
@pytest.mark.parametrize("name", ["crossroad_congested", "doorway"])
def test_episodes_are_the_same_whether_those_at_rest_are_asked_about_or_not(name: str) -> None:
    results = []
    for horizon in (None, OURS_WITH_MAP.time_horizon):
        navigation = make_navigation(load_scenario(name), OURS_WITH_MAP, num_worlds=3)
        navigation.reset(5)
        safety_filter = OURS_WITH_MAP.build(navigation.world, navigation.rules.dt)
        policy = NHORCA(navigation.scenes, navigation.rules.dt)
        rollout = roll_out(
            navigation,
            policy,
            safety_filter,
            seed=5,
            rest_horizon=horizon,
            resets=horizon is not None,
        )
        results.append((rollout.results, rollout.recording))
    (first, one), (second, other) = results
    for field in ("fate", "time", "decisions", "interventions", "min_clearance", "detour"):
        np.testing.assert_array_equal(getattr(first, field), getattr(second, field))
    np.testing.assert_array_equal(one.position, other.position)
    assert np.array_equal(one.case, other.case)
