"""A summary as tables in the terminal."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table

from safefilter.comparison.cells import COLUMNS, CROSSING_HEADS, crossing_cells, crossings_of
from safefilter.comparison.machine import is_quiet
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode


def as_tables(summary: Summary) -> RenderableType:
    """The advice, then one table for each kind of problems, then what came of it in closed loop."""
    parts: list[RenderableType] = [_answers(summary)]
    parts += [_measures(summary, kind) for kind in summary.kinds]
    if summary.comparison.crossings:
        parts.append(_crossings(summary))
    parts.append(_machine(summary))
    return Group(*parts)


def _answers(summary: Summary) -> Panel:
    lines = [f"[bold]{advice.question}[/bold]\n  {advice.answer}" for advice in summary.advice]
    return Panel("\n".join(lines), title="which solver should I use?", expand=False)


def _measures(summary: Summary, kind: str) -> Table:
    table = Table(title=f"{kind}, in sequence", title_justify="left")
    table.add_column("", no_wrap=True)
    for column in COLUMNS:
        table.add_column(column.title, justify="right")
    cold = {line.contender: line for line in summary.of_problems(kind, Mode.COLD)}
    table.add_column("cold p50", justify="right")
    standings = next(advice.standings for advice in summary.advice if advice.kind == kind)
    p50 = next(column for column in COLUMNS if column.title == "p50")
    for standing in standings:
        cells = [column.cell(standing.measures) for column in COLUMNS]
        table.add_row(standing.contender.title, *cells, p50.cell(cold[standing.contender].measures))
    return table


def _crossings(summary: Summary) -> Table:
    table = Table(title="ten robots cross each other's ways", title_justify="left")
    table.add_column("", no_wrap=True)
    for head in CROSSING_HEADS:
        table.add_column(head, justify="right")
    for _, title, crossing in crossings_of(summary):
        table.add_row(title, *crossing_cells(crossing))
    return table


def _machine(summary: Summary) -> str:
    machine = summary.comparison.machine
    text = ", ".join(f"{name} {value}" for name, value in machine.items())
    busy = "" if is_quiet(float(machine["load at start"])) else "[bold red]" + DISTURBED + "[/]\n"
    left_out = summary.comparison.left_out
    cut = f"The run was cut short: {left_out} tasks were left out.\n" if left_out else ""
    return f"{busy}{cut}[dim]{text}; {summary.comparison.seconds:.0f} s[/dim]"


DISTURBED = "Others were working on this machine: times are rough, and their tails say little."
