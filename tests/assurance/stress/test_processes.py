"""Killed at any moment, by a signal that nobody can catch, a campaign goes on without losing or repeating a case."""

import multiprocessing
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from assurance.stress.campaign import LOG, this_run
from assurance.stress.case_log import CaseLog, read_log
from assurance.stress.cases import Campaign, Result
from assurance.stress.kinds import CYCLE
from assurance.stress.processes import Crew, Driver, DriverDied, drive_cases
from safefilter.errors import OutOfRange
from safefilter.testing.tally import NOTHING

ROOT = Path(__file__).parents[3]
SMALL = Campaign(seed=1, scale=0.005)
PATIENCE = 300.0
COMMAND = [
    sys.executable, "-m", "assurance.stress", "--seed", "1", "--scale", "0.005", "--steps", "1", "--processes", "2",
]  # fmt: skip


def num_lines(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def kill_after(num_cases: int, out: Path) -> None:
    """Begin, or go on with, a campaign, and kill it when so many lines are added to its log."""
    wanted = num_lines(out / LOG) + num_cases
    process = subprocess.Popen([*COMMAND, "--out", str(out)], cwd=ROOT, stderr=subprocess.DEVNULL)
    begun = time.monotonic()
    while num_lines(out / LOG) < wanted:
        assert process.poll() is None, "it ended before it could be killed"
        assert time.monotonic() - begun < PATIENCE
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.wait()


@pytest.mark.stress
def test_killed_twice_it_drives_every_case_once_and_the_same(tmp_path: Path) -> None:
    kill_after(4, tmp_path)
    # Beyond the cases of which each kind has one here: two processes are in the middle of cases.
    kill_after(12, tmp_path)
    before = read_log(tmp_path / LOG)
    assert 10 <= len(before.results) < len(CYCLE)
    done = subprocess.run(
        [*COMMAND, "--out", str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    after = read_log(tmp_path / LOG)
    assert sorted(after.results) == list(range(len(CYCLE)))
    assert len(after.runs) == 3
    assert f"{len(CYCLE)} cases: 0 collisions, 0 uncertified" in done.stdout
    # What was there is still there, and what was interrupted came out as in a campaign that nobody killed.
    assert {k: after.results[k] for k in before.results} == before.results
    drive(tmp_path / "whole", SMALL)
    whole = read_log(tmp_path / "whole").results
    assert {k: replace(result, seconds=0.0) for k, result in whole.items()} == {
        k: replace(result, seconds=0.0) for k, result in after.results.items()
    }


def drive(path: Path, campaign: Campaign, steps: int = 1) -> list[Result]:
    told: list[Result] = []
    log = CaseLog.open(path, this_run(campaign, steps, 1))
    drive_cases(log, campaign, 1, told.append, steps)
    log.close()
    return told


def made_up(campaign: Campaign, number: int) -> Result:
    tally = replace(NOTHING, robot_steps=10 + campaign.seed)
    return Result(number, CYCLE[number % len(CYCLE)], "made up", tally, (), 0.0)


@pytest.fixture
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cases that take no time: who hands out which number is the same."""
    monkeypatch.setattr("assurance.stress.processes.run_case", made_up)


@pytest.mark.usefixtures("_quick")
def test_cases_come_in_order_until_there_are_steps_enough(tmp_path: Path) -> None:
    steps = 20 * len(CYCLE)
    told = drive(tmp_path / "log", Campaign(0), steps)
    assert sorted(result.number for result in told) == list(range(2 * len(CYCLE)))
    # One of each kind, then in order.
    kinds = [result.kind for result in told[: len(set(CYCLE))]]
    assert set(kinds) == set(CYCLE)
    rest = [result.number for result in told[len(kinds) :]]
    assert rest == sorted(rest)
    assert drive(tmp_path / "log", Campaign(0), steps) == []
    more = drive(tmp_path / "log", Campaign(0), steps + 11)
    assert [result.number for result in more] == [2 * len(CYCLE), 2 * len(CYCLE) + 1]


@pytest.mark.usefixtures("_quick")
def test_a_cycle_is_driven_however_few_steps_are_wanted(tmp_path: Path) -> None:
    assert len(drive(tmp_path / "log", Campaign(0))) == len(CYCLE)


@pytest.mark.usefixtures("_quick")
def test_gaps_that_a_kill_left_are_filled_even_if_there_are_steps_enough(tmp_path: Path) -> None:
    campaign = Campaign(0)
    log = CaseLog.open(tmp_path / "log", this_run(campaign, 1, 2))
    last = 3 * len(CYCLE)
    for number in range(last + 1):
        if number not in {5, last - 1}:
            log.note(made_up(campaign, number))
    log.close()
    assert [result.number for result in drive(tmp_path / "log", campaign)] == [5, last - 1]


@pytest.mark.parametrize("has_begun", [False, True])
def test_a_driver_that_dies_is_told_with_its_case(*, has_begun: bool) -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=sys.exit, args=(3,))
    process.start()
    theirs.close()
    crew = Crew(SMALL, (Driver(process, ours),))
    if not has_begun:
        process.join()
    crew.begin(5)
    assert not crew.has_room
    with pytest.raises(DriverDied, match=r"case 5 ended with exit code 3.*--scale 0.005 --case 5"):
        list(crew.finished())


def test_nobody_cannot_drive(tmp_path: Path) -> None:
    log = CaseLog.open(tmp_path / "log", this_run(SMALL, 1, 0))
    with pytest.raises(OutOfRange, match="processes: expected 1 or more, got 0"):
        drive_cases(log, SMALL, 0, lambda _: None, 1)
    log.close()
