"""A summary has a line for everything that was measured."""

from __future__ import annotations

from safefilter.comparison.problem import OTHERS, PLANE
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode


def test_there_is_a_line_a_contender_mode_and_set(summary: Summary) -> None:
    keys = {(line.contender.backend, line.mode, line.problems) for line in summary.lines}
    assert len(keys) == len(summary.lines) == 2 * 2 * 4
    assert {problems for *_, problems in keys} == {PLANE, OTHERS, "plane", "space"}
    assert summary.kinds == [PLANE, OTHERS]


def test_lines_of_a_set_are_those_of_who_takes_it(summary: Summary) -> None:
    assert len(summary.of_problems("plane", Mode.COLD)) == 2
    (only,) = summary.of_problems("space", Mode.COLD)
    assert only.contender.backend == "liar"


def test_percentiles_are_named(summary: Summary) -> None:
    numbers = summary.of_problems("plane", Mode.COLD)[0].numbers
    assert {"build_p50", "solve_p99_9", "total_max", "misses", "asked"} <= set(numbers)
    assert numbers["total_max"] == 3e-3
