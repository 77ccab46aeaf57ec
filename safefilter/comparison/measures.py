"""Measures: what a contender's attempts come to.

Rates are shares of the problems that they are about; a rate of nothing is NaN. Violations, distances and gaps are
relative to the largest action, v_max for robots, unless a name says otherwise. Times in s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.contender import ACCURACY, Contender
from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.comparison.runner import Comparison
from safefilter.comparison.worker import Mode
from safefilter.decision import Case

# A violation that separation's own margin of 1 um takes up: 1 um/s at 0.2 m/s, in steps of up to a second.
SAFE_EXCESS = 5e-6
# A percentile is a measurement only if some samples lie beyond it.
SAMPLES_BEYOND = {50.0: 2, 90.0: 10, 99.0: 100, 99.9: 1000, 100.0: 1}


class Judged(NamedTuple):
    """An attempt, and what it was about."""

    attempt: Attempt
    problem: Problem
    truth: Truth | None


class Latency(NamedTuple):
    """Percentiles of times, in s; NaN where there are too few samples to tell."""

    p50: float
    p90: float
    p99: float
    p99_9: float
    max: float

    @classmethod
    def of(cls, times: FloatArray) -> Latency:
        """Percentiles of samples."""
        return cls(
            *(
                float(np.percentile(times, percentile)) if len(times) >= least else math.nan
                for percentile, least in SAMPLES_BEYOND.items()
            )
        )


class Measures(NamedTuple):
    """What attempts come to.

    Attributes:
        asked: Attempts, those at unsupported problems left out.
        unsupported: Those.
        late: Stopped at the time limit, or not asked any more.
        killed: Died.
        verified_safe: Share of raw answers whose point keeps the rows, as far as possible, to `SAFE_EXCESS`.
        case_agreement: Share of raw answers of the right case; margins below the accuracy count as either.
        false_feasible: Share of the clearly empty problems for which the raw answer claims a permitted point.
        false_empty: Share of the clearly feasible problems that the raw answer calls empty.
        fail_closed: Share that the filter refused and had another solver answer.
        worst_excess: Largest violation by a raw point.
        worst_excess_absolute: The same in the unit of the action, m/s for robots.
        median_off: Median distance of the raw point from the right one.
        suboptimality: Largest excess of the raw point's distance from the wish.
        least_gap: Largest error of the least violation in Case-3.
        cut: Largest multiplier below zero.
        complementarity: Largest sum of ``multipliers_i * |slack_i|``.
        stationarity: Largest residual of ``P x + q + G' multipliers``.
        verified_wrong: Verified answers that violate rows by more than `SAFE_EXCESS` or are of the wrong case.
        verified_off: Largest distance of a verified point from the right one.
        build: Of handing programs over.
        solve: Of solving.
        total: Of whole decisions.
        misses: Share of decisions over the budget, late and dead ones included.
    """

    asked: int
    unsupported: int
    late: int
    killed: int
    verified_safe: float
    case_agreement: float
    false_feasible: float
    false_empty: float
    fail_closed: float
    worst_excess: float
    worst_excess_absolute: float
    median_off: float
    suboptimality: float
    least_gap: float
    cut: float
    complementarity: float
    stationarity: float
    verified_wrong: int
    verified_off: float
    build: Latency
    solve: Latency
    total: Latency
    misses: float


def judged(
    comparison: Comparison, contender: Contender, mode: Mode, sets: Iterable[ProblemSet]
) -> list[Judged]:
    """All attempts of a contender at the problems of some sets."""
    found = []
    for problems in sets:
        attempts = comparison.attempts.get((contender, mode, problems.name), ())
        for place, attempt in enumerate(attempts):
            number = place % len(problems)
            found.append(Judged(attempt, problems.problems[number], problems.truths.get(number)))
    return found


def measures_of(all_attempts: Sequence[Judged], budget: float) -> Measures:
    """Sum up.

    Args:
        all_attempts: From `judged`.
        budget: Time that a decision may take, in s.
    """
    taken = [one for one in all_attempts if one.attempt.fate is not Fate.UNSUPPORTED]
    back = [one for one in taken if one.attempt.fate is Fate.ANSWERED]
    known = [one for one in taken if one.truth is not None]
    empty = [one for one in known if _margin(one) > ACCURACY]
    feasible = [one for one in known if not _is_empty(one) and not _margin(one) >= -ACCURACY]
    times = np.array([one.attempt.total for one in back])
    num_over = int((times > budget).sum()) + len(taken) - len(back)
    return Measures(
        asked=len(taken),
        unsupported=len(all_attempts) - len(taken),
        late=_count(taken, lambda one: one.attempt.fate in {Fate.LATE, Fate.STRUCK}),
        killed=_count(taken, lambda one: one.attempt.fate is Fate.KILLED),
        verified_safe=_share(known, lambda one: _relative(one, "excess") <= SAFE_EXCESS),
        case_agreement=_share(known, lambda one: is_right_case(one, one.attempt.claim)),
        false_feasible=_share(empty, lambda one: one.attempt.claim == Case.PROJECTED),
        false_empty=_share(feasible, lambda one: one.attempt.claim == Case.LEAST_VIOLATION),
        fail_closed=_share(taken, lambda one: not one.attempt.is_own),
        worst_excess=_most(_relative(one, "excess") for one in back),
        worst_excess_absolute=_most(one.attempt.excess for one in back),
        median_off=_median([_relative(one, "off") for one in back]),
        suboptimality=_most(_relative(one, "longer") for one in back),
        least_gap=_most(abs(_relative(one, "least_gap")) for one in back),
        cut=_most(_relative(one, "cut") for one in back),
        complementarity=_most(one.attempt.complementarity / one.problem.scale**2 for one in back),
        stationarity=_most(_relative(one, "stationarity") for one in back),
        verified_wrong=_count(known, is_wrong_though_verified),
        verified_off=_most(_relative(one, "verified_off") for one in back),
        build=Latency.of(np.array([one.attempt.build for one in back])),
        solve=Latency.of(np.array([one.attempt.solve for one in back])),
        total=Latency.of(times),
        misses=num_over / len(taken) if taken else math.nan,
    )


def is_right_case(one: Judged, case: int) -> bool:
    """Is this the right case? Near the margin either is. A problem whose wish is permitted counts as Case-2."""
    if abs(_margin(one)) <= ACCURACY:
        return case != 0
    return case == (Case.LEAST_VIOLATION if _is_empty(one) else Case.PROJECTED)


def is_wrong_though_verified(one: Judged) -> bool:
    """Was an answer taken that is not right?"""
    attempt = one.attempt
    if not attempt.is_own:
        return False
    return _relative(one, "verified_excess") > SAFE_EXCESS or not is_right_case(one, attempt.case)


def _is_empty(one: Judged) -> bool:
    return one.truth is not None and one.truth.is_empty


def _margin(one: Judged) -> float:
    return math.nan if one.truth is None else one.truth.margin / one.problem.scale


def _relative(one: Judged, field: str) -> float:
    value: float = getattr(one.attempt, field)
    return value / one.problem.scale


def _count(attempts: Iterable[Judged], test: Callable[[Judged], bool]) -> int:
    return sum(map(test, attempts))


def _share(attempts: Sequence[Judged], test: Callable[[Judged], bool]) -> float:
    return _count(attempts, test) / len(attempts) if attempts else math.nan


def _most(values: Iterable[float]) -> float:
    """Largest value; NaN if there is none."""
    return max((value for value in values if not math.isnan(value)), default=math.nan)


def _median(values: Iterable[float]) -> float:
    known = [value for value in values if not math.isnan(value)]
    return float(np.median(known)) if known else math.nan
