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

MARK_EVERY = 4.0
"""Robots are drawn as discs this often along their ways, in s: close together is slow."""
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


def write_trajectories(path: Path, recordings: Sequence[tuple[str, Recording]]) -> None:
    """Draw whole episodes beside each other: one colour a robot, discs in regular time, a cross at each collision.

    Args:
        path: PNG to write.
        recordings: Titles and episodes.
    """
    figure = Figure(figsize=(5.6 * len(recordings), 6.0), layout="constrained")
    axes = figure.subplots(1, len(recordings), squeeze=False, sharex=True, sharey=True)[0]
    for ax, (title, recording) in zip(axes, recordings, strict=True):
        _draw(ax, recording)
        ax.set_title(f"{title}: {_result(recording)}")
        ax.set_xlabel("x in m")
    axes[0].set_ylabel("y in m")
    figure.savefig(path, dpi=110)


def _draw(ax: Axes, recording: Recording) -> None:
    step = recording.time[1] - recording.time[0] if recording.num_moments > 1 else 1.0
    every = max(1, round(MARK_EVERY / step))
    ax.add_collection(LineCollection(list(recording.walls), colors="0.35", linewidths=2.0))
    for robot in range(recording.num_robots):
        colour = COLOURS[robot % len(COLOURS)]
        way = recording.position[recording.present[:, robot], robot]
        ax.plot(way[:, 0], way[:, 1], color=colour, linewidth=1.2)
        diameter = 2.0 * recording.radius[robot]
        ax.add_collection(
            EllipseCollection(
                [diameter],
                [diameter],
                [0.0],
                units="xy",
                offsets=way[::every],
                transOffset=ax.transData,
                facecolors=colour,
                alpha=0.35,
            )
        )
        ax.plot(
            *recording.goal[robot], marker="*", markersize=11, color=colour, markeredgecolor="k"
        )
    wrecks = recording.position[-1][recording.collided[-1]]
    ax.plot(
        wrecks[:, 0],
        wrecks[:, 1],
        "X",
        markersize=11,
        color="#d61e1e",
        markeredgecolor="w",
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.grid(visible=True, color="0.9")


def _result(recording: Recording) -> str:
    collided = int(recording.collided[-1].sum())
    arrived = int(np.count_nonzero(recording.arrived[-1] & ~recording.collided[-1]))
    return f"{arrived} of {recording.num_robots} arrived, {collided} collided"
