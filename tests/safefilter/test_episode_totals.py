import math

import numpy as np
import pytest

import safefilter as sf
from safefilter.wrappers.episode_totals import EpisodeTotals, least_clearance

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
HEAD_ON = sf.Scene.from_world(
    [[0.0, 0.0], [0.5, 0.0], [9.0, 9.0]], [[0.2, 0.0], [-0.2, 0.0], [0.0, 0.0]], 0.1
)
EVERYONE = np.arange(3)


def test_empty_episode_has_totals() -> None:
    numbers = EpisodeTotals().numbers()
    assert numbers.pop("min_clearance") == math.inf
    assert numbers.pop("certified") == 1.0
    assert set(numbers.values()) == {0.0}


def test_totals_add_up_over_steps_and_robots() -> None:
    totals = EpisodeTotals()
    nan = np.full((3, 2), np.nan)
    wanted = np.array([[0.2, 0.0], [-0.2, 0.0], [0.1, 0.1]])
    decisions = [FILTER.decide(HEAD_ON, action) for action in (wanted, wanted, nan)]
    for decision in decisions:
        totals.add(decision)
        totals.see(HEAD_ON, EVERYONE)
    correction = np.concatenate([decision.correction for decision in decisions])
    case = np.concatenate([decision.case for decision in decisions])
    assert totals.numbers() == {
        "steps": 3.0,
        "decisions": 9.0,
        "interventions": float((correction > 0).sum()),
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


def test_totals_are_plain_floats() -> None:
    totals = EpisodeTotals()
    totals.add(FILTER.decide(HEAD_ON, np.zeros((3, 2))))
    totals.see(HEAD_ON, EVERYONE)
    assert {type(value) for value in totals.numbers().values()} == {float}


def test_least_clearance_is_that_of_the_robots_asked_about() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0], [5.0, 0.0], [5.0, 0.1]], np.zeros((4, 2)), [0.1, 0.2, 0.1, 0.1]
    )
    assert least_clearance(scene, np.array([0])) == pytest.approx(0.7)
    assert least_clearance(scene, np.array([0, 2])) == pytest.approx(-0.1)
    assert least_clearance(scene, np.arange(4)) == pytest.approx(-0.1)


def test_clearance_is_infinite_where_nobody_is_seen() -> None:
    far = sf.Scene.from_world([[0, 0], [9, 0]], np.zeros((2, 2)), 0.1, reach=2.0)
    assert least_clearance(far, np.arange(2)) == math.inf
    assert least_clearance(far, np.arange(0)) == math.inf
