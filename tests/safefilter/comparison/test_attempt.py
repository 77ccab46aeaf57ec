"""What contenders are judged by is our own check: solvers that lie, give up or raise are seen through."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter

import numpy as np
import pytest

from safefilter.backend_answer import Solvers
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.planar import Planar
from safefilter.comparison.attempt import Attempt, Fate, decide, excess, judge
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem
from safefilter.decision import Case, Fault
from safefilter.errors import BackendFailed
from safefilter.programs.convex_program import ConvexProgram

ACCURACY = 5e-9


class Scripted:
    """Answers what it is told to."""

    name = "scripted"
    capabilities = Capabilities(qp=True, lp=True)

    def __init__(self, answer: Callable[[ConvexProgram], Solution]) -> None:
        self._answer = answer

    def solve(self, program: ConvexProgram) -> Solution:
        return self._answer(program)


def attempt(backend: Backend, problem: Problem) -> Attempt:
    truth = truth_of(problem, ACCURACY)
    solvers = Solvers(backend, backend, ACCURACY)
    return judge(decide(solvers, problem, perf_counter()), problem, truth, 0.0)


def point(*x: float, cut: float = 0.0) -> Callable[[ConvexProgram], Solution]:
    """Call this point optimal, whatever was asked."""

    def answer(program: ConvexProgram) -> Solution:
        values = np.zeros(program.num_variables)
        values[: len(x)] = x[: program.num_variables]
        return Solution(Status.OPTIMAL, values, np.zeros(program.num_rows), 0.0, 0.0, cut)

    return answer


def says(status: Status) -> Callable[[ConvexProgram], Solution]:
    return lambda program: Solution.without_point(program, status, 0.0, 0.0)


def test_the_built_in_solver_is_right(feasible: Problem, empty: Problem) -> None:
    for problem, case in ((feasible, Case.PROJECTED), (empty, Case.LEAST_VIOLATION)):
        found = attempt(Planar(ACCURACY), problem)
        assert found.fate is Fate.ANSWERED
        assert (found.claim, found.case, found.fault) == (case, case, Fault.NONE)
        assert found.excess <= 2.0 * ACCURACY
        assert max(found.off, found.verified_off) <= 2.0 * ACCURACY
        assert abs(found.longer) <= 2.0 * ACCURACY
        assert found.is_own
        assert 0.0 < found.build + found.solve <= found.total


def test_the_least_violation_is_compared_in_case_3_only(feasible: Problem, empty: Problem) -> None:
    assert math.isnan(attempt(Planar(ACCURACY), feasible).least_gap)
    assert abs(attempt(Planar(ACCURACY), empty).least_gap) <= 1e-15


def test_a_point_outside_is_measured_and_refused(feasible: Problem) -> None:
    found = attempt(Scripted(point(0.25, 0.0)), feasible)
    assert found.claim == Case.PROJECTED
    assert found.excess == pytest.approx(0.25)
    assert found.off == pytest.approx(0.25)
    # Nearer to the wish than is permitted.
    assert found.longer == pytest.approx(-0.25)
    assert not found.is_own
    assert found.case == 0
    assert math.isnan(found.verified_excess)


def test_a_point_further_than_needed_is_suboptimal(feasible: Problem) -> None:
    found = attempt(Scripted(point(0.75, 0.0)), feasible)
    assert found.excess == 0.0
    assert found.longer == pytest.approx(0.25)


def test_an_empty_set_called_solvable_is_seen(empty: Problem) -> None:
    found = attempt(Scripted(point(0.5, 0.0)), empty)
    assert found.claim == Case.PROJECTED
    # It violates one row by 1; 0.5 is unavoidable.
    assert found.excess == pytest.approx(0.5)
    assert found.fault != Fault.NONE


def test_a_solvable_set_called_empty_is_seen(feasible: Problem) -> None:
    found = attempt(Scripted(says(Status.INFEASIBLE)), feasible)
    assert found.claim == Case.LEAST_VIOLATION
    assert math.isnan(found.excess)
    assert not found.is_own


@pytest.mark.parametrize("status", [Status.FAILED, Status.TIME_LIMIT, Status.NOT_FINITE])
def test_who_gives_up_claims_nothing(feasible: Problem, status: Status) -> None:
    found = attempt(Scripted(says(status)), feasible)
    assert (found.fate, found.claim, found.is_own) == (Fate.ANSWERED, 0, False)


def test_who_raises_claims_nothing(feasible: Problem) -> None:
    def fail(program: ConvexProgram) -> Solution:
        raise BackendFailed("no", program, Status.FAILED)

    found = attempt(Scripted(fail), feasible)
    assert (found.fate, found.claim, found.fault) == (Fate.ANSWERED, 0, Fault.BACKEND_RAISED)


def test_who_does_not_take_a_program_is_not_blamed(make_square: Callable[..., Problem]) -> None:
    problem = make_square((1.0, 0.0, 0.0, 0.5), wanted=(0.0, 0.0, 0.0))
    assert attempt(Planar(ACCURACY), problem).fate is Fate.UNSUPPORTED


def test_multipliers_below_zero_are_reported(feasible: Problem) -> None:
    found = attempt(Scripted(point(0.5, 0.0, cut=0.125)), feasible)
    assert found.cut == 0.125
    # The multiplier 0.5 of the active row is missing.
    assert found.stationarity == pytest.approx(0.5)
    assert found.complementarity == 0.0


def test_zero_rows_reach_the_solver_and_not_the_answer(feasible: Problem) -> None:
    padded = Problem.of(
        "",
        feasible.wanted,
        feasible.normals,
        feasible.offsets,
        feasible.hard,
        scale=1.0,
        padding=7,
    )
    seen: list[int] = []
    planar = Planar(ACCURACY)

    def count(program: ConvexProgram) -> Solution:
        seen.append(program.num_rows)
        return planar.solve(program)

    found = attempt(Scripted(count), padded)
    assert seen == [len(feasible.offsets) + 7]
    assert found.is_own
    assert found.off <= ACCURACY


def test_without_an_answer_to_compare_with_only_times_are_known(feasible: Problem) -> None:
    planar = Planar(ACCURACY)
    timed = decide(Solvers(planar, planar, ACCURACY), feasible, perf_counter())
    found = judge(timed, feasible, None, 0.0)
    assert math.isnan(found.excess)
    assert math.isnan(found.off)
    assert found.total > 0.0


def test_what_is_made_for_a_cold_start_counts_as_building(feasible: Problem) -> None:
    planar = Planar(ACCURACY)
    start = perf_counter() - 1.0
    timed = decide(Solvers(planar, planar, ACCURACY), feasible, start)
    found = judge(timed, feasible, None, 1.0)
    assert found.build > 1.0
    assert found.total > 1.0


def test_an_excess_counts_hard_rows_in_full(empty: Problem) -> None:
    truth = truth_of(empty, ACCURACY)
    # 0.25 outside of the box; the soft row is violated by 1.75, 1.25 more than needed.
    assert excess(empty, truth, np.array([0.0, 1.25])) == pytest.approx(0.25)
    assert excess(empty, truth, np.array([1.25, 0.0])) == pytest.approx(1.25)
    assert math.isnan(excess(empty, truth, np.array([np.nan, 0.0])))
