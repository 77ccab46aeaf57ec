"""Run the tests of a file against each of its mutants: ``python -m assurance.mutation``.

A mutant that no test fails for survives: either a test is missing, or the mutant is no mistake. Those that are known to
be none, and why, are in ``docs/testing.md``. Outcomes are kept in ``out/mutants.jsonl``, so that a run goes on where
the last one stopped; delete the file to begin anew. Not part of `make test`: it takes an hour or more.

The tests of a file are collected once, and run once without any mistake, to see how long each takes and which lines it
comes to. Each mutant then has a process of its own, forked from there: the mistake is put in place
(`assurance.swapping`), and the tests that come to its line run, quick ones first, until one fails. Kernels are
interpreted, and Hypothesis neither shrinks nor remembers what it finds.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from assurance.mutant_tests import MutantTests
from assurance.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[1]
REPORT = ROOT / "out" / "mutants.jsonl"
INTERPRETED = {"NUMBA_DISABLE_JIT": "1", "HYPOTHESIS_PROFILE": "mutants"}
PROPERTIES = "tests/assurance/test_planted_bugs.py::test_the_filter_as_it_is_passes"

# File, and its tests.
TARGETS: dict[str, tuple[str, ...]] = {
    "constraints/responsibility": ("test_responsibility", "test_priority_orca_shares"),
    "constraints/velocity_obstacle": (
        "test_velocity_obstacle_formulas", "test_velocity_obstacle", "test_priority_orca",
    ),
    "constraints/separation": (
        "test_separation", "test_budgets", "test_separation_reach", "test_separation_rows", "test_margins",
        "test_uncertain_loop",
    ),
    "constraints/walls": (
        "test_walls", "test_wall_boxes", "test_static_obstacles", "test_margins", "test_outlines",
    ),
    "wall_boxes": ("test_wall_boxes", "test_walls"),
    "programs/convex_program": ("test_convex_program",),
    "programs/least_violation": ("test_least_violation",),
    "programs/nearest_velocity": ("test_nearest_velocity",),
    "kinematics/arc": ("test_arc",),
    "kinematics/last_word": ("test_last_word",),
    "kinematics/drive_last_word": ("test_drive_last_word", "test_differential_drive"),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 1 if a mutant of this run survived, 2 if tests fail without any."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = argparse.ArgumentParser(prog="python -m assurance.mutation", description=__doc__)
    parser.add_argument("--only", default="", help="files whose name holds this")
    parser.add_argument("--sample", type=float, default=1.0, help="part of the mutants to run")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this time")
    options = parser.parse_args(given)
    if any(os.environ.get(name) != value for name, value in INTERPRETED.items()):
        command = [sys.executable, "-m", "assurance.mutation", *given]
        return subprocess.run(command, env={**os.environ, **INTERPRETED}, check=False).returncode
    REPORT.parent.mkdir(exist_ok=True)
    end = time.monotonic() + options.seconds
    worst = 0
    for name in TARGETS:
        drawn = random.Random(f"{options.seed} {name}")
        left = {
            key: mutant
            for key, mutant in numbered(name).items()
            if drawn.random() < options.sample and key not in outcomes(name)
        }
        if options.only in name and left and time.monotonic() < end:
            worst = max(worst, _in_a_process_of_its_own(name, left, end))
    return worst


def _in_a_process_of_its_own(name: str, left: dict[str, Mutant], end: float) -> int:
    """Run mutants of one file: what its tests import and collect is gone afterwards."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        # Whatever happens, this process must not go on as its parent does.
        worst = 2
        try:
            worst = _run_mutants(name, left, end)
        finally:
            sys.stdout.flush()
            os._exit(worst)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status)


def _run_mutants(name: str, left: dict[str, Mutant], end: float) -> int:
    survivors: list[str] = []

    def note(key: str, outcome: str) -> bool:
        if outcome == "survived":
            survivors.append(key)
        _note(name, key, outcome)
        return time.monotonic() < end

    tests = MutantTests(f"safefilter.{name.replace('/', '.')}", left, note)
    files = [f"tests/safefilter/{test}.py" for test in TARGETS[name]]
    quiet = ["-p", "no:terminal", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not stress"]
    pytest.main([*quiet, *files, PROPERTIES], plugins=[tests])
    if tests.failing:
        sys.stdout.write(f"{name}: {tests.failing} fails without any mistake: mend it first\n")
        return 2
    return int(bool(survivors))


def numbered(name: str) -> dict[str, Mutant]:
    """Mutants of a file, each under a name that stays while its line does."""
    source = (ROOT / "safefilter" / f"{name}.py").read_text(encoding="utf-8")
    keyed: dict[str, Mutant] = {}
    for mutant in mutants_of(source):
        key = f"{mutant.line}: {mutant.before} -> {mutant.after}"
        number = sum(other == key or other.startswith(f"{key} (") for other in keyed)
        keyed[key + (f" ({number + 1})" if number else "")] = mutant
    return keyed


def outcomes(name: str) -> dict[str, str]:
    """What is known of the mutants of a file."""
    if not REPORT.exists():
        return {}
    lines = map(json.loads, REPORT.read_text(encoding="utf-8").splitlines())
    return {line["mutant"]: line["outcome"] for line in lines if line["file"] == name}


def _note(name: str, key: str, outcome: str) -> None:
    with REPORT.open("a", encoding="utf-8") as report:
        report.write(json.dumps({"file": name, "mutant": key, "outcome": outcome}) + "\n")
    if outcome != "killed":
        sys.stdout.write(f"{name}.py:{key}: {outcome}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
