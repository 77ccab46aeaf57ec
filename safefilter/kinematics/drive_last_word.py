"""The last word on a differential drive: from a solved velocity to a command (v, w) whose arc keeps every budget.

The turn rate is chosen first; then the speed is cut to the largest at which no instant of the arc passes a budget, and
the chord of the arc keeps the other hard rows that standing still keeps. Turning on the spot moves nothing, because
robots are discs: so speed 0 is always left.
"""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray
from safefilter.constraints.row_buffers import Sections
from safefilter.jit import formula
from safefilter.kinematics.arc import chord_velocity, largest_advance
from safefilter.kinematics.drive import Drive
from safefilter.kinematics.holonomic import SPEED_SLACK
from safefilter.kinematics.last_word import DOUBLE_ULP, MAX_CUTS, SINGLE_ULP, cast
from safefilter.kinematics.tracking import command_towards, largest_tracked_speed

# Rows that allow less than this part of v_max count as contact when a robot looks for a heading that is free.
CONTACT_PART = 0.01
# How far past a quarter turn from a contact a free heading lies, in rad: straight along it would scrape.
PARTING_ANGLE = 0.02
# Solved speeds below this part of v_max are standing still.
STILL_PART = 1e-6


@formula
def speed_cap(
    rows: FloatArray, sections: Sections, heading: float, turn_rate: float, dt: float
) -> float:
    """Largest speed at which the arc keeps all budgets, and its chord the other rows, in m/s."""
    d_x, d_y = math.cos(heading), math.sin(heading)
    end_x, end_y = math.cos(heading + turn_rate * dt), math.sin(heading + turn_rate * dt)
    c_x, c_y = chord_velocity(1.0, turn_rate, heading, dt)
    cap = math.inf
    for k in range(sections.num_sides, sections.num_separated):
        e_x, e_y = -rows[0, k], -rows[1, k]
        advance = largest_advance(
            e_x * d_x + e_y * d_y,
            e_x * d_y - e_y * d_x,
            e_x * end_x + e_y * end_y,
            (e_x * c_x + e_y * c_y) * dt,
            turn_rate,
        )
        if advance > 0.0:
            cap = min(cap, max(0.0, -rows[2, k] * dt / advance))
    for k in range(sections.num_separated, sections.num_budgets):
        along = rows[0, k] * c_x + rows[1, k] * c_y
        if along < 0.0:
            cap = min(cap, rows[2, k] / along)
    return cap


@formula
def is_command_safe(
    rows: FloatArray,
    sections: Sections,
    drive: Drive,
    heading: float,
    v_max: float,
    speed: float,
    turn_rate: float,
) -> bool:
    """Is a command within its limits, and its arc within every budget? False for NaN."""
    within = 0.0 <= speed <= v_max * (1.0 + SPEED_SLACK) and abs(turn_rate) <= drive.omega_max * (
        1.0 + SPEED_SLACK
    )
    return within and speed <= speed_cap(rows, sections, heading, turn_rate, drive.dt)


@formula
def is_free(
    rows: FloatArray, sections: Sections, x: float, y: float, contact: float, skipped: int
) -> bool:
    """Does no contact but ``skipped`` stand in the way of a direction?"""
    for k in range(sections.num_sides, sections.num_budgets):
        in_the_way = rows_along(rows, k, x, y) < 0.0 and -contact < rows[2, k]
        if in_the_way and k != skipped:
            return False
    return True


@formula
def rows_along(rows: FloatArray, k: int, x: float, y: float) -> float:
    """Component of a direction along the normal of row k: negative is towards what the row is against."""
    along: float = rows[0, k] * x + rows[1, k] * y
    return along


@formula
def turn_to_freedom(rows: FloatArray, sections: Sections, heading: float, contact: float) -> float:
    """Smallest turn to a heading that no contact stands in the way of, in rad; 0 if there is none, or none is needed.

    Ties go to the right, so that two noses that meet turn the same way and part (norm-1).
    """
    d_x, d_y = math.cos(heading), math.sin(heading)
    if is_free(rows, sections, d_x, d_y, contact, -1):
        return 0.0
    best = math.inf
    for k in range(sections.num_sides, sections.num_budgets):
        if not -contact < rows[2, k]:
            continue
        away = math.atan2(d_x * rows[1, k] - d_y * rows[0, k], rows_along(rows, k, d_x, d_y))
        for side in (-1.0, 1.0):
            # The normal points away from the contact; a quarter turn from it is along the contact.
            turn = away + side * (0.5 * math.pi - PARTING_ANGLE)
            turn = math.atan2(math.sin(turn), math.cos(turn))
            x, y = math.cos(heading + turn), math.sin(heading + turn)
            is_better = abs(turn) < abs(best) - 1e-9 or (
                abs(turn) < abs(best) + 1e-9 and turn < best
            )
            if is_better and is_free(rows, sections, x, y, contact, k):
                best = turn
    return best if math.isfinite(best) else 0.0


@formula
def tracking_command(
    drive: Drive, turn_rate: float, heading: float, v_max: float, u_x: float, u_y: float
) -> tuple[float, float]:
    """Command that tracks a solved velocity; for one that stands still, the policy's turn rate on the spot."""
    speed = math.sqrt(u_x * u_x + u_y * u_y)
    if not speed > STILL_PART * v_max:
        return 0.0, turn_rate
    d_x, d_y = math.cos(heading), math.sin(heading)
    angle = math.atan2(d_x * u_y - d_y * u_x, d_x * u_x + d_y * u_y)
    if not drive.has_polygon:
        limit = largest_tracked_speed(
            angle, v_max, drive.omega_max, drive.turn_time, drive.tracking_error
        )
        speed = min(speed, limit)
    return command_towards(angle, min(speed, v_max), drive.omega_max, drive.turn_time)


@formula
def wanted_command(
    rows: FloatArray,
    sections: Sections,
    drive: Drive,
    asked_speed: float,
    asked_turn_rate: float,
    heading: float,
    v_max: float,
    u_x: float,
    u_y: float,
) -> tuple[float, float]:
    """Command that goes for a solved velocity, before the last word; the policy asked for another.

    A robot in contact that would be cut to a standstill turns to where it is free instead: tracking alone would only
    creep towards that heading, and never get past it.
    """
    speed, turn_rate = tracking_command(drive, asked_turn_rate, heading, v_max, u_x, u_y)
    still = STILL_PART * v_max
    wants_to_move = speed > still or (asked_speed > still and speed == 0.0)
    if (
        wants_to_move
        and speed_cap(rows, sections, heading, turn_rate, drive.dt) <= CONTACT_PART * v_max
    ):
        turn = turn_to_freedom(rows, sections, heading, CONTACT_PART * v_max)
        if turn != 0.0:
            return 0.0, turn / drive.dt
    return speed, turn_rate


@formula
def drive_last_word(
    rows: FloatArray,
    sections: Sections,
    drive: Drive,
    heading: float,
    v_max: float,
    speed: float,
    turn_rate: float,
    is_single: bool,
) -> tuple[float, float]:
    """Command that executes: cast, within its limits, its arc within every budget exactly."""
    if not (math.isfinite(speed) and math.isfinite(turn_rate)):
        return 0.0, 0.0
    ulp = SINGLE_ULP if is_single else DOUBLE_ULP
    turn_rate = cast(min(drive.omega_max, max(-drive.omega_max, turn_rate)), is_single)
    cap = min(v_max, speed_cap(rows, sections, heading, turn_rate, drive.dt))
    speed = cast(max(0.0, min(speed, cap)), is_single)
    for attempt in range(MAX_CUTS):
        if is_command_safe(rows, sections, drive, heading, v_max, speed, turn_rate):
            return speed, turn_rate
        speed = cast(min(speed, cap) * max(0.0, 1.0 - 2.0**attempt * ulp), is_single)
    return 0.0, turn_rate
