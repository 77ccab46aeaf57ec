"""Measures of attempts by hand are those by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.contender import ACCURACY
from safefilter.comparison.measures import Judged, Latency, is_right_case, judged, measures_of
from safefilter.comparison.problem import Problem, Truth
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode
from safefilter.decision import Case, Fault

BUDGET = 2e-3


def test_the_honest_one_by_hand(summary: Summary) -> None:
    good = summary.comparison.contenders[0]
    attempts = judged(summary.comparison, good, Mode.SEQUENCE, summary.comparison.sets)
    measures = measures_of(attempts, BUDGET)
    assert (measures.asked, measures.unsupported, measures.killed, measures.late) == (2, 1, 0, 0)
    assert (measures.verified_safe, measures.case_agreement) == (1.0, 1.0)
    assert (measures.false_feasible, measures.false_empty, measures.fail_closed) == (0.0, 0.0, 0.0)
    assert measures.least_gap == 1e-9
    assert measures.misses == 0.5
    assert measures.total.p50 == pytest.approx(2e-3)
    assert measures.total.max == 3e-3
    assert measures.verified_wrong == 0


def test_the_liar_by_hand(summary: Summary) -> None:
    liar = summary.comparison.contenders[1]
    attempts = judged(summary.comparison, liar, Mode.COLD, summary.comparison.sets)
    measures = measures_of(attempts, BUDGET)
    assert (measures.asked, measures.killed) == (3, 1)
    assert measures.verified_safe == pytest.approx(1 / 3)
    assert measures.false_feasible == 1.0
    assert measures.false_empty == 0.0
    assert measures.fail_closed == pytest.approx(2 / 3)
    assert measures.worst_excess == 0.5
    # The dead one counts as a miss.
    assert measures.misses == pytest.approx(1 / 3)


def one(problem: Problem, margin: float, attempt: Attempt) -> Judged:
    case = Case.LEAST_VIOLATION if margin > 0.0 else Case.PROJECTED
    return Judged(attempt, problem, Truth(case, margin, np.zeros(2)))


def answered(claim: int, **fields: float) -> Attempt:
    found = Attempt(Fate.ANSWERED, claim=claim, case=claim, fault=Fault.NONE, total=1.0)
    return found._replace(**fields)  # type: ignore[arg-type]  # all of them numbers


def test_near_the_margin_either_case_is_right(feasible: Problem) -> None:
    near, clear = 0.5 * ACCURACY, 2.0 * ACCURACY
    for case in (Case.PROJECTED, Case.LEAST_VIOLATION):
        assert is_right_case(one(feasible, near, answered(case)), case)
        assert is_right_case(one(feasible, -near, answered(case)), case)
    assert not is_right_case(one(feasible, clear, answered(2)), Case.PROJECTED)
    assert not is_right_case(one(feasible, -clear, answered(3)), Case.LEAST_VIOLATION)
    assert not is_right_case(one(feasible, near, answered(0)), 0)
    # And neither is called falsely anything.
    measures = measures_of([one(feasible, near, answered(2))], BUDGET)
    assert math.isnan(measures.false_feasible)
    assert math.isnan(measures.false_empty)


def test_problems_without_soft_rows_count_as_clearly_what_they_are(feasible: Problem) -> None:
    said = one(feasible, math.nan, answered(3))
    assert measures_of([said], BUDGET).false_empty == 1.0
    assert not is_right_case(said, 3)


def test_violations_are_relative_to_the_largest_action(feasible: Problem) -> None:
    large = Problem.of(
        "", feasible.wanted, feasible.normals, feasible.offsets, feasible.hard, scale=100.0
    )
    measures = measures_of([one(large, -1.0, answered(2, excess=0.5, cut=0.25))], BUDGET)
    assert (measures.worst_excess, measures.worst_excess_absolute) == (0.005, 0.5)
    assert measures.cut == 0.0025


@pytest.mark.parametrize(
    ("fields", "wrong"),
    [
        ({"verified_excess": 0.0}, 0),
        ({"verified_excess": 1e-3}, 1),
        ({"verified_excess": 0.0, "case": 3}, 1),
        ({"verified_excess": 1e-3, "fault": Fault.BACKEND_REJECTED}, 0),
    ],
)
def test_a_wrong_answer_that_was_taken_is_counted(
    feasible: Problem, fields: dict[str, float], wrong: int
) -> None:
    attempt = answered(2, **fields)
    assert measures_of([one(feasible, -1.0, attempt)], BUDGET).verified_wrong == wrong


def test_percentiles_need_samples_beyond_them() -> None:
    times = np.arange(1.0, 101.0)
    latency = Latency.of(times)
    assert (latency.p50, latency.max) == (50.5, 100.0)
    assert latency.p99 == pytest.approx(99.01)
    assert math.isnan(latency.p99_9)
    assert math.isnan(Latency.of(times[:99]).p99)
    assert all(math.isnan(value) for value in Latency.of(times[:0]))


def test_nothing_measured_is_not_a_number() -> None:
    measures = measures_of([], BUDGET)
    assert measures.asked == 0
    assert math.isnan(measures.verified_safe)
    assert math.isnan(measures.misses)
