"""The exact steps reach the oracle's answer from any guess, or prove that there is none."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.exact import (
    Outcome,
    RationalProgram,
    independent_rows,
    inverse_of,
    nearest_float,
    settle,
    solve_definite,
)
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest
from safefilter.testing.program_strategies import (
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
)

guesses = st.lists(st.integers(0, 5), max_size=3)


@given(program=permitted_programs(), guess=guesses)
def test_every_guess_leads_to_the_nearest_point(program: ConvexProgram, guess: list[int]) -> None:
    answer = settle(RationalProgram.of(program), guess, 50)
    point = exact_nearest(program)
    if point is None:
        assert answer.outcome is Outcome.CONTRADICTION
    else:
        assert answer.outcome is Outcome.OPTIMAL
        assert tuple(answer.x) == point
        assert min(answer.multipliers.values(), default=0) >= 0


@given(drawn=contradictory_programs(), guess=guesses)
def test_a_contradiction_comes_with_an_exact_proof(
    drawn: tuple[ConvexProgram, FloatArray], guess: list[int]
) -> None:
    program, _ = drawn
    rows = RationalProgram.of(program)
    answer = settle(rows, guess, 50)
    assert answer.outcome is Outcome.CONTRADICTION
    assert min(answer.multipliers.values()) >= 0
    for k in range(2):
        assert sum(weight * rows.G[i][k] for i, weight in answer.multipliers.items()) == 0
    assert sum(weight * rows.h[i] for i, weight in answer.multipliers.items()) < 0


@given(stages=second_stage_programs(), guess=guesses)
def test_a_linear_program_bent_up_has_its_own_least_value(
    stages: SecondStage, guess: list[int]
) -> None:
    corner = exact_least_violation(stages.first)
    assert corner is not None
    rows = RationalProgram.of(stages.first).bent_up(list(corner))
    answer = settle(rows, guess, 50)
    assert answer.outcome is Outcome.OPTIMAL
    assert 0 <= answer.x[2] - corner[2] <= Fraction(1, 10**12)


def test_steps_are_counted() -> None:
    # From 0 rows held, a corner takes two steps.
    program = ConvexProgram(np.eye(2), np.array([-3.0, -2.0]), np.eye(2), np.zeros(2))
    rows = RationalProgram.of(program)
    assert settle(rows, [], 1).outcome is Outcome.UNSETTLED
    assert settle(rows, [], 2).outcome is Outcome.OPTIMAL
    assert settle(rows, [0, 1], 0).outcome is Outcome.OPTIMAL


def test_violation_that_is_allowed_takes_no_step() -> None:
    program = ConvexProgram(np.eye(1), np.array([-1.0]), np.eye(1), np.array([0.75]))
    rows = RationalProgram.of(program)
    assert settle(rows, [], 5, Fraction(1, 4)).x == [1]
    assert settle(rows, [], 5, Fraction(1, 5)).x == [Fraction(3, 4)]


def test_rows_parallel_but_for_rounding_are_not_both_guessed() -> None:
    G = np.array([[1.0, 0.0], [-1.0, 1e-16], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    program = ConvexProgram(np.eye(2), np.zeros(2), G, np.ones(5))
    assert independent_rows(RationalProgram.of(program), range(5)) == [0, 3]


def test_a_zero_row_is_never_guessed() -> None:
    program = ConvexProgram(np.eye(2), np.zeros(2), np.zeros((1, 2)), np.ones(1))
    assert independent_rows(RationalProgram.of(program), [0]) == []


def test_elimination_solves_and_recognises_what_is_not_definite() -> None:
    two, one, three = Fraction(2), Fraction(1), Fraction(3)
    assert solve_definite([[two, one], [one, two]], [[three, three]]) == [[1, 1]]
    assert solve_definite([[one, one], [one, one]], [[one, one]]) == []
    assert solve_definite([[one, two], [two, one]], [[one, one]]) == []
    assert solve_definite([[-one]], [[one]]) == []


def test_the_inverse_is_of_the_symmetric_part() -> None:
    P = np.array([[2.0, 1.0 + 2.0**-50], [1.0 - 2.0**-50, 2.0]])
    third = Fraction(1, 3)
    assert inverse_of(P) == [[2 * third, -third], [-third, 2 * third]]


@pytest.mark.parametrize(
    ("value", "number"),
    [(Fraction(1, 3), 1 / 3), (Fraction(10) ** 400, np.inf), (-(Fraction(10) ** 400), -np.inf)],
)
def test_rationals_too_large_for_a_float_become_infinite(value: Fraction, number: float) -> None:
    assert nearest_float(value) == number
