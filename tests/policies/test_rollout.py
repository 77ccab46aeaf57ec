import numpy as np
import pytest

import safefilter as sf
from envs import Crossroad, Fleet, Navigation, Rules
from policies import Policy, Ramming, StraightToGoal, UniformRandom
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
