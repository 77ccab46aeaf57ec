from dataclasses import replace

import numpy as np
import pytest

from envs import Crossroad, Fleet, Navigation, Rules
from envs.scenarios import load_scenario
from policies import StraightToGoal
from policies.filtering import (
    LITERAL,
    NUM_BEAMS,
    OFF,
    OURS,
    OURS_WITH_MAP,
    WALL_RANGE,
    Filtering,
)
from safefilter.decision import Case
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.safety_filter import SafetyFilter

RNG = np.random.default_rng(0)


def worlds(name: str = "overtaking") -> Navigation:
    scenario = load_scenario(name)
    navigation = Navigation(scenario, Fleet.of(scenario.num_robots, kinematics="differential"))
    navigation.reset(0)
    return navigation


def built(filtering: Filtering, navigation: Navigation) -> SafetyFilter:
    safety_filter = filtering.build(navigation.world, navigation.rules.dt)
    assert safety_filter is not None
    return safety_filter


def test_off_is_no_filter() -> None:
    assert OFF.build(worlds().world, 0.2) is None


def test_ours_has_rows_that_keep_robots_and_walls_apart() -> None:
    sources = built(OURS_WITH_MAP, worlds()).sources
    assert {"separation", "static_obstacles"} <= set(sources)


def test_the_literal_filter_has_the_rows_of_the_paper_and_no_others() -> None:
    navigation = worlds("passing")
    world = navigation.world
    # A centimetre and a half in front of the wall of the room, and about to drive four.
    world.position[0, 0], world.heading[0, 0] = (0.0, 1.13), 0.5 * np.pi
    action = np.tile([0.2, 0.0], (2, 1))
    scene = navigation.scenes(action[None])
    literal, ours = built(LITERAL, navigation), built(OURS_WITH_MAP, navigation)
    assert "separation" not in literal.sources
    np.testing.assert_array_equal(literal.decide(scene, action).action[0], action[0])
    assert ours.decide(scene, action).action[0, 0] < 0.015 / 0.2


def test_slow_robots_keep_their_own_speed_limit_under_both_filters() -> None:
    navigation = worlds()
    slow = navigation.world.v_max[0] < 0.2
    action = np.tile([0.2, 1.0], (2, 1))
    for filtering in (OURS_WITH_MAP, LITERAL):
        decision = built(filtering, navigation).decide(navigation.scenes(action[None]), action)
        assert (decision.action[slow, 0] <= navigation.world.v_max[0, slow] + 1e-9).all()


def test_walls_are_scanned_by_ours_without_a_map_alone() -> None:
    for filtering, beams in ((OURS, NUM_BEAMS), (OURS_WITH_MAP, 0), (LITERAL, 0), (OFF, 0)):
        assert filtering.rules(Rules(num_beams=7)).num_beams == beams
    assert OURS.rules(Rules(time_limit=33.0)).time_limit == 33.0


@pytest.mark.parametrize("name", ["crossroad_congested", "n_c_o_intersection", "doorway"])
def test_walls_further_away_than_those_looked_at_change_no_decision(name: str) -> None:
    scenario = load_scenario(name)
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    near, far = (
        Navigation(scenario, fleet, rules, num_worlds=2)
        for rules in (OURS.rules(Rules()), replace(OURS.rules(Rules()), wall_range=None))
    )
    near.reset(0)
    far.reset(0)
    safety_filter, rng = built(OURS, near), np.random.default_rng(0)
    for _ in range(100):
        wanted = StraightToGoal().act(near.world, rng)
        decisions = [
            safety_filter.decide(navigation.scenes(wanted), wanted.reshape(-1, 2))
            for navigation in (near, far)
        ]
        np.testing.assert_array_equal(decisions[0].action, decisions[1].action)
        np.testing.assert_array_equal(decisions[0].case, decisions[1].case)
        for navigation in (near, far):
            navigation.step(decisions[0].action.reshape(wanted.shape))
    assert (decisions[0].case != 1).any()


@pytest.mark.parametrize("field", ["kind", "walls", "leg"])
def test_other_names_are_refused(field: str) -> None:
    with pytest.raises(InvalidInput, match=rf"{field}: expected one of .*, got 'sonar'"):
        Filtering(**{field: "sonar"})  # type: ignore[arg-type]  # refused at run time too


def test_a_bias_to_the_right_turns_robots_that_meet_head_on_to_the_right() -> None:
    scenario = Crossroad(is_walled=True)
    navigation = Navigation(scenario, Fleet.of(scenario.num_robots, kinematics="differential"))
    navigation.reset(0)
    world = navigation.world
    world.position[0, :2], world.heading[0, :2] = [(-0.2, 0.0), (0.2, 0.0)], [0.0, np.pi]
    world.position[0, 2:] += 50.0 * np.arange(1, 7)[:, np.newaxis]
    world.velocity[0, :2] = [(0.2, 0.0), (-0.2, 0.0)]
    action = np.tile([0.2, 0.0], (2, 1))
    scene = navigation.scenes()
    biased = Filtering("ours", right_bias=0.3)
    turns = built(biased, navigation).decide(scene, action, [0, 1]).action[:, 1]
    assert (turns < 0.0).all()


def test_a_bias_of_a_quarter_turn_is_refused() -> None:
    with pytest.raises(OutOfRange, match="right_bias: expected an angle within a quarter turn"):
        Filtering(right_bias=2.0)


def test_pairs_are_kept_apart_for_as_long_as_the_horizon() -> None:
    navigation = worlds("crossroad")
    world = navigation.world
    # Two that face each other, with 0.9 m between them: 2.25 s at full speed.
    world.position[0, :2] = [(0.0, 0.0), (0.9 + 2.0 * world.radius[0, 0], 0.0)]
    world.heading[0, :2] = [0.0, np.pi]
    world.position[0, 2:] += 50.0 * np.arange(1, 7)[:, np.newaxis]
    world.velocity[0, :2] = [(0.2, 0.0), (-0.2, 0.0)]
    action, scene = np.tile([0.2, 0.0], (2, 1)), navigation.scenes()
    for horizon, is_case_1 in ((2.0, True), (2.5, False)):
        filtering = Filtering("ours", time_horizon=horizon)
        case = built(filtering, navigation).decide(scene, action, [0, 1]).case
        assert ((case == Case.SAFE) == is_case_1).all()


@pytest.mark.parametrize("wrong", [0.0, -1.0])
def test_a_horizon_that_is_no_time_is_refused(wrong: float) -> None:
    with pytest.raises(OutOfRange, match="time_horizon: expected a number above 0"):
        Filtering(time_horizon=wrong)


def test_beams_are_looked_at_as_far_as_rows_reach_or_the_robots_are_refused() -> None:
    navigation = worlds()
    built(OURS, navigation)
    navigation.world.v_max[0, 1] = 0.6
    with pytest.raises(OutOfRange, match=r"reach 0\.4\d* m, but beams are looked at up to 0\.4 m"):
        built(OURS, navigation)
    built(OURS_WITH_MAP, navigation)


def test_walls_beyond_the_range_looked_at_change_no_decision(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    decided = []
    for wall_range in (WALL_RANGE, 3.0):
        monkeypatch.setattr("policies.filtering.WALL_RANGE", wall_range)
        scenario = load_scenario("crossroad_dense")
        fleet = Fleet.of(scenario.num_robots, kinematics="differential")
        navigation = Navigation(scenario, fleet, OURS.rules(Rules()), num_worlds=2)
        navigation.reset(3)
        safety_filter = built(OURS, navigation)
        for _ in range(60):
            actions = navigation.wanted(StraightToGoal().act(navigation.world, RNG))
            scene = navigation.scenes(actions)
            decision = safety_filter.decide(scene, actions.reshape(-1, 2))
            navigation.step(decision.action.reshape(actions.shape))
            decided.append(decision.action)
    half = len(decided) // 2
    assert (np.array(decided[:half]) != 0.2).any()
    np.testing.assert_array_equal(decided[:half], decided[half:])
