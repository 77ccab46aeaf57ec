import pytest

from benchmarks.crowd_states import make_crowd
from benchmarks.navground_crowd import FILTER, NAVGROUND, navground_rows

pytest.importorskip("navground")


def test_both_sides_are_timed() -> None:
    rows = list(navground_rows(make_crowd(20), rounds=2))
    assert [row.name for row in rows] == [NAVGROUND, FILTER]
    assert rows[0].ratio == 1.0
    assert all(row.numbers["best"] > 0.0 for row in rows)
