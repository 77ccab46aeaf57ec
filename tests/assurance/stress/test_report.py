"""The report says what the log holds, whatever the order of its lines."""

import json
from dataclasses import replace
from pathlib import Path

from assurance.stress.case_log import Entries, Run
from assurance.stress.cases import Result
from assurance.stress.kinds import KINDS
from assurance.stress.moments import Failure
from assurance.stress.report import report_json, report_page, sum_of
from safefilter.testing.tally import NOTHING, Tally

COMMITTED = Path(__file__).parents[3] / "docs" / "stress"
RUN = Run(7, 1.0, 1000, 2, "c0de", "abc", "2026-01-01T00:00:00+00:00", "of the test")
WELL = Tally(100, 0, 1e-6, (50, 30, 20), (90, 0, 10, 0, 0, 0, 0, 0), 0, 0, 7)
HIT = replace(WELL, collisions=1, min_clearance=-0.5)
FAILURE = Failure(3, "robots", (1, 2), -0.5)


def result(number: int, kind: str, tally: Tally = WELL) -> Result:
    failures = (FAILURE,) if tally is HIT else ()
    return Result(number, kind, f"number {number}", tally, failures, 0.5)


def entries(*results: Result) -> Entries:
    return Entries((RUN,), {result.number: result for result in results})


def test_counts_of_all_kinds_add_up() -> None:
    report = json.loads(
        report_json(entries(*(result(k, kind.name) for k, kind in enumerate(KINDS))))
    )
    assert list(report["kinds"]) == [kind.name for kind in KINDS]
    total = report["total"]
    for name in ("num_cases", "robot_steps", "collisions", "uncertified", "capped", "cpu_seconds"):
        assert total[name] == sum(kind[name] for kind in report["kinds"].values())
    assert total["robot_steps"] == 100 * len(KINDS)
    assert total["cases"] == {
        name: number * len(KINDS)
        for name, number in {"SAFE": 50, "PROJECTED": 30, "LEAST_VIOLATION": 20}.items()
    }
    assert total["faults"]["BACKEND_RAISED"] == 10 * len(KINDS)
    assert report["failed"] == []
    assert report["runs"][0]["seed"] == 7


def test_it_does_not_depend_on_the_order_of_the_log() -> None:
    some = [result(k, KINDS[k % 3].name) for k in range(7)]
    one, other = entries(*some), entries(*reversed(some))
    assert report_json(one) == report_json(other)
    assert report_page(one) == report_page(other)


def test_a_failure_is_named_with_the_command_that_repeats_it() -> None:
    some = entries(result(0, "crowds"), result(5, "drives", HIT))
    page = report_page(some)
    assert page.startswith("200 robot-steps in 2 cases: 1 collisions, 0 uncertified")
    assert "python -m assurance.stress --seed 7 --case 5" in page
    (failed,) = json.loads(report_json(some))["failed"]
    assert failed["number"] == 5
    assert failed["failures"] == [{"step": 3, "what": "robots", "who": [1, 2], "clearance": -0.5}]


def test_without_a_failure_none_is_told() -> None:
    assert "Failed" not in report_page(entries(result(0, "crowds")))


def test_kinds_without_a_case_and_cases_without_a_neighbour_have_no_figures() -> None:
    alone = entries(result(0, "space", replace(NOTHING, robot_steps=1)))
    report = json.loads(report_json(alone))
    assert list(report["kinds"]) == ["space"]
    assert report["total"]["min_clearance"] is None
    assert "| - |" in report_page(alone)


def test_nothing_sums_to_nothing() -> None:
    assert sum_of([]) == NOTHING


def test_the_report_that_is_committed_says_one_thing_and_names_no_failure() -> None:
    report = json.loads((COMMITTED / "report.json").read_text(encoding="utf-8"))
    first = (COMMITTED / "report.md").read_text(encoding="utf-8").splitlines()[0]
    total = report["total"]
    assert first == (
        f"{total['robot_steps']:,} robot-steps in {total['num_cases']:,} cases: "
        "0 collisions, 0 uncertified actions executed."
    )
    assert total["collisions"] == total["uncertified"] == 0
    assert report["failed"] == []
