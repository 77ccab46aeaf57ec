"""Attempt: what one contender made of one problem, by our own check and not by the solver's word.

Two answers are judged. The *raw* one is what the solver says, as a program that trusts it would take it: the point of
Case-2's program if it names one, otherwise that of Case-3's. The *verified* one is what the filter makes of the same
solves: polished on its active rows, certified, or refused; a refusal is answered by another solver, so it costs time
and never safety.

Letters: n variables, m rows, d dimensions. Everything in the unit of the action; times in s.
"""

from __future__ import annotations

import math
from enum import Enum
from time import perf_counter
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backend_answer import BackendAnswer, Solvers, ask_backend
from safefilter.backends.backend import Backend, Solution, Status
from safefilter.comparison.contender import accuracy_of
from safefilter.comparison.problem import Problem, Truth
from safefilter.decision import Case, Fault
from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram
from safefilter.residuals import measure

NOTHING = 0


class Fate(Enum):
    """How a contender came through a problem; the value is the sentence to print."""

    ANSWERED = "it came back"
    UNSUPPORTED = "it does not take programs of this kind"
    LATE = "it was stopped at the time limit"
    KILLED = "its process died"
    STRUCK = "it was not asked any more after too many of these"


class Attempt(NamedTuple):
    """Plain numbers; NaN where there is nothing to measure.

    Attributes:
        fate: How it went.
        claim: Case that the raw answer claims, 2 or 3; 0 if it claims nothing.
        excess: How much the raw point violates rows beyond what the least violation makes necessary, >= 0.
        off: Distance of the raw point from the right one.
        longer: Suboptimality: how much farther from the wish the raw point is than the right one.
        least_gap: Case-3: least violation found, less the right one.
        cut: How far the lowest multiplier of the last projection was below zero.
        complementarity: Of the last projection: sum of ``multipliers_i * |slack_i|``.
        stationarity: Of the last projection: length of ``P x + q + G' multipliers``.
        fault: What the filter says of it, a `Fault`.
        case: Case of the verified answer; 0 if there is none.
        verified_excess: As ``excess``, of the verified point.
        verified_off: As ``off``, of the verified point.
        build: Time spent on handing programs over, setting up included where it was.
        solve: Time spent in the solver.
        total: Time of the whole decision, polish and proof included.
    """

    fate: Fate
    claim: int = NOTHING
    excess: float = math.nan
    off: float = math.nan
    longer: float = math.nan
    least_gap: float = math.nan
    cut: float = math.nan
    complementarity: float = math.nan
    stationarity: float = math.nan
    fault: int = Fault.BACKEND_RAISED
    case: int = NOTHING
    verified_excess: float = math.nan
    verified_off: float = math.nan
    build: float = math.nan
    solve: float = math.nan
    total: float = math.nan

    @property
    def is_own(self) -> bool:
        """Did the contender decide itself, verified?"""
        return self.fate is Fate.ANSWERED and self.fault == Fault.NONE


class Asked(NamedTuple):
    """One program that a solver was given, and what it said."""

    program: ConvexProgram
    solution: Solution


class Observed:
    """A backend that is watched: it keeps what it was asked and what it said; see `Backend`."""

    def __init__(self, backend: Backend, seen: list[Asked], padding: int) -> None:
        self.name = backend.name
        self.capabilities = backend.capabilities
        self._backend = backend
        self._seen = seen
        self._padding = padding

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a program, with rows ``0 @ v >= -1`` besides if there is padding; see `Backend.solve`."""
        solution = self._backend.solve(_padded(program, self._padding))
        solution = _without_padding(solution, program.num_rows)
        self._seen.append(Asked(program, solution))
        return solution


class Raw(NamedTuple):
    """The raw answer.

    Attributes:
        claim: 2, 3 or 0.
        point: Shape (d,), or NaN.
        least: Least violation found, or NaN.
        projection: The last projection that was asked for, or None.
    """

    claim: int
    point: FloatArray
    least: float
    projection: Asked | None


def raw_answer(seen: list[Asked], dimension: int, accuracy: float) -> Raw:
    """What a program that trusts the solver would take for the answer.

    Args:
        seen: The projection, then where the filter went on: the least violation, and the relaxed projection.
        dimension: Number of dimensions d.
        accuracy: Least violation up to which rows count as kept.
    """
    point, least = np.full(dimension, np.nan), math.nan
    if not seen:
        return Raw(NOTHING, point, least, None)
    first = seen[0]
    if first.solution.status.has_point:
        return Raw(Case.PROJECTED, first.solution.x, least, first)
    if len(seen) > 1 and seen[1].solution.status.has_point:
        least = float(seen[1].solution.x[-1])
    last = seen[2] if len(seen) > 2 else None
    if last is not None and last.solution.status.has_point:
        point = last.solution.x
    claim: int = NOTHING
    if first.solution.status is Status.INFEASIBLE or least > accuracy:
        claim = Case.LEAST_VIOLATION
    elif last is not None and least <= accuracy:
        claim = Case.PROJECTED
    return Raw(claim, point, least, last)


class Timed(NamedTuple):
    """One decision as the filter makes it, watched."""

    answer: BackendAnswer
    seen: list[Asked]
    total: float


def decide(solvers: Solvers, problem: Problem, start: float) -> Timed:
    """Let solvers decide one problem, as `SafetyFilter` would.

    Args:
        solvers: Who is asked.
        problem: What.
        start: When the decision began, by `perf_counter`: before the solvers were made, if they are new.
    """
    seen: list[Asked] = []
    quadratic = Observed(solvers.quadratic, seen, problem.padding)
    is_one = solvers.linear is solvers.quadratic
    linear = quadratic if is_one else Observed(solvers.linear, seen, problem.padding)
    watched = Solvers(quadratic, linear, solvers.tolerance)
    answer = ask_backend(watched, problem.rows, 0, problem.wanted, problem.radius)
    return Timed(answer, seen, perf_counter() - start)


def judge(timed: Timed, problem: Problem, truth: Truth | None, made: float) -> Attempt:
    """Judge a decision.

    Args:
        timed: What was decided, and how long it took.
        problem: What was asked.
        truth: The right answer, if it is known.
        made: Time spent on making the solvers, part of ``timed.total``.
    """
    answer, accuracy = timed.answer, accuracy_of(problem.scale)
    if isinstance(answer.cause, UnsupportedProgram):
        return Attempt(Fate.UNSUPPORTED)
    raw = raw_answer(timed.seen, problem.dimension, accuracy)
    verified = (
        answer.velocity if answer.fault == Fault.NONE else np.full_like(problem.wanted, np.nan)
    )
    in_solver = sum(asked.solution.solve_time for asked in timed.seen)
    building = sum(asked.solution.build_time for asked in timed.seen)
    return Attempt(
        Fate.ANSWERED,
        claim=raw.claim,
        excess=excess(problem, truth, raw.point),
        off=_distance(truth, raw.point),
        longer=_longer(problem, truth, raw.point),
        least_gap=raw.least - truth.least if truth is not None and truth.is_empty else math.nan,
        **_proof(raw.projection),
        fault=int(answer.fault),
        case=int(answer.case) if answer.fault == Fault.NONE else NOTHING,
        verified_excess=excess(problem, truth, verified),
        verified_off=_distance(truth, verified),
        build=made + building,
        solve=in_solver,
        total=timed.total,
    )


def excess(problem: Problem, truth: Truth | None, point: FloatArray) -> float:
    """How much a point violates rows beyond what is necessary: soft ones beyond t*, hard ones at all; >= 0 or NaN."""
    if truth is None or np.isnan(point).any():
        return math.nan
    violation = problem.rows.violation(point[np.newaxis])[0]
    necessary = np.where(problem.hard, 0.0, truth.least)
    # inf - inf: where the hard rows contradict each other, soft ones are given up.
    beyond = np.where(np.isinf(necessary), -np.inf, violation - necessary)
    return float(beyond.max(initial=0.0))


def _distance(truth: Truth | None, point: FloatArray) -> float:
    return math.nan if truth is None else float(np.linalg.norm(point - truth.point))


def _longer(problem: Problem, truth: Truth | None, point: FloatArray) -> float:
    if truth is None:
        return math.nan
    own, right = (np.linalg.norm(at - problem.wanted) for at in (point, truth.point))
    return float(own - right)


def _proof(asked: Asked | None) -> dict[str, float]:
    if asked is None or not asked.solution.status.has_point:
        return {}
    solution = asked.solution
    with np.errstate(all="ignore"):
        left = measure(asked.program, solution.x, solution.multipliers, 1.0, math.inf)
    return {
        "cut": solution.cut,
        "complementarity": left.complementarity,
        "stationarity": left.dual,
    }


def _padded(program: ConvexProgram, padding: int) -> ConvexProgram:
    if not padding:
        return program
    blank = np.zeros((padding, program.num_variables))
    return ConvexProgram(
        P=program.P,
        q=program.q,
        G=np.concatenate([program.G, blank]),
        h=np.concatenate([program.h, np.ones(padding)]),
    )


def _without_padding(solution: Solution, num_rows: int) -> Solution:
    if len(solution.multipliers) == num_rows:
        return solution
    return Solution(
        status=solution.status,
        x=solution.x,
        multipliers=solution.multipliers[:num_rows].copy(),
        build_time=solution.build_time,
        solve_time=solution.solve_time,
        cut=solution.cut,
    )
