"""The demo: policies that know nothing of safety cross an intersection, with the filter off and on.

Run it as ``python -m policies.demo``; it prints tables and leaves pictures in ``out/demo/``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
import tyro
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, track
from rich.table import Table

from envs import Crossroad, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED
from envs.recording import Recording
from envs.rendering import Canvas, side_by_side, write_gif
from envs.trajectory_figure import write_trajectories
from policies import Policy, Ramming, StraightToGoal, UniformRandom
from policies.rollout import Rollout, roll_out
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Separation
from safefilter.arrays import FloatArray

POLICIES: tuple[Policy, ...] = (StraightToGoal(), UniformRandom(), Ramming())
# One robot of high and one of low priority in each arm, left and right in turn.
PRIORITIES = {"equal": (1.0,) * 8, "mixed": (1.0, 8.0, 2.0, 4.0, 8.0, 1.0, 4.0, 2.0)}
FILTERS = ("off", "on")
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
    worlds: int = 16
    quick: bool = False


@dataclass(frozen=True, slots=True)
class Trial:
    """One line of the table.

    Attributes:
        policy: Drives all robots.
        priorities: Key of `PRIORITIES`.
        filtering: One of `FILTERS`.
    """

    policy: Policy
    priorities: str
    filtering: str


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
    rules = Rules()
    safety_filter = SafetyFilter(
        [PriorityORCA(time_horizon=2.0), Separation(dt=rules.dt)], Holonomic(v_max=MAX_SPEED)
    )
    results = _run_all(settings, rules, safety_filter, console)
    console.print(_outcome_table(results, settings))
    console.print(_decision_table(results))
    console.print(_priority_table(results))
    for path in _write_pictures(results, settings, console):
        console.print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)", highlight=False)
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)


def _trials() -> Iterator[Trial]:
    for policy in POLICIES:
        for priorities in PRIORITIES:
            for filtering in FILTERS:
                yield Trial(policy, priorities, filtering)


def _run_all(
    settings: Settings, rules: Rules, safety_filter: SafetyFilter, console: Console
) -> dict[Trial, Rollout]:
    console.print(
        "compiling the kernels (half a minute; they are kept on disk for the next time) ..."
    )
    _run(Trial(POLICIES[0], "mixed", "on"), Settings(steps=2, worlds=1), rules, safety_filter)
    columns = (
        TextColumn("{task.description:<36}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    trials = list(_trials())
    results = {}
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=len(trials))
        for trial in trials:
            progress.update(task, description=f"{trial.policy.name}, filter {trial.filtering}")
            results[trial] = _run(trial, settings, rules, safety_filter)
            progress.advance(task)
    return results


def _run(trial: Trial, settings: Settings, rules: Rules, safety_filter: SafetyFilter) -> Rollout:
    scenario = Crossroad()
    is_on = trial.filtering == "on"
    fleet = Fleet.of(scenario.num_robots, priority=PRIORITIES[trial.priorities], cooperative=is_on)
    return roll_out(
        Navigation(scenario, fleet, rules, num_worlds=settings.worlds),
        trial.policy,
        safety_filter if is_on else None,
        seed=settings.seed,
        max_steps=settings.steps,
    )


def _outcome_table(results: dict[Trial, Rollout], settings: Settings) -> Table:
    num_robots = next(iter(results.values())).summary.num_robots
    table = _empty_table(
        f"What happened to {num_robots} robots within {settings.steps * Rules().dt:.0f} s "
        f"(crossroads: {settings.worlds})",
        "clearance: least free distance inside any step; negative: discs would overlap",
        ("policy", "priority", "filter"),
        ("collided\n(pairs)", "clearance\n(mm)", "success\n(%)", "time to\ngoal (s)"),
    )
    for trial, result in results.items():
        summary = result.summary
        colour = "red" if summary.num_collided else "green"
        table.add_row(
            trial.policy.name,
            trial.priorities,
            trial.filtering,
            f"[bold {colour}]{summary.num_collided} ({summary.num_contacts})[/]",
            f"{1000.0 * summary.min_clearance:.3f}",
            f"{100.0 * summary.success_rate:.1f}",
            _number(summary.mean_time, ".1f"),
            end_section=(trial.priorities, trial.filtering) == ("mixed", "on"),
        )
    return table


def _decision_table(results: dict[Trial, Rollout]) -> Table:
    table = _empty_table(
        "What the filter decided for robots under way",
        "cases of Alg. 2: safe as it is, projected, least violation",
        ("policy", "priority"),
        (
            "changed\n(%)",
            "case 1\n(%)",
            "case 2\n(%)",
            "case 3\n(%)",
            "decision\n(us)",
        ),
    )
    for trial, result in results.items():
        if trial.filtering == "off":
            continue
        table.add_row(
            trial.policy.name,
            trial.priorities,
            _number(100.0 * result.summary.intervention_rate, ".1f"),
            *(_number(100.0 * rate, ".1f") for rate in result.summary.case_rates),
            _number(1e6 * result.decision_time, ".1f"),
            end_section=trial.priorities == "mixed",
        )
    return table


def _priority_table(results: dict[Trial, Rollout]) -> Table:
    levels = np.unique(PRIORITIES["mixed"])
    table = _empty_table(
        "What priority buys straight to goal: mean time to goal (s)",
        "the same robots in both lines: read from top to bottom",
        ("robots of ...",),
        tuple(f"priority {level:g}" for level in levels),
    )
    for trial, result in results.items():
        if trial.policy.name != StraightToGoal.name or trial.filtering == "off":
            continue
        means = [
            _mean(result.arrival_time[:, np.equal(PRIORITIES["mixed"], level)]) for level in levels
        ]
        label = "when all count the same" if trial.priorities == "equal" else "when it counts"
        table.add_row(label, *(_number(mean, ".1f") for mean in means))
    return table


def _write_pictures(
    results: dict[Trial, Rollout], settings: Settings, console: Console
) -> Iterator[Path]:
    pair = [
        (f"{trial.policy.name}, filter {trial.filtering}", result.recording)
        for trial, result in results.items()
        if (trial.policy.name, trial.priorities) == PICTURED
    ]
    figure = settings.out / "trajectories.png"
    write_trajectories(figure, pair)
    yield figure
    canvas = Canvas(WINDOW, Crossroad().half_extent)
    every = 5 if settings.quick else 2
    last = max(_last_change(recording) for _, recording in pair)
    moments = [*range(0, last, every), last]
    frames = [
        side_by_side(pair, moment, canvas)
        for moment in track(moments, "drawing the animation", console=console)
    ]
    animation = settings.out / "crossroad.gif"
    write_gif(animation, frames, frame_time=0.06)
    yield animation


def _last_change(recording: Recording) -> int:
    """First moment at which everybody has arrived or collided, or the last one."""
    done = (recording.arrived | recording.collided).all(axis=1)
    return int(done.argmax()) if done.any() else recording.num_moments - 1


def _empty_table(
    title: str, caption: str, texts: tuple[str, ...], numbers: tuple[str, ...]
) -> Table:
    """Table with the headers of columns of text, then of numbers; narrow enough for 80 characters."""
    table = Table(
        title=f"\n[bold]{title}[/]",
        caption=caption,
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
    )
    for header in texts:
        table.add_column(header, no_wrap=True)
    for header in numbers:
        table.add_column(header, justify="right", no_wrap=True)
    return table


def _mean(times: FloatArray) -> float:
    arrived = times[~np.isnan(times)]
    return float(arrived.mean()) if len(arrived) else math.nan


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
