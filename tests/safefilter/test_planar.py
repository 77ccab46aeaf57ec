from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.backends.planar import Planar
from safefilter.backends.registry import make_backend
from safefilter.certificate import certify
from safefilter.errors import NotFinite, OutOfRange, UnsupportedProgram
from safefilter.polish import polish
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.backend_contract import BACKEND_CHECKS
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest
from safefilter.testing.program_strategies import (
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
)

BOX = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
REFERENCES = ("clarabel", "qpsolvers:daqp", "qpsolvers:quadprog")


def nearest(
    target: npt.ArrayLike, rows: npt.ArrayLike, bounds: npt.ArrayLike, scale: float = 1.0
) -> ConvexProgram:
    wanted = np.asarray(target, dtype=np.float64)
    h = np.asarray(bounds, dtype=np.float64)
    return ConvexProgram(scale * np.eye(2), -scale * wanted, np.reshape(rows, (len(h), 2)), h)


def epigraph(rows: npt.ArrayLike, bounds: npt.ArrayLike, cost: float = 1.0) -> ConvexProgram:
    G = np.asarray(rows, dtype=np.float64)
    h = np.asarray(bounds, dtype=np.float64)
    return ConvexProgram(np.zeros((3, 3)), np.array([0.0, 0.0, cost]), G, h)


def solve(program: ConvexProgram) -> Solution:
    return Planar(1e-9).solve(program)


def assert_optimal(program: ConvexProgram, point: npt.ArrayLike) -> Solution:
    solution = solve(program)
    assert solution.status is Status.OPTIMAL
    assert solution.x == pytest.approx(np.asarray(point), abs=1e-12)
    certificate = certify(program, solution, radius=4.0, exact=True)
    assert certificate.valid, certificate.reason
    return solution


@pytest.mark.parametrize("check", BACKEND_CHECKS)
def test_it_keeps_the_contract_at_other_tolerances_too(check: str) -> None:
    for tolerance in (1e-12, 1e-7):
        BACKEND_CHECKS[check](partial(Planar, tolerance))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 2.0, 1e4])
def test_a_projection_by_hand_with_its_multipliers(scale: float) -> None:
    program = nearest([1.0, -2.0], BOX, [0.5] * 4, scale)
    solution = assert_optimal(program, [0.5, -0.5])
    assert solution.multipliers == pytest.approx(scale * np.array([0.5, 0.0, 0.0, 1.5]), rel=1e-12)


def test_multipliers_belong_to_rows_as_they_were_given() -> None:
    length = np.array([1e4, 1e-4, 3.0, 1e2])
    program = nearest([1.0, -2.0], BOX * length[:, None], 0.5 * length)
    solution = assert_optimal(program, [0.5, -0.5])
    assert solution.multipliers * length == pytest.approx([0.5, 0.0, 0.0, 1.5], rel=1e-12)


def test_no_row_leaves_the_wanted_point() -> None:
    solution = assert_optimal(nearest([0.3, -0.4], [], []), [0.3, -0.4])
    assert solution.multipliers.shape == (0,)


def test_rows_of_zeros_hold_or_prove_that_nothing_does() -> None:
    assert_optimal(nearest([1.0, 0.0], [[0.0, 0.0], [1.0, 0.0]], [0.0, 0.5]), [0.5, 0.0])
    empty = nearest([1.0, 0.0], [[1.0, 0.0], [0.0, 0.0]], [0.5, -1e-3])
    solution = solve(empty)
    assert solution.status is Status.INFEASIBLE
    assert solution.multipliers.tolist() == [0.0, 1.0]
    assert certify(empty, solution, exact=True)


def test_a_row_of_zeros_in_an_epigraph_is_blamed_by_its_own_place() -> None:
    program = epigraph([[0, 0, -1], [1, 0, 0], [0, 0, 0]], [0.0, 1.0, -0.5])
    solution = solve(program)
    assert solution.status is Status.INFEASIBLE
    assert solution.multipliers.tolist() == [0.0, 0.0, 1.0]
    assert np.isnan(solution.x).all()


@pytest.mark.parametrize("floor", [0.0, -1.0, 0.25, 3.0])
@pytest.mark.parametrize("cost", [1.0, 7.0])
def test_an_epigraph_may_start_anywhere(floor: float, cost: float) -> None:
    # |v_x - 0.1| <= t - 0.1 in a box: t* = 0.1 unless the floor is above.
    rows = [*np.column_stack([BOX, np.zeros(4)]), [-1, 0, -1], [1, 0, -1], [0, 0, -1]]
    bounds = [0.5] * 4 + [-0.2, 0.0, -floor]
    program = epigraph(rows, bounds, cost)
    solution = solve(program)
    assert solution.status is Status.OPTIMAL
    assert solution.x[2] == pytest.approx(max(0.1, floor), abs=1e-9)
    certificate = certify(program, solution, radius=4.0, exact=True)
    assert certificate.valid, certificate.reason
    assert (solution.multipliers[-1] > 0.0) == (floor > 0.1)


def test_of_several_floors_the_highest_counts() -> None:
    program = epigraph([[0, 0, -2], [0, 0, -1], [0, 0, -4]], [-0.5, -0.3, 0.0])
    solution = solve(program)
    assert solution.x[2] == pytest.approx(0.3, abs=1e-15)
    assert solution.multipliers.tolist() == [0.0, 1.0, 0.0]


def test_soft_rows_need_not_be_of_unit_length() -> None:
    program = epigraph([[-3, 0, -3], [5, 0, -5], [0, 0, -1]], [-0.3, -1.0, 0.0])
    solution = solve(program)
    assert solution.x[2] == pytest.approx(0.15, abs=1e-12)
    assert certify(program, solution, radius=4.0, exact=True)


@pytest.mark.parametrize(
    "program",
    [
        ConvexProgram(np.diag([1.0, 2.0]), np.zeros(2), BOX, np.ones(4)),
        ConvexProgram(np.array([[1.0, 0.1], [0.1, 1.0]]), np.zeros(2), BOX, np.ones(4)),
        ConvexProgram(-np.eye(2), np.zeros(2), BOX, np.ones(4)),
        ConvexProgram(np.eye(1), np.zeros(1), np.ones((1, 1)), np.ones(1)),
        ConvexProgram(np.eye(3), np.zeros(3), np.eye(3), np.ones(3)),
    ],
)
def test_other_quadratic_programs_are_refused(program: ConvexProgram) -> None:
    with pytest.raises(UnsupportedProgram) as caught:
        solve(program)
    assert str(caught.value) == (
        "planar takes P = c * identity in 2 variables, got P of shape "
        f"{program.P.shape}: use another backend, such as 'clarabel'"
    )


@pytest.mark.parametrize(
    ("q", "G"),
    [
        ([0.0, 0.0, 1.0], [[1, 0, 0]]),  # no floor
        ([0.0, 0.0, 1.0], [[1, 0, -0.5], [0, 0, -1]]),  # slopes that are no distance
        ([0.0, 0.0, 1.0], [[1, 0, 1], [0, 0, -1]]),
        ([0.0, 0.0, 1.0], [[0, 0, 1], [0, 0, -1]]),  # a ceiling
        ([1.0, 0.0, 1.0], [[0, 0, -1]]),
        ([0.0, 0.0, -1.0], [[0, 0, -1]]),
        ([0.0, 0.0, 0.0], [[0, 0, -1]]),
        ([0.0, 1.0], [[0, -1]]),
        ([0.0, 0.0, 0.0, 1.0], [[0, 0, 0, -1]]),
    ],
)
def test_other_linear_programs_are_refused(q: list[float], G: list[list[float]]) -> None:
    size = len(q)
    program = ConvexProgram(
        np.zeros((size, size)), np.array(q), np.array(G, dtype=np.float64), np.ones(len(G))
    )
    with pytest.raises(UnsupportedProgram) as caught:
        solve(program)
    assert str(caught.value) == (
        "planar takes linear programs min t over rows n @ v + t >= b with unit n, hard rows and t >= b0 only: "
        "use another backend, such as 'clarabel'"
    )


@pytest.mark.parametrize(
    ("tolerance", "error", "message"),
    [
        (0.0, OutOfRange, "tolerance: expected a number above 0, got 0.0"),
        (-1e-9, OutOfRange, "tolerance: expected a number above 0, got -1e-09"),
        (np.nan, NotFinite, "tolerance: expected a finite number, got nan"),
    ],
)
def test_a_tolerance_that_cannot_be_met_is_refused(
    tolerance: float, error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        Planar(tolerance)
    assert str(caught.value) == message


@given(permitted_programs())
def test_a_projection_is_the_exact_one_with_an_exact_certificate(program: ConvexProgram) -> None:
    solution, exact = solve(program), exact_nearest(program)
    assume(exact is not None)
    assert exact is not None
    if solution.status is Status.INFEASIBLE:
        # Sets of the size of rounding may be lost, and only those.
        drawn_out = ConvexProgram(program.P, program.q, program.G, program.h + 1e-12)
        assert solve(drawn_out).status is Status.OPTIMAL
        return
    assert solution.x == pytest.approx([float(value) for value in exact], abs=1e-9)
    assert certify(program, solution)


@given(second_stage_programs())
def test_a_least_violation_is_the_exact_one_with_an_exact_certificate(stages: SecondStage) -> None:
    program = stages.first
    solution, corner = solve(program), exact_least_violation(program)
    assert corner is not None
    assert solution.status is Status.OPTIMAL
    assert solution.x[2] == pytest.approx(float(corner[2]), abs=1e-9)
    assert solution.multipliers.min() >= 0.0
    certificate = certify(program, solution, radius=4.0, exact=True)
    assert certificate.valid, certificate.reason


@given(contradictory_programs())
def test_an_empty_set_comes_with_an_exact_farkas_proof(
    drawn: tuple[ConvexProgram, FloatArray],
) -> None:
    program, _ = drawn
    solution = solve(program)
    assert solution.status is Status.INFEASIBLE
    assert np.count_nonzero(solution.multipliers) <= 3
    certificate = certify(program, solution, radius=4.0, exact=True)
    assert certificate.valid, certificate.reason


@pytest.mark.parametrize("name", REFERENCES)
@given(program=permitted_programs())
def test_general_solvers_find_the_same_point(name: str, program: ConvexProgram) -> None:
    solution = solve(program)
    answer = make_backend(name, tolerance=1e-9).solve(program)
    if not (answer.status is solution.status is Status.OPTIMAL):
        return  # a set without width: either may lose it
    polished = polish(program, answer, tolerance=1e-9)
    assert polished.x == pytest.approx(solution.x, abs=1e-7)


@pytest.mark.parametrize("name", ["clarabel", "qpsolvers:highs"])
@given(stages=second_stage_programs())
def test_general_solvers_find_the_same_least_violation(name: str, stages: SecondStage) -> None:
    answer = make_backend(name, tolerance=1e-9).solve(stages.first)
    assert answer.status.has_point
    assert answer.x[2] == pytest.approx(solve(stages.first).x[2], abs=1e-6)


@given(st.integers(0, 10_000), st.sampled_from([3, 30, 140]))
def test_programs_as_large_as_crowds_agree_with_a_general_solver(seed: int, num_rows: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, num_rows)
    rows = np.vstack([np.column_stack([np.cos(angle), np.sin(angle)]), BOX])
    program = nearest(
        rng.normal(size=2), rows, np.append(rng.uniform(-0.1, 0.5, num_rows), [0.5] * 4)
    )
    solution, answer = solve(program), make_backend("clarabel", tolerance=1e-9).solve(program)
    assert solution.status is answer.status
    if solution.status is Status.OPTIMAL:
        assert polish(program, answer, tolerance=1e-9).x == pytest.approx(solution.x, abs=1e-8)
    assert certify(program, solution, radius=1.0)
