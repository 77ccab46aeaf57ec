from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.results import FOLDER, Result, Row, as_markdown, as_table, committed_ratios, save

RESULT = Result(
    name="example",
    title="Something, in us",
    ratio_of="this",
    rows=(
        Row("this", "small", {"p50": 2.0}, 1.0),
        Row("that", "small", {"p50": 3.0, "p99": 4.0}, 1.5),
        Row("that", "large", {"p50": 7.0}),
    ),
    notes=("as it was",),
)


def test_saved_ratios_are_found_again_by_group_and_row(tmp_path: Path) -> None:
    path = save(RESULT, {"processor": "abacus"}, tmp_path)
    assert '"processor": "abacus"' in path.read_text(encoding="utf-8")
    ratios = committed_ratios("example", tmp_path)
    assert ratios == {("small", "this"): 1.0, ("small", "that"): 1.5}


def test_a_benchmark_never_saved_has_no_ratios(tmp_path: Path) -> None:
    assert committed_ratios("example", tmp_path) == {}


def test_a_table_shows_each_ratio_beside_the_committed_one() -> None:
    console = Console(width=100)
    with console.capture() as printed:
        console.print(as_table(RESULT, {("small", "that"): 1.25}))
    line = next(line for line in printed.get().splitlines() if "that" in line)
    cells = [cell.strip() for cell in line.strip("│ ").split("│")]
    assert cells == ["that", "3", "4", "1.50", "1.25"]


def test_markdown_has_one_cell_a_column_in_every_line() -> None:
    lines = [line for line in as_markdown(RESULT).splitlines() if line.startswith("|")]
    assert {line.count("|") for line in lines} == {len(RESULT.columns) + 3}
    assert "| that | 3 | 4 | 1.50 |" in lines


@pytest.mark.parametrize("name", ["circle_step", "drive_mappings", "single_decision", "start_up"])
def test_committed_results_hold_ratios(name: str) -> None:
    ratios = committed_ratios(name, FOLDER)
    assert ratios
    assert all(ratio > 0.0 for ratio in ratios.values())
