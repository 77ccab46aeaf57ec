from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.clarabel_backend import Clarabel
from safefilter.backends.registry import available_backends, make_backend
from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.backend_contract import (
    BACKEND_CHECKS,
    CONTRACT_TOLERANCE,
    ContractBroken,
    MakeBackend,
    backend_contract,
)

# Faults of the solvers themselves; the filter refutes such answers and uses its own.
KNOWN_FAULTS = {
    # Calls 4 % of random feasible programs infeasible.
    ("qpsolvers:proxqp", "proves_random_answers"): (
        "https://github.com/Simple-Robotics/proxsuite/issues/445"
    ),
}


class Faulty:
    """Clarabel, with one fault."""

    name = "faulty"
    capabilities = Capabilities(qp=True, lp=True)

    def __init__(
        self, spoil: Callable[[ConvexProgram, Solution], Solution] = lambda _, solution: solution
    ) -> None:
        self._honest = Clarabel(CONTRACT_TOLERANCE)
        self._spoil = spoil

    def solve(self, program: ConvexProgram) -> Solution:
        return self._spoil(program, self._honest.solve(program))


class Stale(Faulty):
    """Goes on using the rows it saw first in each shape."""

    def __init__(self) -> None:
        super().__init__()
        self._rows: dict[tuple[int, ...], FloatArray] = {}

    def solve(self, program: ConvexProgram) -> Solution:
        rows = self._rows.setdefault(program.G.shape, program.G)
        return self._honest.solve(replace(program, G=rows))


class Aliasing(Faulty):
    """Hands its own buffer out, and writes to it at the next solve."""

    def __init__(self) -> None:
        super().__init__()
        self._buffer = np.zeros(100)

    def solve(self, program: ConvexProgram) -> Solution:
        solution = self._honest.solve(program)
        self._buffer[: len(solution.x)] = solution.x
        return replace(solution, x=self._buffer[: len(solution.x)])


class Guessing(Faulty):
    """Says that it takes no linear program, and answers all the same."""

    capabilities = Capabilities(qp=True, lp=False)


class OverwritingItsInput(Faulty):
    """Writes to the program."""

    def solve(self, program: ConvexProgram) -> Solution:
        solution = self._honest.solve(program)
        program.q.setflags(write=True)
        program.q[0] += 1.0
        return solution


def _claim_optimal_where_infeasible(program: ConvexProgram, solution: Solution) -> Solution:
    if solution.status is not Status.INFEASIBLE:
        return solution
    return replace(
        solution,
        status=Status.OPTIMAL,
        x=np.zeros(program.num_variables),
        multipliers=np.zeros(program.num_rows),
    )


def _claim_optimal_where_unbounded(program: ConvexProgram, solution: Solution) -> Solution:
    if solution.status is not Status.UNBOUNDED:
        return solution
    return replace(
        solution,
        status=Status.OPTIMAL,
        x=np.full(program.num_variables, -1e9),
        multipliers=np.zeros(program.num_rows),
    )


def _with_negative_multipliers(_: ConvexProgram, solution: Solution) -> Solution:
    return replace(solution, multipliers=-solution.multipliers)


def _beside_the_point(_: ConvexProgram, solution: Solution) -> Solution:
    return replace(solution, x=solution.x + 1e-4)


def _with_a_wrong_proof(program: ConvexProgram, solution: Solution) -> Solution:
    if solution.status is not Status.INFEASIBLE:
        return solution
    return replace(solution, multipliers=np.ones(program.num_rows))


def _without_time(_: ConvexProgram, solution: Solution) -> Solution:
    return replace(solution, solve_time=float("nan"))


@pytest.mark.parametrize("check", BACKEND_CHECKS)
@pytest.mark.parametrize("name", available_backends())
def test_every_installed_backend_keeps_the_contract(
    name: str, check: str, capfd: pytest.CaptureFixture[str]
) -> None:
    if (name, check) in KNOWN_FAULTS:
        pytest.skip(KNOWN_FAULTS[name, check])
    BACKEND_CHECKS[check](lambda: make_backend(name, tolerance=CONTRACT_TOLERANCE))
    assert capfd.readouterr() == ("", "")


def test_the_contract_runs_all_checks() -> None:
    backend_contract(Faulty)


@pytest.mark.parametrize(
    ("make", "check"),
    [
        (Stale, "forgets_earlier_programs"),
        (Aliasing, "gives_answers_of_its_own"),
        (OverwritingItsInput, "gives_answers_of_its_own"),
        (Guessing, "refuses_other_programs"),
        (lambda: Faulty(_claim_optimal_where_infeasible), "recognises_empty_sets"),
        (lambda: Faulty(_claim_optimal_where_infeasible), "never_calls_barely_empty_sets_solved"),
        (lambda: Faulty(_claim_optimal_where_unbounded), "never_finds_a_point_without_bound"),
        (lambda: Faulty(_with_negative_multipliers), "finds_known_answers"),
        (lambda: Faulty(_with_negative_multipliers), "proves_random_answers"),
        (lambda: Faulty(_beside_the_point), "finds_known_answers"),
        (lambda: Faulty(_beside_the_point), "proves_random_answers"),
        (lambda: Faulty(_with_a_wrong_proof), "recognises_empty_sets"),
        (lambda: Faulty(_without_time), "tells_its_times"),
    ],
)
def test_the_contract_finds_each_fault(make: MakeBackend, check: str) -> None:
    with pytest.raises(ContractBroken, match="faulty"):
        BACKEND_CHECKS[check](make)


class Picky(Faulty):
    """Takes quadratic programs of its own choice only."""

    def solve(self, program: ConvexProgram) -> Solution:
        if program.is_linear or not np.array_equal(program.P, np.eye(2)):
            raise UnsupportedProgram("not of my form")
        return self._honest.solve(program)


class PickyBySize(Picky):
    """Has a limit on its variables, and may be picky therefore."""

    capabilities = Capabilities(qp=True, lp=False, max_variables=2)


class PickyBeyondWhatItOffers(Picky):
    """Offers linear programs, and takes none."""

    capabilities = Capabilities(qp=True, lp=True, max_variables=13)


def test_only_a_backend_with_a_limit_may_take_programs_of_one_form() -> None:
    backend_contract(PickyBySize)
    with pytest.raises(ContractBroken, match="faulty on 'a skew cost': refused, within"):
        backend_contract(Picky)
    with pytest.raises(ContractBroken, match=r"offers .*lp=True.*takes only .*lp=False"):
        backend_contract(PickyBeyondWhatItOffers)


def test_the_contract_wants_a_capability() -> None:
    class Useless(Faulty):
        capabilities = Capabilities(qp=False, lp=False)

    def make() -> Backend:
        return Useless()

    with pytest.raises(ContractBroken, match="faulty takes no program"):
        backend_contract(make)
