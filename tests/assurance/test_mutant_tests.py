"""A mistake is noticed by a test that fails, one without a test survives, one without an end is stopped."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from assurance.mutant_tests import Run, choose_tests, lines_of_statement

SOURCE = """\
LIMIT = 2


def count(number):
    total = 0
    while total < number:
        total = (
            total + 1
        )
    return total


def untested(number):
    return number + 1
"""
TESTS = """
from made_up_module import count

def test_count():
    assert count(3) == 3

def test_nothing():
    pass
"""
RUN = """
import sys
import pytest
from assurance import mutant_tests
from assurance.mutants import mutants_of
mutant_tests.PATIENCE = 1.0
source = open("made_up_module.py").read()
mutants = {f"{m.line}: {m.after}": m for m in mutants_of(source)}
def note(key, outcome):
    sys.__stderr__.write(f"{key} = {outcome}\\n")
    return True
tests = mutant_tests.MutantTests("made_up_module", mutants, note)
pytest.main(["-p", "no:terminal", "-p", "no:cacheprovider", "test_made_up.py"], plugins=[tests])
sys.__stderr__.write(f"failing: {tests.failing}\\n")
"""
ROOT = Path(__file__).parents[2]


def run_mutants(folder: Path, tests: str) -> str:
    (folder / "made_up_module.py").write_text(SOURCE, encoding="utf-8")
    (folder / "test_made_up.py").write_text(tests, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", RUN],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}"},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return run.stderr


def test_mutants_are_killed_survive_or_are_stopped(tmp_path: Path) -> None:
    said = run_mutants(tmp_path, TESTS)
    assert "6: total <= number = killed" in said
    assert "5: 1 = survived" in said  # counting from 1 comes to 3 as well
    assert "8: total - 1 = timed out" in said
    assert "14: number - 1 = survived" in said
    assert "failing: \n" in said


def test_tests_that_fail_without_a_mistake_are_named(tmp_path: Path) -> None:
    said = run_mutants(tmp_path, TESTS + "\ndef test_wrong():\n    assert count(3) == 4\n")
    assert "failing: test_made_up.py::test_wrong" in said
    assert " = " not in said


def test_lines_of_a_statement() -> None:
    assert lines_of_statement(SOURCE, 8) == {7, 8, 9}
    assert lines_of_statement(SOURCE, 6) == {6}
    assert lines_of_statement(SOURCE, 1) == frozenset()


class Item:
    def __init__(self, nodeid: str) -> None:
        self.nodeid = nodeid


def test_tests_that_come_to_a_line_are_chosen_quick_ones_first() -> None:
    runs = {
        "a": Run(True, 3.0, frozenset({1, 2})),
        "b": Run(True, 1.0, frozenset({2})),
        "c": Run(True, 2.0, frozenset({3})),
    }
    items: list[pytest.Item] = [Item(name) for name in runs]  # type: ignore[misc]  # as much of one as is needed
    chosen = choose_tests(items, runs, frozenset({2, 9}))
    assert [item.nodeid for item in chosen] == ["b", "a"]
    assert len(choose_tests(items, runs, frozenset())) == 3
