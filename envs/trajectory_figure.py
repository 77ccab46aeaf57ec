"""Figures of whole trajectories, as Figs. 6 and 7 of Qin et al.

Letters: T moments, N robots. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from envs.recording import Recording
from safefilter.arrays import FloatArray

MARK_EVERY = 4.0
"""Robots are drawn as discs this often along their ways, in s: close together is slow, and each is darker than the
one before."""
LABEL_EVERY = 8.0
"""The time is written beside the disc this often, in s."""
FEW_ROBOTS = 12
"""Up to so many robots have their times written."""
COLOURS = (
    "#4477aa",
    "#ee6677",
    "#228833",
    "#ccbb44",
    "#66ccee",
    "#aa3377",
    "#ee8866",
    "#555555",
)
"""One a robot, repeated: Paul Tol's palette that colour-blind readers tell apart."""
PERSON = "#b0a898"


def write_trajectories(path: Path, recordings: Sequence[tuple[str, Recording]]) -> None:
    """Draw whole episodes beside each other: one colour a robot, the start as a ring, the goal as a star.

    Discs stand where the robot was in regular time, darker as time goes on, with the time in s beside every other
    one; a cross stands at each collision. Of people there are the starts and the ways, in grey.

    Args:
        path: PNG to write.
        recordings: Titles and episodes.
    """
    width, height = _extent(recordings)
    # Wide worlds make flat figures.
    tall = float(np.clip(5.0 * height / width + 1.0, 2.4, 6.0))
    figure = Figure(figsize=(5.6 * len(recordings), tall), layout="constrained")
    axes = figure.subplots(1, len(recordings), squeeze=False, sharex=True, sharey=True)[0]
    for ax, (title, recording) in zip(axes, recordings, strict=True):
        _draw(ax, recording)
        ax.set_title(f"{title}: {_result(recording)}")
        ax.set_xlabel("x in m")
    axes[0].set_ylabel("y in m")
    figure.savefig(path, dpi=110)


def _extent(recordings: Sequence[tuple[str, Recording]]) -> tuple[float, float]:
    """Width and height of what is shown, in m."""
    places = [
        part.reshape(-1, 2)
        for _, recording in recordings
        for part in (recording.setting.walls, recording.setting.goal, recording.position)
    ]
    # As much room as a robot takes.
    width, height = np.ptp(np.concatenate(places), axis=0) + 0.4
    return float(width), float(height)


def _draw(ax: Axes, recording: Recording) -> None:
    setting = recording.setting
    ax.add_collection(LineCollection(list(setting.walls), colors="0.35", linewidths=2.0))
    number = 0
    for robot in range(recording.num_robots):
        is_person = bool(setting.person[robot])
        colour = PERSON if is_person else COLOURS[number % len(COLOURS)]
        number += not is_person
        _draw_way(ax, recording, robot, colour)
        if not is_person:
            ax.plot(
                *setting.goal[robot],
                marker="*",
                markersize=11,
                color=colour,
                markeredgecolor="k",
                zorder=4,
            )
    wrecks = recording.position[-1][recording.collided[-1]]
    ax.plot(
        *wrecks.T,
        "X",
        markersize=11,
        color="#d61e1e",
        markeredgecolor="w",
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.grid(visible=True, color="0.9")
    ax.set_axisbelow(True)


def _draw_way(ax: Axes, recording: Recording, robot: int, colour: str) -> None:
    """The way of a robot from its start until it is gone or rests at its goal."""
    way = recording.position[recording.present[:, robot], robot]
    moved = np.flatnonzero(np.hypot(*np.diff(way, axis=0).T) > 0.0)
    shown = way[: (moved[-1] + 2) if len(moved) else 1]
    every = max(1, round(MARK_EVERY / recording.setting.dt))
    marks = shown[::every]
    diameter = 2.0 * recording.setting.radius[robot]
    if recording.setting.person[robot]:
        ax.plot(*shown.T, color=colour, linewidth=0.8, zorder=1)
        _ring(ax, way[:1], diameter, colour)
        return
    ax.plot(*shown.T, color=colour, linewidth=1.2, zorder=2)
    ax.add_collection(
        EllipseCollection(
            [diameter],
            [diameter],
            [0.0],
            units="xy",
            offsets=marks,
            transOffset=ax.transData,
            facecolors=colour,
            alpha=np.linspace(0.15, 0.75, len(marks)),
        )
    )
    _ring(ax, way[:1], diameter, colour)
    if int((~recording.setting.person).sum()) > FEW_ROBOTS:
        return
    for k in range(1, len(marks)):
        if round(k * MARK_EVERY, 6) % LABEL_EVERY == 0.0:
            ax.annotate(
                f"{k * MARK_EVERY:.0f}",
                marks[k],
                ha="center",
                va="center",
                fontsize=6,
                color="k",
                zorder=6,
            )


def _ring(ax: Axes, place: FloatArray, diameter: float, colour: str) -> None:
    ax.add_collection(
        EllipseCollection(
            [diameter],
            [diameter],
            [0.0],
            units="xy",
            offsets=place,
            transOffset=ax.transData,
            facecolors="none",
            edgecolors=colour,
            linewidths=1.6,
        )
    )


def _result(recording: Recording) -> str:
    robots = ~recording.setting.person
    collided = int((recording.collided[-1] & robots).sum())
    arrived = int(np.count_nonzero(recording.arrived[-1] & ~recording.collided[-1] & robots))
    return f"{arrived} of {int(robots.sum())} arrived, {collided} collided"
