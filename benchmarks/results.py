"""Results: rows of numbers, kept as JSON beside this file and shown as tables, next to those that are committed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.table import Table

FOLDER = Path(__file__).parent / "results"
MISSING = "-"


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a benchmark.

    Attributes:
        name: What was timed; with ``group`` it tells the row from all others.
        group: What it is compared within.
        numbers: Times by name, in the unit of the benchmark.
        ratio: Time over that of the row it is compared with, or None.
    """

    name: str
    group: str
    numbers: dict[str, float]
    ratio: float | None = None


@dataclass(frozen=True, slots=True)
class Result:
    """What one benchmark found.

    Attributes:
        name: Name of the file that it is kept in.
        title: A sentence on what is timed, and in which unit.
        ratio_of: What the ratio is a ratio of.
        rows: Lines, in order.
        notes: How it was measured.
    """

    name: str
    title: str
    ratio_of: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @property
    def columns(self) -> list[str]:
        """Names of the numbers, in order of appearance."""
        return list(dict.fromkeys(name for row in self.rows for name in row.numbers))

    def cells(self, row: Row) -> list[str]:
        """Numbers of a row as they are shown."""
        numbers = [row.numbers.get(column) for column in self.columns]
        return [MISSING if number is None else f"{number:.4g}" for number in numbers]


def save(result: Result, machine: Mapping[str, str], folder: Path = FOLDER) -> Path:
    """Write a result, and what it ran on."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{result.name}.json"
    text = json.dumps({"machine": dict(machine), **asdict(result)}, indent=1)
    path.write_text(text + "\n", encoding="utf-8")
    return path


def committed_ratios(name: str, folder: Path = FOLDER) -> dict[tuple[str, str], float]:
    """Ratios of the result that is kept under a name, by (group, row); empty if there is none."""
    path = folder / f"{name}.json"
    if not path.exists():
        return {}
    rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    return {(row["group"], row["name"]): row["ratio"] for row in rows if row["ratio"] is not None}


def as_table(result: Result, committed: Mapping[tuple[str, str], float]) -> Table:
    """Show a result, each ratio beside the one that is committed."""
    table = Table(title=result.title, title_justify="left", caption="\n".join(result.notes))
    table.caption_justify = "left"
    table.add_column("")
    for column in (*result.columns, f"ratio to {result.ratio_of}", "committed"):
        table.add_column(column, justify="right")
    group = None
    for row in result.rows:
        if row.group != group:
            table.add_section()
            table.add_row(f"[bold]{row.group}")
            group = row.group
        before = committed.get((row.group, row.name))
        table.add_row(row.name, *result.cells(row), _ratio(row.ratio), _ratio(before))
    return table


def as_markdown(result: Result) -> str:
    """Write a result as Markdown."""
    head = ["", *result.columns, f"ratio to {result.ratio_of}"]
    lines = [f"## {result.title}", "", _line(head), _line(["---", *["---:"] * (len(head) - 1)])]
    group = None
    for row in result.rows:
        if row.group != group:
            lines.append(_line([f"**{row.group}**", *[""] * (len(head) - 1)]))
            group = row.group
        lines.append(_line([row.name, *result.cells(row), _ratio(row.ratio)]))
    return "\n".join([*lines, "", *(f"* {note}" for note in result.notes), ""])


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _ratio(ratio: float | None) -> str:
    return MISSING if ratio is None else f"{ratio:.2f}"
