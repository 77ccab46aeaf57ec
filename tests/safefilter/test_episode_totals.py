import math

import numpy as np
import pytest

import safefilter as sf
from safefilter.wrappers.episode_totals import EpisodeTotals, least_clearance

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
HEAD_ON = sf.Scene.from_world(
    [[0.0, 0.0], [0.5, 0.0], [9.0, 9.0]], [[0.2, 0.0], [-0.2, 0.0], [0.0, 0.0]], 0.1
)
EVERYONE = np.arange(3)[np.newaxis]
WANTED = np.array([[0.2, 0.0], [-0.2, 0.0], [0.1, 0.1]])
FIRST, GOES_ON = np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.bool_)


def test_empty_episode_has_totals() -> None:
    numbers = {name: value.item() for name, value in EpisodeTotals().numbers().items()}
    assert numbers.pop("min_clearance") == math.inf
    assert numbers.pop("certified") == 1.0
    assert set(numbers.values()) == {0.0}


def test_totals_add_up_over_steps_and_robots() -> None:
    totals = EpisodeTotals()
    nan = np.full((3, 2), np.nan)
    decisions = [FILTER.decide(HEAD_ON, action) for action in (WANTED, WANTED, nan)]
    for decision in decisions:
        totals.add(decision, np.zeros(3, dtype=np.int64), GOES_ON)
        totals.see(HEAD_ON, EVERYONE, FIRST)
    correction = np.concatenate([decision.correction for decision in decisions])
    case = np.concatenate([decision.case for decision in decisions])
    assert {name: value.item() for name, value in totals.numbers().items()} == {
        "steps": 3.0,
        "decisions": 9.0,
        # A wish that is not finite is replaced too: three robots stand still instead.
        "interventions": float((correction > 0).sum() + 3),
        "mean_correction": pytest.approx(correction.mean()),
        "case_1": float((case == 1).sum()),
        "case_2": float((case == 2).sum()),
        "case_3": 0.0,
        "certified": 1.0,
        "faults": 3.0,
        "min_clearance": pytest.approx(0.3),
    }
    assert (case == 2).any()
    assert (correction > 0).any()


def test_episodes_side_by_side_count_as_each_alone() -> None:
    together = EpisodeTotals(3)
    decision = FILTER.decide(HEAD_ON, WANTED)
    episode = np.array([2, 0, 2])
    together.add(decision, episode, np.array([True, False, True]))
    together.see(HEAD_ON, np.array([[2], [0]]), np.array([2, 0]))
    for number, robots in ((0, [1]), (1, []), (2, [0, 2])):
        alone = EpisodeTotals()
        own = FILTER.decide(HEAD_ON, WANTED[robots], robots)
        alone.add(own, np.zeros(len(robots), dtype=np.int64), np.array([bool(robots)]))
        if robots:
            alone.see(HEAD_ON, np.array([[number]]), FIRST)
        for name, value in alone.numbers().items():
            assert together.numbers()[name][number] == value[0], name
    together.begin(np.array([False, False, True]))
    assert together.numbers()["steps"].tolist() == [1.0, 0.0, 0.0]
    assert together.numbers()["min_clearance"].tolist()[1:] == [math.inf, math.inf]


def test_numbers_do_not_change_afterwards() -> None:
    totals = EpisodeTotals()
    numbers = totals.numbers()
    totals.add(FILTER.decide(HEAD_ON, WANTED), np.zeros(3, dtype=np.int64), GOES_ON)
    totals.see(HEAD_ON, EVERYONE, FIRST)
    assert numbers["decisions"].tolist() == [0.0]
    assert numbers["min_clearance"].tolist() == [math.inf]


def test_least_clearance_is_that_of_each_robot_asked_about() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0], [5.0, 0.0], [5.0, 0.1]], np.zeros((4, 2)), [0.1, 0.2, 0.1, 0.1]
    )
    np.testing.assert_allclose(least_clearance(scene, np.array([2, 0])), [-0.1, 0.7])
    np.testing.assert_allclose(least_clearance(scene, np.arange(4)), [0.7, 0.7, -0.1, -0.1])


def test_clearance_is_infinite_where_nobody_is_seen() -> None:
    scene = sf.Scene.from_world([[0, 0], [9, 0], [9, 1]], np.zeros((3, 2)), 0.1, reach=2.0)
    np.testing.assert_allclose(least_clearance(scene, np.arange(3)), [math.inf, 0.8, 0.8])
    assert len(least_clearance(scene, np.arange(0))) == 0
