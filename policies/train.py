"""Train a policy: Alg. 1 of Qin et al.

    python -m policies.train srl-orca --settings.seed 2
    python -m policies.train my_settings.yaml --out runs/mine

See docs/learning.md, and `policies.training_command` for the command line.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from policies.trainer import Progress as TrainingProgress
from policies.trainer import Trainer
from policies.training_command import USAGE, parse
from policies.training_run import RunOptions, TrainingRun, clear
from safefilter.errors import SafeFilterError

INTERRUPTED = 130
"""Exit status of a program that Ctrl-C has stopped."""


def main(arguments: Sequence[str]) -> int:
    """Train; returns the exit status."""
    name, command = parse(arguments)
    torch.set_num_threads(command.num_threads)
    folder = command.out or Path("runs") / f"{name}-{command.settings.seed}"
    if command.is_fresh:
        clear(folder)
    options = RunOptions(
        name=name,
        command=shlex.join([*USAGE.split(), *arguments]),
        keep_every=command.keep_every,
        check_every=command.check_every,
    )
    console = Console()
    run = TrainingRun(command.settings, folder, options, command.device)
    for reason in run.torn:
        console.print(f"[yellow]Not used:[/] {reason}", soft_wrap=True)
    if run.curve:
        console.print(
            f"{folder}: goes on from step {run.trainer.num_steps:,}",
            highlight=False,
            soft_wrap=True,
        )
    try:
        weights = _train(run, console)
    except KeyboardInterrupt:
        console.print(f"{folder}: stopped; the same command goes on from the last checkpoint")
        return INTERRUPTED
    _print_times(run.trainer, console)
    console.print(f"Weights: {weights}", soft_wrap=True)
    return 0


def _train(run: TrainingRun, console: Console) -> Path:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=14),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[figures]}"),
    )
    trainer, first = run.trainer, run.trainer.num_steps
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(
            "training", total=trainer.settings.num_steps, completed=first, figures=""
        )

        def report(progress: TrainingProgress) -> None:
            rate = (progress.num_steps - first) / sum(trainer.stopwatch.seconds.values())
            figures = progress.figures
            bar.update(
                task,
                completed=progress.num_steps,
                figures=f"{rate / 1e3:.1f} k steps/s, reward {figures['reward']:.2f}, "
                f"{100 * figures['arrival_rate']:.1f} % arrive in {figures['arrival_time']:.1f} s",
            )

        return run.run(report)


def _print_times(trainer: Trainer, console: Console) -> None:
    seconds = trainer.stopwatch.seconds
    total = sum(seconds.values())
    if total:
        parts = ", ".join(f"{name} {part:.1f} s" for name, part in seconds.items())
        console.print(f"{total:.1f} s: {parts}", highlight=False)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except SafeFilterError as error:
        sys.exit(f"safefilter: {error}")
