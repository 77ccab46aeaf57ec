"""The exact answers, against those by hand and against trying everything."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem
from safefilter.decision import Case
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest

TOLERANCE = 1e-9
MakeSquare = Callable[..., Problem]


def test_a_feasible_problem_by_hand(feasible: Problem) -> None:
    truth = truth_of(feasible, TOLERANCE)
    assert (truth.case, truth.margin, truth.least) == (Case.PROJECTED, -0.5, 0.0)
    assert truth.point.tolist() == [0.5, 0.0]
    assert not truth.is_empty


def test_an_empty_problem_by_hand(empty: Problem) -> None:
    truth = truth_of(empty, TOLERANCE)
    assert (truth.case, truth.margin, truth.least) == (Case.LEAST_VIOLATION, 0.5, 0.5)
    assert truth.point.tolist() == [0.0, 0.0]
    assert truth.is_empty


def test_a_permitted_wish_is_case_1(make_square: MakeSquare) -> None:
    truth = truth_of(make_square((1.0, 0.0, -0.5)), TOLERANCE)
    assert (truth.case, truth.margin, truth.point.tolist()) == (Case.SAFE, -1.5, [0.0, 0.0])


def test_a_margin_in_the_last_bit_is_seen(make_square: MakeSquare) -> None:
    """Rows that miss each other by one unit in the last place are empty, and those that touch are not."""
    next_to = math.nextafter(0.5, 1.0)
    touching = truth_of(make_square((1.0, 0.0, 0.5), (-1.0, 0.0, -0.5)), TOLERANCE)
    apart = truth_of(make_square((1.0, 0.0, next_to), (-1.0, 0.0, -0.5)), TOLERANCE)
    assert (touching.case, touching.margin) == (Case.PROJECTED, 0.0)
    assert apart.is_empty
    assert apart.margin == (next_to - 0.5) / 2.0


def test_without_soft_rows_there_is_no_margin() -> None:
    box = (np.concatenate([np.eye(2), -np.eye(2)]), -np.ones(4), np.ones(4, dtype=np.bool_))
    truth = truth_of(Problem.of("", [3.0, 0.0], *box, scale=1.0), TOLERANCE)
    assert truth.case is Case.PROJECTED
    assert math.isnan(truth.margin)
    assert truth.point.tolist() == [1.0, 0.0]


@pytest.mark.parametrize("has_soft", [False, True])
def test_contradicting_hard_rows_leave_no_point(has_soft: bool) -> None:
    normals = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    hard = [True, True, not has_soft]
    problem = Problem.of("", [0.0, 0.0], normals, [1.0, 1.0, 0.0], hard, scale=1.0)
    truth = truth_of(problem, TOLERANCE)
    assert (truth.case, truth.margin) == (Case.LEAST_VIOLATION, math.inf)
    assert np.isnan(truth.point).all()


# Few bits keep trying everything fast.
SIXTEENTHS = st.integers(-16, 16).map(lambda value: value / 16.0)
NORMALS = st.sampled_from([(1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.8, 0.6), (-0.28, -0.96)])
ROWS = st.lists(st.tuples(NORMALS, SIXTEENTHS), min_size=1, max_size=5)


@given(ROWS, st.tuples(SIXTEENTHS, SIXTEENTHS))
def test_trying_everything_finds_the_same(
    rows: list[tuple[tuple[float, float], float]], wanted: tuple[float, float]
) -> None:
    soft = np.array([normal for normal, _ in rows])
    problem = Problem.of(
        "",
        wanted,
        np.concatenate([np.eye(2), -np.eye(2), soft]),
        np.concatenate([-np.ones(4), [offset for _, offset in rows]]),
        np.arange(4 + len(rows)) < 4,
        scale=1.0,
    )
    truth = truth_of(problem, TOLERANCE)
    relaxation = 0.0
    nearest = exact_nearest(nearest_velocity(problem.rows, 0, problem.wanted))
    assert truth.is_empty == (nearest is None)
    if nearest is None:
        least = exact_least_violation(least_violation(problem.rows, 0))
        assert least is not None
        assert truth.margin == float(least[2])
        relaxation = truth.margin + TOLERANCE
        nearest = exact_nearest(nearest_velocity(problem.rows, 0, problem.wanted, relaxation))
    assert nearest is not None
    assert truth.point.tolist() == [float(value) for value in nearest]


@given(ROWS)
def test_a_margin_is_what_the_rows_must_be_loosened_by(
    rows: list[tuple[tuple[float, float], float]],
) -> None:
    def loosened(by: float) -> Problem:
        soft = np.array([normal for normal, _ in rows])
        bounds = np.array([offset - by for _, offset in rows])
        return Problem.of(
            "",
            [0.0, 0.0],
            np.concatenate([np.eye(2), -np.eye(2), soft]),
            np.concatenate([-np.ones(4), bounds]),
            np.arange(4 + len(rows)) < 4,
            scale=1.0,
        )

    margin = truth_of(loosened(0.0), TOLERANCE).margin
    assert truth_of(loosened(margin - 1e-6), TOLERANCE).is_empty
    assert not truth_of(loosened(margin + 1e-6), TOLERANCE).is_empty
    assert truth_of(loosened(0.25), TOLERANCE).margin == pytest.approx(margin - 0.25, abs=1e-12)
