import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import reward_terms as terms
from envs.reward import RewardWeights
from safefilter.arrays import FloatArray

WEIGHTS = RewardWeights()
angles = st.floats(-math.pi, math.pi)


def unit(angle: float) -> FloatArray:
    return np.array([math.cos(angle), math.sin(angle)])


def forward(since: FloatArray, position: FloatArray, goal: FloatArray) -> float:
    """The term at the paper's weight."""
    was_away, is_away = (float(np.linalg.norm(goal - place)) for place in (since, position))
    return terms.moving_forward(was_away, is_away, 3.0)


def direction(course: FloatArray, to_goal: FloatArray, share: float = 1.0, c: float = 1.0) -> float:
    return terms.direction(course[0], course[1], to_goal[0], to_goal[1], share, c)


def direction_as_printed(velocity: FloatArray, to_goal: FloatArray) -> float:
    """Eq. (9) word by word, with c = 1."""
    cosine = float(velocity @ to_goal / (np.linalg.norm(velocity) * np.linalg.norm(to_goal)))
    return math.pi - 2.0 * abs(math.acos(min(1.0, max(-1.0, cosine))))


def test_coming_nearer_pays_by_the_metre_and_going_away_costs_the_same() -> None:
    near, far, goal = np.array([1.0, 0.0]), np.array([1.0, 2.0]), np.array([1.0, -1.0])
    assert forward(far, near, goal) == pytest.approx(6.0)
    assert forward(near, far, goal) == pytest.approx(-6.0)


def test_forward_term_by_hand() -> None:
    # Eq. (8): 3 (|(3, 4)| - |(0, 1)|) = 3 (5 - 1)
    found = forward(np.zeros(2), np.array([3.0, 3.0]), np.array([3.0, 4.0]))
    assert found == pytest.approx(12.0)


def test_going_round_the_goal_pays_nothing() -> None:
    assert forward(np.array([0.0, 2.0]), np.array([2.0, 0.0]), np.zeros(2)) == 0.0


def test_progress_telescopes_so_that_lingering_earns_nothing() -> None:
    way, goal = np.random.default_rng(0).normal(size=(30, 2)), np.array([5.0, 5.0])
    total = sum(forward(way[k], way[k + 1], goal) for k in range(29))
    assert total == pytest.approx(forward(way[0], way[-1], goal))


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(0, math.pi), (45, math.pi / 2), (90, 0), (-90, 0), (135, -math.pi / 2), (180, -math.pi)],
)
def test_direction_term_by_hand(degrees: float, expected: float) -> None:
    course, to_goal = 0.1 * unit(math.radians(30 + degrees)), 4.0 * unit(math.radians(30))
    assert direction(course, to_goal) == pytest.approx(expected)
    assert direction(course, to_goal, share=0.5, c=2.0) == pytest.approx(expected)


@given(angles, angles, st.floats(1e-3, 10.0), st.floats(1e-3, 10.0))
def test_direction_term_is_equation_9(a: float, b: float, speed: float, distance: float) -> None:
    course, to_goal = speed * unit(a), distance * unit(b)
    # acos loses half of the digits near 0 and pi.
    expected = direction_as_printed(course, to_goal)
    assert direction(course, to_goal) == pytest.approx(expected, abs=1e-7)


@given(angles, angles, angles)
def test_direction_term_knows_no_axes_and_no_hands(a: float, b: float, turn: float) -> None:
    found = direction(unit(a), unit(b))
    assert direction(unit(a + turn), unit(b + turn)) == pytest.approx(found, abs=1e-12)
    assert direction(unit(-a), unit(-b)) == pytest.approx(found, abs=1e-12)


def test_without_course_or_at_the_goal_there_is_no_direction() -> None:
    rest, ahead = np.zeros(2), np.array([1.0, 0.0])
    assert direction(rest, ahead) == direction(ahead, rest) == direction(rest, rest) == 0.0


@pytest.mark.parametrize(
    ("term", "weight", "constant"),
    [
        (terms.static_collision, WEIGHTS.static_collision, -40.0),
        (terms.dynamic_collision, WEIGHTS.dynamic_collision, -15.0),
        (terms.passing_time, WEIGHTS.time, -0.25),
        (terms.reaching_goal, WEIGHTS.goal, 80.0),
        (terms.norm, WEIGHTS.norm, -2.0),
    ],
)
def test_events_pay_the_papers_constants_where_they_happen(
    term: Callable[[bool, float], float], weight: float, constant: float
) -> None:
    assert term(True, weight) == constant
    assert term(False, weight) == 0.0


def test_intervention_costs_in_proportion() -> None:
    assert terms.intervention(0.05, -2.0) == -0.1
    assert terms.intervention(0.0, -2.0) == 0.0


def test_the_way_is_paid_by_the_metre_and_back_again() -> None:
    assert terms.way(0.04, 20.0) == 0.8
    assert terms.way(-0.04, 20.0) == -0.8


@pytest.mark.parametrize(
    ("progress", "expected"), [(0.04, math.pi), (0.02, math.pi / 3), (0.0, 0.0), (-0.04, -math.pi)]
)
def test_direction_of_the_way_by_hand(progress: float, expected: float) -> None:
    assert terms.way_direction(progress, 0.04, 1.0, 1.0) == pytest.approx(expected)
    assert terms.way_direction(progress, 0.04, 0.5, 0.3) == pytest.approx(0.15 * expected)


@given(angles, st.floats(0.1, 1.0))
def test_without_walls_the_direction_of_the_way_is_that_of_the_goal(
    angle: float, speed: float
) -> None:
    # Far away, where the goal lies in the same direction all the step long.
    goal, moved = np.array([1e9, 0.0]), speed * unit(angle)
    progress = float(moved[0])
    found = terms.way_direction(progress, float(np.linalg.norm(moved)), 1.0, 1.0)
    assert found == pytest.approx(direction(moved, goal), abs=1e-6)


def test_direction_of_the_way_takes_more_progress_than_way_for_straight_ahead() -> None:
    # Lengths are read off a grid: they may change by more than the robot moved.
    assert terms.way_direction(0.05, 0.04, 1.0, 1.0) == math.pi
    assert terms.way_direction(-0.05, 0.04, 1.0, 1.0) == -math.pi
    assert terms.way_direction(0.01, 0.0, 1.0, 1.0) == 0.0
