"""The demo: differential drives between walls, by unsafe policies and by one that was trained, filter off and on.

Run it as ``python -m policies.demo``; it prints tables and leaves pictures in ``out/demo/``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, track

from envs.animation import write_gif
from envs.brush import Canvas
from envs.recording import Recording
from envs.rendering import side_by_side
from envs.trajectory_figure import write_trajectories
from policies.demo_cases import CasePictures
from policies.demo_learned import learned_table, show_all, write_pictures
from policies.demo_tables import decision_table, outcome_table, priority_table
from policies.demo_trials import (
    SCENARIO,
    TIME_HORIZON,
    Trial,
    all_trials,
    make_filter,
    run_trial,
)
from policies.rollout import Rollout
from policies.straight_to_goal import StraightToGoal
from safefilter.safety_filter import SafetyFilter

PICTURED = (StraightToGoal.name, "mixed")
WINDOW = 400  # px


@dataclass(frozen=True, slots=True)
class Settings:
    """Drive robots over a crossroad with unsafe policies, and show what the filter changes.

    Attributes:
        out: Folder for the pictures.
        seed: Seed of starts and policies.
        steps: Longest episode, in steps of 0.2 s.
        worlds: Worlds of eight robots that are driven at once.
        quick: One world and 30 s only, and a coarser animation.
    """

    out: Path = Path("out/demo")
    seed: int = 0
    steps: int = 400
    worlds: int = 12
    quick: bool = False


def main(settings: Settings, console: Console) -> None:
    """Run all trials, print the tables and write the pictures.

    Args:
        settings: What to run.
        console: Where to print.
    """
    if settings.quick:
        settings = replace(settings, steps=min(settings.steps, 150), worlds=1)
    started = perf_counter()
    settings.out.mkdir(parents=True, exist_ok=True)
    safety_filter, cases = make_filter(), CasePictures()
    results = _run_all(settings, safety_filter, cases, console)
    with console.status("the trained policy ...") as status:
        showings = show_all(
            settings.worlds, settings.seed, lambda what: status.update(f"{what} ...")
        )
    console.print(outcome_table(results, settings.steps))
    console.print(decision_table(results))
    console.print(priority_table(results))
    console.print(learned_table(showings))
    picture = settings.out / "cases.png"
    cases.write(picture, safety_filter, TIME_HORIZON)
    for path in (
        picture,
        *_write_pictures(results, settings, console),
        *write_pictures(showings, settings.out),
    ):
        console.print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)", highlight=False)
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)


def _run_all(
    settings: Settings, safety_filter: SafetyFilter, cases: CasePictures, console: Console
) -> dict[Trial, Rollout]:
    trials = list(all_trials())
    console.print("compiling the kernels (half a minute once; they are kept on disk) ...")
    first_filtered = next(trial for trial in trials if trial.is_filtered)
    run_trial(first_filtered, safety_filter, seed=0, max_steps=2, num_worlds=1)
    columns = (
        TextColumn("{task.description:<36}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    results = {}
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=len(trials))
        for trial in trials:
            progress.update(task, description=f"{trial.policy.name}, filter {trial.filtering}")
            results[trial] = run_trial(
                trial,
                safety_filter,
                seed=settings.seed,
                max_steps=settings.steps,
                num_worlds=settings.worlds,
                watch=cases.watch if _is_pictured(trial) else lambda *_: None,
            )
            progress.advance(task)
    return results


def _write_pictures(
    results: dict[Trial, Rollout], settings: Settings, console: Console
) -> Iterator[Path]:
    pair = [
        (f"{trial.policy.name}, filter {trial.filtering}", result.recording)
        for trial, result in results.items()
        if _is_pictured(trial)
    ]
    figure = settings.out / "trajectories.png"
    write_trajectories(figure, pair)
    yield figure
    canvas = Canvas(WINDOW, SCENARIO.half_extent)
    every = 6 if settings.quick else 3
    last = max(_last_change(recording) for _, recording in pair)
    moments = [*range(0, last, every), last]
    frames = [
        side_by_side(pair, moment, canvas)
        for moment in track(moments, "drawing the animation", console=console)
    ]
    animation = settings.out / "crossroad.gif"
    write_gif(animation, frames, frame_time=0.09)
    yield animation


def _is_pictured(trial: Trial) -> bool:
    return (trial.policy.name, trial.priorities) == PICTURED


def _last_change(recording: Recording) -> int:
    """First moment at which everybody has arrived or collided, or the last one."""
    done = (recording.arrived | recording.collided).all(axis=1)
    return int(done.argmax()) if done.any() else recording.num_moments - 1


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
