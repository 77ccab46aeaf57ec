"""The fused path for many worlds: the scene of each is made, used and dropped, world by world, in one kernel.

Decisions are those of `decide_range` for the scene of all worlds, bit for bit.

Letters: W worlds, N robots a world, B decisions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray, all_true
from safefilter.batch.decide import decide_one
from safefilter.batch.handed import Problem, capacity_for, limits_of
from safefilter.batch.records import Results, empty_results, make_scratch, outcome_of
from safefilter.batch.settings import Settings, settings_of
from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.constraints.separation import reach_needed
from safefilter.constraints.user_rows import NUM_MARKS
from safefilter.jit import formula, kernel
from safefilter.kept import KeptRecord
from safefilter.kinematics.drive import TURN_RATE, ask_command
from safefilter.neighbours import ALL_PAIRS_LIMIT, list_pairs
from safefilter.scene_arguments import PLANE_COLUMNS
from safefilter.scene_arrays import PLANE, SceneArrays
from safefilter.threads import over_worlds
from safefilter.usable_state import is_usable
from safefilter.worlds import WorldArrays, Worlds, write_numbers, write_state


@formula
def can_decide(
    state: FloatArray,
    heading: FloatArray,
    cooperative: BoolArray,
    speed_limit: FloatArray,
    settings: Settings,
    reach: float,
) -> bool:
    """Are all numbers of a world usable, and do robots see as far as hard rows need?"""
    if not is_usable(state, heading):
        return False
    separation = settings.separation
    if not separation.is_used or reach == np.inf:
        return True
    needed = reach_needed(
        state,
        cooperative,
        speed_limit,
        separation.dt,
        separation.safety_margin,
        separation.passive_speed,
        separation.position_error,
        separation.velocity_error,
        separation.stale_time,
        separation.gain,
    )
    return reach >= needed


@kernel
def decide_worlds(
    handed: tuple[Any, ...],
    kept: KeptRecord,
    results: Results,
    first_world: int,
    last_world: int,
) -> None:
    """Decide for robots of worlds [first, last), with one set of scratch.

    Args:
        handed: Actions, shape (W, N, 2), what executes is written to them; the robots to decide for as rows w N + i,
            rising, shape (B,); room for what they are asked, see `safefilter.batch.handed.Handed`, and for whether all
            is right in a world, shape (W,); the rules for W N robots; are actions float32?
        kept: `WorldArrays`.
        results: Written to; not in worlds where something is wrong.
        first_world: The first one.
        last_world: One past the last one.
    """
    action, index, asked, is_right, rules, is_single = handed
    worlds: WorldArrays = kept.record
    settings, out = settings_of(rules), outcome_of(results)
    num_worlds, num_robots = worlds.radius.shape
    in_all, others = num_worlds * num_robots, max(0, num_robots - 1)
    limits = limits_of(rules, in_all, PLANE)
    capacity = capacity_for(limits, settings, others + worlds.most_walls)
    buffers, scratch = row_buffers(1, capacity), make_scratch(others)
    rows = RowLabels(buffers.array[0], buffers.label[0])
    number = np.empty(in_all, dtype=np.int64)
    # Rows are those of the scene of all, as labels name them, but only those of one world at a time are looked at.
    scene = SceneArrays(
        np.empty((in_all, PLANE_COLUMNS)),
        worlds.cooperative.reshape(in_all),
        worlds.heading.reshape(in_all),
        np.empty(in_all + 1, dtype=np.int64),
        np.empty(num_robots * others, dtype=np.int64),
        others,
        worlds.walls,
        worlds.wall_boxes,
        0,
        worlds.wall_range,
        worlds.most_walls,
    )
    user = np.empty((0, NUM_MARKS, 0))
    problem = Problem(scene, index, asked, user, limits, capacity, is_single)
    position = worlds.position.reshape(in_all, PLANE)
    k = np.searchsorted(index, first_world * num_robots)
    for w in range(first_world, last_world):
        first, last = w * num_robots, (w + 1) * num_robots
        write_state(scene.state, worlds, worlds.velocity, w)
        is_right[w] = can_decide(
            scene.state[first:last],
            scene.heading[first:last],
            scene.cooperative[first:last],
            limits.speed_limit[first:last],
            settings,
            worlds.reach,
        )
        if is_right[w]:
            write_numbers(number, worlds.present, w)
            scene.neighbour_start[first] = 0
            list_pairs(
                position,
                number,
                worlds.reach,
                first,
                last,
                scene.neighbour_start,
                scene.neighbours,
            )
        while k < len(index) and index[k] < last:
            i, local = index[k], index[k] - first
            if not scene.cooperative[i]:
                is_right[w] = False
            if is_right[w]:
                x, y = action[w, local, 0], action[w, local, 1]
                if settings.drive.is_used:
                    ask_command(asked, k, x, y, scene.heading[i], settings.drive.dt)
                else:
                    asked[k, 0], asked[k, 1] = x, y
                decide_one(problem, settings, out, k, rows, scratch)
                action[w, local, 0], action[w, local, 1] = out.action[k, 0], out.action[k, 1]
            k += 1


def decide_at_once(
    worlds: Worlds,
    action: npt.NDArray[Any],
    index: IntArray,
    rules: FloatArray,
    *,
    is_driven: bool,
) -> tuple[FloatArray, FloatArray, Results] | None:
    """Decide for robots of many worlds without a scene; None where that cannot be.

    Worlds may be too large: neighbours of theirs are found by a grid of the whole scene. Or something is wrong in one,
    decided in or not, and a `Scene` will say what.

    Args:
        worlds: The robots.
        action: Of all, shape (W, N, 2).
        index: Rows w N + i of those to decide for, rising, shape (B,).
        rules: For W N robots, see `make_rules`.
        is_driven: Are actions commands (v, w), which need headings?

    Returns:
        Actions that execute, of all robots, shape (W, N, 2); what those decided for are asked, see
        `safefilter.batch.handed.Handed`; and results.
    """
    if worlds.shape[1] > ALL_PAIRS_LIMIT or (is_driven and not worlds.has_headings):
        return None
    asked = np.empty((len(index), TURN_RATE + 1 if is_driven else PLANE))
    results = empty_results(len(index), PLANE)
    executed = np.array(action, dtype=np.float64, order="C")
    is_right = np.zeros(worlds.shape[0], dtype=np.bool_)
    handed = executed, index, asked, is_right, rules, action.dtype == np.float32
    over_worlds(decide_worlds, *worlds.shape, handed, worlds.kept.handle, results)
    return (executed, asked, results) if all_true(is_right) else None
