"""Judging the pairs and walls of one world: a broad phase by cells and start distances, then the certified bound.

Nothing comes nearer in a step than its distance at the start less what both travel. So only the nearest of each robot,
and what that bound does not clear, need the arcs of `envs.arcs` at all.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from envs.arcs import Path, Segment, first_entry, least_path_distance, point_distance_squared
from envs.robot_grid_kernel import RobotGrid, cells_near
from envs.walls import WallArrays, cells_within, entries_of_row
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import formula

# Discs may start exactly touching. Coordinates of kilometres are rounded to 1e-13 m; a nanometre is no rounding.
CONTACT_TOLERANCE = 1e-9
COARSENESS = 0.05
"""Of a free distance: how much less may be reported. Contacts are decided to a nanometre all the same."""
NEAR_WALLS = 0.8
"""Distance in m within which walls are looked for first."""
POINT = Segment(0.0, 0.0, 0.0, 0.0)


class StepArrays(NamedTuple):
    """What moves how in one step, and what can touch what.

    Attributes:
        position: Centres at the start, shape (W, N, 2), in m.
        displacement: Start velocities times the duration of the step, shape (W, N, 2), in m.
        turn: Angles turned, shape (W, N), in rad.
        travel: Lengths of the ways, shape (W, N), in m.
        radius: Shape (W, N), in m.
        present: Shape (W, N): robots with a body.
        wrecked: Shape (W, N): robots that have collided before.
        person: Shape (W, N): people, who are not judged against each other, nor against walls.
    """

    position: FloatArray
    displacement: FloatArray
    turn: FloatArray
    travel: FloatArray
    radius: FloatArray
    present: BoolArray
    wrecked: BoolArray
    person: BoolArray


class ContactArrays(NamedTuple):
    """Fields of `envs.collision.Contacts`."""

    clearance: FloatArray
    wall_clearance: FloatArray
    touched: BoolArray
    hit_wall: BoolArray
    fraction: FloatArray
    num_pairs: IntArray


@formula
def is_judged(step: StepArrays, w: int, i: int, j: int) -> bool:
    """Can two robots touch in a way that counts? Two wrecks have, and people look after each other."""
    both_wrecked: bool = step.wrecked[w, i] and step.wrecked[w, j]
    both_people: bool = step.person[w, i] and step.person[w, j]
    return i != j and not both_wrecked and not both_people


@formula
def start_gap(step: StepArrays, w: int, i: int, j: int) -> float:
    """Free distance of two robots at the start of the step, in m."""
    x = step.position[w, j, 0] - step.position[w, i, 0]
    y = step.position[w, j, 1] - step.position[w, i, 1]
    gap: float = math.sqrt(x * x + y * y) - step.radius[w, i] - step.radius[w, j]
    return gap


@formula
def judge_pair(step: StepArrays, contacts: ContactArrays, w: int, i: int, j: int) -> None:
    """Free distance of two robots over the step, and when they touch, if they do."""
    gap, travels = start_gap(step, w, i, j), step.travel[w, i] + step.travel[w, j]
    least = gap - travels
    # What is further than both robots' least clearance so far need not be known; every contact has to be.
    known = max(0.0, contacts.clearance[w, i], contacts.clearance[w, j])
    if least >= known:
        return
    if travels > COARSENESS * gap:
        path = Path(
            step.position[w, j, 0] - step.position[w, i, 0],
            step.position[w, j, 1] - step.position[w, i, 1],
            step.displacement[w, j, 0],
            step.displacement[w, j, 1],
            step.turn[w, j],
            step.displacement[w, i, 0],
            step.displacement[w, i, 1],
            step.turn[w, i],
        )
        reach = step.radius[w, i] + step.radius[w, j]
        least = least_path_distance(path, POINT, reach + known, reach, COARSENESS) - reach
        if least < -CONTACT_TOLERANCE:
            s = first_entry(path, POINT, reach)
            contacts.num_pairs[w] += 1
            contacts.touched[w, i], contacts.touched[w, j] = True, True
            contacts.fraction[w, i] = min(contacts.fraction[w, i], s)
            contacts.fraction[w, j] = min(contacts.fraction[w, j], s)
    contacts.clearance[w, i] = min(contacts.clearance[w, i], least)
    contacts.clearance[w, j] = min(contacts.clearance[w, j], least)


@formula
def nearest_later(
    step: StepArrays, grid: RobotGrid, w: int, i: int, cells: tuple[int, int, int, int], wide: float
) -> int:
    """Nearest of the robots after i, within ``wide`` of it at the start; -1 if there is none."""
    nearest, least = -1, wide
    for row in range(cells[2], cells[3] + 1):
        start = grid.cell_start[row * grid.cells_along[0] + cells[0]]
        for e in range(start, grid.cell_start[row * grid.cells_along[0] + cells[1] + 1]):
            j = grid.order[e]
            if j > i and is_judged(step, w, i, j):
                gap = start_gap(step, w, i, j)
                if gap <= least:
                    nearest, least = j, gap
    return nearest


@formula
def judge_robots(
    step: StepArrays, contacts: ContactArrays, grid: RobotGrid, w: int, horizon: float
) -> None:
    """Judge all pairs of world w that start within the horizon, or could touch; each once, from its first robot."""
    largest, furthest = 0.0, 0.0
    for i in range(step.radius.shape[1]):
        if step.present[w, i]:
            largest, furthest = max(largest, step.radius[w, i]), max(furthest, step.travel[w, i])
    for i in range(step.radius.shape[1]):
        if not step.present[w, i]:
            continue
        x, y = step.position[w, i, 0], step.position[w, i, 1]
        # Whatever the horizon, who could touch is looked at.
        wide = max(horizon, step.travel[w, i] + furthest)
        cells = cells_near(grid, x, y, wide + step.radius[w, i] + largest)
        # The nearest first: what it leaves open, few others come near enough to change.
        nearest = nearest_later(step, grid, w, i, cells, wide)
        if nearest >= 0:
            judge_pair(step, contacts, w, i, nearest)
            judge_others(step, contacts, grid, w, i, cells, wide, nearest)


@formula
def judge_others(
    step: StepArrays,
    contacts: ContactArrays,
    grid: RobotGrid,
    w: int,
    i: int,
    cells: tuple[int, int, int, int],
    wide: float,
    nearest: int,
) -> None:
    """Judge the robots after i but for the nearest one."""
    for row in range(cells[2], cells[3] + 1):
        start = grid.cell_start[row * grid.cells_along[0] + cells[0]]
        for e in range(start, grid.cell_start[row * grid.cells_along[0] + cells[1] + 1]):
            j = grid.order[e]
            if j <= i or j == nearest or not is_judged(step, w, i, j):
                continue
            if start_gap(step, w, i, j) <= wide:
                judge_pair(step, contacts, w, i, j)


@formula
def wall_of(walls: WallArrays, s: int) -> Segment:
    """Wall s."""
    return Segment(
        walls.segment[s, 0], walls.segment[s, 1], walls.segment[s, 2], walls.segment[s, 3]
    )


@formula
def judge_wall(
    step: StepArrays, contacts: ContactArrays, w: int, i: int, wall: Segment, gap: float
) -> None:
    """Free distance of a robot from a wall over the step, and when it touches it, if it does."""
    reach, travels = step.radius[w, i], step.travel[w, i]
    least = gap - travels
    known = max(0.0, contacts.wall_clearance[w, i])
    if least >= known:
        return
    if travels > COARSENESS * gap:
        path = Path(
            step.position[w, i, 0],
            step.position[w, i, 1],
            step.displacement[w, i, 0],
            step.displacement[w, i, 1],
            step.turn[w, i],
            0.0,
            0.0,
            0.0,
        )
        least = least_path_distance(path, wall, reach + known, reach, COARSENESS) - reach
        if least < -CONTACT_TOLERANCE:
            contacts.hit_wall[w, i] = True
            entry = first_entry(path, wall, reach)
            contacts.fraction[w, i] = min(contacts.fraction[w, i], entry)
    contacts.wall_clearance[w, i] = min(contacts.wall_clearance[w, i], least)


@formula
def nearest_wall(
    walls: WallArrays,
    m: int,
    x: float,
    y: float,
    within: float,
    cells: tuple[int, int, int, int],
    squared: FloatArray,
) -> int:
    """Nearest wall of map m within a distance; -1 if there is none. Writes the ``squared`` distances of all entries."""
    nearest, least = -1, within * within
    origin = walls.cell_start[walls.first_cell[m]]
    for row in range(cells[2], cells[3] + 1):
        first, end = entries_of_row(walls, m, row, cells[0], cells[1])
        for e in range(first, end):
            distance = point_distance_squared(wall_of(walls, walls.entry[e]), x, y)
            squared[e - origin] = distance
            if distance <= least:
                nearest, least = walls.entry[e], distance
    return nearest


@formula
def judge_walls(
    step: StepArrays,
    contacts: ContactArrays,
    walls: WallArrays,
    w: int,
    horizon: float,
    squared: FloatArray,
) -> None:
    """Judge all robots of world w against walls that start within the horizon, or could be touched: nearest first.

    ``squared`` is room for a number an entry of any map, see `most_entries`.
    """
    m = walls.map_of[w]
    for i in range(step.radius.shape[1]):
        if not step.present[w, i] or step.wrecked[w, i] or step.person[w, i]:
            continue
        x, y, radius = step.position[w, i, 0], step.position[w, i, 1], step.radius[w, i]
        reach = max(horizon, step.travel[w, i]) + radius
        cells = cells_within(walls, m, x, y, reach)
        near = cells_within(walls, m, x, y, min(reach, NEAR_WALLS))
        # The nearest one is seldom far away, and then all that matters is near.
        is_settled = near != cells and judge_walls_in(
            step, contacts, walls, w, i, min(reach, NEAR_WALLS), near, squared
        )
        if not is_settled:
            judge_walls_in(step, contacts, walls, w, i, reach, cells, squared)


@formula
def judge_walls_in(
    step: StepArrays,
    contacts: ContactArrays,
    walls: WallArrays,
    w: int,
    i: int,
    within: float,
    cells: tuple[int, int, int, int],
    squared: FloatArray,
) -> bool:
    """Judge robot i against walls within a distance; is it certain that no wall further away changes anything?"""
    m = walls.map_of[w]
    x, y, radius = step.position[w, i, 0], step.position[w, i, 1], step.radius[w, i]
    nearest = nearest_wall(walls, m, x, y, within, cells, squared)
    if nearest < 0:
        return False
    wall = wall_of(walls, nearest)
    judge_wall(step, contacts, w, i, wall, math.sqrt(point_distance_squared(wall, x, y)) - radius)
    # What comes no nearer than that cannot change anything.
    open_to = max(contacts.wall_clearance[w, i], 0.0) + radius + step.travel[w, i]
    origin = walls.cell_start[walls.first_cell[m]]
    for row in range(cells[2], cells[3] + 1):
        first, end = entries_of_row(walls, m, row, cells[0], cells[1])
        for e in range(first, end):
            distance, s = squared[e - origin], walls.entry[e]
            if distance <= min(open_to, within) ** 2 and s != nearest:
                judge_wall(step, contacts, w, i, wall_of(walls, s), math.sqrt(distance) - radius)
    is_settled: bool = open_to <= within
    return is_settled
