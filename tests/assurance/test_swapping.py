"""Functions get other code wherever they have gone; constants are replaced wherever they are named."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from assurance.mutants import mutants_of
from assurance.swapping import swap_source

SOURCE = """
from dataclasses import dataclass
LIMIT = 0.5
def double(x, factor=2.0):
    return factor * x
def above(x):
    return x > LIMIT
@dataclass
class Pair:
    a: float = 1.0
    @property
    def twice(self):
        return double(self.a)
    @classmethod
    def of(cls, a):
        return cls(a + 0.0)
"""


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    made = ModuleType("safefilter_made_up")
    made.__file__ = "made_up.py"
    monkeypatch.setitem(sys.modules, made.__name__, made)
    exec(compile(SOURCE, "made_up.py", "exec"), made.__dict__)
    return made


def test_the_same_source_changes_nothing(module: ModuleType) -> None:
    assert swap_source(module, SOURCE) == 0


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        ("factor * x", "factor / x", (0.5, 2.0, True, 2.0)),
        ("factor=2.0", "factor=3.0", (12.0, 3.0, True, 3.0)),
        ("x > LIMIT", "x <= LIMIT", (8.0, 2.0, False, 2.0)),
        ("LIMIT = 0.5", "LIMIT = 1.5", (8.0, 2.0, False, 2.0)),
        ("a: float = 1.0", "a: float = 2.0", (8.0, 4.0, True, 2.0)),
        ("a + 0.0", "a - 1.0", (8.0, 2.0, True, 0.0)),
        ("double(self.a)", "double(-self.a)", (8.0, -2.0, True, -2.0)),
    ],
)
def test_a_mistake_reaches_who_held_the_function_before(
    before: str, after: str, found: tuple[float, float, bool, float], module: ModuleType
) -> None:
    double, above, pair = module.double, module.above, module.Pair
    assert (double(4.0), pair().twice, above(1.0), pair.of(1.0).twice) == (8.0, 2.0, True, 2.0)
    assert swap_source(module, SOURCE.replace(before, after)) == 1
    assert (double(4.0), pair().twice, above(1.0), pair.of(1.0).twice) == found


def test_every_mutant_of_a_shipped_file_differs() -> None:
    # In modules of their own: those that ship stay as they are.
    path = Path(__file__).parents[2] / "safefilter" / "kinematics" / "tracking.py"
    source = path.read_text(encoding="utf-8").replace("@formula\n", "")
    for mutant in mutants_of(source):
        made = ModuleType("safefilter_mutated")
        made.__file__ = str(path)
        exec(compile(source, str(path), "exec"), made.__dict__)
        assert swap_source(made, mutant.source) == 1, mutant
