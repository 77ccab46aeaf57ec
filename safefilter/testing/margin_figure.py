"""The picture of `margin_curves`. Needs matplotlib (`pip install safefilter[compare]`).

m and s; clearances are shown in mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from safefilter.closest_approach import CONTACT_TOLERANCE

# Paul Tol's palette, which colour-blind readers tell apart, and a shape each.
STYLES = (
    ("#4477aa", "o"),
    ("#ee6677", "s"),
    ("#228833", "^"),
    ("#ccbb44", "D"),
    ("#66ccee", "v"),
    ("#aa3377", "P"),
    ("#777777", "X"),
    ("#000000", "*"),
)
CellFigures = Mapping[str, str | float]


def save_figure(cells: Sequence[CellFigures], path: Path) -> None:
    """Draw what was stated against what came of it.

    Args:
        cells: Fields of `margin_curves.Cell`.
        path: Picture.
    """
    figure = Figure(figsize=(14.0, 4.2), layout="constrained")
    axes: list[Axes] = list(figure.subplots(1, 3))
    errors = list(dict.fromkeys(str(cell["error"]) for cell in cells))
    for error, (colour, marker) in zip(errors, STYLES, strict=False):
        own = [cell for cell in cells if cell["error"] == error]
        ratio = [float(cell["ratio"]) for cell in own]
        values = (
            [
                1e3 * min(float(cell["clearance"]), float(cell["crossing_clearance"]))
                for cell in own
            ],
            [100.0 * float(cell["collisions"]) / float(cell["encounters"]) for cell in own],
            [float(cell["time_to_goal"]) for cell in own],
        )
        label = f"{error.replace('_', ' ')}, {float(own[0]['real']):g}"
        for axis, value in zip(axes, values, strict=True):
            axis.plot(ratio, value, color=colour, marker=marker, label=label)
    axes[0].axhspan(axes[0].get_ylim()[0], -1e3 * CONTACT_TOLERANCE, color="#ee6677", alpha=0.15)
    titles = ("least clearance, mm", "encounters with a collision, %", "mean time to goal, s")
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title)
        axis.set_xlabel("stated bound / real error")
        axis.axvline(1.0, color="0.6", linestyle=":", zorder=0)
        axis.grid(visible=True, color="0.92")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, title="real error (m, rad, m/s, s, 1)", loc="outside right upper"
    )
    figure.savefig(path, dpi=110)
