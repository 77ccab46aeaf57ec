"""Train a policy: Alg. 1 of Qin et al.

    python -m policies.train srl-orca --settings.seed 2
    python -m policies.train my_settings.yaml --out runs/mine

The first argument is the name of a preset (`policies.presets`) or a file of settings; every setting can be changed
after it. In the folder of the run are checkpoints, TensorBoard's events, and in the end the weights with their card.
The same command goes on with a training that was stopped.
"""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from policies.presets import PRESETS
from policies.settings_file import read_settings
from policies.trainer import Progress as TrainingProgress
from policies.trainer import Trainer
from policies.training_run import RunOptions, TrainingRun
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput, SafeFilterError

USUAL = "srl-orca"
USAGE = "python -m policies.train"


@dataclass(frozen=True, slots=True)
class Command:
    """Train a policy.

    Attributes:
        settings: What the training depends on.
        out: Folder of the run; None: runs/NAME-SEED.
        device: Where networks live: cpu or cuda.
        num_threads: Threads of torch; 1 gives the same numbers on every machine of a kind.
        keep_every: Steps between checkpoints.
        check_every: Steps between checks in the paper's scenarios; 0: none.
        is_fresh: Begin anew, whatever is in the folder.
    """

    settings: TrainingSettings
    out: Path | None = None
    device: str = "cpu"
    num_threads: int = torch.get_num_threads()
    keep_every: int = 500_000
    check_every: int = 1_000_000
    is_fresh: bool = False


def main(arguments: Sequence[str]) -> int:
    """Train; returns the exit status."""
    source, rest = _split(arguments)
    settings = PRESETS[source] if source in PRESETS else read_settings(Path(source))
    command = tyro.cli(
        Command, default=Command(settings), args=rest, prog=f"{USAGE} {source}", description=__doc__
    )
    torch.set_num_threads(command.num_threads)
    name = Path(source).stem
    folder = command.out or Path("runs") / f"{name}-{command.settings.seed}"
    if command.is_fresh:
        shutil.rmtree(folder, ignore_errors=True)
    options = RunOptions(
        name=name,
        command=f"{USAGE} {shlex.join(arguments)}",
        keep_every=command.keep_every,
        check_every=command.check_every,
    )
    console = Console()
    run = TrainingRun(command.settings, folder, options, command.device)
    for reason in run.torn:
        console.print(f"[yellow]Not used:[/] {reason}")
    weights = _train(run, console)
    _print_times(run.trainer, console)
    console.print(f"Weights: {weights}")
    return 0


def _split(arguments: Sequence[str]) -> tuple[str, list[str]]:
    """The preset or file, and what comes after it.

    Raises:
        InvalidInput: If it is neither.
    """
    if not arguments or arguments[0].startswith("-"):
        return USUAL, list(arguments)
    source = arguments[0]
    if source not in PRESETS and not Path(source).is_file():
        raise InvalidInput(
            f"expected a file of settings or one of {', '.join(PRESETS)}, got {source!r}"
        )
    return source, list(arguments[1:])


def _train(run: TrainingRun, console: Console) -> Path:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[figures]}"),
    )
    trainer = run.trainer
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("training", total=trainer.settings.num_steps, figures="")
        bar.update(task, completed=trainer.num_steps)

        def report(progress: TrainingProgress) -> None:
            seconds = sum(trainer.stopwatch.seconds.values())
            rate = (progress.num_steps - first) / seconds
            figures = progress.figures
            bar.update(
                task,
                completed=progress.num_steps,
                figures=f"{rate / 1e3:.0f} k steps/s, reward {figures['reward']:.2f}, "
                f"{100 * figures['arrival_rate']:.1f} % arrive in {figures['arrival_time']:.1f} s",
            )

        first = trainer.num_steps
        return run.run(report)


def _print_times(trainer: Trainer, console: Console) -> None:
    seconds = trainer.stopwatch.seconds
    total = sum(seconds.values())
    if total:
        parts = ", ".join(f"{name} {part:.1f} s" for name, part in seconds.items())
        console.print(f"{total:.1f} s: {parts}")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except SafeFilterError as error:
        sys.exit(f"safefilter: {error}")
