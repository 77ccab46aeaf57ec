from __future__ import annotations

import numpy as np
import pytest

from safefilter.backends.backend import Capabilities, Status
from safefilter.backends.unit_program import (
    Times,
    UnitProgram,
    gap_tolerance,
    require_supported,
)
from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram

TIMES = Times(build=1.0, solve=2.0)


def two_rows(first: float, second: float, *, stretch: float = 1.0) -> ConvexProgram:
    """``x <= first`` and ``-x <= second``, the second row written ``stretch`` times as long."""
    return ConvexProgram(
        P=4.0 * np.eye(2),
        q=np.array([-8.0, 0.0]),
        G=np.array([[1.0, 0.0], [-stretch, 0.0]]),
        h=np.array([first, stretch * second]),
    )


def linear(rows: list[list[float]]) -> ConvexProgram:
    return ConvexProgram(
        P=np.zeros((2, 2)), q=np.array([0.0, 5.0]), G=np.array(rows), h=np.ones(len(rows))
    )


def test_rows_get_length_one_and_the_cost_size_one() -> None:
    unit = UnitProgram.of(two_rows(0.5, 0.25, stretch=1e3))
    np.testing.assert_allclose(np.linalg.norm(unit.G, axis=1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(unit.h, [0.5, 0.25], rtol=1e-15)
    np.testing.assert_array_equal(unit.P, np.eye(2))
    np.testing.assert_array_equal(unit.q, [-2.0, 0.0])


def test_a_linear_program_is_scaled_by_its_linear_cost_and_keeps_zero_rows() -> None:
    unit = UnitProgram.of(linear([[0.0, 0.0], [3.0, 4.0]]))
    np.testing.assert_array_equal(unit.q, [0.0, 1.0])
    np.testing.assert_array_equal(unit.G, [[0.0, 0.0], [0.6, 0.8]])
    np.testing.assert_array_equal(unit.h, [1.0, 0.2])


def test_multipliers_return_to_the_scale_of_the_program() -> None:
    program = two_rows(0.5, 1.0, stretch=1e3)
    # At x = 0.5 the unit cost has gradient 0.5 - 2, which the first row holds with 1.5.
    solution = UnitProgram.of(program).solution(Status.OPTIMAL, [0.5, 0.0], [1.5, -1e-18], TIMES)
    gradient = program.P @ solution.x + program.q + program.G.T @ solution.multipliers
    np.testing.assert_array_equal(gradient, [0.0, 0.0])
    np.testing.assert_array_equal(solution.multipliers, [6.0, 0.0])
    assert (solution.build_time, solution.solve_time) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("x", "multipliers"),
    [
        ([np.nan, 0.0], [0.0, 0.0]),
        ([0.0, 0.0], [np.inf, 0.0]),
        (None, [0.0, 0.0]),
        ([0.0, 0.0], None),
    ],
)
def test_an_answer_that_is_not_finite_has_no_point(
    x: list[float] | None, multipliers: list[float] | None
) -> None:
    solution = UnitProgram.of(two_rows(0.5, 1.0)).solution(Status.OPTIMAL, x, multipliers, TIMES)
    assert solution.status is Status.NOT_FINITE
    assert np.isnan(solution.x).all()
    assert np.isnan(solution.multipliers).all()


def test_an_answer_is_a_copy() -> None:
    x, multipliers = np.array([0.5, 0.0]), np.array([1.5, 0.0])
    solution = UnitProgram.of(two_rows(0.5, 1.0)).solution(Status.OPTIMAL, x, multipliers, TIMES)
    x[0] = multipliers[0] = 7.0
    np.testing.assert_array_equal(solution.x, [0.5, 0.0])
    np.testing.assert_array_equal(solution.multipliers, [6.0, 0.0])


def test_a_proof_of_infeasibility_is_kept_in_the_scale_of_the_program() -> None:
    program = two_rows(-0.1, -0.1, stretch=1e3)
    solution = UnitProgram.of(program).infeasible([5.0, 5.0], TIMES, sure=False)
    assert solution.status is Status.INFEASIBLE
    assert solution.multipliers.max() == 1.0
    np.testing.assert_allclose(program.G.T @ solution.multipliers, 0.0, atol=1e-15)
    assert program.h @ solution.multipliers < 0.0


@pytest.mark.parametrize(
    "proof",
    [None, [1.0], [1.0, 0.0], [1.0, 0.9], [np.nan, 1.0], [-1.0, -1.0], [0.0, 0.0]],
    ids=["none", "too short", "one row", "unbalanced", "NaN", "negative", "zero"],
)
def test_what_proves_nothing_is_not_handed_on(proof: list[float] | None) -> None:
    unit = UnitProgram.of(two_rows(-0.1, -0.1))
    claimed = unit.infeasible(proof, TIMES)
    assert claimed.status is Status.INFEASIBLE
    assert np.isnan(claimed.multipliers).all()
    assert unit.infeasible(proof, TIMES, sure=False).status is Status.FAILED


def test_no_proof_is_believed_for_rows_that_meet() -> None:
    unit = UnitProgram.of(two_rows(0.1, -0.1))
    assert unit.infeasible([1.0, 1.0], TIMES, sure=False).status is Status.FAILED


@pytest.mark.parametrize(
    ("capabilities", "program", "message"),
    [
        (Capabilities(qp=True, lp=False), linear([[1.0, 0.0]]), "mine takes no linear program"),
        (Capabilities(qp=False, lp=True), two_rows(1, 1), "mine takes no quadratic program"),
        (
            Capabilities(qp=True, lp=True, max_variables=1),
            two_rows(1, 1),
            "mine takes programs of at most 1 variables, got 2",
        ),
    ],
)
def test_a_program_outside_the_capabilities_is_refused(
    capabilities: Capabilities, program: ConvexProgram, message: str
) -> None:
    with pytest.raises(UnsupportedProgram, match=f"{message}.*use another backend"):
        require_supported("mine", capabilities, program)


@pytest.mark.parametrize(("tolerance", "gap"), [(1e-3, 1e-6), (1e-6, 1e-12), (1e-9, 1e-13)])
def test_a_gap_is_the_square_of_the_tolerance_down_to_rounding(
    tolerance: float, gap: float
) -> None:
    assert gap_tolerance(tolerance) == pytest.approx(gap, rel=1e-12)


def test_a_program_within_the_capabilities_is_taken() -> None:
    require_supported("mine", Capabilities(qp=True, lp=False, max_variables=2), two_rows(1, 1))
    require_supported("mine", Capabilities(qp=False, lp=True), linear([[1.0, 0.0]]))
