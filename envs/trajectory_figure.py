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
MANY_ROBOTS = 30
"""More robots have stars and crosses of half the size."""
LABEL_GAP = 0.12
"""Times nearer to each other than this, in m, could not be read: the later one is left out."""
STANDING = 0.5
"""A robot that has moved by less than this part of its radius since its last disc gets no other one."""
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

    Discs stand where the robot was in regular time, darker as time goes on, with the time in s on every other one; of a
    robot that stands there is one disc. A cross stands at each collision. Of people there are the starts and the ways,
    in grey.

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
    number, written = 0, np.zeros((0, 2))
    size = 11.0 if recording.num_robots <= MANY_ROBOTS else 5.0
    for robot in range(recording.num_robots):
        is_person = bool(setting.person[robot])
        colour = PERSON if is_person else COLOURS[number % len(COLOURS)]
        number += not is_person
        marks = _draw_way(ax, recording, robot, colour)
        if int((~setting.person).sum()) <= FEW_ROBOTS:
            written = _write_times(ax, marks, written)
        if not is_person:
            ax.plot(
                *setting.goal[robot],
                marker="*",
                markersize=size,
                color=colour,
                markeredgecolor="k",
                markeredgewidth=size / 11.0,
                zorder=4,
            )
    wrecks = recording.position[-1][recording.collided[-1]]
    ax.plot(
        *wrecks.T,
        "X",
        markersize=size,
        color="#d61e1e",
        markeredgecolor="w",
        markeredgewidth=size / 11.0,
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.grid(visible=True, color="0.9")
    ax.set_axisbelow(True)


def _draw_way(
    ax: Axes, recording: Recording, robot: int, colour: str
) -> list[tuple[float, FloatArray]]:
    """The way of a robot from its start until it is gone or rests at its goal.

    Returns:
        Times, in s, and places of its discs.
    """
    way = recording.position[recording.present[:, robot], robot]
    moved = np.flatnonzero(np.hypot(*np.diff(way, axis=0).T) > 0.0)
    shown = way[: (moved[-1] + 2) if len(moved) else 1]
    radius = float(recording.setting.radius[robot])
    if recording.setting.person[robot]:
        ax.plot(*shown.T, color=colour, linewidth=0.8, zorder=1)
        _ring(ax, way[:1], 2.0 * radius, colour)
        return []
    every = max(1, round(MARK_EVERY / recording.setting.dt))
    marks: list[tuple[float, FloatArray]] = []
    for k, place in enumerate(shown[::every]):
        if not marks or np.hypot(*(place - marks[-1][1])) >= STANDING * radius:
            marks.append((k * MARK_EVERY, place))
    ax.plot(*shown.T, color=colour, linewidth=1.2, zorder=2)
    ax.add_collection(
        EllipseCollection(
            [2.0 * radius],
            [2.0 * radius],
            [0.0],
            units="xy",
            offsets=np.array([place for _, place in marks]),
            transOffset=ax.transData,
            facecolors=colour,
            alpha=np.linspace(0.15, 0.75, len(marks)),
        )
    )
    _ring(ax, way[:1], 2.0 * radius, colour)
    return marks


def _write_times(
    ax: Axes, marks: list[tuple[float, FloatArray]], written: FloatArray
) -> FloatArray:
    """Write times on discs, but not on others; ``written`` says where those stand, shape (K, 2), in m.

    Returns:
        The same with the new ones.
    """
    for time, place in marks[1:]:
        is_due = round(time, 6) % LABEL_EVERY == 0.0
        if is_due and not (np.hypot(*(written - place).T) < LABEL_GAP).any():
            ax.text(
                place[0], place[1], f"{time:.0f}", ha="center", va="center", fontsize=6, zorder=6
            )
            written = np.concatenate([written, place[np.newaxis]])
    return written


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
