"""The report of a campaign: a function of its log, and of nothing else."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any

from assurance.stress.case_log import Entries, Run
from assurance.stress.cases import Campaign, Result, replay
from assurance.stress.kinds import KINDS, Kind
from safefilter.decision import Case, Fault
from safefilter.testing.tally import NOTHING, Tally


def report_json(entries: Entries) -> str:
    """All counts, kind by kind, as JSON."""
    report = {
        "runs": [asdict(run) for run in entries.runs],
        "total": _counts(list(entries.results.values())),
        "kinds": {
            kind.name: {"what": kind.what, **_counts(_of_kind(entries, kind))}
            for kind in KINDS
            if _of_kind(entries, kind)
        },
        "failed": [
            result.as_json() for _, result in sorted(entries.results.items()) if result.has_failed
        ],
    }
    return json.dumps(report, indent=1, allow_nan=False) + "\n"


def report_page(entries: Entries) -> str:
    """The same to be read, as Markdown."""
    results = [result for _, result in sorted(entries.results.items())]
    failed = [result for result in results if result.has_failed]
    total = sum_of(results)
    lines = [
        f"{total.robot_steps:,} robot-steps in {len(results):,} cases: "
        f"{total.collisions} collisions, {total.uncertified} uncertified actions executed.",
        "",
        "| kind | cases | robot-steps | Case-1 | Case-2 | Case-3 | cut by the last word | collisions | uncertified "
        "| least clearance, m | faults answered | CPU s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
        *(_row(kind.name, _of_kind(entries, kind)) for kind in KINDS if _of_kind(entries, kind)),
        _row("all", results),
        "",
        *(f"* {kind.name}: {kind.what}." for kind in KINDS if _of_kind(entries, kind)),
        "",
        *_answered(total),
        "",
        *(_told(run) for run in entries.runs),
    ]
    if failed:
        lines += ["", "Failed:", "", *(_failure(result, entries.runs[-1]) for result in failed)]
    return "\n".join(lines) + "\n"


def sum_of(results: list[Result]) -> Tally:
    """Counts of cases together."""
    return sum((result.tally for result in results), NOTHING)


def _of_kind(entries: Entries, kind: Kind) -> list[Result]:
    return [result for _, result in sorted(entries.results.items()) if result.kind == kind.name]


def _counts(results: list[Result]) -> dict[str, Any]:
    tally = sum_of(results)
    record = asdict(tally)
    record["min_clearance"] = _finite(tally.min_clearance)
    record["cases"] = {case.name: tally.cases[k] for k, case in enumerate(Case)}
    record["faults"] = {fault.name: tally.faults[fault] for fault in Fault}
    seconds = round(math.fsum(result.seconds for result in results), 1)
    return {"num_cases": len(results), **record, "cpu_seconds": seconds}


def _finite(clearance: float) -> float | None:
    return clearance if math.isfinite(clearance) else None


def _row(name: str, results: list[Result]) -> str:
    tally = sum_of(results)
    cases = " | ".join(f"{number:,}" for number in tally.cases)
    clearance = f"{tally.min_clearance:.1e}" if math.isfinite(tally.min_clearance) else "-"
    seconds = math.fsum(result.seconds for result in results)
    return (
        f"| {name} | {len(results):,} | {tally.robot_steps:,} | {cases} | {tally.capped:,} | {tally.collisions} "
        f"| {tally.uncertified} | {clearance} | {tally.num_faults:,} | {seconds:,.0f} |"
    )


def _answered(total: Tally) -> list[str]:
    return [
        f"* {fault.name}: {total.faults[fault]:,} decisions."
        for fault in Fault
        if fault is not Fault.NONE and total.faults[fault] > 0
    ]


def _told(run: Run) -> str:
    scale = "" if run.scale == 1.0 else f" --scale {run.scale}"
    return (
        f"`python -m assurance.stress --steps {run.steps:g} --seed {run.seed}{scale} --processes {run.processes}`, "
        f"begun {run.started}, commit {run.commit or 'unknown'}, code {run.code}, on {run.machine}."
    )


def _failure(result: Result, run: Run) -> str:
    return (
        f"* case {result.number}, {result.kind}, {result.name}: {result.tally.collisions} collisions, "
        f"{result.tally.uncertified} uncertified; `{replay(Campaign(run.seed, run.scale), result.number)}`"
    )
