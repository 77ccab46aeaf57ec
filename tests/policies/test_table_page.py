import csv
import io
import json
from collections.abc import Callable

import numpy as np
import pytest

from envs.robot_results import RobotResults
from envs.table_row import TableRow
from policies.table_page import BEGIN, END, HEADERS, csv_text, filled, json_text, page
from policies.table_rows import Entry, Outcome, TimeGain
from safefilter.errors import InvalidInput

MakeResults = Callable[[list[float]], RobotResults]


def entry(results: RobotResults, seeds: tuple[int, ...] = (1, 2, 3)) -> Entry:
    return Entry(TableRow.of("crossroad", "srl-orca", results), "SRL-ORCA, ours", seeds, 7)


def test_rows_go_into_json_and_csv_alike(results_of: MakeResults) -> None:
    entries = [entry(results_of([20.0, 22.0])), entry(results_of([np.inf]))]
    rows = json.loads(json_text(entries))
    assert rows[0]["scenario"] == "crossroad"
    assert rows[0]["success_rate"] == 1.0
    assert rows[1]["mean_time"] is None
    assert {
        "social_success_rate",
        "collision_robot_rate",
        "collision_obstacle_rate",
        "timeout_rate",
    } <= set(rows[0])
    lines = list(csv.DictReader(io.StringIO(csv_text(entries))))
    assert float(lines[0]["mean_time"]) == rows[0]["mean_time"]
    assert lines[1]["mean_time"] == ""
    assert lines[0]["training_seeds"] == "1 2 3"
    assert csv_text([]) == ""


def test_a_page_shows_every_row_under_as_many_headers(results_of: MakeResults) -> None:
    shown = entry(results_of([20.0, np.inf]))
    gain = TimeGain(0.2, 30.0, 25.0, (0.1, 0.2, 0.3))
    text = page(
        Outcome((shown,), (shown,), gain),
        [],
        command="make table",
        missing=["no weights of drl-cf"],
    )
    assert (
        "`make table`: 2 episodes a row, of seed 7; policies of the training seeds 1, 2, 3" in text
    )
    (row,) = (line for line in text.splitlines() if line.startswith("| SRL-ORCA, ours | 50.00"))
    assert row.count("|") == len(HEADERS) + 1
    assert "| 90.7, -, 2.7, 3.3, 1.3, 2.0, 27.9 |" in row
    assert "| 30.0 |" in row
    assert "(t_NH - t_SRL) / t_SRL = 20.0 %" in text
    assert "* no weights of drl-cf" in text
    widths = {
        line.count("|")
        for line in text.splitlines()
        if line.startswith("| ") and "crossroad" in line
    }
    assert len(widths) == 1


def test_a_table_is_filled_in_between_its_marks_alone() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    once = filled(text, "new", "page")
    assert once == f"before\n{BEGIN}\n\nnew\n{END}\nafter\n"
    assert filled(once, "new", "page") == once


@pytest.mark.parametrize("text", ["", BEGIN, f"{END}\n{BEGIN}", f"{BEGIN}\n{BEGIN}\n{END}"])
def test_a_page_without_a_place_for_it_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="page: expected one line '<!-- table: begin -->'"):
        filled(text, "new", "page")
