import numpy as np
import pytest

import safefilter as sf
from envs import Corridor, Crossroad, Doorway, Fleet, Navigation, Rules, UShape
from envs.scenarios import Scenario
from policies import BangBang, Policy, Ramming, StraightToGoal, UniformRandom
from policies.rollout import Rollout, roll_out

pytestmark = pytest.mark.stress

POLICIES: list[Policy] = [StraightToGoal(), UniformRandom(), Ramming()]


def run(
    policy: Policy, *, filtered: bool, num_worlds: int = 3, max_steps: int | None = None
) -> Rollout:
    fleet = Fleet.of(8, priority=[1.0, 8.0, 2.0, 4.0] * 2, cooperative=filtered)
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(time_horizon=2.0), sf.Separation(dt=0.2)], sf.Holonomic(v_max=0.2)
    )
    return roll_out(
        Navigation(Crossroad(), fleet, Rules(), num_worlds=num_worlds),
        policy,
        safety_filter if filtered else None,
        seed=0,
        max_steps=max_steps,
    )


@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.name)
def test_filter_keeps_every_policy_from_colliding(policy: Policy) -> None:
    summary = run(policy, filtered=True).summary
    assert summary.num_collided == 0
    assert summary.num_contacts == 0
    assert summary.min_clearance > 0.0
    assert summary.num_uncertified == 0


@pytest.mark.parametrize("policy", [StraightToGoal(), Ramming()], ids=lambda policy: policy.name)
def test_the_same_policies_collide_without_the_filter(policy: Policy) -> None:
    summary = run(policy, filtered=False).summary
    assert summary.num_collided > 12
    assert summary.min_clearance < 0.0


def test_straight_to_goal_arrives_through_the_filter() -> None:
    result = run(StraightToGoal(), filtered=True)
    assert result.summary.success_rate == 1.0
    assert result.summary.mean_time == pytest.approx(result.arrival_time.mean())
    assert result.summary.mean_time > 23.0
    assert 0.0 < result.summary.intervention_rate < 1.0
    assert sum(result.summary.case_rates) == pytest.approx(1.0)
    assert result.decision_time > 0.0


def test_without_a_filter_nothing_is_decided() -> None:
    result = run(StraightToGoal(), filtered=False)
    assert np.isnan(result.decision_time)
    assert np.isnan(result.summary.intervention_rate)
    assert np.isnan(result.arrival_time).all()


def test_rollout_ends_when_nobody_is_under_way_or_the_steps_are_over() -> None:
    assert run(StraightToGoal(), filtered=False).num_steps < Rules().max_steps
    short = run(UniformRandom(), filtered=False, max_steps=7)
    assert short.num_steps == 7
    assert short.recording.num_moments == 8


def test_same_seed_makes_the_same_rollout() -> None:
    first, second = (run(UniformRandom(), filtered=True, max_steps=40) for _ in range(2))
    np.testing.assert_array_equal(first.recording.position, second.recording.position)


DRIVE_SCENARIOS: list[Scenario] = [
    Crossroad(is_walled=True),
    Corridor(num_robots=8),
    Doorway(num_robots=6),
    UShape(num_robots=3),
]


def drive(
    policy: Policy, scenario: Scenario, *, filtered: bool, num_beams: int = 0, max_steps: int = 150
) -> Rollout:
    priority = np.logspace(-3.0, 3.0, scenario.num_robots)
    fleet = Fleet.of(
        scenario.num_robots, priority=priority, cooperative=filtered, kinematics="differential"
    )
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
        sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
    )
    return roll_out(
        Navigation(scenario, fleet, Rules(num_beams=num_beams), num_worlds=2),
        policy,
        safety_filter if filtered else None,
        seed=0,
        max_steps=max_steps,
    )


@pytest.mark.parametrize("scenario", DRIVE_SCENARIOS, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("policy", [*POLICIES, BangBang()], ids=lambda policy: policy.name)
def test_filtered_drives_touch_neither_robots_nor_walls(policy: Policy, scenario: Scenario) -> None:
    summary = drive(policy, scenario, filtered=True).summary
    assert summary.num_collided == 0
    assert summary.min_clearance >= 0.0
    assert summary.min_wall_clearance >= 0.0
    assert summary.num_uncertified == 0


def test_bare_drives_hit_robots_and_walls() -> None:
    rammed = drive(Ramming(), Crossroad(is_walled=True), filtered=False).summary
    assert rammed.num_robot_hits > 8
    drifted = drive(BangBang(), Corridor(num_robots=8), filtered=False).summary
    assert drifted.num_wall_hits > 4
    assert drifted.min_wall_clearance < 0.0


@pytest.mark.parametrize("policy", [StraightToGoal(), BangBang()], ids=lambda policy: policy.name)
def test_drives_that_know_walls_from_their_beams_alone_do_not_hit_them(policy: Policy) -> None:
    scenario = Crossroad(is_walled=True)
    summary = drive(policy, scenario, filtered=True, num_beams=360, max_steps=60).summary
    assert summary.num_collided == 0
    assert summary.min_wall_clearance >= 0.0


def test_every_decision_can_be_watched() -> None:
    seen: list[tuple[int, int]] = []
    fleet = Fleet.of(8, kinematics="differential")
    safety_filter = sf.SafetyFilter(
        [sf.Separation(0.2)], sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05)
    )
    roll_out(
        Navigation(Crossroad(is_walled=True), fleet),
        StraightToGoal(),
        safety_filter,
        seed=0,
        max_steps=3,
        watch=lambda scene, _, decision: seen.append((scene.num_robots, len(decision))),
    )
    assert seen == [(8, 8)] * 3
