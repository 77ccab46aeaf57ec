import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.results import (
    FOLDER,
    Result,
    Row,
    all_tables,
    as_markdown,
    as_table,
    committed_ratios,
    read_result,
    save,
)

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


def test_what_was_found_out_about_a_group_does_not_hide_its_ratios(tmp_path: Path) -> None:
    rows = (Row("this", "10 robots (4.9 neighbours)", {}, 0.0031),)
    save(replace(RESULT, rows=rows), {}, tmp_path)
    committed = committed_ratios("example", tmp_path)
    assert committed == {("10 robots", "this"): 0.0031}
    now = replace(RESULT, rows=(replace(rows[0], group="10 robots (5.0 neighbours)"),))
    console = Console(width=100)
    with console.capture() as printed:
        console.print(as_table(now, committed))
    # A ratio below a tenth keeps two digits, or a regression would not show.
    line = next(line for line in printed.get().splitlines() if line.startswith("│ this"))
    assert line.count("0.0031") == 2


def test_tables_are_made_of_all_that_is_kept(tmp_path: Path) -> None:
    path = save(replace(RESULT, series={"us": [1.0]}), {"processor": "abacus"}, tmp_path)
    assert read_result(path) == (RESULT, {"processor": "abacus"})
    page = all_tables(["missing", "example"], tmp_path)
    assert as_markdown(RESULT) in page
    assert "* `example`: processor abacus." in page


def test_series_are_kept_with_the_result(tmp_path: Path) -> None:
    path = save(replace(RESULT, series={"us": [1.0, 2.0]}), {"processor": "abacus"}, tmp_path)
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert kept["series"] == {"us": [1.0, 2.0]}
    assert kept["machine"] == {"processor": "abacus"}
    assert "series" not in json.loads(save(RESULT, {}, tmp_path).read_text(encoding="utf-8"))


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


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.json")))
def test_committed_results_hold_ratios(name: str) -> None:
    ratios = committed_ratios(name, FOLDER)
    assert ratios
    assert all(ratio > 0.0 for ratio in ratios.values())
