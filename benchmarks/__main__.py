"""Run the benchmarks: ``python -m benchmarks``; see ``--help``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import tyro
from rich.console import Console

from benchmarks import (
    circle_step,
    differentiable,
    drive_mappings,
    drive_step,
    simulator,
    single_decision,
    sphere_step,
    start_up,
    training,
    wrappers,
)
from benchmarks.machine import describe_machine
from benchmarks.results import FOLDER, Result, as_markdown, as_table, committed_ratios, save

BENCHMARKS: dict[str, Callable[..., Result]] = {
    "circle_step": circle_step.measure,
    "differentiable": differentiable.measure,
    "drive_mappings": drive_mappings.measure,
    "drive_step": drive_step.measure,
    "simulator": simulator.measure,
    "single_decision": single_decision.measure,
    "sphere_step": sphere_step.measure,
    "start_up": start_up.measure,
    "training": training.measure,
    "wrappers": wrappers.measure,
}
TABLES = FOLDER / "README.md"


@dataclass(frozen=True, slots=True)
class Settings:
    """Time the filter against RVO2 and other solvers; every ratio is shown beside the committed one.

    Attributes:
        only: Names of the benchmarks to run; none means all.
        quick: A minute instead of many: smallest sizes, few repeats.
        save: Keep the results: benchmarks/results/*.json and the tables in README.md there.
    """

    only: tuple[str, ...] = ()
    quick: bool = False
    save: bool = False


def main(settings: Settings, console: Console) -> None:
    """Run, print, and keep if asked.

    Args:
        settings: What to run.
        console: Where to print.
    """
    started, machine = perf_counter(), describe_machine()
    about = ", ".join(f"{name} {value}" for name, value in machine.items())
    console.print(about, highlight=False)
    sections = [f"# Benchmarks\n\nMade by `python -m benchmarks --save`: {about}.\n"]
    for name, measure in BENCHMARKS.items():
        if settings.only and name not in settings.only:
            continue
        with console.status(f"timing {name} ..."):
            result = measure(quick=settings.quick)
        console.print(as_table(result, committed_ratios(name)))
        sections.append(as_markdown(result))
        if settings.save:
            save(result, machine)
    if settings.save and not settings.only:
        TABLES.write_text("\n".join(sections), encoding="utf-8")
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
