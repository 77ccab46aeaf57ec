"""A summary as one HTML file that needs no other: the answer first, then plots, tables, and how it was measured."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from safefilter.comparison.advice import RULES
from safefilter.comparison.attempt import Fate
from safefilter.comparison.cells import (
    COLUMNS,
    CROSSING_HEADS,
    MORE_COLUMNS,
    Column,
    crossing_cells,
    crossings_of,
)
from safefilter.comparison.contender import Setting
from safefilter.comparison.figures import latency_figure, profile_figure, violation_figure
from safefilter.comparison.machine import is_quiet
from safefilter.comparison.summary import Line, Summary
from safefilter.comparison.table import DISTURBED
from safefilter.comparison.worker import Mode
from safefilter.safety_filter import BUILT_IN

# Contenders in the first table; the others are below.
MOST_IN_FIRST_TABLE = 6
STYLE = """
body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:1120px;padding:1.2rem;color:#1b1f24;background:#fff}
h1{font-size:1.5rem;margin:.2rem 0 .6rem}h2{font-size:1.15rem;margin:2rem 0 .4rem;border-top:1px solid
#d8dee4;padding-top:1rem} .answers{display:grid;grid-template-columns:repeat(auto-fit,minmax(320px,1fr));gap:.7rem}
.answer{border:1px solid #d8dee4;border-left:5px solid #009e73;border-radius:6px;padding:.55rem .8rem}
.answer.none{border-left-color:#d55e00}.answer p{margin:.15rem 0}.question{color:#57606a;font-size:.85rem}
.verdict{font-weight:600}table{border-collapse:collapse;font-size:.8rem;margin:.5rem 0;display:block;overflow-x:auto}
th,td{padding:.18rem .5rem;text-align:right;border-bottom:1px solid #eaeef2;white-space:nowrap}
th:first-child,td:first-child{text-align:left}thead th{color:#57606a;font-weight:600}
.busy{background:#fff4ec;border:1px solid #d55e00;border-radius:6px;padding:.4rem .8rem;margin:.6rem 0}
.note{color:#57606a;font-size:.85rem}figure{margin:.6rem
0}svg{max-width:100%;height:auto}summary{cursor:pointer;padding:.2rem 0}
"""


PLOTS = {
    "How long a decision takes, from the fastest to the slowest; the bar holds 80 %, the tick is the median.": (
        latency_figure
    ),
    "How far the worst raw answer is outside, against the median time of a decision. In the green band it is safe. "
    "Hollow: the filter refused more than 1 % of the answers.": violation_figure,
    "Performance profile: share of the problems that a solver decides itself, verified, within a multiple of the "
    "fastest solver's time. Up and to the left is better.": profile_figure,
}
CONSEQUENCE = (
    "Trusted: what the solver says executes, and the robot stands still where it says nothing. Through the filter: "
    "what SafetyFilter makes of it executes. Contacts are judged in closed form within steps."
)


def write_report(path: Path, summary: Summary) -> None:
    """Write the report."""
    path.write_text(as_html(summary), encoding="utf-8")


def as_html(summary: Summary) -> str:
    """The report as text."""
    return "\n".join([
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Which solver should I use?</title><style>{STYLE}</style></head><body>",
        *_first_screen(summary),
        *_plots(summary),
        *_consequence(summary),
        *_all_tables(summary),
        *_method(summary),
        "</body></html>",
    ])


def _first_screen(summary: Summary) -> Iterator[str]:
    yield "<h1>Which solver should I use, and at what setting?</h1>"
    if not is_quiet(float(summary.comparison.machine["load at start"])):
        yield f'<p class="busy">{DISTURBED}</p>'
    yield '<div class="answers">'
    for advice in summary.advice:
        kind = "answer" if advice.best else "answer none"
        yield (
            f'<div class="{kind}"><p class="question">{escape(advice.question)}</p>'
            f'<p class="verdict">{escape(advice.answer)}</p></div>'
        )
    yield "</div>"
    yield _note_on_built_in(summary)
    for kind in summary.kinds:
        standings = next(advice.standings for advice in summary.advice if advice.kind == kind)
        yield f"<p><b>{escape(kind[0].upper() + kind[1:])}</b>, the best settings of each solver:</p>"
        firsts = {standing.contender.backend: standing for standing in reversed(standings)}
        shown = [one for one in standings if one in firsts.values()][:MOST_IN_FIRST_TABLE]
        yield _table(
            COLUMNS,
            [(one.contender.title, [c.cell(one.measures) for c in COLUMNS]) for one in shown],
        )


def _note_on_built_in(summary: Summary) -> str:
    """Why the built-in solver looks so slow in the tables."""
    if all(contender.backend != BUILT_IN for contender in summary.comparison.contenders):
        return ""
    return (
        f"<p class='note'>In the tables {BUILT_IN} is asked through the same door as others, one program at a time. "
        "SafetyFilter calls it directly, for all robots at once: see the first answer.</p>"
    )


def _plots(summary: Summary) -> Iterator[str]:
    for kind in summary.kinds:
        yield f"<h2>Plots: {escape(kind)}</h2>"
        for caption, draw in PLOTS.items():
            svg = as_svg(draw(summary, kind))
            yield f"<figure><figcaption class='note'>{caption}</figcaption>{svg}</figure>"


def _consequence(summary: Summary) -> Iterator[str]:
    crossings = crossings_of(summary)
    if not crossings:
        return
    yield "<h2>The consequence: ten robots cross each other's ways</h2>"
    yield f"<p class='note'>{CONSEQUENCE}</p>"
    rows = [(title, crossing_cells(crossing)) for _, title, crossing in crossings]
    yield _plain_table(["", *CROSSING_HEADS], rows)


def _all_tables(summary: Summary) -> Iterator[str]:
    yield "<h2>All measures</h2>"
    columns = (*COLUMNS, *MORE_COLUMNS)
    descriptions = {problems.name: problems.description for problems in summary.comparison.sets}
    for name in [*summary.kinds, *descriptions]:
        for mode in (Mode.SEQUENCE, Mode.COLD):
            lines = summary.of_problems(name, mode)
            about = descriptions.get(name, "")
            yield f"<details><summary><b>{escape(name)}</b>, {mode.name.lower()}. {escape(about)}</summary>"
            yield _table(columns, [_line(line, columns) for line in lines])
            yield "</details>"


def _method(summary: Summary) -> Iterator[str]:
    comparison = summary.comparison
    yield "<h2>How it was measured</h2><ul class='note'>"
    yield from (f"<li>{escape(rule)}</li>" for rule in RULES)
    yield from (f"<li>Setting <b>{s.title}</b>: {escape(s.value)}.</li>" for s in Setting)
    yield from (f"<li>{m.name.title()}: {escape(m.value)}.</li>" for m in Mode)
    yield (
        "<li>Every problem goes to all solvers before the next one does, in an order that changes; "
        f"{comparison.plan.rounds} rounds in sequence, one cold; two problems of each set to warm up; garbage "
        "collector off. Solvers work in a process of their own, replaced when it dies or takes more than "
        f"{comparison.plan.time_limit:g} s.</li>"
    )
    fates = {
        fate: sum(a.fate is fate for attempts in comparison.attempts.values() for a in attempts)
        for fate in (Fate.LATE, Fate.KILLED, Fate.STRUCK)
    }
    yield from (
        f"<li>{number} decisions: {escape(fate.value)}.</li>"
        for fate, number in fates.items()
        if number
    )
    if comparison.left_out:
        yield f"<li>The run was cut short: {comparison.left_out} tasks were left out.</li>"
    yield f"<li>Budget of a decision: {1e3 * summary.budget:g} ms. The run took {comparison.seconds:.0f} s.</li>"
    machine = ", ".join(f"{name} {value}" for name, value in comparison.machine.items())
    yield f"<li>{escape(machine)}</li></ul>"
    yield "<p class='note'>Columns: "
    yield "; ".join(
        f"<b>{escape(c.title)}</b> {escape(c.meaning)}" for c in (*COLUMNS, *MORE_COLUMNS)
    )
    yield ".</p>"


def _line(line: Line, columns: Sequence[Column]) -> tuple[str, list[str]]:
    return line.contender.title, [column.cell(line.measures) for column in columns]


def _table(columns: Sequence[Column], rows: Iterable[tuple[str, list[str]]]) -> str:
    return _plain_table(["", *(column.title for column in columns)], rows)


def _plain_table(heads: Sequence[str], rows: Iterable[tuple[str, list[str]]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in (title, *cells)) + "</tr>\n"
        for title, cells in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def as_svg(figure: Figure) -> str:
    """A figure as an element of a page: text stays text, and the same figure gives the same bytes."""
    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "safefilter"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]
