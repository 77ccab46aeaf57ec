"""Run the tests of a file against each of its mutants: ``python -m assurance.mutation``.

A mutant that no test fails for survives: either a test is missing, or the mutant is no mistake. Those that are known to
be none, and why, are in ``docs/testing.md``. Outcomes are kept in ``out/mutants.jsonl``, so that a run goes on where
the last one stopped; delete the file to begin anew. Not part of `make test`: it takes hours.

Kernels are interpreted, and each mutant has a process of its own, forked from one that has imported what is slow to
import.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from pathlib import Path
from types import ModuleType

from assurance.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[1]
REPORT = ROOT / "out" / "mutants.jsonl"
INTERPRETED = {"NUMBA_DISABLE_JIT": "1", "HYPOTHESIS_PROFILE": "coverage"}
# A mutant that makes a loop endless is killed after this, in s.
PATIENCE = 240.0
PROPERTIES = "tests/assurance/test_planted_bugs.py::test_the_filter_as_it_is_passes"

# File, and its tests: the quick ones first, because the first failure ends a run.
TARGETS: dict[str, tuple[str, ...]] = {
    "constraints/responsibility": ("test_responsibility",),
    "constraints/velocity_obstacle": (
        "test_velocity_obstacle_formulas", "test_velocity_obstacle", "test_priority_orca",
    ),
    "constraints/separation": (
        "test_separation", "test_budgets", "test_separation_reach",
    ),
    "constraints/walls": ("test_walls", "test_static_obstacles"),
    "programs/convex_program": ("test_convex_program",),
    "programs/least_violation": ("test_least_violation",),
    "programs/nearest_velocity": ("test_nearest_velocity",),
    "kinematics/arc": ("test_arc",),
    "kinematics/last_word": ("test_last_word",),
    "kinematics/drive_last_word": ("test_drive_last_word", "test_differential_drive"),
}  # fmt: skip


class MutantLoader:
    """Imports one module from other source; a finder and a loader in one."""

    def __init__(self, module: str, path: Path, source: str) -> None:
        self._module, self._path, self._source = module, path, source

    def find_spec(
        self, name: str, _path: object = None, _target: object = None
    ) -> ModuleSpec | None:
        """Answer for that module only."""
        if name != self._module:
            return None
        return spec_from_loader(name, self, origin=str(self._path))  # type: ignore[arg-type]  # a loader by what it does

    def create_module(self, _spec: ModuleSpec) -> ModuleType | None:
        """As Python does."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        """Run the other source."""
        module.__file__ = str(self._path)
        exec(compile(self._source, str(self._path), "exec"), module.__dict__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 1 if a mutant of this run survived."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = argparse.ArgumentParser(prog="python -m assurance.mutation", description=__doc__)
    parser.add_argument("--only", default="", help="files whose name holds this")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this time")
    options = parser.parse_args(given)
    if any(os.environ.get(name) != value for name, value in INTERPRETED.items()):
        command = [sys.executable, "-m", "assurance.mutation", *given]
        return subprocess.run(command, env={**os.environ, **INTERPRETED}, check=False).returncode
    _import_slow_packages()
    REPORT.parent.mkdir(exist_ok=True)
    start, survivors = time.perf_counter(), 0
    for name in TARGETS:
        if options.only not in name:
            continue
        done = _outcomes(name)
        if run_mutant(name, _unchanged(name)) != "survived":
            sys.stdout.write(f"{name}: its tests fail without any mistake in it: mend them first\n")
            return 2
        for key, mutant in _numbered(name):
            if key in done:
                continue
            if time.perf_counter() - start > options.seconds:
                sys.stdout.write("time is up; run it again to go on\n")
                return int(survivors > 0)
            outcome = run_mutant(name, mutant)
            survivors += outcome == "survived"
            _note(name, key, mutant, outcome)
    return int(survivors > 0)


def run_mutant(name: str, mutant: Mutant) -> str:
    """Run the tests of a file against one of its mutants; returns "killed", "survived" or "timed out"."""
    child = os.fork()
    if child == 0:
        _run_tests(name, mutant)
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return "survived" if os.waitstatus_to_exitcode(status) == 0 else "killed"
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "timed out"


def _run_tests(name: str, mutant: Mutant) -> None:
    """Be the process of a mutant; does not return."""
    import pytest  # noqa: PLC0415  # imported before, in the parent

    path = ROOT / "safefilter" / f"{name}.py"
    module = f"safefilter.{name.replace('/', '.')}"
    sys.meta_path.insert(0, MutantLoader(module, path, mutant.source))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    tests = [f"tests/safefilter/{test}.py" for test in TARGETS[name]]
    quiet = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not stress"]
    # Hypothesis is in memory already, so pytest cannot rewrite its asserts.
    quiet += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    os._exit(int(pytest.main([*quiet, *tests, PROPERTIES])))


def _import_slow_packages() -> None:
    """What tests import besides this package, which each mutant imports anew."""
    import clarabel  # noqa: F401, PLC0415
    import gymnasium  # noqa: F401, PLC0415
    import hypothesis.extra.numpy  # noqa: F401, PLC0415
    import numba  # noqa: F401, PLC0415
    import osqp  # noqa: F401, PLC0415
    import pytest  # noqa: F401, PLC0415
    import scipy.optimize  # noqa: F401, PLC0415


def _numbered(name: str) -> list[tuple[str, Mutant]]:
    """Mutants of a file, each under a name that stays while its line does."""
    source = (ROOT / "safefilter" / f"{name}.py").read_text(encoding="utf-8")
    keyed: dict[str, Mutant] = {}
    for mutant in mutants_of(source):
        key = f"{mutant.before} -> {mutant.after}"
        number = sum(other.startswith(f"{mutant.line}: {key}") for other in keyed)
        keyed[f"{mutant.line}: {key}" + (f" ({number + 1})" if number else "")] = mutant
    return list(keyed.items())


def _unchanged(name: str) -> Mutant:
    source = (ROOT / "safefilter" / f"{name}.py").read_text(encoding="utf-8")
    return Mutant(0, "nothing", "nothing", source)


def _outcomes(name: str) -> set[str]:
    if not REPORT.exists():
        return set()
    lines = map(json.loads, REPORT.read_text(encoding="utf-8").splitlines())
    return {line["mutant"] for line in lines if line["file"] == name}


def _note(name: str, key: str, mutant: Mutant, outcome: str) -> None:
    with REPORT.open("a", encoding="utf-8") as report:
        report.write(json.dumps({"file": name, "mutant": key, "outcome": outcome}) + "\n")
    if outcome == "survived":
        sys.stdout.write(f"{name}.py:{mutant.line}: {mutant.before}  ->  {mutant.after}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
