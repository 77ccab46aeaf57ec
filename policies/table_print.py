"""The table on a terminal, at most 80 characters wide."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from envs.intervals import Interval
from envs.table_row import TableRow
from policies.paper_table import PAPER_TABLE
from policies.priority_table import HIGH, LOW, PriorityGain, gain_cells
from policies.table_rows import Entry, Outcome, number, percent

COLUMNS = (
    "success\n(%)",
    "95 %\n",
    "social\n(%)",
    "hit\nrobots",
    "hit\nwalls",
    "stuck\n(%)",
    "time\n(s)",
    "paper\n(%, s)",
)


def tables(outcome: Outcome, gains: Sequence[PriorityGain]) -> Iterator[Table]:
    """One table a scenario, and what priority saves.

    Args:
        outcome: Rows.
        gains: What priority saves.
    """
    for scenario in dict.fromkeys(entry.row.scenario for entry in outcome.pooled):
        yield scenario_table(
            scenario, [entry for entry in outcome.pooled if entry.row.scenario == scenario]
        )
    if gains:
        yield _priority_table(gains)


def scenario_table(scenario: str, entries: Sequence[Entry]) -> Table:
    """The rows of one scenario, over all training seeds.

    Args:
        scenario: Name of it.
        entries: Rows.
    """
    table = _empty(
        f"{scenario}: {' or '.join(map(str, sorted({entry.row.num_episodes for entry in entries})))} episodes",
        "shares of robots; stuck: timed out or rotating; paper: success, time",
    )
    table.add_column("method", no_wrap=True)
    for header in COLUMNS:
        table.add_column(header, justify="right", no_wrap=True)
    for entry in entries:
        row = entry.row
        table.add_row(
            entry.label,
            percent(row.success_rate),
            _span(row.success_interval),
            percent(row.social_success_rate),
            percent(row.collision_robot_rate, 2),
            percent(row.collision_obstacle_rate, 2),
            percent(row.timeout_rate + row.rotate_in_place_rate),
            number(row.mean_time),
            _paper(row),
        )
    return table


def _priority_table(gains: Sequence[PriorityGain]) -> Table:
    table = _empty(
        f"Priority {HIGH:g} against {LOW:g} (norm-3)", "in brackets: 95 %, over episodes"
    )
    for header in ("scenario", "episodes", "saved (s)", "of its time (%)", "by others (s)"):
        table.add_column(header, justify="left" if header == "scenario" else "right", no_wrap=True)
    for gain in gains:
        table.add_row(*gain_cells(gain))
    return table


def _empty(title: str, caption: str) -> Table:
    return Table(
        title=f"\n[bold]{title}[/]",
        caption=caption,
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=0,  # the box itself leaves a space between columns
    )


def _span(interval: Interval) -> str:
    return f"{100.0 * interval.low:.1f}-{100.0 * interval.high:.1f}"


def _paper(row: TableRow) -> str:
    paper = PAPER_TABLE.get((row.scenario, row.method))
    return "" if paper is None else f"{number(paper.success)}, {number(paper.mean_time)}"
