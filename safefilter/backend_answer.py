"""One decision by a generic backend: solve, polish, verify; and if anything is wrong, say what.

The case is decided by t*, never by what a solver says: Case-2 if the permitted set holds a point to the tolerance,
Case-3 otherwise. Every answer on the way is certified without the solver.

Letters: M rows, d dimensions. m/s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Backend, Solution, Status
from safefilter.backends.registry import backend_factory, make_backend
from safefilter.backends.supervised import Supervised
from safefilter.certificate import Certificate, certify
from safefilter.decision import Case, Fault
from safefilter.half_spaces import HalfSpaces
from safefilter.polish import polish
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity


class Solvers(NamedTuple):
    """Who is asked, and how exactly.

    Attributes:
        quadratic: Takes the projections.
        linear: Takes t*: the same backend if it takes linear programs.
        tolerance: In m/s.
    """

    quadratic: Backend
    linear: Backend
    tolerance: float

    def start(self) -> None:
        """Begin a call of `SafetyFilter.decide`: a deadline counts from here."""
        for backend in (self.quadratic, self.linear):
            if isinstance(backend, Supervised):
                backend.start()

    @property
    def is_late(self) -> bool:
        """Has the deadline passed?"""
        backends = (self.quadratic, self.linear)
        return any(isinstance(backend, Supervised) and backend.is_late for backend in backends)


# Who takes t* where a backend takes no linear programs.
LINEAR_BACKEND = "clarabel"


def make_solvers(name: str, tolerance: float, deadline: float | None) -> Solvers:
    """Make the backends that one filter asks.

    Args:
        name: Name of the backend.
        tolerance: In m/s.
        deadline: Seconds for a call of `SafetyFilter.decide`, or None; with it each backend works in a process of
            its own.

    Raises:
        UnknownBackend: If there is no such backend.
        BackendNotInstalled: If its package is missing.
        OutOfRange: If the deadline is not above zero.
    """
    quadratic = make_backend(name, tolerance=tolerance)
    is_linear = quadratic.capabilities.lp
    linear = quadratic if is_linear else make_backend(LINEAR_BACKEND, tolerance=tolerance)
    if deadline is not None:
        quadratic = Supervised(quadratic, backend_factory(name), tolerance, deadline)
        linear = (
            quadratic
            if is_linear
            else Supervised(linear, backend_factory(LINEAR_BACKEND), tolerance, deadline)
        )
    return Solvers(quadratic, linear, tolerance)


@dataclass(frozen=True, slots=True, eq=False)
class BackendAnswer:
    """What a backend contributes to one decision.

    Attributes:
        fault: `Fault.NONE` if everything below is verified; the rest is to be ignored otherwise, except that ``proof``
            is verified for `Fault.EMPTY_HARD_SET` too: then all of it is on hard rows.
        case: `Case.PROJECTED` or `Case.LEAST_VIOLATION`.
        velocity: Shape (d,).
        multipliers: Of the projection, one a present row.
        proof: In Case-3 and for an empty hard set: weights of the contradiction, one a present row; zeros otherwise.
        build_time: Seconds.
        solve_time: Seconds, polish and verification included.
        cause: What the backend raised, for `Fault.BACKEND_RAISED`.
    """

    fault: Fault
    case: Case
    velocity: FloatArray
    multipliers: FloatArray
    proof: FloatArray
    build_time: float
    solve_time: float
    cause: Exception | None = None


class _Verified(NamedTuple):
    status: Status
    solution: Solution
    certificate: Certificate


def _is_usable(answer: _Verified) -> bool:
    return answer.status.has_point and answer.certificate.valid


class _Attempt:
    """Asks backends about one decision, and keeps account of the time."""

    def __init__(self, solvers: Solvers, radius: float) -> None:
        self._solvers = solvers
        self._radius = radius
        self.build_time = 0.0
        self.solve_time = 0.0

    def ask(self, backend: Backend, program: ConvexProgram) -> _Verified:
        solution = backend.solve(program)
        self.build_time += solution.build_time
        self.solve_time += solution.solve_time
        polished = polish(program, solution, tolerance=self._solvers.tolerance)
        certificate = certify(
            program, polished, tolerance=self._solvers.tolerance, radius=self._radius
        )
        return _Verified(solution.status, polished, certificate)

    def fault_of(self, status: Status) -> Fault:
        """What to call an answer of this status that could not be used."""
        if self._solvers.is_late:
            return Fault.DEADLINE
        if status in {Status.INFEASIBLE, Status.UNBOUNDED}:
            return Fault.BACKEND_WRONG_STATUS
        return Fault.BACKEND_REJECTED


def ask_backend(
    solvers: Solvers, rows: HalfSpaces, decision: int, wanted: FloatArray, radius: float
) -> BackendAnswer:
    """Find the velocity of one decision with a generic backend, and verify it.

    Args:
        solvers: Who is asked.
        rows: Permitted sets of a batch.
        decision: Which decision of the batch.
        wanted: Wanted velocity, shape (d,).
        radius: Bound on the length of velocities within the hard rows.
    """
    attempt = _Attempt(solvers, radius)
    try:
        return _find(attempt, solvers, rows, decision, wanted)
    except Exception as error:  # noqa: BLE001 - the one place where foreign code runs: whatever it raises, robots keep moving safely
        fault = Fault.DEADLINE if solvers.is_late else Fault.BACKEND_RAISED
        return replace(_faulty(attempt, rows, decision, fault), cause=error)


def _find(
    attempt: _Attempt, solvers: Solvers, rows: HalfSpaces, decision: int, wanted: FloatArray
) -> BackendAnswer:
    first = attempt.ask(solvers.quadratic, nearest_velocity(rows, decision, wanted))
    if _is_usable(first):
        no_proof = np.zeros(len(first.solution.multipliers))
        return _answer(attempt, Case.PROJECTED, first.solution, no_proof)
    if first.status in {Status.NOT_FINITE, Status.UNBOUNDED}:
        return _faulty(attempt, rows, decision, attempt.fault_of(first.status))
    # Out of iterations, inaccurate or failed: first-order solvers end so where the set is empty.
    bound = attempt.ask(solvers.linear, least_violation(rows, decision))
    if not _is_usable(bound):
        return _faulty(attempt, rows, decision, attempt.fault_of(bound.status))
    is_empty = float(bound.solution.x[-1]) > solvers.tolerance
    # Rows that clash by less than the tolerance count as met; calling them infeasible with a proof is no lie.
    is_honest = first.status is Status.INFEASIBLE and bool(first.certificate)
    if first.status is (Status.OPTIMAL if is_empty else Status.INFEASIBLE) and not is_honest:
        return _faulty(attempt, rows, decision, Fault.BACKEND_WRONG_STATUS)
    return _relaxed(attempt, solvers, rows, wanted, _Bound(decision, bound.solution, is_empty))


class _Bound(NamedTuple):
    decision: int
    solution: Solution
    is_empty: bool


def _relaxed(
    attempt: _Attempt, solvers: Solvers, rows: HalfSpaces, wanted: FloatArray, bound: _Bound
) -> BackendAnswer:
    """The nearest of all points that violate soft rows least."""
    decision, least = bound.decision, float(bound.solution.x[-1])
    relaxed = nearest_velocity(rows, decision, wanted, least + solvers.tolerance)
    second = attempt.ask(solvers.quadratic, relaxed)
    if not _is_usable(second):
        return _faulty(attempt, rows, decision, attempt.fault_of(second.status))
    # The last row of the first stage is t >= 0: it takes no part in a contradiction.
    proof = bound.solution.multipliers[:-1].copy()
    if not bound.is_empty:
        return _answer(attempt, Case.PROJECTED, second.solution, np.zeros(len(proof)))
    return _answer(attempt, Case.LEAST_VIOLATION, second.solution, proof)


def _answer(attempt: _Attempt, case: Case, solution: Solution, proof: FloatArray) -> BackendAnswer:
    return BackendAnswer(
        fault=Fault.NONE,
        case=case,
        velocity=solution.x,
        multipliers=solution.multipliers,
        proof=proof,
        build_time=attempt.build_time,
        solve_time=attempt.solve_time,
    )


def _faulty(attempt: _Attempt, rows: HalfSpaces, decision: int, fault: Fault) -> BackendAnswer:
    nothing = np.zeros(int(rows.present[decision].sum()))
    return BackendAnswer(
        fault=fault,
        case=Case.PROJECTED,
        velocity=np.full(rows.dimension, np.nan),
        multipliers=nothing,
        proof=nothing,
        build_time=attempt.build_time,
        solve_time=attempt.solve_time,
    )
