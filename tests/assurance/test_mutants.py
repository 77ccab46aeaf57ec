"""Mutants are the file with one small mistake: each compiles, differs, and leaves annotations and messages alone."""

import ast

import pytest

from assurance.mutants import mutants_of

SOURCE = '''"""What it is."""

LIMIT: float = 1.5


def least(values: list[float], start: int = 2) -> float:
    """Least of 3 values."""
    if start > 0 and not values[0] == -1.0:
        raise ValueError("expected 1" + "2")
    total = min(values) * LIMIT if values else 0.0
    total += True
    return total
'''


def test_every_kind_of_mistake_is_made() -> None:
    made = {f"{mutant.before} -> {mutant.after}" for mutant in mutants_of(SOURCE)}
    assert made == {
        "1.5 -> 2.5",
        "2 -> 3",
        "start > 0 and (not values[0] == -1.0) -> not (start > 0 and (not values[0] == -1.0))",
        "start > 0 and (not values[0] == -1.0) -> start > 0 or not values[0] == -1.0",
        "start > 0 -> start >= 0",
        "0 -> 1",
        "not values[0] == -1.0 -> not not values[0] == -1.0",
        "values[0] == -1.0 -> values[0] != -1.0",
        "-1.0 -> --1.0",
        "1.0 -> 2.0",
        "min(values) * LIMIT if values else 0.0 -> min(values) * LIMIT if not values else 0.0",
        "min(values) * LIMIT -> min(values) / LIMIT",
        "min(values) -> max(values)",
        "0.0 -> 1.0",
        "total += True -> total -= True",
        "True -> False",
    }


def test_mutants_compile_and_differ_from_the_file_in_one_place() -> None:
    right = ast.dump(ast.parse(SOURCE))
    sources = [mutant.source for mutant in mutants_of(SOURCE)]
    assert len(set(sources)) == len(sources)
    for source in sources:
        assert ast.dump(ast.parse(source)) != right


def test_lines_are_those_of_the_file() -> None:
    assert {mutant.line for mutant in mutants_of(SOURCE)} == {3, 6, 8, 10, 11}


@pytest.mark.parametrize("source", ["", '"""Text."""', "x: int\n", "raise ValueError(1 + 1)\n"])
def test_where_nothing_can_go_wrong_there_is_no_mutant(source: str) -> None:
    assert list(mutants_of(source)) == []
