"""Each invariant fails for a filter that breaks it, and its message repeats the failure."""

from dataclasses import replace

import numpy as np
import pytest

import safefilter as sf
from safefilter.testing.invariants import (
    Collision,
    NotCertified,
    WrongAllocation,
    assert_certified,
    assert_collision_free,
    assert_priority_allocation,
)
from safefilter.testing.policies import Ramming
from safefilter.testing.rollout import Trial

NAMES = {
    "Ramming": Ramming,
    "Scene": sf.Scene,
    "Trial": Trial,
    "assert_certified": assert_certified,
    "assert_collision_free": assert_collision_free,
    "assert_priority_allocation": assert_priority_allocation,
    "np": np,
}


def repeat(message: str, safety_filter: sf.SafetyFilter) -> None:
    """Run the code at the end of a message."""
    lines = message.split("to repeat it:\n")[1].splitlines()
    code = "\n".join(line.strip() for line in lines)
    exec(code, {**NAMES, "safety_filter": safety_filter})


def head_on_trial(num_steps: int = 20) -> Trial:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.5, 0.0], [9.0, 9.0]], np.zeros((3, 2)), 0.3, priority=[1.0, 4.0, 1.0]
    )
    return Trial(scene, Ramming(), np.array([1.0, 0.7, 1.0]), num_steps=num_steps)


def without_separation(trial: Trial) -> sf.SafetyFilter:
    # A horizon shorter than a step sees nothing coming.
    return sf.SafetyFilter([sf.PriorityORCA(0.01)], sf.Holonomic(trial.v_max))


def test_a_collision_is_told_with_robots_step_depth_and_code() -> None:
    trial = head_on_trial()
    safety_filter = without_separation(trial)
    with pytest.raises(Collision, match="robots 0 and 1 collide in step 2: 120 mm deep") as caught:
        assert_collision_free(safety_filter, trial)
    assert "from 220 mm apart" in str(caught.value)
    with pytest.raises(Collision) as again:
        repeat(str(caught.value), safety_filter)
    assert str(again.value) == str(caught.value)


def test_a_collision_with_a_wall_is_told_with_robot_wall_depth_and_code() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [4.0, 0.0]], np.zeros((2, 2)), 0.3, walls=[[[1.0, -1.0], [1.0, 2.0]]]
    )
    trial = Trial(scene, Ramming(), np.ones(2), num_steps=9)
    blind = without_separation(trial)
    told = r"robot 0 and wall 0 from \[1\.0, -1\.0\] to \[1\.0, 2\.0\] m collide in step 3: 100 mm deep"
    with pytest.raises(Collision, match=told) as caught:
        assert_collision_free(blind, trial)
    with pytest.raises(Collision) as again:
        repeat(str(caught.value), blind)
    assert str(again.value) == str(caught.value)
    seeing = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(trial.dt)], sf.Holonomic(1.0))
    assert assert_collision_free(seeing, trial).min_clearance >= 0.0


def test_a_run_without_collision_is_counted() -> None:
    trial = head_on_trial()
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(trial.dt)], sf.Holonomic(trial.v_max)
    )
    tally = assert_collision_free(safety_filter, trial)
    assert tally.robot_steps == 60
    assert tally.min_clearance >= 0.0


def test_an_uncertified_action_is_told() -> None:
    # A fallback that the user's own contradicting rows leave is executed, and certified is False.
    trial = head_on_trial(1)
    rows = sf.LinearConstraint([[1.0, 0.0], [-1.0, 0.0]], [0.5, 0.5], hard=True)
    safety_filter = sf.SafetyFilter(
        [sf.Separation(trial.dt), rows], sf.Holonomic(trial.v_max), fallback=[0.0, 0.0]
    )
    with pytest.raises(
        NotCertified, match=r"robots \[0, 1, 2\] in step 0: .* not certified"
    ) as caught:
        assert_collision_free(safety_filter, trial)
    with pytest.raises(NotCertified):
        repeat(str(caught.value), safety_filter)


def test_a_certificate_that_fails_is_told_with_its_reason_and_code() -> None:
    trial = head_on_trial()
    scene, action = trial.scene, np.array([[1.0, 0.0], [-0.7, 0.0], [0.0, 0.0]], dtype=np.float32)
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(trial.dt)], sf.Holonomic(trial.v_max)
    )
    decision = safety_filter.decide(scene, action)
    assert_certified(safety_filter, scene, action, decision)
    altered = replace(decision, action=decision.action + np.float32(1e-3))
    with pytest.raises(NotCertified, match="robot 0, PROJECTED: ") as caught:
        assert_certified(safety_filter, scene, action, altered)
    # The code decides anew, and that decision is right.
    repeat(str(caught.value), safety_filter)
    disowned = replace(decision, certified=np.zeros_like(decision.certified))
    with pytest.raises(NotCertified, match="the decision itself says that it is not certified"):
        assert_certified(safety_filter, scene, action, disowned)


def test_a_wrong_share_is_told_with_both_priorities_and_code() -> None:
    trial = head_on_trial()
    paper = sf.SafetyFilter([sf.PriorityORCA(2.0, slack_rule="paper")], sf.Holonomic(trial.v_max))
    scene = trial.scene
    with pytest.raises(
        WrongAllocation, match=r"robots 0 and 1: priorities 1\.0 and 4\.0 give"
    ) as caught:
        assert_priority_allocation(paper, scene, scene.velocity, v_opt=scene.velocity)
    with pytest.raises(WrongAllocation) as again:
        repeat(str(caught.value), paper)
    assert str(again.value) == str(caught.value)


def test_half_planes_around_different_velocities_are_told() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.5]], [[1.0, 0.0], [0.0, 0.0]], 0.3, wanted=[[0.0, 1.0], [0.0, 1.0]]
    )
    own = sf.SafetyFilter([sf.PriorityORCA(2.0, "own")], sf.Holonomic(1.0))
    assert scene.wanted is not None
    with pytest.raises(WrongAllocation, match="are not opposite"):
        assert_priority_allocation(own, scene, scene.wanted, v_opt=scene.wanted)


def test_pairs_with_a_robot_that_does_not_cooperate_share_nothing() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], np.zeros((3, 2)), 0.3, cooperative=[True, True, False]
    )
    safety_filter = sf.SafetyFilter([sf.PriorityORCA(2.0)], sf.Holonomic(1.0))
    num_pairs = assert_priority_allocation(
        safety_filter, scene, np.zeros((2, 2)), v_opt=scene.velocity
    )
    assert num_pairs == 1
