"""Plots of a summary. Needs matplotlib (`pip install safefilter[compare]`).

Times in s, shown in ms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from safefilter.arrays import FloatArray
from safefilter.comparison.advice import MOST_REFUSED, Standing, standings_of
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.measures import SAFE_EXCESS, judged
from safefilter.comparison.problem import groups_of
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode

# Colours that keep apart for colour-blind readers (Okabe and Ito), and shapes for print.
SETTING_COLOURS = {
    Setting.DEFAULT: "#e69f00",
    Setting.TOLERANCE: "#0072b2",
    Setting.TIGHT: "#009e73",
}
SETTING_MARKERS = {Setting.DEFAULT: "o", Setting.TOLERANCE: "s", Setting.TIGHT: "^"}
# Below this a violation is rounding; logarithms need a floor.
FLOOR = 1e-17
FARTHEST_RATIO = 1e3


def latency_figure(summary: Summary, kind: str) -> Figure:
    """How long decisions take: a line from the fastest to the slowest, a bar from 10 to 90 %, a tick at the median."""
    names = _backends_by_time(summary, kind)
    figure, ax = _axes(0.42 * len(names) + 1.3)
    shift = {Setting.DEFAULT: 0.25, Setting.TOLERANCE: 0.0, Setting.TIGHT: -0.25}
    for contender in summary.comparison.contenders:
        times = 1e3 * _times(summary, kind, contender)
        if contender.backend not in names or not len(times):
            continue
        y = names.index(contender.backend) + shift[contender.setting]
        least, low, middle, high, most = np.percentile(times, [0, 10, 50, 90, 100])
        colour = SETTING_COLOURS[contender.setting]
        ax.plot([least, most], [y, y], color=colour, linewidth=1.0)
        ax.plot([low, high], [y, y], color=colour, linewidth=5.0, solid_capstyle="butt")
        ax.plot(middle, y, marker="|", color="black", markersize=8, zorder=3)
    ax.axvline(1e3 * summary.budget, color="#d55e00", linestyle="--", linewidth=1.2)
    ax.set(
        xscale="log",
        xlabel="time of a decision in ms (dashed: the budget)",
        yticks=range(len(names)),
    )
    ax.set_yticklabels(names)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.grid(axis="x", which="both", alpha=0.25)
    _settings_legend(ax, [s for s in Setting if _has(summary, s)], "upper right")
    return figure


def violation_figure(summary: Summary, kind: str) -> Figure:
    """Worst violation of the raw answers against the median time; hollow where the filter refused more than 1 %."""
    figure, ax = _axes(5.0)
    ax.set(xscale="log", yscale="log")
    standings = standings_of(
        summary.comparison, groups_of(summary.comparison.sets)[kind], summary.budget
    )
    labelled: set[str] = set()
    for standing in standings:
        if not math.isnan(standing.measures.worst_excess):
            # One name a backend, on different heights where they crowd.
            is_new = standing.contender.backend not in labelled
            _mark(ax, standing, 10 + 13 * (len(labelled) % 5) if is_new else None)
            labelled.add(standing.contender.backend)
    lowest, highest = ax.get_ylim()
    lowest, highest = min(lowest, SAFE_EXCESS) / 30.0, max(highest, SAFE_EXCESS) * 30.0
    ax.axhspan(lowest, SAFE_EXCESS, color="#009e73", alpha=0.08)
    ax.axvline(1e3 * summary.budget, color="#d55e00", linestyle="--", linewidth=1.2)
    ax.set(
        ylim=(lowest, highest),
        xlabel="median time of a decision in ms (dashed: the budget)",
        ylabel="worst violation, in parts of $v_{max}$",
    )
    ax.grid(which="major", alpha=0.25)
    _settings_legend(ax, [s for s in Setting if _has(summary, s)], "best", markers=True)
    return figure


def _mark(ax: Axes, standing: Standing, name_height: int | None) -> None:
    """One contender; its name that many points higher, or no name."""
    contender, measures = standing
    x, y = 1e3 * measures.total.p50, max(measures.worst_excess, FLOOR)
    colour = SETTING_COLOURS[contender.setting]
    ax.plot(
        x,
        y,
        marker=SETTING_MARKERS[contender.setting],
        color=colour,
        markerfacecolor=colour if measures.fail_closed <= MOST_REFUSED else "none",
        linestyle="none",
        markersize=7,
    )
    if name_height is not None:
        ax.annotate(
            contender.backend,
            (x, y),
            xytext=(4, name_height),
            textcoords="offset points",
            fontsize=7,
            arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": "#57606a"},
        )


def profile_figure(summary: Summary, kind: str) -> Figure:
    """Performance profile (Dolan and More 2002): share of the problems decided within a multiple of the fastest's time.

    A problem that a contender did not decide itself, verified, counts as never decided.
    """
    setting = Setting.TOLERANCE if _has(summary, Setting.TOLERANCE) else _any_setting(summary)
    names = [name for name in _backends_by_time(summary, kind) if name]
    own = {
        name: times
        for name in names
        if len(times := _own_times(summary, kind, Contender(name, setting)))
    }
    figure, ax = _axes(5.0)
    ax.set(
        xscale="log",
        xlim=(1.0, FARTHEST_RATIO),
        ylim=(0.0, 1.02),
        xlabel=f"time of a decision over the fastest's, at the setting '{setting.title}'",
        ylabel="share of problems decided",
    )
    ax.grid(alpha=0.25)
    if not own:
        return figure
    best = np.min(list(own.values()), axis=0)
    solved = np.isfinite(best)
    colours = colormaps["tab20"].resampled(max(len(own), 2))
    for k, (name, times) in enumerate(reversed(own.items())):
        ratios = np.sort(times[solved] / best[solved])
        share = np.arange(1, len(ratios) + 1) / max(len(ratios), 1)
        reached = ratios <= FARTHEST_RATIO
        x = np.concatenate([[1.0], ratios[reached], [FARTHEST_RATIO]])
        y = np.concatenate([[0.0], share[reached], [share[reached].max(initial=0.0)]])
        dash = ("-", "--", ":")[k % 3]
        ax.step(x, y, where="post", label=name, color=colours(k), linestyle=dash, linewidth=1.6)
    ax.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return figure


def _axes(height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(8.4, height), layout="constrained")
    return figure, figure.subplots()


def _times(summary: Summary, kind: str, contender: Contender) -> FloatArray:
    """Times of the decisions that came back, in s."""
    sets = groups_of(summary.comparison.sets)[kind]
    times = [
        one.attempt.total for one in judged(summary.comparison, contender, Mode.SEQUENCE, sets)
    ]
    return np.array([time for time in times if not math.isnan(time)])


def _own_times(summary: Summary, kind: str, contender: Contender) -> FloatArray:
    """Times a problem and round, infinite where the contender did not decide itself; empty if it took no part."""
    sets = groups_of(summary.comparison.sets)[kind]
    attempts = [one.attempt for one in judged(summary.comparison, contender, Mode.SEQUENCE, sets)]
    times = np.array([attempt.total if attempt.is_own else math.inf for attempt in attempts])
    return times if np.isfinite(times).any() else np.empty(0)


def _backends_by_time(summary: Summary, kind: str) -> list[str]:
    """Backends that take these problems, the slowest first: figures are filled from below."""
    lines = summary.of_problems(kind, Mode.SEQUENCE)
    times: dict[str, float] = {}
    for line in lines:
        time = line.measures.total.p50
        name = line.contender.backend
        times[name] = min(times.get(name, math.inf), math.inf if math.isnan(time) else time)
    return sorted(times, key=lambda name: -times[name])


def _has(summary: Summary, setting: Setting) -> bool:
    return any(contender.setting is setting for contender in summary.comparison.contenders)


def _any_setting(summary: Summary) -> Setting:
    return summary.comparison.contenders[0].setting


def _settings_legend(
    ax: Axes,
    settings: Sequence[Setting],
    place: Literal["best", "upper right"],
    *,
    markers: bool = False,
) -> None:
    handles = [
        Line2D(
            [],
            [],
            color=SETTING_COLOURS[setting],
            linewidth=0 if markers else 5,
            marker=SETTING_MARKERS[setting] if markers else None,
            label=setting.title,
        )
        for setting in settings
    ]
    ax.legend(handles=handles, loc=place, fontsize=8, framealpha=0.9)
