import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import reward_terms as terms
from envs.reward import RewardWeights
from safefilter.arrays import FloatArray

WEIGHTS = RewardWeights()
ONE = np.ones(())
angles = st.floats(-math.pi, math.pi)


def unit(angle: float) -> FloatArray:
    return np.array([math.cos(angle), math.sin(angle)])


def direction_as_printed(velocity: FloatArray, to_goal: FloatArray) -> float:
    """Eq. (9) word by word, with c = 1."""
    cosine = float(velocity @ to_goal / (np.linalg.norm(velocity) * np.linalg.norm(to_goal)))
    return math.pi - 2.0 * abs(math.acos(min(1.0, max(-1.0, cosine))))


def test_coming_nearer_pays_by_the_metre_and_going_away_costs_the_same() -> None:
    near, far, goal = np.array([[1.0, 0.0]]), np.array([[1.0, 2.0]]), np.array([[1.0, -1.0]])
    assert terms.moving_forward(far, near, goal, 3.0) == pytest.approx([6.0])
    assert terms.moving_forward(near, far, goal, 3.0) == pytest.approx([-6.0])


def test_forward_term_by_hand() -> None:
    # Eq. (8): 3 (|(3, 4)| - |(0, 1)|) = 3 (5 - 1)
    found = terms.moving_forward(np.zeros(2), np.array([3.0, 3.0]), np.array([3.0, 4.0]), 3.0)
    assert found == pytest.approx(12.0)


def test_going_round_the_goal_pays_nothing() -> None:
    turned = terms.moving_forward(
        np.array([[0.0, 2.0]]), np.array([[2.0, 0.0]]), np.zeros((1, 2)), 3.0
    )
    assert turned == pytest.approx([0.0])


def test_progress_telescopes_so_that_lingering_earns_nothing() -> None:
    way, goal = np.random.default_rng(0).normal(size=(30, 2)), np.array([5.0, 5.0])
    total = terms.moving_forward(way[:-1], way[1:], goal, 3.0).sum()
    assert total == pytest.approx(terms.moving_forward(way[0], way[-1], goal, 3.0))


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(0, math.pi), (45, math.pi / 2), (90, 0), (-90, 0), (135, -math.pi / 2), (180, -math.pi)],
)
def test_direction_term_by_hand(degrees: float, expected: float) -> None:
    course, to_goal = 0.1 * unit(math.radians(30 + degrees)), 4.0 * unit(math.radians(30))
    assert terms.direction(course, to_goal, ONE, 1.0) == pytest.approx(expected)
    assert terms.direction(course, to_goal, 0.5 * ONE, 2.0) == pytest.approx(expected)


@given(angles, angles, st.floats(1e-3, 10.0), st.floats(1e-3, 10.0))
def test_direction_term_is_equation_9(a: float, b: float, speed: float, distance: float) -> None:
    course, to_goal = speed * unit(a), distance * unit(b)
    # acos loses half of the digits near 0 and pi.
    assert float(terms.direction(course, to_goal, ONE, 1.0)) == pytest.approx(
        direction_as_printed(course, to_goal), abs=1e-7
    )


@given(angles, angles, angles)
def test_direction_term_knows_no_axes_and_no_hands(a: float, b: float, turn: float) -> None:
    found = float(terms.direction(unit(a), unit(b), ONE, 1.0))
    assert float(terms.direction(unit(a + turn), unit(b + turn), ONE, 1.0)) == pytest.approx(
        found, abs=1e-12
    )
    assert float(terms.direction(unit(-a), unit(-b), ONE, 1.0)) == pytest.approx(found, abs=1e-12)


def test_without_course_or_at_the_goal_there_is_no_direction() -> None:
    course = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    to_goal = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    assert terms.direction(course, to_goal, np.ones(3), 1.0).tolist() == [0.0, 0.0, 0.0]


def test_events_pay_the_papers_constants_where_they_happen() -> None:
    flags = np.array([True, False])
    assert terms.static_collision(flags, WEIGHTS.static_collision).tolist() == [-40.0, 0.0]
    assert terms.dynamic_collision(flags, WEIGHTS.dynamic_collision).tolist() == [-15.0, 0.0]
    assert terms.passing_time(flags, WEIGHTS.time).tolist() == [-0.25, 0.0]
    assert terms.reaching_goal(flags, WEIGHTS.goal).tolist() == [80.0, 0.0]
    assert terms.norm(flags, WEIGHTS.norm).tolist() == [-2.0, 0.0]


def test_intervention_costs_in_proportion() -> None:
    assert terms.intervention(np.array([0.0, 0.05]), -2.0).tolist() == [0.0, -0.1]
