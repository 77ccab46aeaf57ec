"""The report is one file that needs no other, with the answer first."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

from safefilter.comparison.report import as_html, write_report
from safefilter.comparison.summary import Summary
from safefilter.comparison.table import DISTURBED

VOID = {"meta", "br", "link", "use", "path", "stop", "rect", "circle"}


class Balance(HTMLParser):
    """Every element that is opened is closed, in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002 - theirs
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag


def test_the_answer_comes_first(summary: Summary) -> None:
    text = as_html(summary)
    first = text[: text.index("<svg")]
    assert "good @ tolerance: 2000 us a decision." in first
    assert "None decides 99 % of the problems itself." in first
    assert len(re.findall(r'class="answer(?: none)?"', first)) == 5
    assert first.count("<table>") == 2


def test_it_needs_no_other_file(summary: Summary) -> None:
    text = as_html(summary)
    assert re.findall(r"""(?:src|href)\s*=\s*["'](?!#)""", text) == []
    assert "<script" not in text
    assert "@import" not in text
    assert text.count("<svg") == 6


def test_elements_are_closed_and_text_is_escaped(summary: Summary) -> None:
    parser = Balance()
    text = as_html(summary)
    parser.feed(text)
    assert parser.open == []
    assert "abacus &lt;1&gt;" in text
    assert "abacus <1>" not in text


def test_all_measures_of_all_sets_are_there(summary: Summary) -> None:
    text = as_html(summary)
    assert text.count("<details>") == 2 * 4
    assert "plane by hand." in text
    assert "1 decisions: its process died" not in text
    assert "2 decisions: its process died" in text


def test_the_same_summary_makes_the_same_file(tmp_path: Path, summary: Summary) -> None:
    first, second = tmp_path / "1.html", tmp_path / "2.html"
    write_report(first, summary)
    write_report(second, summary)
    assert first.read_bytes() == second.read_bytes()


def test_a_busy_machine_is_named_so_on_top(summary: Summary) -> None:
    machine = {"processor": "abacus", "load at start": "3.5"}
    busy = replace(summary, comparison=replace(summary.comparison, machine=machine))
    text = as_html(busy)
    assert 0 < text.index(DISTURBED) < text.index('class="answers"')
    assert DISTURBED not in as_html(summary)
