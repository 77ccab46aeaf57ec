from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis.vendor.pretty import pretty

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.kinematics.arc import chord_velocity
from safefilter.outlines import OwnWalls
from safefilter.testing.policies import GoalSeeking, Mixed, NotFinite, Ramming, UniformRandom
from safefilter.testing.rollout import SENSIBLE_SPEED, Trial, roll_out
from safefilter.testing.strategies import rollouts

DT = 0.2


def filter_of(trial: Trial) -> sf.SafetyFilter:
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    return sf.SafetyFilter([sf.PriorityORCA(2.0), separation], sf.Holonomic(trial.v_max))


two_robots = partial(sf.Scene.from_world, [[0.0, 0.0], [2.0, 0.0]], np.zeros((2, 2)), 0.3)


def test_without_a_filter_robots_do_what_the_policy_asks_for_up_to_top_speed() -> None:
    trial = Trial(two_robots(), Ramming(), np.array([0.5, 1.0]), dt=DT, num_steps=2)
    first, second = roll_out(None, trial)
    assert first.decision is None
    assert first.velocity.tolist() == [[0.5, 0.0], [-1.0, 0.0]]
    assert second.scene.position == pytest.approx(np.array([[0.1, 0.0], [1.8, 0.0]]))
    assert second.scene.velocity.tolist() == first.velocity.tolist()


def test_overspeed_is_cut_without_a_filter() -> None:
    trial = Trial(two_robots(), UniformRandom(), np.array([0.5, 1.0]), num_steps=50)
    for step in roll_out(None, trial):
        assert (np.hypot(*step.velocity.T) <= trial.v_max * (1.0 + 1e-12)).all()


@given(rollouts())
def test_with_a_filter_robots_that_cooperate_execute_what_it_decided(trial: Trial) -> None:
    for step in roll_out(filter_of(trial), trial):
        assert step.decision is not None
        assert step.decision.index.tolist() == np.flatnonzero(step.scene.cooperative).tolist()
        assert step.decision.action.dtype == (np.float32 if trial.is_single else np.float64)
        assert np.array_equal(step.velocity[step.decision.index], step.decision.action)
        assert step.scene.wanted is not None
        makes_sense = (np.abs(step.action) <= SENSIBLE_SPEED).all(axis=1)
        assert np.array_equal(step.scene.wanted[makes_sense], step.action[makes_sense])
        assert not step.scene.wanted[~makes_sense].any()


@given(rollouts())
def test_a_trial_is_repeated_bit_for_bit_by_the_code_it_is_written_as(trial: Trial) -> None:
    names = {
        "GoalSeeking": GoalSeeking,
        "Mixed": Mixed,
        "NotFinite": NotFinite,
        "inf": np.inf,
        "Ramming": Ramming,
        "Scene": sf.Scene,
        "Trial": Trial,
        "UniformRandom": UniformRandom,
        "np": np,
    }
    again = eval(repr(trial), names)
    for one, other in zip(
        roll_out(filter_of(trial), trial), roll_out(filter_of(again), again), strict=True
    ):
        assert np.array_equal(one.velocity, other.velocity)


def test_hypothesis_prints_that_code() -> None:
    trial = Trial(two_robots(), Ramming(), np.ones(2))
    assert pretty(trial) == repr(trial)


def test_all_that_a_robot_is_stays_with_it() -> None:
    scene = two_robots(
        priority=[1.0, 9.0], cooperative=[True, False], heading=[0.1, 0.2], world=[0, 1], reach=3.0
    )
    last = list(roll_out(None, Trial(scene, Ramming(), np.ones(2), num_steps=3)))[-1].scene
    assert last.priority.tolist() == [1.0, 9.0]
    assert last.cooperative.tolist() == [True, False]
    assert last.world.tolist() == [0, 1]
    assert last.reach == 3.0
    assert last.heading is not None
    assert last.heading.tolist() == [0.1, 0.2]


def test_two_robots_that_do_not_cooperate_are_not_judged() -> None:
    position = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]])
    scene = sf.Scene.from_world(position, np.zeros((3, 2)), 0.3, cooperative=[True, False, False])
    step = next(roll_out(None, Trial(scene, Ramming(), np.ones(3))))
    assert sorted(zip(step.pairs.first.tolist(), step.pairs.second.tolist(), strict=True)) == [
        (0, 1),
        (0, 2),
    ]


def test_nobody_is_filtered_where_nobody_cooperates() -> None:
    trial = Trial(two_robots(cooperative=False), Ramming(), np.ones(2))
    assert next(roll_out(filter_of(trial), trial)).decision is None


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
    with pytest.raises(OutOfRange, match="omega_max: expected from 0 up"):
        replace(trial, omega_max=-1.0)
    with pytest.raises(OutOfRange, match=r"less than half a turn in a step, got 20\.0"):
        replace(trial, omega_max=20.0)
    with pytest.raises(InvalidInput, match="scene: differential drives need heading="):
        replace(trial, omega_max=1.0)
    own = OwnWalls.of([[[5.0, 0.0], [5.0, 1.0]]], [[0, 1], [0, 0]])
    with pytest.raises(InvalidInput, match="leave own_walls and lidar out"):
        replace(trial, scene=two_robots(own_walls=own))


def test_robots_that_cooperate_are_judged_against_walls() -> None:
    scene = two_robots(walls=[[[1.0, -1.0], [1.0, 1.0]]], cooperative=[True, False])
    first, second = roll_out(None, Trial(scene, Ramming(), np.full(2, 2.0), num_steps=2))
    assert first.wall_pairs.first.tolist() == [0]
    assert first.wall_approach.start == pytest.approx([0.7])
    assert not first.wall_approach.collided.any()
    assert second.wall_approach.least == pytest.approx([-0.1])
    assert second.wall_approach.collided.all()
    assert second.scene.walls.tolist() == scene.walls.tolist()


def test_drives_go_along_arcs_and_turn() -> None:
    scene = two_robots(heading=[0.0, np.pi])
    trial = Trial(
        scene, GoalSeeking(((0.0, 9.0), (2.0, 0.0)), DT), np.ones(2), num_steps=2, omega_max=2.0
    )
    first, second = roll_out(None, trial)
    assert first.action == pytest.approx(np.array([[1.0, 2.0], [0.0, -2.0]]))
    # A fifth of a metre along a circle of half a metre.
    assert first.velocity[0] * DT == pytest.approx([0.5 * np.sin(0.4), 0.5 - 0.5 * np.cos(0.4)])
    assert first.turn.tolist() == pytest.approx([0.4, -0.4])
    assert second.scene.heading == pytest.approx([0.4, np.pi - 0.4])


def test_unfiltered_drives_that_ask_for_no_number_stand_still_beside_filtered_ones() -> None:
    scene = two_robots(cooperative=[True, False], heading=0.0)
    separation = sf.Separation(DT, passive_speed=1.0)
    drive = sf.DifferentialDrive(1.0, 2.0, DT, 0.05)
    trial = Trial(
        scene, NotFinite(Ramming()), np.ones(2), num_steps=50, passive_speed=1.0, omega_max=2.0
    )
    steps = list(roll_out(sf.SafetyFilter([separation], drive), trial))
    assert any(not np.isfinite(step.action[1]).all() for step in steps)
    assert all(np.isfinite(step.velocity).all() for step in steps)


@given(rollouts(omega_max=2.0))
def test_filtered_drives_execute_their_commands(trial: Trial) -> None:
    drive = sf.DifferentialDrive(trial.v_max, trial.omega_max, trial.dt, 0.05)
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    for step in roll_out(sf.SafetyFilter([separation], drive), trial):
        assert step.decision is not None
        assert step.scene.heading is not None
        robots = step.decision.index
        assert step.turn[robots] == pytest.approx(step.decision.action[:, 1] * trial.dt)
        assert step.velocity[robots] == pytest.approx(
            np.array([
                chord_velocity(float(v), float(w), float(heading), trial.dt)
                for (v, w), heading in zip(
                    step.decision.action, step.scene.heading[robots], strict=True
                )
            ]).reshape(-1, 2)
        )
