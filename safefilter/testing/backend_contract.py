"""What every backend must do, as checks: small programs with known answers, and what may not happen between solves.

``backend_contract(lambda: MyBackend(1e-9))`` runs them all and raises `ContractBroken` at the first that fails;
``pytest.mark.parametrize("check", BACKEND_CHECKS.values(), ids=BACKEND_CHECKS)`` runs them one by one.

Programs that a backend does not offer to take are left out, after checking that it refuses them. A backend with a limit
on its variables may be made for programs of one form, and refuse others by `UnsupportedProgram`; one without a limit
takes every program of its kinds.

Letters: n variables, m rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.known_programs import (
    KnownProgram,
    barely_empty_program,
    empty_programs,
    known_programs,
    known_series,
    random_programs,
    unbounded_program,
)

MakeBackend = Callable[[], Backend]

# The tolerance to make backends with when they are checked.
CONTRACT_TOLERANCE = 1e-9
# How near a point must be, in the unit of the variables, of size 1 here. Solvers stop at residuals: active rows of
# condition 100 and a duality gap of 1e-13 each leave some 1e-7 in the point. Polishing on the active rows does the
# rest.
ACCURACY = 1e-6
# Residuals of rows and of the KKT equations are what solvers stop at; some scale them, some sum them over rows.
RESIDUAL = 1e-7


class ContractBroken(AssertionError):
    """A backend does not do what `safefilter.backends.backend.Backend` promises."""


def backend_contract(make: MakeBackend) -> None:
    """Check a backend.

    Args:
        make: Makes a new backend, asked for an accuracy of `CONTRACT_TOLERANCE`.

    Raises:
        ContractBroken: At the first check that fails; the message names the backend, the program and the figures.
    """
    for check in BACKEND_CHECKS.values():
        check(make)


def names_itself_and_some_capability(make: MakeBackend) -> None:
    """It has a name, and takes some kind of program."""
    backend = make()
    _expect(bool(backend.name), "the name is empty")
    _expect(backend.capabilities.qp or backend.capabilities.lp, f"{backend.name} takes no program")


def finds_known_answers(make: MakeBackend) -> None:
    """Points, or values of linear programs, and their proofs are right."""
    backend = make()
    found = Capabilities(qp=False, lp=False)
    for known, solution in _answers(backend, known_programs()):
        text = f"{backend.name} on {known.name!r}"
        _expect(solution.status is Status.OPTIMAL, f"{text}: expected OPTIMAL, got {solution}")
        _expect_at(known, solution, text)
        _expect_proof_of_optimality(known.program, solution, text)
        linear = known.program.is_linear
        found = replace(found, qp=found.qp or not linear, lp=found.lp or linear)
    offered = replace(backend.capabilities, max_variables=None)
    _expect(found == offered, f"{backend.name} offers {offered}, and takes only {found}")


def proves_random_answers(make: MakeBackend) -> None:
    """Random feasible programs of 2 to 13 variables and 0 to 80 rows: the KKT equations hold."""
    backend = make()
    for known, solution in _answers(backend, random_programs()):
        text = f"{backend.name} on {known.name!r}"
        _expect(solution.status is Status.OPTIMAL, f"{text}: expected OPTIMAL, got {solution}")
        _expect_proof_of_optimality(known.program, solution, text)


def recognises_empty_sets(make: MakeBackend) -> None:
    """Contradicting rows are `Status.INFEASIBLE`, and what is given as a proof proves it."""
    backend = make()
    for known, solution in _answers(backend, empty_programs()):
        text = f"{backend.name} on {known.name!r}"
        _expect(
            solution.status is Status.INFEASIBLE, f"{text}: expected INFEASIBLE, got {solution}"
        )
        _expect_proof_or_none(known.program, solution, text)


def never_calls_barely_empty_sets_solved(make: MakeBackend) -> None:
    """Rows that miss each other by 1e-6, a thousand times the tolerance, have no optimal point."""
    backend = make()
    for known, solution in _answers(backend, [barely_empty_program()]):
        text = f"{backend.name} on {known.name!r}"
        _expect(solution.status is not Status.OPTIMAL, f"{text}: called solved: {solution}")
        _expect_proof_or_none(known.program, solution, text)


def never_finds_a_point_without_bound(make: MakeBackend) -> None:
    """A linear program without lower bound has no optimal point."""
    backend = make()
    for known, solution in _answers(backend, [unbounded_program()]):
        _expect(
            not solution.status.has_point and solution.status is not Status.INFEASIBLE,
            f"{backend.name} on {known.name!r}: expected UNBOUNDED or a failure, got {solution}",
        )


def forgets_earlier_programs(make: MakeBackend) -> None:
    """On one object, every answer is that of a new object: new data, other sizes, empty sets in between."""
    backend = make()
    for step, (known, solution) in enumerate(_answers(backend, known_series())):
        text = f"{backend.name} on {known.name!r}, solve number {step} on one object"
        fresh = make().solve(known.program)
        _expect(
            solution.status is fresh.status,
            f"{text}: {solution.status}, a new object says {fresh.status}",
        )
        if fresh.status.has_point:
            _expect_at(known, solution, text)


def gives_answers_of_its_own(make: MakeBackend) -> None:
    """A later solve changes no earlier answer, and no solve changes the program."""
    backend = make()
    programs = random_programs()
    untouched = {known.name: known.program for known in random_programs()}
    kept: list[tuple[Solution, FloatArray, FloatArray]] = []
    for known, solution in _answers(backend, programs):
        _expect(
            _are_same(known.program, untouched[known.name]),
            f"{backend.name} changed the program {known.name!r}",
        )
        kept.append((solution, solution.x.copy(), solution.multipliers.copy()))
    for solution, x, multipliers in kept:
        _expect(
            np.array_equal(solution.x, x, equal_nan=True)
            and np.array_equal(solution.multipliers, multipliers, equal_nan=True),
            f"{backend.name}: a later solve changed an earlier answer",
        )
        _expect(not solution.x.flags.writeable, f"{backend.name}: answers can be written to")


def refuses_other_programs(make: MakeBackend) -> None:
    """A program outside the capabilities is `UnsupportedProgram`, not a guess.

    Raises:
        ContractBroken: If it answers.
    """
    backend = make()
    for known in (*known_programs(), *random_programs()):
        if _takes(backend.capabilities, known.program):
            continue
        try:
            solution = backend.solve(known.program)
        except UnsupportedProgram:
            continue
        raise ContractBroken(
            f"{backend.name} on {known.name!r}: expected UnsupportedProgram for what is outside "
            f"{backend.capabilities}, got {solution}"
        )


def tells_its_times(make: MakeBackend) -> None:
    """Times are seconds: finite and not negative."""
    backend = make()
    for _, solution in _answers(backend, known_programs()):
        for seconds in (solution.build_time, solution.solve_time):
            _expect(0.0 <= seconds < np.inf, f"{backend.name}: a time of {seconds} s")


BACKEND_CHECKS: dict[str, Callable[[MakeBackend], None]] = {
    check.__name__: check
    for check in (
        names_itself_and_some_capability,
        finds_known_answers,
        proves_random_answers,
        recognises_empty_sets,
        never_calls_barely_empty_sets_solved,
        never_finds_a_point_without_bound,
        forgets_earlier_programs,
        gives_answers_of_its_own,
        refuses_other_programs,
        tells_its_times,
    )
}


def _takes(capabilities: Capabilities, program: ConvexProgram) -> bool:
    kind = capabilities.lp if program.is_linear else capabilities.qp
    most = capabilities.max_variables
    return kind and (most is None or program.num_variables <= most)


def _answers(
    backend: Backend, programs: Iterable[KnownProgram]
) -> Iterator[tuple[KnownProgram, Solution]]:
    for known in programs:
        if not _takes(backend.capabilities, known.program):
            continue
        try:
            solution = backend.solve(known.program)
        except UnsupportedProgram as error:
            _expect(
                backend.capabilities.max_variables is not None,
                f"{backend.name} on {known.name!r}: refused, within {backend.capabilities}: {error}",
            )
            continue
        yield known, solution


def _are_same(one: ConvexProgram, other: ConvexProgram) -> bool:
    pairs = ((one.P, other.P), (one.q, other.q), (one.G, other.G), (one.h, other.h))
    return all(np.array_equal(first, second) for first, second in pairs)


def _expect(holds: bool, message: str) -> None:
    if not holds:
        raise ContractBroken(message)


def _expect_near(found: FloatArray, expected: FloatArray, text: str) -> None:
    scale = 1.0 + np.abs(expected).max(initial=0.0)
    _expect(
        bool(np.abs(found - expected).max(initial=0.0) <= ACCURACY * scale),
        f"{text}: expected {expected}, got {found}",
    )


def _expect_at(known: KnownProgram, solution: Solution, text: str) -> None:
    if known.program.is_linear:
        # The value of a linear program is unique, its point need not be.
        found, expected = (known.program.objective(x) for x in (solution.x, known.point))
        _expect_near(np.array([found]), np.array([expected]), f"{text}, objective")
    else:
        _expect_near(solution.x, known.point, text)


def _expect_proof_of_optimality(program: ConvexProgram, solution: Solution, text: str) -> None:
    # Rows and cost of size 1: what is small is judged against that.
    length = np.linalg.norm(program.G, axis=1)
    length[length == 0.0] = 1.0
    cost = max(np.abs(program.P).max(), np.abs(program.q).max())
    slack = (program.h - program.G @ solution.x) / length
    weights = solution.multipliers * length / cost
    gradient = (program.P @ solution.x + program.q + program.G.T @ solution.multipliers) / cost
    scale = 1.0 + np.abs(weights).max(initial=0.0)
    for what, size in {
        "violation of a row": -slack.min(initial=0.0),
        "multiplier below zero": -weights.min(initial=0.0),
        "gradient of the Lagrangian": np.abs(gradient).max(),
        "multiplier of a row that is slack": np.abs(weights * slack).max(initial=0.0),
    }.items():
        _expect(bool(size <= RESIDUAL * scale), f"{text}: {what} of {size}: {solution}")


def _expect_proof_or_none(program: ConvexProgram, solution: Solution, text: str) -> None:
    proof = solution.multipliers
    if solution.status is not Status.INFEASIBLE or np.isnan(proof).all():
        return
    gain = -float(program.h @ proof)
    residual = float(np.linalg.norm(program.G.T @ proof))
    _expect(
        bool((proof >= 0.0).all()) and gain > residual,
        f"{text}: expected a Farkas proof or NaN, got {proof}: gain {gain}, residual {residual}",
    )
