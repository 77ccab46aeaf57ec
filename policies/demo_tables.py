"""The demo's tables, each at most 80 characters wide."""

from __future__ import annotations

import math

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from policies.demo_trials import PRIORITIES, RULES, Trial
from policies.rollout import Rollout
from policies.straight_to_goal import StraightToGoal
from safefilter.arrays import FloatArray


def outcome_table(results: dict[Trial, Rollout], max_steps: int) -> Table:
    """Collisions, clearance, success and times of all trials.

    Args:
        results: Trials and what came of them.
        max_steps: Steps at most of each.
    """
    num_robots = next(iter(results.values())).summary.num_robots
    table = _empty_table(
        f"What happened to {num_robots} robots within {max_steps * RULES.dt:.0f} s",
        "gap: least free distance inside any step, in mm; negative: overlap",
        ("policy", "prior-\nities", "filter"),
        (
            "hit\nrobots",
            "hit\nwalls",
            "gap to\nrobots",
            "gap to\nwalls",
            "success\n(%)",
            "time\n(s)",
        ),
    )
    for trial, result in results.items():
        summary = result.summary
        table.add_row(
            trial.policy.name,
            trial.priorities,
            trial.filtering,
            _hits(summary.num_robot_hits),
            _hits(summary.num_wall_hits),
            _millimetres(summary.min_clearance),
            _millimetres(summary.min_wall_clearance),
            f"{100.0 * summary.success_rate:.1f}",
            _number(summary.mean_time, ".1f"),
            end_section=(trial.priorities, trial.filtering) == ("mixed", "on"),
        )
    return table


def decision_table(results: dict[Trial, Rollout]) -> Table:
    """Interventions, cases and time of a decision of the trials with the filter on."""
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
        if not trial.is_filtered:
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


def priority_table(results: dict[Trial, Rollout]) -> Table:
    """Times to goal of the robots of each priority, when it counts and when it does not."""
    levels = np.unique(PRIORITIES["mixed"])
    table = _empty_table(
        "What priority buys straight to goal: mean time to goal (s)",
        "the same robots in both lines: read from top to bottom",
        ("robots of ...",),
        tuple(f"priority {level:g}" for level in levels),
    )
    for trial, result in results.items():
        if trial.policy.name != StraightToGoal.name or not trial.is_filtered:
            continue
        means = [
            _mean(result.arrival_time[:, np.equal(PRIORITIES["mixed"], level)]) for level in levels
        ]
        label = "when all count the same" if trial.priorities == "equal" else "when it counts"
        table.add_row(label, *(_number(mean, ".1f") for mean in means))
    return table


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
        collapse_padding=True,
    )
    for header in texts:
        table.add_column(header, no_wrap=True)
    for header in numbers:
        table.add_column(header, justify="right", no_wrap=True)
    return table


def _millimetres(gap: float) -> str:
    """A tenth of a millimetre, and more where that shows nothing."""
    return f"{1000.0 * gap:.{3 if abs(gap) < 1e-3 else 1}f}"


def _hits(number: int) -> str:
    return f"[bold {'red' if number else 'green'}]{number}[/]"


def _mean(times: FloatArray) -> float:
    arrived = times[~np.isnan(times)]
    return float(arrived.mean()) if len(arrived) else math.nan


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)
