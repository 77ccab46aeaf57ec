"""The problem sets that come with the package, by name."""

from __future__ import annotations

import difflib
from pathlib import Path

from safefilter.arguments import require_kind
from safefilter.comparison.problem import ProblemSet
from safefilter.comparison.problem_file import read_problems
from safefilter.errors import InvalidInput

FOLDER = Path(__file__).parent / "problems"
SUFFIX = ".jsonl"
# For qpbenchmark, which loads a test set by the path of its file.
TEST_SET = Path(__file__).parent / "safety_programs.py"

# In the order of reports: from what robots meet to what is made to be hard, then more variables.
SHIPPED = (
    "recorded_crossroad",
    "recorded_circle",
    "recorded_crowd",
    "case_2",
    "barely_feasible",
    "barely_empty",
    "clearly_empty",
    "degenerate",
    "badly_scaled",
    "head_on",
    "barriers_3",
    "barriers_6",
    "barriers_12",
    "barriers_50",
)


def shipped_set(name: str) -> ProblemSet:
    """Read one of the sets that come with the package.

    Raises:
        InvalidInput: If there is none of this name; lists those that there are.
    """
    require_kind(name, "name", str)
    if name not in SHIPPED:
        close = difflib.get_close_matches(name, SHIPPED, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise InvalidInput(
            f"sets: no set is called {name!r}.{hint} There are: {', '.join(SHIPPED)}"
        )
    return read_problems(path_of(name))


def path_of(name: str) -> Path:
    """Where the file of a set is."""
    return FOLDER / f"{name}{SUFFIX}"
