"""Steps of every closed loop count alike: who touches whom, and what is not certified, is told once."""

from dataclasses import replace

import numpy as np
import pytest

import safefilter as sf
from assurance.stress.moments import Failure, of_rollout, of_uncertain_steps, of_worlds
from policies.drive_campaign import drive_steps
from policies.drive_trials import COMBINATIONS, Size, drive_trial
from safefilter.testing.policies import Ramming
from safefilter.testing.rollout import Trial, roll_out
from safefilter.testing.uncertain_loop import (
    Adversary,
    UncertainStep,
    UncertainTrial,
    roll_out_uncertain,
)

WALL = [[[-5.0, 1.0], [5.0, 1.0]]]


def trial(**changes: object) -> Trial:
    scene = sf.Scene.from_world([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.4, walls=WALL)
    return replace(Trial(scene, Ramming(), np.ones(2), num_steps=3), **changes)  # type: ignore[arg-type]  # fields


def safety() -> sf.SafetyFilter:
    return sf.SafetyFilter([sf.Separation(0.2)], sf.Holonomic(1.0))


def test_robots_that_touch_are_told_once() -> None:
    moments = [of_rollout(step) for step in roll_out(None, trial())]
    (failure,) = [failure for moment in moments for failure in moment.failures]
    assert failure == Failure(0, "robots", (0, 1), moments[0].tally.min_clearance)
    assert failure.clearance == pytest.approx(-0.2)
    assert sum(moment.tally.collisions for moment in moments) == 1


def test_a_robot_that_touches_a_wall_is_told() -> None:
    class Up:
        def act(
            self, scene: sf.Scene, *_: object
        ) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
            return np.tile([0.0, 4.0], (scene.num_robots, 1))

    slow = trial(policy=Up(), v_max=np.full(2, 4.0), num_steps=1)
    (moment,) = (of_rollout(step) for step in roll_out(None, slow))
    assert [(failure.what, failure.who) for failure in moment.failures] == [
        ("wall", (0, 0)),
        ("wall", (1, 0)),
    ]
    assert moment.tally.wall_collisions == moment.tally.collisions == 2


def test_what_is_not_certified_is_told() -> None:
    step = next(roll_out(safety(), trial()))
    assert step.decision is not None
    assert of_rollout(step).failures == ()
    spoilt = replace(step.decision, certified=np.array([True, False]))
    moment = of_rollout(replace(step, decision=spoilt))
    assert moment.failures == (Failure(0, "uncertified", (1,), 0.0),)
    assert moment.tally.uncertified == 1


def test_worlds_tell_world_and_robot() -> None:
    choice = next(found for found in COMBINATIONS if found.policy.name == "ramming")
    rng = np.random.default_rng(0)
    drawn = drive_trial(rng, choice, Size(40, 10), 0, kinematics="holonomic")
    failures, collisions = list[Failure](), 0
    for step in drive_steps(drawn, "filter off"):
        moment = of_worlds(step)
        assert moment.tally.cases == (0, 0, 0)
        collisions += moment.tally.collisions
        failures += moment.failures
        for failure in moment.failures:
            world, robot = failure.who
            hit = step.outcome.hit_wall if failure.what == "wall" else step.outcome.hit_robot
            assert hit[world, robot]
    assert collisions > 0
    assert {failure.what for failure in failures} >= {"robots"}
    assert all(failure.clearance < 0.0 for failure in failures)


def test_filtered_worlds_count_every_decision() -> None:
    drawn = drive_trial(np.random.default_rng(0), COMBINATIONS[0], Size(20, 5), 0)
    for step in drive_steps(drawn):
        moment = of_worlds(step)
        assert moment.failures == ()
        assert sum(moment.tally.cases) == sum(moment.tally.faults) == moment.tally.robot_steps > 0


def uncertain_step(number: int, clearance: float, wall: float = np.inf) -> UncertainStep:
    return UncertainStep(number, np.zeros((1, 2)), clearance, wall, ())


def test_an_uncertain_contact_counts_when_it_begins() -> None:
    steps = [
        uncertain_step(k, clearance) for k, clearance in enumerate((0.1, -0.1, -0.2, 0.1, -0.3))
    ]
    moments = list(of_uncertain_steps([*steps, uncertain_step(5, 0.1, -0.1)]))
    assert [moment.tally.collisions for moment in moments] == [0, 1, 0, 0, 1, 0]
    assert [len(moment.failures) for moment in moments] == [0, 1, 0, 0, 1, 0]
    assert moments[1].failures == (Failure(1, "robots", (), -0.1),)
    walled = list(of_uncertain_steps([uncertain_step(0, 0.1, -0.1)]))
    assert walled[0].tally.wall_collisions == walled[0].tally.collisions == 1


def test_uncertain_decisions_count_robot_by_robot() -> None:
    scene = trial().scene
    exact = UncertainTrial(scene, Ramming(), 1.0, sf.Uncertainty(), Adversary(), num_steps=3)
    moments = list(of_uncertain_steps(roll_out_uncertain(safety(), exact)))
    assert [moment.tally.robot_steps for moment in moments] == [2, 2, 2]
    assert [sum(moment.tally.cases) for moment in moments] == [2, 2, 2]
    assert all(moment.failures == () for moment in moments)
