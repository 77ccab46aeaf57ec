"""Walls: the direction to the closest point of a segment, and the free gap to it.

A segment is convex, so everything of it lies beyond the line through its closest point across the direction e to that
point. A disc that advances along e by no more than the gap does not touch it. Shapes, convex or not, are taken by
their outline: a robot that starts outside cannot get in without crossing it.

Letters: p is the robot's centre, a and b the ends of the segment. m.
"""

from __future__ import annotations

import math

from safefilter.constraints.margins import add_fence, wall_tilt
from safefilter.constraints.row_buffers import RowLabels, label_rows
from safefilter.jit import formula
from safefilter.scene import RADIUS, X, Y
from safefilter.scene_arrays import SceneArrays
from safefilter.wall_boxes import RUN, is_box_far, is_far


@formula
def projection_part(
    a_x: float, a_y: float, b_x: float, b_y: float, p_x: float, p_y: float, length_squared: float
) -> float:
    """Where the foot of the perpendicular from p lies on the line: 0 at a, 1 at b."""
    return ((p_x - a_x) * (b_x - a_x) + (p_y - a_y) * (b_y - a_y)) / length_squared


@formula
def to_closest_point(
    a_x: float, a_y: float, b_x: float, b_y: float, p_x: float, p_y: float
) -> tuple[float, float]:
    """Vector from p to the closest point of the segment."""
    length_squared = (b_x - a_x) * (b_x - a_x) + (b_y - a_y) * (b_y - a_y)
    part = 0.0
    if length_squared > 0.0:
        part = min(1.0, max(0.0, projection_part(a_x, a_y, b_x, b_y, p_x, p_y, length_squared)))
    return a_x + part * (b_x - a_x) - p_x, a_y + part * (b_y - a_y) - p_y


@formula
def across(a_x: float, a_y: float, b_x: float, b_y: float) -> tuple[float, float]:
    """Unit vector across a segment, for a centre that lies on it; along x for a point."""
    length = math.sqrt((b_x - a_x) * (b_x - a_x) + (b_y - a_y) * (b_y - a_y))
    if length > 0.0:
        return -(b_y - a_y) / length, (b_x - a_x) / length
    return 1.0, 0.0


@formula
def wall_budget(distance: float, radius: float, margin: float) -> float:
    """How far a robot may advance towards a wall: all of the gap."""
    return max(0.0, distance - radius - margin)


@formula
def add_wall_rows(
    rows: RowLabels,
    count: int,
    scene: SceneArrays,
    i: int,
    margin: float,
    horizon: float,
    speed_limit: float,
    source: int,
    error: float,
    gain: float,
    turn_cosine: float,
    turn_sine: float,
) -> int:
    """Write robot i's rows ``e @ v <= gap / horizon`` from ``count`` on; returns the new count.

    With the step as horizon these are the budgets of the one-step separation. With a longer one they are the velocity
    obstacle of the segment around standing still: the boundary point nearest to v = 0 is the cut-off across e.
    A row that the speed limit makes true anyway is left out.

    The last four say by how much the robot may be off where it is said to be, and off what it is told to do: see
    `margins`. The speed limit is that of what executes.
    """
    state = scene.state
    p_x, p_y, radius = state[i, X], state[i, Y], state[i, RADIUS]
    reach = speed_limit * horizon + radius + margin + error
    for part in range(2):
        # Walls that everyone knows come first, then those of this robot's own.
        start = 0 if part == 0 else scene.wall_range[i, 0]
        stop = scene.num_shared_walls if part == 0 else scene.wall_range[i, 1]
        for run in range(start // RUN, -(-stop // RUN)):
            if len(scene.wall_boxes) > 0:
                left, bottom, right, top, most = scene.wall_boxes[run]
                if is_box_far(left, bottom, right, top, p_x, p_y, reach + most):
                    continue
            for w in range(max(start, run * RUN), min(stop, (run + 1) * RUN)):
                a_x, a_y, b_x, b_y, own_margin = scene.walls[w]
                c_x, c_y = to_closest_point(a_x, a_y, b_x, b_y, p_x, p_y)
                if is_far(c_x, c_y, reach + own_margin):
                    continue
                distance = math.sqrt(c_x * c_x + c_y * c_y)
                e_x, e_y = across(a_x, a_y, b_x, b_y)
                if distance > 0.0:
                    e_x, e_y = c_x / distance, c_y / distance
                kept = margin + own_margin + error
                first = count
                count = add_fence(
                    rows,
                    count,
                    e_x,
                    e_y,
                    wall_tilt(distance, radius + kept, error),
                    turn_cosine,
                    turn_sine,
                    wall_budget(distance, radius, kept) / (gain * horizon),
                )
                label_rows(rows, first, count, source, w)
    return count
