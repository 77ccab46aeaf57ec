"""Whatever stops a campaign, its log holds whole cases, each once; whatever else is in it is refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from assurance.stress.case_log import CaseLog, Entries, LogError, Run, line_of, read_log
from assurance.stress.cases import Result
from assurance.stress.moments import Failure
from safefilter.testing.tally import NOTHING, Tally

RUN = Run(
    seed=3,
    scale=1.0,
    steps=1000,
    processes=2,
    code="c0de",
    commit="abc",
    started="2026-01-01T00:00:00+00:00",
    machine="of the test",
)
FAILURE = Failure(step=4, what="robots", who=(1, 2), clearance=-0.25)
TALLY = Tally(100, 1, -0.25, (50, 30, 20), (90, 0, 10, 0, 0, 0, 0, 0), 2, 0, 7)


def result(number: int, tally: Tally = TALLY) -> Result:
    return Result(number, "crowds", "ramming, 2 robots", tally, (FAILURE,), 1.25)


def written(path: Path, *numbers: int) -> bytes:
    log = CaseLog.open(path, RUN)
    for number in numbers:
        log.note(result(number))
    log.close()
    return path.read_bytes()


def test_what_was_noted_is_read_again(tmp_path: Path) -> None:
    written(tmp_path / "deep" / "log", 0, 2)
    assert read_log(tmp_path / "deep" / "log") == Entries((RUN,), {0: result(0), 2: result(2)})


def test_a_log_that_is_not_there_is_empty(tmp_path: Path) -> None:
    assert read_log(tmp_path / "log") == Entries((), {})


def test_nobody_near_comes_back_as_nobody_near(tmp_path: Path) -> None:
    log = CaseLog.open(tmp_path / "log", RUN)
    log.note(result(0, replace(NOTHING, robot_steps=1)))
    log.close()
    assert read_log(tmp_path / "log").results[0].tally.min_clearance == math.inf


@given(st.integers(0, 2000))
def test_a_log_that_is_cut_anywhere_holds_the_whole_lines_before(
    tmp_path_factory: pytest.TempPathFactory, length: int
) -> None:
    path = tmp_path_factory.mktemp("cut") / "log"
    content = written(path, 0, 1, 2)
    cut = content[: min(length, len(content))]
    path.write_bytes(cut)
    whole = max(0, cut.count(b"\n") - 1)
    assert sorted(read_log(path).results) == list(range(whole))
    # Opened again, it goes on at the end of them, and the case that was cut can be noted again.
    log = CaseLog.open(path, RUN)
    log.note(result(whole))
    log.close()
    assert sorted(read_log(path).results) == list(range(whole + 1))


@given(st.integers(0, 10_000), st.integers(1, 255))
def test_a_byte_that_was_altered_is_found(
    tmp_path_factory: pytest.TempPathFactory, place: int, change: int
) -> None:
    path = tmp_path_factory.mktemp("altered") / "log"
    content = bytearray(written(path, 0, 1))
    # The last line may end anywhere: what was altered is then a line that was cut.
    end = content.rindex(b"\n", 0, len(content) - 1)
    content[place % end] ^= change
    path.write_bytes(bytes(content))
    with pytest.raises(LogError, match=r"line \d: was altered"):
        read_log(path)


def test_a_number_changed_by_hand_is_found(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(written(path, 0).replace(b'"collisions":1', b'"collisions":0'))
    with pytest.raises(LogError, match="line 2: was altered"):
        CaseLog.open(path, RUN)


def test_a_case_that_is_there_twice_is_found(tmp_path: Path) -> None:
    path = tmp_path / "log"
    content = written(path, 0)
    path.write_bytes(content + content.splitlines(keepends=True)[1])
    with pytest.raises(LogError, match="line 3: case 0 is there a second time"):
        read_log(path)


def test_cases_without_a_run_are_nobodys(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(line_of({"case": result(0).as_json()}))
    with pytest.raises(LogError, match="the line of the run"):
        read_log(path)


@pytest.mark.parametrize("change", [{"seed": 4}, {"scale": 0.5}, {"code": "other"}])
def test_another_campaign_does_not_go_on_with_it(tmp_path: Path, change: dict[str, object]) -> None:
    written(tmp_path / "log", 0)
    (what,) = change
    with pytest.raises(LogError, match=f"holds cases of {what}"):
        CaseLog.open(tmp_path / "log", replace(RUN, **change))  # type: ignore[arg-type]  # a field and its value


def test_more_steps_and_other_processes_go_on_with_it(tmp_path: Path) -> None:
    written(tmp_path / "log", 0)
    later = replace(RUN, steps=10**9, processes=1, commit="def")
    log = CaseLog.open(tmp_path / "log", later)
    log.close()
    assert log.entries.runs == (RUN, later)
    assert sorted(log.entries.results) == [0]


def test_two_do_not_write_one_log(tmp_path: Path) -> None:
    first = CaseLog.open(tmp_path / "log", RUN)
    with pytest.raises(LogError, match="another campaign is writing"):
        CaseLog.open(tmp_path / "log", RUN)
    first.close()
    CaseLog.open(tmp_path / "log", RUN).close()


def test_lines_are_json_after_their_digest(tmp_path: Path) -> None:
    for line in written(tmp_path / "log", 0).splitlines():
        assert isinstance(json.loads(line.split(b" ", 1)[1]), dict)
