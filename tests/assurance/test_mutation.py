"""The runner loads what it is told to, in place of the file; every target and every test of it exists."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

from assurance import mutation
from assurance.mutants import Mutant
from assurance.mutation import TARGETS, MutantLoader, run_mutant

ROOT = Path(__file__).parents[2]


def test_targets_and_their_tests_exist() -> None:
    for name, tests in TARGETS.items():
        assert (ROOT / "safefilter" / f"{name}.py").exists(), name
        for test in tests:
            assert (ROOT / "tests" / "safefilter" / f"{test}.py").exists(), test


def test_one_module_is_imported_from_other_source(tmp_path: Path) -> None:
    loader = MutantLoader("made_up_module", tmp_path / "made_up_module.py", "value = 3 + 4\n")
    sys.meta_path.insert(0, loader)
    try:
        made_up_module = import_module("made_up_module")
        assert made_up_module.value == 7
        assert loader.find_spec("another_module") is None
    finally:
        sys.meta_path.remove(loader)
        sys.modules.pop("made_up_module", None)


@pytest.mark.parametrize(("rc", "outcome"), [(0, "survived"), (1, "killed")])
def test_a_mutant_that_fails_no_test_survives(
    rc: int, outcome: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os  # noqa: PLC0415  # for the process of the mutant

    monkeypatch.setattr(mutation, "_run_tests", lambda *_: os._exit(rc))
    assert run_mutant("kinematics/arc", Mutant(1, "", "", "")) == outcome


def test_a_mutant_that_never_ends_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    import time  # noqa: PLC0415  # for the process of the mutant

    monkeypatch.setattr(mutation, "PATIENCE", 0.3)
    monkeypatch.setattr(mutation, "_run_tests", lambda *_: time.sleep(60.0))
    assert run_mutant("kinematics/arc", Mutant(1, "", "", "")) == "timed out"
