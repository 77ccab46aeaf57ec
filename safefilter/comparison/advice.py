"""Advice: which solver, and at what setting, read off the measures by rules that are printed beside it.

Times in s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from safefilter.comparison.closed_loop import NUM_ROBOTS
from safefilter.comparison.contender import Contender
from safefilter.comparison.measures import Measures, judged, measures_of
from safefilter.comparison.problem import OTHERS, PLANE, ProblemSet, groups_of
from safefilter.comparison.runner import Comparison
from safefilter.comparison.worker import Mode

# Share of decisions that may be refused, and answered by another solver, before a solver is not worth its name.
MOST_REFUSED = 0.01
RULES = (
    "In the filter: no collision in the crossing, and at most 1 % of the decisions refused; of these, the least "
    "median time of a step.",
    "Checked: no verified answer is wrong, and at most 1 % are refused (and answered by another solver); "
    "of these, those that miss the budget in at most 1 %, if there are any; of these, the least median time.",
    "Unchecked: every answer is safe to 1 um/s at 0.2 m/s and of the right case; of these, the least "
    "median time. Of two settings of one solver that differ by less than 5 %, the tighter one.",
)
QUESTIONS = {PLANE: "robots in the plane", OTHERS: "actions in other dimensions"}


class Standing(NamedTuple):
    """A contender, and what its attempts in sequence at some problems come to."""

    contender: Contender
    measures: Measures


class Advice(NamedTuple):
    """Answer to one question.

    Attributes:
        kind: Kind of problems, `PLANE` or `OTHERS`.
        question: What is asked.
        answer: In a sentence.
        best: The contender named, or None.
        standings: All contenders that take these problems, the best first.
    """

    kind: str
    question: str
    answer: str
    best: Contender | None
    standings: tuple[Standing, ...]


def advice_of(comparison: Comparison, budget: float) -> tuple[Advice, ...]:
    """Answer the questions that the problems allow."""
    found: list[Advice] = []
    for kind, sets in groups_of(comparison.sets).items():
        standings = standings_of(comparison, sets, budget)
        if kind == PLANE and any(comparison.crossings.values()):
            found.append(_in_loop(comparison, standings))
        found += [
            _through_filter(kind, standings, budget),
            _alone(kind, standings),
        ]
    return tuple(found)


def standings_of(
    comparison: Comparison, sets: Sequence[ProblemSet], budget: float, mode: Mode = Mode.SEQUENCE
) -> tuple[Standing, ...]:
    """All contenders that take problems of some sets, the fewest refusals first, then the fastest."""
    standings = [
        Standing(contender, measures_of(judged(comparison, contender, mode, sets), budget))
        for contender in comparison.contenders
    ]
    return tuple(
        sorted(
            (standing for standing in standings if standing.measures.asked),
            key=lambda standing: (
                standing.measures.verified_wrong > 0,
                standing.measures.fail_closed > MOST_REFUSED,
                _number(standing.measures.total.p50),
            ),
        )
    )


def _in_loop(comparison: Comparison, standings: tuple[Standing, ...]) -> Advice:
    """The one question of the closed loop, where the filter calls its built-in solver without a detour."""
    fit = sorted(
        (crossing.step_time, contender.backend, contender)
        for contender, crossings in comparison.crossings.items()
        for crossing in crossings
        if crossing.is_verified
        and crossing.collisions == 0
        and crossing.decisions > 0
        and crossing.not_own <= MOST_REFUSED * crossing.decisions
    )
    question = f"In SafetyFilter, a step of {NUM_ROBOTS} robots in the plane"
    if not fit:
        answer = "None decides 99 % of its decisions itself."
        return Advice(PLANE, question, answer, None, standings)
    step_time, name, best = fit[0]
    answer = f"{name}: {1e6 * step_time:.0f} us."
    if len(fit) > 1:
        answer += f" Next: {fit[1][1]}, {1e6 * fit[1][0]:.0f} us."
    return Advice(PLANE, question, answer, best, standings)


def _through_filter(kind: str, standings: tuple[Standing, ...], budget: float) -> Advice:
    question = f"One program at a time, checked, for {QUESTIONS[kind]}"
    fit = [
        standing
        for standing in standings
        if standing.measures.verified_wrong == 0 and standing.measures.fail_closed <= MOST_REFUSED
    ]
    if not fit:
        answer = "None decides 99 % of the problems itself."
        return Advice(kind, question, answer, None, standings)
    in_time = [standing for standing in fit if standing.measures.misses <= MOST_REFUSED]
    best = _fastest(in_time or fit)
    answer = _sentence(best, in_time or fit)
    if not in_time:
        answer += (
            f" None keeps the budget of {1e3 * budget:g} ms: it misses {best.measures.misses:.1%}."
        )
    return Advice(kind, question, answer, best.contender, standings)


def _alone(kind: str, standings: tuple[Standing, ...]) -> Advice:
    question = f"One at a time, unchecked, for {QUESTIONS[kind]}"
    fit = [
        standing
        for standing in standings
        if standing.measures.verified_safe == 1.0 and standing.measures.case_agreement == 1.0
    ]
    if fit:
        best = _fastest(fit)
        return Advice(kind, question, _sentence(best, fit), best.contender, standings)
    if not standings:
        return Advice(kind, question, "None of them takes these problems.", None, standings)
    best = max(
        standings,
        key=lambda one: (_number(one.measures.verified_safe), _number(one.measures.case_agreement)),
    )
    return Advice(
        kind,
        question,
        f"None: the best, {best.contender.title}, is unsafe or silent in "
        f"{1.0 - best.measures.verified_safe:.1%} of the problems.",
        None,
        standings,
    )


def _fastest(standings: Sequence[Standing]) -> Standing:
    fastest = min(standings, key=lambda one: _number(one.measures.total.p50))
    alike = [
        one
        for one in standings
        if one.contender.backend == fastest.contender.backend
        and one.measures.total.p50 <= 1.05 * fastest.measures.total.p50
    ]
    order = list(type(fastest.contender.setting))
    return max(alike, key=lambda one: order.index(one.contender.setting))


def _sentence(best: Standing, fit: Sequence[Standing]) -> str:
    total = best.measures.total
    late = f", 99 % within {1e6 * total.p99:.0f} us" if not math.isnan(total.p99) else ""
    others = [one for one in fit if one.contender.backend != best.contender.backend]
    then = f" Next: {_fastest(others).contender.title}." if others else ""
    return f"{best.contender.title}: {1e6 * total.p50:.0f} us a decision{late}.{then}"


def _number(value: float) -> float:
    return math.inf if math.isnan(value) else value
