"""Advice follows its rules."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from safefilter.comparison.advice import advice_of, standings_of
from safefilter.comparison.attempt import Attempt
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.problem import OTHERS, PLANE, groups_of
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode
from safefilter.decision import Fault


def test_a_fast_liar_is_not_advised(summary: Summary) -> None:
    _, through, alone = (advice for advice in summary.advice if advice.kind == PLANE)
    good = summary.comparison.contenders[0]
    assert through.best == alone.best == good
    assert through.answer.startswith("good @ tolerance: 2000 us a decision.")
    # Half of its decisions take longer than the budget: it is advised, and that is said.
    assert "None keeps the budget of 2 ms: it misses 50.0%." in through.answer
    assert through.standings[0].contender == good


def test_nobody_is_advised_where_nobody_is_fit(summary: Summary) -> None:
    through, alone = (advice for advice in summary.advice if advice.kind == OTHERS)
    assert through.best is None
    assert through.answer == "None decides 99 % of the problems itself."
    assert alone.best is None
    assert alone.answer.startswith("None: the best, liar @ default, is unsafe or silent in 100.0%")


def test_who_does_not_take_the_problems_does_not_stand(summary: Summary) -> None:
    space = groups_of(summary.comparison.sets)[OTHERS]
    standings = standings_of(summary.comparison, space, 1.0)
    assert [standing.contender.backend for standing in standings] == ["liar"]


def with_attempts(summary: Summary, contender: Contender, *attempts: Attempt) -> Summary:
    """Another contender in the plane."""
    comparison = summary.comparison
    more = dict(comparison.attempts)
    for mode in Mode:
        more[contender, mode, "plane"] = attempts
        more[contender, mode, "space"] = comparison.attempts[
            comparison.contenders[0], mode, "space"
        ]
    changed = replace(comparison, contenders=(*comparison.contenders, contender), attempts=more)
    return replace(summary, comparison=changed)


def scaled(summary: Summary, factor: float) -> tuple[Attempt, ...]:
    good = summary.comparison.contenders[0]
    attempts = summary.comparison.attempts[good, Mode.COLD, "plane"]
    return tuple(attempt._replace(total=factor * attempt.total) for attempt in attempts)


def test_the_fastest_of_the_fit_is_advised(summary: Summary) -> None:
    quick = Contender("quick", Setting.DEFAULT)
    more = with_attempts(summary, quick, *scaled(summary, 0.5))
    advice = advice_of(more.comparison, 1.0)[1]
    assert advice.best == quick
    assert advice.answer.endswith("Next: good @ tolerance.")


def test_of_settings_alike_the_tighter_one_is_advised(summary: Summary) -> None:
    tight = Contender("good", Setting.TIGHT)
    alike = with_attempts(summary, tight, *scaled(summary, 1.04))
    assert advice_of(alike.comparison, 1.0)[1].best == tight
    slower = with_attempts(summary, tight, *scaled(summary, 1.2))
    assert advice_of(slower.comparison, 1.0)[1].best == Contender("good", Setting.TOLERANCE)


def test_who_keeps_the_budget_goes_before_who_is_faster(summary: Summary) -> None:
    first, second = scaled(summary, 1.0)
    steady = Contender("steady", Setting.TOLERANCE)
    more = with_attempts(
        summary, steady, first._replace(total=2.5e-3), second._replace(total=2.5e-3)
    )
    # `good` takes 1 and 3 ms, a median of 2 ms.
    assert advice_of(more.comparison, 2.6e-3)[1].best == steady
    assert advice_of(more.comparison, 4e-3)[1].best == summary.comparison.contenders[0]


def test_a_refused_answer_in_two_is_too_many(summary: Summary) -> None:
    first, second = scaled(summary, 0.1)
    refused = Contender("refused", Setting.TOLERANCE)
    attempts = first, second._replace(fault=int(Fault.BACKEND_REJECTED), case=0)
    more = with_attempts(summary, refused, *attempts)
    through, alone = advice_of(more.comparison, 1.0)[1:3]
    assert through.best == summary.comparison.contenders[0]
    # Its raw answers are right all the same.
    assert alone.best == refused


def crossed(summary: Summary, **fields: Any) -> Summary:
    """The good one crosses otherwise, and the liar, checked, without a fault in 1.5 ms a step."""
    good, liar = summary.comparison.contenders
    calm = summary.comparison.crossings[good][0]
    own = calm._replace(not_own=0)
    crossings = {
        good: [own._replace(**fields)],
        liar: [own._replace(step_time=1.5e-3)],
    }
    return replace(summary, comparison=replace(summary.comparison, crossings=crossings))


def test_in_the_loop_the_fastest_step_is_advised(summary: Summary) -> None:
    good, liar = summary.comparison.contenders
    first = advice_of(crossed(summary).comparison, 1.0)[0]
    assert first.question == "In SafetyFilter, a step of 10 robots in the plane"
    assert (first.best, first.answer) == (good, "good: 1000 us. Next: liar, 1500 us.")
    wrongs: list[dict[str, float]] = [
        {"collisions": 1},
        {"not_own": 2},
        {"step_time": 2e-3},
        {"is_verified": False},
    ]
    for wrong in wrongs:
        assert advice_of(crossed(summary, **wrong).comparison, 1.0)[0].best == liar


def test_in_the_loop_nobody_is_advised_who_is_refused_in_one_of_fifty(summary: Summary) -> None:
    # Two of the hundred decisions of the good one were not its own.
    first = summary.advice[0]
    assert (first.best, first.answer) == (None, "None decides 99 % of its decisions itself.")


def test_without_crossings_nothing_is_said_of_them(summary: Summary) -> None:
    bare = replace(summary.comparison, crossings={})
    assert advice_of(bare, 1.0)[0].question.startswith("One program at a time")
