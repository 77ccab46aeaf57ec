"""Pictures of decisions: the velocity space of the paper's Fig. 3. Needs matplotlib (`pip install safefilter[demo]`).

Letters: K corners. m/s.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Polygon

from safefilter.arrays import FloatArray
from safefilter.decision import Case, Decision
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.scene_arrays import PLANE

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes

    from safefilter.half_spaces import HalfSpaces
    from safefilter.safety_filter import SafetyFilter
    from safefilter.scene import Scene

# Colours that keep apart in grey and for colour-blind readers (Okabe and Ito).
ALLOWED, PERMITTED, HARD, SOFT = "#56b4e9", "#009e73", "#000000", "#d55e00"
OBSTACLE, WANTED, CHOSEN = "#999999", "#e69f00", "#0072b2"
CASE_TITLES = {
    Case.SAFE: "Case-1: the wanted velocity is permitted, and executes",
    Case.PROJECTED: "Case-2: the nearest permitted velocity executes",
    Case.LEAST_VIOLATION: "Case-3: none is permitted; the least violation executes",
}
ARC_CORNERS = 48


def velocity_space(
    safety_filter: SafetyFilter,
    scene: Scene,
    action: npt.ArrayLike,
    decision: Decision,
    k: int = 0,
    *,
    time_horizon: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw what decision k was made from: Fig. 3 of Qin et al. for any decision.

    Allowed velocities in blue; permitted ones in green (in Case-3: those that violate soft rows least, often a sliver);
    each row as a line with whom it is against and its forbidden side shaded; the wanted and the chosen velocity as
    arrows; the velocity obstacles of neighbours in grey.

    Args:
        safety_filter: The filter that decided.
        scene: The scene it decided in.
        action: The wanted actions, shape (B, 2).
        decision: Its decisions.
        k: Which one.
        time_horizon: tau in s; with it, velocity obstacles are drawn (around observed velocities).
        ax: Axes to draw on; None makes new ones.

    Returns:
        The axes.

    Raises:
        OutOfRange: If there is no such decision.
        InvalidInput: If it is about a robot in space.
    """
    if scene.dimension > PLANE:
        raise InvalidInput(
            "scene: pictures are of velocities in the plane, its robots live in space"
        )
    if not 0 <= k < len(decision):
        raise OutOfRange(f"k: expected a decision 0 to {len(decision) - 1}, got {k}")
    axes = plt.subplots(figsize=(6.4, 6.4))[1] if ax is None else ax
    rows = safety_filter.half_spaces(scene, action, decision.index)
    wanted = decision.wanted[k]
    view = _view(rows, k, wanted, decision.velocity[k])
    if time_horizon is not None:
        _draw_obstacles(axes, scene, int(decision.index[k]), time_horizon, view)
    _draw_sets(axes, rows, decision, k, view)
    _draw_rows(axes, rows, k, view)
    _draw_arrows(axes, wanted, decision, k)
    axes.set(
        xlim=(-view, view),
        ylim=(-view, view),
        aspect="equal",
        xlabel="$v_x$ in m/s",
        ylabel="$v_y$ in m/s",
        title=f"robot {decision.index[k]}, {CASE_TITLES[Case(int(decision.case[k]))]}",
    )
    axes.title.set_fontsize(10)
    axes.legend(loc="upper left", fontsize=8, framealpha=0.9)
    return axes


def _view(rows: HalfSpaces, k: int, wanted: FloatArray, chosen: FloatArray) -> float:
    """Half the width of the picture: all of the allowed velocities and both arrows."""
    sides = rows.present[k] & (rows.labels[k, :, 0] == 0)
    largest = float(np.abs(rows.offsets[k][sides]).max(initial=0.0))
    reach = max(largest, float(np.abs(wanted).max()), float(np.abs(chosen).max()), 1e-6)
    return 1.35 * reach


def clipped(corners: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Part of a convex polygon on the permitted side of a row: corners, shape (K, 2)."""
    kept: list[FloatArray] = []
    inside = corners @ normal - offset
    for here in range(len(corners)):
        after = (here + 1) % len(corners)
        if inside[here] >= 0.0:
            kept.append(corners[here])
        if inside[here] * inside[after] < 0.0:
            part = inside[here] / (inside[here] - inside[after])
            kept.append(corners[here] + part * (corners[after] - corners[here]))
    return np.array(kept).reshape(-1, 2)


def _draw_sets(axes: Axes, rows: HalfSpaces, decision: Decision, k: int, view: float) -> None:
    allowed = permitted = view * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    is_relaxed = decision.case[k] == Case.LEAST_VIOLATION
    relaxation = float(decision.violation[k]) if is_relaxed else 0.0
    for m in np.flatnonzero(rows.present[k]):
        normal, offset = rows.normals[k, m], float(rows.offsets[k, m])
        if rows.labels[k, m, 0] == 0:
            allowed = clipped(allowed, normal, offset)
        soft = 0.0 if rows.hard[k, m] else relaxation
        permitted = clipped(permitted, normal, offset - soft)
    axes.add_patch(Polygon(allowed, facecolor=ALLOWED, alpha=0.25, label="allowed"))
    label = "least violation" if relaxation > 0.0 else "permitted"
    if len(permitted):
        axes.add_patch(
            Polygon(
                permitted,
                facecolor=PERMITTED,
                edgecolor=PERMITTED,
                alpha=0.5,
                linewidth=2.0,
                label=label,
            )
        )


def _draw_rows(axes: Axes, rows: HalfSpaces, k: int, view: float) -> None:
    names: set[str] = set()
    for m in np.flatnonzero(rows.present[k] & (rows.labels[k, :, 0] != 0)):
        normal, offset = rows.normals[k, m], float(rows.offsets[k, m])
        if abs(offset) > 1.3 * view:
            continue  # the line misses the picture
        foot, along = offset * normal, np.array([-normal[1], normal[0]])
        ends = np.stack([foot - 3.0 * view * along, foot + 3.0 * view * along])
        colour = HARD if rows.hard[k, m] else SOFT
        name = "hard row" if rows.hard[k, m] else "soft row, Eq. (15)"
        label = None if name in names else name
        names.add(name)
        axes.plot(*ends.T, color=colour, linewidth=1.4, label=label, zorder=3)
        shade = np.concatenate([ends, ends[::-1] - 0.05 * view * normal])
        axes.add_patch(Polygon(shade, facecolor=colour, alpha=0.25, linewidth=0.0))
        # Places alternate, so that names of parallel rows keep apart.
        shift = (0.35 + 0.2 * (m % 3)) * view * (1.0 if m % 2 else -1.0)
        place = np.clip(foot + shift * along, -0.9 * view, 0.9 * view)
        _write(axes, rows.describe(k, int(m)).replace("_", " "), place, along, colour)


def _write(axes: Axes, name: str, place: FloatArray, along: FloatArray, colour: str) -> None:
    """Write a name along a line, never upside down."""
    angle = math.degrees(math.atan2(along[1], along[0]))
    axes.text(
        float(place[0]),
        float(place[1]),
        name,
        color=colour,
        fontsize=7,
        rotation=(angle + 90.0) % 180.0 - 90.0,
        ha="center",
        va="center",
        bbox={"facecolor": "white", "alpha": 0.7, "pad": 0.5, "linewidth": 0.0},
        zorder=5,
    )


def _draw_arrows(axes: Axes, wanted: FloatArray, decision: Decision, k: int) -> None:
    for name, velocity, colour, width in (
        ("wanted", wanted, WANTED, 0.012),
        ("chosen", decision.velocity[k], CHOSEN, 0.007),
    ):
        axes.quiver(
            0.0,
            0.0,
            *velocity,
            color=colour,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            width=width,
            label=name,
            zorder=4,
        )
        axes.plot(*velocity, "o", color=colour, markersize=5, zorder=6)


def _draw_obstacles(axes: Axes, scene: Scene, robot: int, time_horizon: float, view: float) -> None:
    """Velocity obstacles of neighbours, moved by the neighbour's observed velocity."""
    label: str | None = "velocity obstacle"
    for j in scene.neighbours_of(robot):
        relative = scene.position[j] - scene.position[robot]
        radius = float(scene.radius[robot] + scene.radius[j])
        outline = velocity_obstacle_outline(relative, radius, time_horizon, 10.0 * view)
        if len(outline):
            corners = outline + scene.velocity[j]
            axes.add_patch(
                Polygon(corners, facecolor=OBSTACLE, alpha=0.25, linewidth=0.0, label=label)
            )
            label = None


def velocity_obstacle_outline(
    relative: FloatArray, radius: float, time_horizon: float, length: float
) -> FloatArray:
    """Outline of a truncated velocity obstacle, legs cut at a length: shape (K, 2); empty for discs that overlap."""
    distance = float(np.hypot(*relative))
    if distance <= radius:
        return np.empty((0, 2))
    axis, half = math.atan2(relative[1], relative[0]), math.asin(radius / distance)
    # The arc that faces the origin runs from one tangent point to the other.
    opening = 0.5 * math.pi - half
    angle = axis + math.pi + np.linspace(-opening, opening, ARC_CORNERS)
    arc = (relative + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)) / time_horizon
    legs = axis + np.array([-half, half])
    far = length * np.stack([np.cos(legs), np.sin(legs)], axis=1)
    return np.concatenate([arc, far])
