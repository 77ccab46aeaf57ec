"""The campaign from its first line to its report, and one case of it alone."""

from __future__ import annotations

import platform
import subprocess
import sys
from contextlib import closing
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from assurance.stress.case_log import CaseLog, LogError, Run, read_log
from assurance.stress.cases import Campaign, Result, draw_case, replay, run_case
from assurance.stress.moments import Failure, Moment
from assurance.stress.processes import drive_cases
from assurance.stress.report import report_json, report_page
from policies.atomic_file import write_atomically
from policies.code_digest import code_digest

ROOT = Path(__file__).parents[2]
LOG, NUMBERS, PAGE = "cases.log", "report.json", "report.md"


def run_campaign(campaign: Campaign, steps: int, processes: int, out: Path) -> int:
    """Drive what is missing of a campaign, and write its report.

    Args:
        campaign: Which one.
        steps: Robot-steps wanted.
        processes: How many drive.
        out: Folder of log and report.

    Returns:
        Exit code: 1 if anything failed.
    """
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[told]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    ]
    console = Console(stderr=True)
    run = this_run(campaign, steps, processes)
    with closing(CaseLog.open(out / LOG, run)) as log, Progress(*columns, console=console) as bar:
        made = sum(result.tally.robot_steps for result in log.entries.results.values())
        failed = sum(result.has_failed for result in log.entries.results.values())
        task = bar.add_task("robot-steps", total=steps, completed=made, told="")
        num_before, time_before = made, datetime.now(UTC)

        def show(result: Result) -> None:
            nonlocal made, failed
            made += result.tally.robot_steps
            failed += result.has_failed
            seconds = (datetime.now(UTC) - time_before).total_seconds()
            pace = (made - num_before) / max(seconds, 1e-9)
            told = f"{made:.3g}, {pace:,.0f}/s, case {result.number}, {failed} failed"
            bar.update(task, completed=made, told=told)
            if result.has_failed:
                console.print(told_of(campaign, result), markup=False, highlight=False)

        drive_cases(log, campaign, processes, show, steps)
    return write_report(out)


def write_report(out: Path) -> int:
    """Write and print the report of the cases that there are, whether or not more are being driven.

    Args:
        out: Folder of log and report.

    Returns:
        Exit code: 1 if anything failed.

    Raises:
        LogError: If the log was altered, or there is none.
    """
    entries = read_log(out / LOG)
    if not entries.runs:
        raise LogError(
            f"{out / LOG}: there is no log here; drive a campaign with --out {out} first"
        )
    write_atomically(out / NUMBERS, report_json(entries).encode())
    write_atomically(out / PAGE, report_page(entries).encode())
    sys.stdout.write(report_page(entries))
    return int(any(result.has_failed for result in entries.results.values()))


def run_one(campaign: Campaign, number: int) -> int:
    """Drive one case, and tell of each failure as it happens; returns 1 if there is one."""
    out = sys.stdout
    out.write(f"case {number} of seed {campaign.seed}: {draw_case(campaign, number).name}\n")

    def watch(moment: Moment) -> None:
        for failure in moment.failures:
            out.write(f"  {_told(failure)}\n")

    result = run_case(campaign, number, watch)
    out.write(f"  {result.tally}\n")
    return int(result.has_failed)


def told_of(campaign: Campaign, result: Result) -> str:
    """What failed in a case, and how to see it again."""
    lines = [
        f"case {result.number} ({result.kind}: {result.name}): {result.tally.collisions} collisions, "
        f"{result.tally.uncertified} uncertified",
        *(f"  {_told(failure)}" for failure in result.failures),
        f"  again: {replay(campaign, result.number)}",
    ]
    return "\n".join(lines)


def _told(failure: Failure) -> str:
    who = ", ".join(map(str, failure.who)) or "unknown"
    return f"step {failure.step}: {failure.what}, who: {who}, clearance {failure.clearance:.3e} m"


def this_run(campaign: Campaign, steps: int, processes: int) -> Run:
    """What is to be known of a run that starts now."""
    return Run(
        seed=campaign.seed,
        scale=campaign.scale,
        steps=steps,
        processes=processes,
        code=code_digest("assurance.stress.cases")[:16],
        commit=_commit(),
        started=datetime.now(UTC).isoformat(timespec="seconds"),
        machine=_machine(),
    )


def _commit() -> str:
    """Of git, with a + if files that it knows were changed; empty without git."""
    command = [
        "git",
        "-C",
        str(ROOT),
        "describe",
        "--always",
        "--abbrev=12",
        "--dirty=+",
        "--exclude=*",
    ]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _machine() -> str:
    names = ("numpy", "numba", "safefilter")
    packages = ", ".join(f"{name} {version(name)}" for name in names)
    return f"{_processor()}, {platform.system()}, Python {platform.python_version()}, {packages}"


def _processor() -> str:
    told = Path("/proc/cpuinfo")
    if told.exists():
        for line in told.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.machine()
