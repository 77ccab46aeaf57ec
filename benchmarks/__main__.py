"""Run the benchmarks: ``python -m benchmarks``; see ``--help``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter

import tyro
from rich.console import Console

from benchmarks import (
    circle_step,
    crowd_step,
    differentiable,
    drive_mappings,
    drive_step,
    floor,
    latency,
    simulator,
    single_decision,
    sphere_step,
    start_up,
    training,
    wrappers,
)
from benchmarks.latency_figure import draw_latency
from benchmarks.machine import describe_machine
from benchmarks.results import FOLDER, Result, all_tables, as_table, committed_ratios, save
from benchmarks.speed_page import write_page

BENCHMARKS: dict[str, Callable[..., Result]] = {
    "circle_step": circle_step.measure,
    "crowd_step": crowd_step.measure,
    "differentiable": differentiable.measure,
    "drive_mappings": drive_mappings.measure,
    "drive_step": drive_step.measure,
    "floor": floor.measure,
    "latency": latency.measure,
    "simulator": simulator.measure,
    "single_decision": single_decision.measure,
    "sphere_step": sphere_step.measure,
    "start_up": start_up.measure,
    "training": training.measure,
    "wrappers": wrappers.measure,
}
# What is drawn of a result that was saved.
FIGURES: dict[str, Callable[[Path, Path], object]] = {"latency": draw_latency}
TABLES = FOLDER / "README.md"


@dataclass(frozen=True, slots=True)
class Settings:
    """Time the filter against RVO2 and other solvers; every ratio is shown beside the committed one.

    Attributes:
        only: Names of the benchmarks to run; none means all.
        quick: A minute instead of many: smallest sizes, few repeats.
        sizes: Numbers of robots of crowd_step; none means 250 to 1 000 000.
        save: Keep the results: benchmarks/results/*.json and the tables in README.md there, and in
            docs/speed.md.
    """

    only: tuple[str, ...] = ()
    quick: bool = False
    sizes: tuple[int, ...] = ()
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
    benchmarks = dict(BENCHMARKS)
    if settings.sizes:
        benchmarks["crowd_step"] = partial(crowd_step.measure, sizes=settings.sizes)
    for name, measure in benchmarks.items():
        if settings.only and name not in settings.only:
            continue
        with console.status(f"timing {name} ..."):
            result = measure(quick=settings.quick)
        console.print(as_table(result, committed_ratios(name)))
        if settings.save:
            path = save(result, machine)
            if name in FIGURES:
                FIGURES[name](path, path.with_suffix(".png"))
    if settings.save:
        TABLES.write_text(all_tables(BENCHMARKS), encoding="utf-8")
        write_page()
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
