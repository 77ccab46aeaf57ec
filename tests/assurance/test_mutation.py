"""The runner knows its targets and their tests, finds mutants again by name, and goes on where it stopped."""

from pathlib import Path

import pytest

from assurance import mutation
from assurance.mutants import mutants_of
from assurance.mutation import TARGETS, main, numbered, outcomes

ROOT = Path(__file__).parents[2]


def test_targets_and_their_tests_exist() -> None:
    for name, tests in TARGETS.items():
        assert (ROOT / "safefilter" / f"{name}.py").exists(), name
        for test in tests:
            assert (ROOT / "tests" / "safefilter" / f"{test}.py").exists(), test


def test_every_mutant_has_a_name_of_its_own() -> None:
    for name in TARGETS:
        found = numbered(name)
        source = (ROOT / "safefilter" / f"{name}.py").read_text(encoding="utf-8")
        assert len(found) == len(list(mutants_of(source))) > 0


def test_what_was_found_is_not_looked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in mutation.INTERPRETED.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(mutation, "REPORT", tmp_path / "mutants.jsonl")
    asked: list[list[str]] = []
    outcome = "killed"

    def run(name: str, left: dict[str, object], _: float) -> int:
        asked.append(list(left))
        for key in left:
            mutation._note(name, key, outcome)
        return 0

    monkeypatch.setattr(mutation, "_in_a_process_of_its_own", run)
    only = "programs/nearest_velocity"
    assert main(["--only", only, "--sample", "0.5", "--seed", "3"]) == 0
    half = asked.pop()
    assert 0 < len(half) < len(numbered(only))
    assert main(["--only", only]) == 0
    assert sorted([*half, *asked.pop()]) == sorted(numbered(only))
    assert main(["--only", only]) == 0
    assert asked == []
    assert set(outcomes(only).values()) == {"killed"}
