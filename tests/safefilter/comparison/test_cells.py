"""Numbers are shown without hiding what matters."""

from __future__ import annotations

import math

import pytest

from safefilter.comparison.cells import (
    COLUMNS,
    CROSSING_HEADS,
    MORE_COLUMNS,
    crossing_cells,
    crossings_of,
    microseconds,
    percent,
    small,
)
from safefilter.comparison.summary import Summary


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (1.0, "100"),
        (0.0, "0"),
        (0.9999, ">99.9"),
        (0.0001, "<0.1"),
        (0.125, "12.5"),
        (math.nan, "-"),
    ],
)
def test_nearly_all_is_not_all_and_nearly_none_not_none(share: float, text: str) -> None:
    assert percent(share) == text


def test_small_numbers_and_times() -> None:
    assert [small(value) for value in (0.0, 3.2e-6, math.nan)] == ["0", "3e-06", "-"]
    assert [microseconds(t) for t in (1e-6, 1.5e-5, 0.25, math.nan)] == ["1.0", "15", "250000", "-"]


def test_every_column_shows_something(summary: Summary) -> None:
    titles = [column.title for column in (*COLUMNS, *MORE_COLUMNS)]
    assert len(set(titles)) == len(titles)
    for line in summary.lines:
        assert all(column.cell(line.measures) for column in (*COLUMNS, *MORE_COLUMNS))


def test_crossings_are_titled_and_the_verified_ones_last(summary: Summary) -> None:
    found = crossings_of(summary)
    assert [title for _, title, _ in found] == [
        "liar @ default, trusted",
        "good, through the filter",
    ]
    cells = crossing_cells(found[0][2])
    assert dict(zip(CROSSING_HEADS, cells, strict=True)) == {
        "least clearance, mm": "-2.000",
        "collisions": "3",
        "arrived %": "50",
        "time to goal, s": "-",
        "decisions": "100",
        "not its own": "0",
        "time of a step, us": "100",
    }
