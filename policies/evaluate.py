"""Table I of Qin et al. and more: who arrives, who collides, who keeps the norms, and in what time.

    python -m policies.evaluate --all
    python -m policies.evaluate --method srl-orca nh-orca --scenario crossroad passing --json rows.json
    python -m policies.evaluate --policy my_package.policies:make --scenario doorway

A cell (method, scenario, training seed) that is done is kept, and found again by the next call, whatever became of this
one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from envs.table_row import TableRow
from policies.atomic_file import write_atomically
from policies.evaluation import run_episodes
from policies.filtering import OFF, OURS, OURS_WITH_MAP, Filtering
from policies.foreign_policy import load_foreign
from policies.kept_weights import WEIGHTS
from policies.methods import METHODS, find_method
from policies.priority_table import priority_cells, priority_gains
from policies.table_cell import Cell, CellFolder
from policies.table_figures import write_pictures
from policies.table_page import csv_text, filled, json_text, page
from policies.table_plan import cells_of, planned_cells, shared_out, without_missing
from policies.table_print import tables
from policies.table_rows import Entry, Outcome, collect, gain_sentence
from policies.table_run import open_cells, run_cells
from policies.table_scenarios import find_scenario
from safefilter.errors import OutOfRange, SafeFilterError

USUAL_TRAININGS = (1, 2, 3)
FILTERINGS: dict[str, Filtering] = {"off": OFF, "map": OURS_WITH_MAP, "lidar": OURS}


@dataclass(frozen=True, slots=True)
class Settings:
    """Drive policies through scenarios and count.

    Attributes:
        all: The whole table, with what priority saves, pictures, and a page.
        method: Methods, see `policies.methods`.
        scenario: Scenarios of the library, town_held_out, corridor, or files.
        episodes: Episodes of each cell.
        seed: Of the episodes.
        training_seeds: Of the policies that are learnt; without any those of 1, 2 and 3 that there are.
        json: File for the rows.
        out: Folder for cells that are done, and for table and pictures of all.
        weights: Folder of weights.
        processes: Processes that share the work, by default one a core.
        docs: A page to fill the table into, between its marks.
        pictures: Draw pictures with the whole table?
        policy: A policy of elsewhere instead: package.module:callable, or a file .safetensors, .onnx or .zip.
        filtering: The filter of that policy: off, on with a map, or on with walls from lidar alone.
        algorithm: Class of Stable-Baselines3 that wrote the zip.
        trust_pickle: Read a zip, which can execute anything, as I trust whoever made it.
    """

    all: bool = False
    method: tuple[str, ...] = ("nh-orca",)
    scenario: tuple[str, ...] = ("crossroad",)
    episodes: int = 1000
    seed: int = 0
    training_seeds: tuple[int, ...] = ()
    json: Path | None = None
    out: Path = Path("out/table")
    weights: Path = WEIGHTS
    processes: int = os.cpu_count() or 1
    docs: Path | None = None
    pictures: bool = True
    policy: str | None = None
    filtering: Literal["off", "map", "lidar"] = "lidar"
    algorithm: str = "PPO"
    trust_pickle: bool = False


def main(settings: Settings, console: Console, command: str) -> int:
    """Run, print and write.

    Args:
        settings: What to run.
        console: Where to print.
        command: What was typed.

    Returns:
        Exit status.

    Raises:
        OutOfRange: If there is no episode.
    """
    if settings.episodes < 1:
        raise OutOfRange(f"episodes: expected 1 or more, got {settings.episodes}")
    started = perf_counter()
    if settings.policy is not None:
        _finish(settings, Outcome(tuple(_foreign_entries(settings)), (), None), console)
        return 0
    template = Cell(
        METHODS["nh-orca"], "", settings.episodes, settings.seed, weights=settings.weights
    )
    cells, missing = _cells(settings, template)
    seeds = settings.training_seeds or USUAL_TRAININGS
    norm_3 = priority_cells(template, seeds) if settings.all else []
    norm_3, _ = without_missing(norm_3)
    for reason in missing:
        console.print(f"[yellow]Left out:[/] {reason}", highlight=False)
    folder = CellFolder(settings.out / "cells")
    _run([*cells, *norm_3], folder, settings.processes, console)
    outcome, gains = collect(cells, folder), priority_gains(norm_3, folder)
    _finish(settings, outcome, console)
    if settings.all:
        console.print(*tables(Outcome((), (), None), gains))
        text = page(outcome, gains, command=command, missing=missing)
        _write(settings.out / "table.md", text, console)
        if settings.docs is not None:
            old = settings.docs.read_text(encoding="utf-8")
            _write(settings.docs, filled(old, text, str(settings.docs)), console)
        if settings.pictures:
            for path in write_pictures(cells, settings.out):
                console.print(f"wrote {path}", highlight=False)
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)
    return 0


def _cells(settings: Settings, template: Cell) -> tuple[list[Cell], list[str]]:
    """Cells to run, and why others are left out.

    Raises:
        CheckpointMissing: If weights of a training that was asked for are not there, or none of a method.
    """
    seeds = settings.training_seeds or USUAL_TRAININGS
    if settings.all:
        cells, missing = without_missing(planned_cells(template, seeds))
        return shared_out(cells), missing
    cells = []
    missing = []
    for scenario in settings.scenario:
        find_scenario(scenario)
        for name in settings.method:
            wanted = list(cells_of(template, find_method(name).name, scenario, seeds))
            found, reasons = without_missing(wanted)
            if reasons and (settings.training_seeds or not found):
                next(cell for cell in wanted if cell not in found).read_weights()
            cells += found
            missing += reasons
    return cells, list(dict.fromkeys(missing))


def _run(cells: Sequence[Cell], folder: CellFolder, processes: int, console: Console) -> None:
    waiting = open_cells(cells, folder)
    done = len(set(cells)) - len(waiting)
    console.print(f"{len(set(cells))} cells, {done} of them done before", highlight=False)
    if waiting:
        console.print("compiling the kernels (a minute, once; they are kept on disk) ...")
    columns = (
        TextColumn("{task.description:<44}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=len(waiting))

        def report(cell: Cell) -> None:
            progress.update(task, advance=1, description=f"done: {cell.title}")

        run_cells(waiting, folder, processes=processes, report=report)


def _foreign_entries(settings: Settings) -> list[Entry]:
    """Rows of a policy of elsewhere; they are not kept, as its code may change unseen."""
    policy = load_foreign(
        str(settings.policy), algorithm=settings.algorithm, trusts_pickle=settings.trust_pickle
    )
    entries = []
    for name in settings.scenario:
        results = run_episodes(
            policy.make,
            find_scenario(name),
            FILTERINGS[settings.filtering],
            episodes=settings.episodes,
            seed=settings.seed,
            layout=policy.layout,
        )
        entries.append(
            Entry(TableRow.of(name, policy.name, results), policy.name, (), settings.seed)
        )
    return entries


def _finish(settings: Settings, outcome: Outcome, console: Console) -> None:
    """Print the rows, and write them."""
    for table in tables(outcome, ()):
        console.print(table)
    if outcome.gain is not None:
        console.print(gain_sentence(outcome.gain), highlight=False)
    entries = [*outcome.pooled, *outcome.each_seed]
    if settings.json is not None:
        _write(settings.json, json_text(entries), console)
    # A few rows do not replace those of the whole table.
    if settings.all:
        _write(settings.out / "table.json", json_text(entries), console)
        _write(settings.out / "table.csv", csv_text(entries), console)


def _write(path: Path, text: str, console: Console) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text.encode())
    console.print(f"wrote {path}", highlight=False)


if __name__ == "__main__":
    try:
        sys.exit(
            main(
                tyro.cli(Settings, description=__doc__),
                Console(),
                " ".join(["python -m policies.evaluate", *sys.argv[1:]]),
            )
        )
    except SafeFilterError as error:
        sys.exit(f"safefilter: {error}")
