from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.vendor.pretty import pretty

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.closest_approach import pairs_within
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.testing.policies import GoalSeeking, Mixed, Ramming, UniformRandom
from safefilter.testing.rollout import Trial, closed_loop, passive_velocity
from safefilter.testing.strategies import actions, scenes, trials

DT = 0.2


def filter_of(trial: Trial) -> sf.SafetyFilter:
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    return sf.SafetyFilter([sf.PriorityORCA(2.0), separation], sf.Holonomic(trial.v_max))


two_robots = partial(sf.Scene.from_world, [[0.0, 0.0], [2.0, 0.0]], np.zeros((2, 2)), 0.3)


def test_without_a_filter_robots_do_what_the_policy_asks_for_up_to_top_speed() -> None:
    trial = Trial(two_robots(), Ramming(), np.array([0.5, 1.0]), dt=DT, num_steps=2)
    first, second = closed_loop(None, trial)
    assert first.decision is None
    assert first.velocity.tolist() == [[0.5, 0.0], [-1.0, 0.0]]
    assert second.scene.position == pytest.approx(np.array([[0.1, 0.0], [1.8, 0.0]]))
    assert second.scene.velocity.tolist() == first.velocity.tolist()


def test_overspeed_is_cut_without_a_filter() -> None:
    trial = Trial(two_robots(), UniformRandom(), np.array([0.5, 1.0]), num_steps=50)
    for step in closed_loop(None, trial):
        assert (np.hypot(*step.velocity.T) <= trial.v_max * (1.0 + 1e-12)).all()


@given(trials())
def test_with_a_filter_robots_that_cooperate_execute_what_it_decided(trial: Trial) -> None:
    for step in closed_loop(filter_of(trial), trial):
        assert step.decision is not None
        assert step.decision.index.tolist() == np.flatnonzero(step.scene.cooperative).tolist()
        assert step.decision.action.dtype == (np.float32 if trial.is_single else np.float64)
        assert np.array_equal(step.velocity[step.decision.index], step.decision.action)
        assert step.scene.wanted is not None
        assert np.array_equal(step.scene.wanted, step.action)


@given(trials())
def test_a_trial_is_repeated_bit_for_bit_by_the_code_it_is_written_as(trial: Trial) -> None:
    names = {
        "GoalSeeking": GoalSeeking,
        "Mixed": Mixed,
        "Ramming": Ramming,
        "Scene": sf.Scene,
        "Trial": Trial,
        "UniformRandom": UniformRandom,
        "np": np,
    }
    again = eval(repr(trial), names)
    for one, other in zip(
        closed_loop(filter_of(trial), trial), closed_loop(filter_of(again), again), strict=True
    ):
        assert np.array_equal(one.velocity, other.velocity)


def test_hypothesis_prints_that_code() -> None:
    trial = Trial(two_robots(), Ramming(), np.ones(2))
    assert pretty(trial) == repr(trial)


def test_all_that_a_robot_is_stays_with_it() -> None:
    scene = two_robots(
        priority=[1.0, 9.0], cooperative=[True, False], heading=[0.1, 0.2], world=[0, 1], reach=3.0
    )
    last = list(closed_loop(None, Trial(scene, Ramming(), np.ones(2), num_steps=3)))[-1].scene
    assert last.priority.tolist() == [1.0, 9.0]
    assert last.cooperative.tolist() == [True, False]
    assert last.world.tolist() == [0, 1]
    assert last.reach == 3.0
    assert last.heading is not None
    assert last.heading.tolist() == [0.1, 0.2]


def test_two_robots_that_do_not_cooperate_are_not_judged() -> None:
    position = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]])
    scene = sf.Scene.from_world(position, np.zeros((3, 2)), 0.3, cooperative=[True, False, False])
    step = next(closed_loop(None, Trial(scene, Ramming(), np.ones(3))))
    assert sorted(zip(step.pairs.first.tolist(), step.pairs.second.tolist(), strict=True)) == [
        (0, 1),
        (0, 2),
    ]


def test_nobody_is_filtered_where_nobody_cooperates() -> None:
    trial = Trial(two_robots(cooperative=False), Ramming(), np.ones(2))
    assert next(closed_loop(filter_of(trial), trial)).decision is None


@given(st.data(), scenes(cooperative=st.just(False)), st.sampled_from([0.0, 0.3]))
def test_robots_that_do_not_cooperate_keep_to_what_they_are_credited_with(
    data: st.DataObject, scene: sf.Scene, passive_speed: float
) -> None:
    wanted = data.draw(actions(scene))
    pairs = pairs_within(scene.world)
    velocity = passive_velocity(scene, wanted, pairs, DT, passive_speed)
    # Robot 0 is the only one that cooperates.
    offset = scene.position[0] - scene.position[1:]
    distance = np.hypot(*offset.T)
    towards = offset / distance[:, None]
    gap = np.maximum(distance - scene.radius[0] - scene.radius[1:], 0.0)
    credit = np.maximum(along(towards, scene.velocity[1:]), passive_speed) * DT
    advance = along(towards, velocity[1:]) * DT
    assert (advance <= np.minimum(np.maximum(credit, 0.0), gap) + 1e-12).all()


def along(direction: FloatArray, velocity: FloatArray) -> FloatArray:
    return np.asarray((direction * velocity).sum(axis=1))


def test_a_robot_that_does_not_cooperate_moves_on_as_seen() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [2.0, 0.0]],
        [[0.0, 0.0], [-1.0, 0.0]],
        0.3,
        cooperative=[True, False],
    )
    pairs = pairs_within(scene.world)
    # It was seen to come at 1 m/s: twice that is not credited; going sideways is free.
    for wanted, expected in (
        ([-2.0, 0.0], [-1.0, 0.0]),
        ([0.0, 3.0], [0.0, 3.0]),
        ([0.0, 0.0], [-1.0, 0.0]),
    ):
        both = np.array([[0.0, 0.0], wanted])
        assert passive_velocity(scene, both, pairs, DT, 0.0)[1].tolist() == expected


def test_a_robot_that_does_not_cooperate_stops_at_contact() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [0.7, 0.0]],
        [[0.0, 0.0], [-1.0, 0.0]],
        0.3,
        cooperative=[True, False],
    )
    velocity = passive_velocity(scene, scene.velocity, pairs_within(scene.world), DT, 0.0)
    assert velocity[1] == pytest.approx(np.array([-0.5, 0.0]))


def test_a_trial_says_what_is_wrong_with_it() -> None:
    trial = Trial(two_robots(), Ramming(), np.ones(2))
    with pytest.raises(ShapeError, match="v_max"):
        replace(trial, v_max=np.ones(3))
    with pytest.raises(OutOfRange, match="v_max of row 1"):
        replace(trial, v_max=np.array([1.0, 0.0]))
    with pytest.raises(OutOfRange, match="dt"):
        replace(trial, dt=0.0)
    with pytest.raises(InvalidInput, match="num_steps: expected at least 1, got 0"):
        replace(trial, num_steps=0)
    with pytest.raises(
        InvalidInput, match="scene: the judge of this closed loop knows robots only"
    ):
        replace(trial, scene=two_robots(walls=[[[5.0, 0.0], [5.0, 1.0]]]))
