"""The ways of drones across a sphere, at four moments beside each other.

Letters: T steps, N robots. SI units.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from safefilter.arrays import FloatArray

MOMENTS = (0.0, 0.4, 0.6, 1.0)
"""Parts of the flight."""
TAIL = 12.0
"""Ways are drawn this long, in s."""
COLOURS = ("#4477aa", "#ccbb44", "#ee6677")
"""From the lowest priority to the highest: Paul Tol's palette that colour-blind readers tell apart."""


def write_sphere(
    path: Path, track: FloatArray, priority: FloatArray, dt: float, radius: float
) -> None:
    """Draw four moments of a flight beside each other.

    Args:
        path: PNG file to write.
        track: Centres, shape (T, N, 3), in m.
        priority: Shape (N,).
        dt: Duration of a step, in s.
        radius: Of a drone, in m.
    """
    figure = Figure(figsize=(16.0, 4.8), layout="constrained")
    extent = float(np.abs(track[0]).max())
    values = np.unique(priority)
    colour = np.array(COLOURS)[np.searchsorted(values, priority) % len(COLOURS)]
    for k, part in enumerate(MOMENTS):
        axes = figure.add_subplot(1, len(MOMENTS), k + 1, projection="3d")
        step = round(part * (len(track) - 1))
        _draw(axes, track[max(0, step - round(TAIL / dt)) : step + 1], colour)
        axes.set_title(f"{step * dt:.0f} s")
        axes.set_xlim(-extent, extent)
        axes.set_ylim(-extent, extent)
        axes.set_zlim(-extent, extent)
        axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.95)
        axes.set_xlabel("x in m")
        axes.set_ylabel("y in m")
    legend = "   ".join(
        f"{name}: priority {value:g}"
        for name, value in zip(("blue", "yellow", "red"), values.tolist(), strict=False)
    )
    figure.suptitle(
        f"{track.shape[1]} drones of radius {radius:g} m to opposite points; tails of {TAIL:.0f} s. {legend}"
    )
    figure.savefig(path, dpi=80)


def _draw(axes: Any, tail: FloatArray, colour: npt.NDArray[np.str_]) -> None:
    for robot in range(tail.shape[1]):
        axes.plot(*tail[:, robot].T, color=colour[robot], linewidth=0.8, alpha=0.6)
    axes.scatter(*tail[-1].T, c=colour, s=22.0, depthshade=True)
