from dataclasses import replace

import numpy as np
from hypothesis import given

import safefilter as sf
from safefilter.testing.policies import GoalSeeking, Ramming
from safefilter.testing.rollout import Trial, roll_out
from safefilter.testing.strategies import rollouts
from safefilter.testing.tally import NOTHING, Tally


def filter_of(trial: Trial) -> sf.SafetyFilter:
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    return sf.SafetyFilter([sf.PriorityORCA(2.0), separation], sf.Holonomic(trial.v_max))


@given(rollouts())
def test_every_decision_counts_once(trial: Trial) -> None:
    tally = NOTHING
    for step in roll_out(filter_of(trial), trial):
        tally += Tally.of(step)
    cooperative = int(trial.scene.cooperative.sum())
    assert tally.robot_steps == cooperative * trial.num_steps
    assert sum(tally.cases) == sum(tally.faults) == tally.robot_steps
    assert tally.uncertified == 0


def test_a_collision_counts_once_however_long_robots_overlap() -> None:
    scene = sf.Scene.from_world([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.4)
    tally = NOTHING
    for step in roll_out(None, Trial(scene, Ramming(), np.ones(2), num_steps=3)):
        tally += Tally.of(step)
    assert tally.collisions == 1
    assert tally.min_clearance < -0.7
    assert tally.robot_steps == 6
    assert tally.cases == (0, 0, 0)


def test_faults_are_counted_by_kind() -> None:
    scene = sf.Scene.from_world([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.4)
    trial = Trial(scene, Ramming(), np.ones(2), num_steps=1)
    (step,) = roll_out(filter_of(trial), trial)
    assert Tally.of(step).num_faults == 0
    assert step.decision is not None
    decision = filter_of(trial).decide(step.scene, [[np.nan, 0.0], [0.0, 0.0]])
    assert Tally.of(replace(step, decision=decision)).num_faults == 1


@given(rollouts(), rollouts())
def test_totals_do_not_depend_on_the_order(one: Trial, other: Trial) -> None:
    first, second = (Tally.of(next(roll_out(filter_of(t), t))) for t in (one, other))
    assert first + second == second + first
    assert first + NOTHING == first


def test_contacts_with_walls_count_among_the_others_and_apart() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0]], [[0.0, 2.0]] * 2, 0.4, walls=[[[-5.0, 0.5], [5.0, 0.5]]]
    )
    up = GoalSeeking(((0.0, 9.0), (0.0, 9.0)), dt=0.2)
    (step,) = roll_out(None, Trial(scene, up, np.full(2, 2.0), num_steps=1))
    tally = Tally.of(step)
    assert tally.wall_collisions == 2
    assert tally.collisions >= 2
    assert tally.collisions - tally.wall_collisions == int(step.approach.collided.sum())


def test_decisions_alone_count_no_steps() -> None:
    scene = sf.Scene.from_world([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.4)
    trial = Trial(scene, Ramming(), np.full(2, 5.0), num_steps=1)
    (step,) = roll_out(filter_of(trial), trial)
    assert step.decision is not None
    tally = Tally.decided(step.decision)
    assert tally.robot_steps == tally.collisions == 0
    assert sum(tally.cases) == 2
    assert tally.capped == int(step.decision.capped.sum())
    spoilt = replace(step.decision, capped=np.array([True, False]), certified=np.zeros(2, np.bool_))
    assert (Tally.decided(spoilt).capped, Tally.decided(spoilt).uncertified) == (1, 2)
    both = Tally.decided(spoilt) + Tally.decided(spoilt)
    assert (both.capped, both.uncertified) == (2, 4)
