"""The tables in the terminal."""

from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from safefilter.comparison.summary import Summary
from safefilter.comparison.table import DISTURBED, as_tables


def printed(summary: Summary) -> str:
    console = Console(file=io.StringIO(), width=250)
    console.print(as_tables(summary))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_tables_show_the_advice_first(summary: Summary) -> None:
    text = printed(summary)
    assert text.index("which solver should I use?") < text.index("all in the plane, in sequence")
    assert "good @ tolerance: 2000 us a decision." in text
    assert "liar @ default, trusted" in text
    assert "abacus <1>" in text
    assert DISTURBED not in text


def test_a_busy_machine_is_named_so(summary: Summary) -> None:
    machine = {"processor": "abacus", "load at start": "3.5"}
    busy = replace(summary, comparison=replace(summary.comparison, machine=machine))
    assert DISTURBED in printed(busy)


def test_without_crossings_there_is_no_table_of_them(summary: Summary) -> None:
    still = replace(summary, comparison=replace(summary.comparison, crossings={}))
    assert "collisions" in printed(summary)
    assert "collisions" not in printed(still)
