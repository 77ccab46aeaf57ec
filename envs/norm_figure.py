"""The picture of Fig. 2 of Qin et al., drawn from the shipped area, and the distances that it asks for.

    python -m envs.norm_figure --out docs/norm_area.png

SI units.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from envs.fleet import RADIUS
from envs.norm_area import KEY_POINTS, NormArea
from envs.norm_distances import (
    SideDistances,
    corner_distances,
    oncoming_distances,
    overlap_region,
    overtaking_distances,
    ring,
    ring_radius,
)
from envs.norm_manoeuvre import overtaking_overlap
from safefilter.arrays import FloatArray

BLUE, RED, GREEN = "#4477aa", "#ee6677", "#228833"
UP = np.array([0.0, 1.0])
RING = 8
"""Robots of a ring, as many as cross in Scenarios 3 and 4."""


def write_norm_figure(path: Path, area: NormArea) -> None:
    """Draw the area, and the distances at which two of them just touch.

    Args:
        path: PNG to write.
        area: Around every robot.
    """
    figure = Figure(figsize=(13.0, 8.6), layout="constrained")
    axes = figure.subplots(2, 3)
    _draw_area(axes[0, 0], area)
    _draw_oncoming(axes[0, 1], area)
    _draw_overtaking(axes[0, 2], area)
    for ax, letter, is_clockwise in ((axes[1, 0], "d", True), (axes[1, 1], "e", False)):
        _draw_ring(ax, area, letter, is_clockwise=is_clockwise)
    _draw_regions(axes[1, 2], area)
    for ax in axes.flat:
        ax.set_aspect("equal")
        ax.grid(visible=True, color="0.92")
        ax.set_axisbelow(True)
        ax.autoscale_view()
    figure.supxlabel("m; robots of radius 0.105 m; areas just touch")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)


def distance_lines(area: NormArea) -> list[str]:
    """The distances that an area asks for, as lines of text, in m."""

    def line(text: str, found: SideDistances) -> str:
        return f"{text:<44} {found.left:10.4f} {found.right:10.4f}"

    lines = [f"{'other robot is on the':<44} {'left':>10} {'right':>10}"]
    lines += [
        line("oncoming: distance of the lanes", oncoming_distances(area)),
        line("overtaking: distance of the lanes", overtaking_distances(area)),
        line("farthest corners abeam: distance of centres", corner_distances(area)),
        f"{'middle of the ring is on the':<44} {'left':>10} {'right':>10}",
    ]
    for number in (2, 3, 4, 6, RING):
        radii = SideDistances(
            left=ring_radius(area, number, is_clockwise=False),
            right=ring_radius(area, number, is_clockwise=True),
        )
        lines.append(line(f"ring of {number}: radius", radii))
    lines.append(f"{'overtaking manoeuvre: s of overlap, on the':<44} {'left':>10} {'right':>10}")
    for aside, length in ((0.30, 1.0), (0.30, 1.5), (0.36, 1.5)):
        times = overtaking_overlap(area, aside, length)
        text = f"{aside:.2f} m aside over {length:.1f} m"
        lines.append(f"{text:<44} {times.on_left:10.2f} {times.on_right:10.2f}")
    nearest = float(area.edge_distances.min())
    lines.append(
        f"nearest edge {nearest:.4f} from the centre, farthest corner {area.circumradius:.4f}"
    )
    return lines


def main(out: Path = Path("out/norm_area.png")) -> None:
    """Draw the picture of Fig. 2, and print the distances for both readings of the key points.

    Args:
        out: PNG to write.
    """
    area = NormArea.of_paper()
    write_norm_figure(out, area)
    other = NormArea(np.array(KEY_POINTS))
    for title, each in (
        ("key points as (right, forward): shipped", area),
        ("key points as (forward, left): the other reading", other),
    ):
        sys.stdout.write("\n".join([title, *distance_lines(each), "", ""]))
    sys.stdout.write(f"wrote {out}\n")


def _draw_robot(
    ax: Axes, area: NormArea, position: FloatArray, facing: FloatArray, colour: str
) -> None:
    corners = area.placed(position, facing)
    ax.add_patch(Polygon(corners, facecolor=colour, alpha=0.25, edgecolor=colour, linewidth=1.5))
    ax.add_patch(
        Circle((position[0], position[1]), RADIUS, fill=False, color=colour, linewidth=1.2)
    )
    ax.annotate(
        "",
        xy=tuple(position + 1.3 * RADIUS * facing),
        xytext=tuple(position),
        arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.6},
    )
    ax.update_datalim(corners)


def _draw_area(ax: Axes, area: NormArea) -> None:
    _draw_robot(ax, area, np.zeros(2), UP, BLUE)
    for number, (right, forward) in enumerate(KEY_POINTS, start=1):
        ax.plot(right, forward, "o", color="k", markersize=4)
        ax.annotate(
            f"$z_{number}$ ({right:g}, {forward:g})",
            (right, forward),
            textcoords="offset points",
            xytext=(0, 7 if forward > 0.0 else -15),
            ha="center",
            fontsize=8,
        )
    ax.set_title("(a) the area: (right, forward)")
    ax.margins(0.25)


def _measure(ax: Axes, start: FloatArray, end: FloatArray, text: str) -> None:
    ax.annotate(
        "", xy=tuple(end), xytext=tuple(start), arrowprops={"arrowstyle": "<->", "color": "k"}
    )
    ax.annotate(
        text,
        tuple(0.5 * (start + end)),
        textcoords="offset points",
        xytext=(0, 5),
        ha="center",
        fontsize=9,
    )


def _draw_pairs(
    ax: Axes, area: NormArea, distances: SideDistances, other_facing: FloatArray
) -> None:
    """Two pairs above each other: the other robot (red) on the left, then on the right."""
    for height, aside, colour in ((0.0, -distances.left, GREEN), (0.75, distances.right, RED)):
        here, there = np.array([0.0, height]), np.array([aside, height])
        _draw_robot(ax, area, here, UP, BLUE)
        _draw_robot(ax, area, there, other_facing, colour)
        label = np.array([0.0, 0.25])
        _measure(ax, here + label, there + label, f"{abs(aside):.2f}")
    ax.margins(0.08)
    ax.set_ylim(-0.3, 1.15)


def _draw_oncoming(ax: Axes, area: NormArea) -> None:
    _draw_pairs(ax, area, oncoming_distances(area), -UP)
    ax.set_title(
        "(b) head-on: passing on the right (below)\nneeds less room than on the left (above)"
    )


def _draw_overtaking(ax: Axes, area: NormArea) -> None:
    _draw_pairs(ax, area, overtaking_distances(area), UP)
    ax.set_title("(c) overtaking: on the left (above)\nneeds as much room as on the right (below)")


def _draw_ring(ax: Axes, area: NormArea, letter: str, *, is_clockwise: bool) -> None:
    radius = ring_radius(area, RING, is_clockwise=is_clockwise)
    positions, facings = ring(RING, radius, is_clockwise=is_clockwise)
    for position, facing in zip(positions, facings, strict=True):
        _draw_robot(ax, area, position, facing, RED if is_clockwise else GREEN)
    ax.add_patch(Circle((0.0, 0.0), radius, fill=False, color="0.4", linestyle="--"))
    _measure(ax, np.zeros(2), positions[0], f"{radius:.2f}")
    ax.set_title(f"({letter}) {'clockwise' if is_clockwise else 'anticlockwise'}, ring of {RING}")
    ax.set_xlim(-0.75, 0.75)
    ax.set_ylim(-0.75, 0.75)


def _draw_regions(ax: Axes, area: NormArea) -> None:
    """Regions of relative positions, with the robot facing up."""
    for turn, colour, label in ((np.pi, BLUE, "oncoming"), (0.0, RED, "the same way")):
        region = overlap_region(area, turn)
        corners = np.stack([-region[:, 1], region[:, 0]], axis=1)
        ax.add_patch(
            Polygon(
                corners, facecolor=colour, alpha=0.25, edgecolor=colour, linewidth=1.5, label=label
            )
        )
        ax.update_datalim(corners)
    ax.plot(0.0, 0.0, "^", color="k", markersize=9)
    ax.axvline(0.0, color="0.6", linewidth=0.8)
    ax.set_title("(f) centres of another robot\nthat make the areas overlap")
    ax.legend(loc="upper left", fontsize=8)
    ax.margins(0.15)


if __name__ == "__main__":
    tyro.cli(main)
