"""Results: rows of numbers, kept as JSON beside this file and shown as tables, next to those that are committed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
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
        series: What is drawn rather than shown in a table, by name.
    """

    name: str
    title: str
    ratio_of: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    series: dict[str, list[float]] = field(default_factory=dict)

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
    kept = {"machine": dict(machine), **asdict(result)}
    series = kept.pop("series")
    text = json.dumps(kept, indent=1)
    if series:
        # On one line: nobody reads them.
        text = f'{text[:-2]},\n "series": {json.dumps(series)}\n}}'
    path.write_text(text + "\n", encoding="utf-8")
    return path


def committed_ratios(name: str, folder: Path = FOLDER) -> dict[tuple[str, str], float]:
    """Ratios of the result that is kept under a name, by (`group_key`, row); empty if there is none."""
    path = folder / f"{name}.json"
    if not path.exists():
        return {}
    rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    return {
        (group_key(row["group"]), row["name"]): row["ratio"]
        for row in rows
        if row["ratio"] is not None
    }


def group_key(group: str) -> str:
    """What a group is, without what was found out about it, which stands in brackets and may change a little."""
    return group.split(" (", maxsplit=1)[0]


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
        before = committed.get((group_key(row.group), row.name))
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


def read_result(path: Path) -> tuple[Result, dict[str, str]]:
    """Read what `save` wrote: the result, without its series, and the machine."""
    kept = json.loads(path.read_text(encoding="utf-8"))
    machine, _ = kept.pop("machine"), kept.pop("series", None)
    kept["rows"] = tuple(Row(**row) for row in kept["rows"])
    kept["notes"] = tuple(kept["notes"])
    return Result(**kept), machine


def all_tables(names: Iterable[str], folder: Path = FOLDER) -> str:
    """Write the results that are kept as one page of Markdown, each with its machine and date."""
    parts = ["# Benchmarks\n\nMade by `python -m benchmarks --save`, some with `--only NAME`.\n"]
    for name in names:
        path = folder / f"{name}.json"
        if path.exists():
            result, machine = read_result(path)
            about = ", ".join(f"{part} {value}" for part, value in machine.items())
            parts.append(f"{as_markdown(result)}\n* `{name}`: {about}.\n")
    return "\n".join(parts)


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _ratio(ratio: float | None) -> str:
    """Two decimals, and for small ratios two digits: a regression must show."""
    if ratio is None:
        return MISSING
    return f"{ratio:.2f}" if ratio >= 0.1 else f"{ratio:.2g}"
