"""The fused path: a batch of decisions in one kernel, rows made, used and dropped robot by robot.

This is Alg. 2 of Qin et al. with the built-in solver; every formula is called from its own file.

Letters: B decisions. m/s; commands (v, w) in m/s and rad/s.
"""

from __future__ import annotations

import math
from typing import Any

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.handed import Problem, named
from safefilter.batch.program import ACTION_NOT_FINITE, NO_FAULT, SAFE, solve, write_labels
from safefilter.batch.records import Outcome, Results, Scratch, make_scratch, outcome_of
from safefilter.batch.rows import hold, make_rows, soft_violation
from safefilter.batch.settings import Settings
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.jit import formula, kernel
from safefilter.kinematics.arc import chord_velocity
from safefilter.kinematics.drive import SPEED, TURN_RATE, Drive
from safefilter.kinematics.drive_last_word import (
    drive_last_word,
    is_command_safe,
    wanted_command,
)
from safefilter.kinematics.last_word import SINGLE_ULP, keeps_budgets, last_word

# A last word within this many roundings of the solved velocity is a push off a row, not a cut.
CUT_ROUNDINGS = 10.0


@formula
def keeps_hard_rows(
    problem: Problem,
    drive: Drive,
    k: int,
    rows: FloatArray,
    sections: Sections,
    action_x: float,
    action_y: float,
) -> bool:
    """Does an action, a velocity or a command, keep its limits and every budget exactly? False for NaN."""
    i = problem.index[k]
    if drive.is_used:
        return is_command_safe(
            rows,
            sections,
            drive,
            problem.scene.heading[i],
            problem.limits.v_max[i],
            action_x,
            action_y,
        )
    limit = problem.limits.speed_limit[i]
    return keeps_budgets(rows, sections.num_sides, sections.num_budgets, limit, action_x, action_y)


@formula
def velocity_of(
    problem: Problem, drive: Drive, k: int, action_x: float, action_y: float
) -> tuple[float, float]:
    """Velocity of an action: itself, or the chord of a command's arc."""
    if drive.is_used:
        heading = problem.scene.heading[problem.index[k]]
        return chord_velocity(action_x, action_y, heading, drive.dt)
    return action_x, action_y


@formula
def decide_one(
    problem: Problem,
    settings: Settings,
    out: Outcome,
    k: int,
    rows: RowLabels,
    scratch: Scratch,
) -> None:
    """Alg. 2 for decision k."""
    i, tolerance = problem.index[k], settings.tolerance
    wanted_x, wanted_y = problem.asked[k, 0], problem.asked[k, 1]
    out.fault[k] = NO_FAULT
    if not (math.isfinite(wanted_x) and math.isfinite(wanted_y)):
        out.fault[k] = ACTION_NOT_FINITE
        wanted_x, wanted_y = 0.0, 0.0
        forget_wish(problem.asked, k)
    sections = make_rows(problem, settings, k, rows, scratch.chosen, scratch.keys)
    asked_x, asked_y = wanted_x, wanted_y
    if settings.drive.is_used:
        asked_x, asked_y = problem.asked[k, SPEED], problem.asked[k, TURN_RATE]
    # The sides are not asked in Case-1: any action within its limits executes exactly.
    is_safe = keeps_hard_rows(
        problem, settings.drive, k, rows.array, sections, asked_x, asked_y
    ) and hold(rows.array, sections.num_separated, sections.num_rows, wanted_x, wanted_y, tolerance)
    if is_safe:
        out.case[k], out.optimal[k] = SAFE, True
        out.violation[k] = soft_violation(rows.array, sections, wanted_x, wanted_y)
        write_labels(
            out.active[k], out.multipliers[k], rows, scratch.active, scratch.multipliers, 0
        )
        write_labels(
            out.proof[k],
            out.proof_multipliers[k],
            rows,
            scratch.proof,
            scratch.proof_multipliers,
            0,
        )
        out.velocity[k, 0], out.velocity[k, 1] = wanted_x, wanted_y
    else:
        out.velocity[k, 0], out.velocity[k, 1] = solve(
            out,
            k,
            rows,
            scratch,
            sections,
            settings.inner_radius * problem.limits.v_max[i],
            problem.limits.speed_limit[i],
            settings.bias_cos * wanted_x + settings.bias_sin * wanted_y,
            settings.bias_cos * wanted_y - settings.bias_sin * wanted_x,
            tolerance,
        )
    finish(problem, settings, out, k, rows.array, sections)


@formula
def forget_wish(asked: FloatArray, k: int) -> None:
    """Take a wish that is not finite as standing still."""
    for column in range(asked.shape[1]):
        asked[k, column] = 0.0


@formula
def last_word_of(
    problem: Problem,
    drive: Drive,
    out: Outcome,
    k: int,
    rows: FloatArray,
    sections: Sections,
) -> tuple[float, float]:
    """Action that executes for decision k's velocity."""
    i = problem.index[k]
    x, y = out.velocity[k, 0], out.velocity[k, 1]
    if not drive.is_used:
        first, last = sections.num_sides, sections.num_budgets
        limit = problem.limits.speed_limit[i]
        return last_word(rows, first, last, limit, x, y, problem.is_single)
    heading, v_max = problem.scene.heading[i], problem.limits.v_max[i]
    speed, turn_rate = problem.asked[k, SPEED], problem.asked[k, TURN_RATE]
    if out.case[k] != SAFE:
        speed, turn_rate = wanted_command(
            rows, sections, drive, speed, turn_rate, heading, v_max, x, y
        )
        return drive_last_word(
            rows, sections, drive, heading, v_max, speed, turn_rate, problem.is_single
        )
    return speed, turn_rate


@formula
def finish(
    problem: Problem,
    settings: Settings,
    out: Outcome,
    k: int,
    rows: FloatArray,
    sections: Sections,
) -> None:
    """The last word on decision k's velocity, and the check of what executes."""
    action_x, action_y = last_word_of(problem, settings.drive, out, k, rows, sections)
    done_x, done_y = velocity_of(problem, settings.drive, k, action_x, action_y)
    limit = problem.limits.speed_limit[problem.index[k]]
    rounding = settings.tolerance + (2.0 * SINGLE_ULP * limit if problem.is_single else 0.0)
    out.action[k, 0], out.action[k, 1] = action_x, action_y
    moved = max(abs(done_x - out.velocity[k, 0]), abs(done_y - out.velocity[k, 1]))
    out.capped[k] = moved > CUT_ROUNDINGS * rounding
    out.correction[k] = math.hypot(done_x - problem.asked[k, 0], done_y - problem.asked[k, 1])
    out.certified[k] = keeps_hard_rows(
        problem, settings.drive, k, rows, sections, action_x, action_y
    ) and hold(
        rows, sections.num_budgets, sections.num_hard, done_x, done_y, CUT_ROUNDINGS * rounding
    )


@kernel
def decide_range(handed: tuple[Any, ...], results: Results, first: int, last: int) -> None:
    """Decide [first, last) of a batch, with one set of scratch.

    Args:
        handed: A `Handed`, without its names.
        results: Written to.
        first: First decision.
        last: One past the last decision.
    """
    problem, settings = named(handed)
    out = outcome_of(results)
    buffers = row_buffers(1, problem.capacity)
    rows = RowLabels(buffers.array[0], buffers.label[0])
    scratch = make_scratch(problem.scene.most_neighbours)
    for k in range(first, last):
        decide_one(problem, settings, out, k, rows, scratch)


@kernel
def finish_batch(
    handed: tuple[Any, ...], results: Results, array: FloatArray, sections: IntArray
) -> None:
    """The last word and check for velocities from elsewhere, with the rows of `collect_rows`."""
    problem, settings = named(handed)
    out = outcome_of(results)
    for k in range(len(problem.index)):
        own = Sections(
            sections[k, 0], sections[k, 1], sections[k, 2], sections[k, 3], sections[k, 4]
        )
        finish(problem, settings, out, k, array[k], own)
