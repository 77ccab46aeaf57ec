"""``safefilter compare``: the options, and what is done with them. Needs `pip install safefilter[compare]`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from safefilter.arrays import positive_number
from safefilter.backends.registry import available_backends
from safefilter.comparison.contender import Setting, contenders_of
from safefilter.comparison.files import write_csv, write_json
from safefilter.comparison.problem import ProblemSet
from safefilter.comparison.problem_file import read_problems
from safefilter.comparison.report import write_report
from safefilter.comparison.runner import LOOP_STEPS, Plan, compare_backends
from safefilter.comparison.shipped import SHIPPED, shipped_set
from safefilter.comparison.summary import Summary
from safefilter.comparison.table import as_tables
from safefilter.errors import InvalidInput, OutOfRange, SafeFilterError, UnknownBackend

BUDGET = 5e-3
ROUNDS = 4
# --quick: without CVXPY, which takes a hundred times as long as some; as many problems of each set; few steps.
SLOW = "cvxpy:"
QUICK_PROBLEMS = 3
QUICK_ROUNDS = 1
QUICK_LOOP_STEPS = 20
QUICK_SECONDS = 20.0
# Width of tables in characters where they go to a file or a pipe, which know none.
FILE_WIDTH = 220


@dataclass(frozen=True, slots=True)
class Options:
    """Which solver should I use, and at what setting? Compares solvers on the problems of a safety filter."""

    problems: tuple[Path, ...] = ()
    """Files of your own, as SafeAction(..., record=FILE) writes them, in place of the sets of the package."""
    sets: tuple[str, ...] = ()
    """Names of sets that come with the package; all if none is named."""
    backends: tuple[str, ...] = ()
    """Names of backends; all that are installed if none is named."""
    settings: tuple[str, ...] = ("default", "tolerance", "tight")
    """How accurately solvers are asked to work."""
    budget: float = BUDGET
    """Time that a decision may take, in s."""
    rounds: int | None = None
    """Rounds in sequence (default: 4, 1 if quick); percentiles far out need many."""
    time_limit: float = 5.0
    """Time after which a solver counts as hanging and its process is ended, in s."""
    quick: bool = False
    """Fewer problems, rounds and steps, and no CVXPY: under 30 s."""
    json: Path | None = None
    """Write all measures as JSON."""
    csv: Path | None = None
    """Write all measures as CSV."""
    html: Path | None = None
    """Write a report with plots, one file."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    options = tyro.cli(Options, args=arguments, prog="safefilter compare")
    errors, console = Console(stderr=True), Console()
    if not console.is_terminal:
        console = Console(width=FILE_WIDTH)
    try:
        summary = compare(options, errors)
    except SafeFilterError as error:
        errors.print(f"safefilter compare: {error}", style="red", markup=False)
        return 2
    console.print(as_tables(summary))
    return 0


def compare(options: Options, console: Console) -> Summary:
    """Measure, and write the files that were asked for.

    Args:
        options: What the user asked for.
        console: Where progress is shown.

    Raises:
        InvalidInput: If an option cannot be used.
        OutOfRange: If a number cannot be used.
        UnknownBackend: If a backend is not installed.
    """
    positive_number(options.budget, "budget")
    positive_number(options.time_limit, "time_limit")
    sets = _sets(options)
    contenders = contenders_of(_backends(options), _settings(options))
    with console.status("starting") as status:
        comparison = compare_backends(
            sets,
            contenders,
            _plan(options),
            lambda done, total, title: status.update(f"{done} of {total}: {title}"),
        )
    summary = Summary.of(comparison, options.budget)
    for path, write in (
        (options.json, write_json),
        (options.csv, write_csv),
        (options.html, write_report),
    ):
        if path is not None:
            write(path, summary)
            console.print(f"wrote {path}")
    return summary


def _sets(options: Options) -> list[ProblemSet]:
    if options.problems and options.sets:
        raise InvalidInput("problems, sets: give files of your own or names of sets, not both")
    if options.problems:
        return [read_problems(path) for path in options.problems]
    sets = [shipped_set(name) for name in options.sets or SHIPPED]
    return [_sample(problems) for problems in sets] if options.quick else sets


def _sample(problems: ProblemSet) -> ProblemSet:
    """A few problems from all over a set."""
    size = len(problems)
    number = min(QUICK_PROBLEMS, size)
    return problems.part([k * size // number for k in range(number)])


def _backends(options: Options) -> tuple[str, ...]:
    known = available_backends()
    for name in options.backends:
        if name not in known:
            raise UnknownBackend(
                f"backends: {name!r} is not installed. There are: {', '.join(known)}"
            )
    if options.backends:
        return tuple(dict.fromkeys(options.backends))
    # The built-in one first, and in a quick run only what is fast.
    fast = [name for name in known if not (options.quick and name.startswith(SLOW))]
    return tuple(sorted(fast, key=lambda name: (name != "planar", ":" in name, name)))


def _settings(options: Options) -> list[Setting]:
    known = {setting.title: setting for setting in Setting}
    for name in options.settings:
        if name not in known:
            raise InvalidInput(f"settings: expected some of {', '.join(known)}, got {name!r}")
    return [known[name] for name in dict.fromkeys(options.settings)]


def _plan(options: Options) -> Plan:
    rounds = options.rounds
    if rounds is None:
        rounds = QUICK_ROUNDS if options.quick else ROUNDS
    if rounds < 1:
        raise OutOfRange(f"rounds: expected 1 or more, got {rounds}")
    steps = QUICK_LOOP_STEPS if options.quick else LOOP_STEPS
    return Plan(
        rounds=rounds,
        time_limit=options.time_limit,
        loop_steps=steps,
        has_all_loops=not options.quick,
        seconds=QUICK_SECONDS if options.quick else math.inf,
        num_warm_up=1 if options.quick else 2,
        num_cold=1 if options.quick else None,
    )
