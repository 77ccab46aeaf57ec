"""Residuals and allowances by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.programs.convex_program import ConvexProgram
from safefilter.residuals import (
    Allowance,
    Residuals,
    allowance,
    complaint,
    least_curvature,
    measure,
)


def line(wanted: float) -> ConvexProgram:
    """The nearest x <= 1, in one dimension."""
    return ConvexProgram(np.eye(1), np.array([-wanted]), np.eye(1), np.ones(1))


def test_an_exact_answer_leaves_nothing() -> None:
    assert measure(line(3.0), np.ones(1), np.array([2.0]), 1.0, math.inf) == (0, 0, 0, 0)


def test_each_residual_is_the_number_it_says() -> None:
    # x = 3/2 violates by 1/2; the gradient is 3/2 - 3 + 1 = -1/2.
    residuals = measure(line(3.0), np.array([1.5]), np.array([1.0]), 1.0, math.inf)
    assert residuals.primal == pytest.approx(0.5, abs=1e-12)
    assert residuals[1:] == (0.5, 0.5, -0.5 + 0.125)


@given(x=st.floats(-2.0, 1.0), multiplier=st.floats(0.0, 4.0), wanted=st.floats(-3.0, 3.0))
def test_the_gap_bounds_how_far_the_objective_is_from_the_least(
    x: float, multiplier: float, wanted: float
) -> None:
    program = line(wanted)
    best = program.objective(np.array([min(wanted, 1.0)]))
    residuals = measure(program, np.array([x]), np.array([multiplier]), 1.0, math.inf)
    assert program.objective(np.array([x])) - best <= residuals.gap + 1e-12


@given(
    x=st.floats(-1.0, 1.0),
    multipliers=st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)),
    slope=st.floats(-2.0, 2.0),
)
def test_the_gap_of_a_linear_program_is_a_bound_within_the_radius(
    x: float, multipliers: tuple[float, float], slope: float
) -> None:
    G = np.array([[1.0], [-1.0]])
    program = ConvexProgram(np.zeros((1, 1)), np.array([slope]), G, np.ones(2))
    residuals = measure(program, np.array([x]), np.array(multipliers), 0.0, 1.0)
    assert slope * x + abs(slope) <= residuals.gap + 1e-12


def test_curvature_is_the_least_eigenvalue() -> None:
    assert least_curvature(np.diag([3.0, 2.0])) == pytest.approx(2.0)
    assert least_curvature(np.zeros((2, 2))) == 0.0
    assert least_curvature(np.array([[1.0, 1.0], [1.0, 1.0]])) == 0.0
    assert least_curvature(np.diag([3.0, -1e-6])) == pytest.approx(-1e-6)


def test_flat_programs_allow_smaller_residuals() -> None:
    limits = allowance(line(0.0), np.zeros(1), 1e-3, 1e-6)
    assert limits == pytest.approx((1e-6, 1e-9, 1e-9))
    assert allowance(line(0.0), np.zeros(1), 100.0, 1e-6) == pytest.approx((1e-6, 1e-6, 1e-6))


def test_large_numbers_are_allowed_their_rounding() -> None:
    limits = allowance(line(1e8), np.array([1e8]), 1.0, 1e-7)
    assert limits.dual == pytest.approx(1e-7 + 1e-5)
    assert limits.gap == pytest.approx(4e3, rel=1e-6)


@pytest.mark.parametrize("value", [2.0, math.nan, math.inf])
@pytest.mark.parametrize(
    ("field", "reason"),
    [
        ("primal", "a row is violated"),
        ("dual", "P x + q + G' multipliers is not zero"),
        ("complementarity", "a row with a multiplier is not active"),
        ("gap", "the objective can be above the least one"),
    ],
)
def test_what_is_too_large_or_not_a_number_is_named(field: str, reason: str, value: float) -> None:
    residuals = Residuals(1.0, 1.0, 1.0, 1.0)._replace(**{field: value})
    assert complaint(residuals, Allowance(1.0, 1.0, 1.0)).startswith(reason)


def test_what_is_within_the_limits_is_no_complaint() -> None:
    assert complaint(Residuals(1.0, 1.0, 1.0, -5.0), Allowance(1.0, 1.0, 1.0)) == ""
