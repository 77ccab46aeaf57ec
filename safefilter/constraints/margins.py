"""Margins: what bounds on errors take from a robot's budgets, and the rows that keep a budget in spite of them.

The vector from a robot to a neighbour, or to the closest point of a wall, is known up to ``error``. So the distance is
at least the estimated one less the error, and the true direction is at most an angle alpha off the estimated e:
``sin(alpha) = error / distance``. What executes is at most an angle beta off the command and ``gain`` times as long.
An advance along any of those directions must stay within the budget. It does if the command keeps

* ``e . v <= budget / gain``, where nothing is uncertain but distances and lengths;
* else two rows, along e turned by ``gamma = alpha + beta`` to either side: ``<= budget cos(gamma) / gain`` each. Every
  direction between is a combination of the two, with weights that sum to at most ``1 / cos(gamma)``;
* from ``gamma`` of a quarter turn on, where the direction says nothing any more: a triangle around standing still, with
  its corners at a distance of ``budget / gain``.

A budget of 0 so leaves the directions that are away from the neighbour wherever it is, or standing still; a row along e
alone would let a robot slide sideways, and into a neighbour that is not quite where it seems.

Letters: B decisions, N robots. m, m/s, s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from safefilter.constraints.row_buffers import RowLabels
from safefilter.errors import OutOfRange
from safefilter.jit import formula
from safefilter.uncertainty import Uncertainty

# Rows at most against one neighbour or wall.
ROWS_EACH = 3
# Cosine and sine of a third of a turn.
THIRD_COSINE, THIRD_SINE = -0.5, 0.5 * math.sqrt(3.0)
# Commands in single precision may turn that much faster than they should.
FASTER = 1.0 + 1e-6
# Corners of that triangle are twice as far out as its sides; a little less, because its angles are rounded.
NEARLY_HALF = 0.499


class Margins(NamedTuple):
    """`Uncertainty` as kernels take it.

    Attributes:
        position_error: In m.
        velocity_error: In m/s.
        stale_time: The longest that robots move on after they were measured and before a command executes, in s.
        gain: The most that executed movements are longer than commanded ones: 1 + the part by which they are off.
        turn_cosine: Cosine of the largest angle beta between a command and what executes.
        turn_sine: Its sine.
    """

    position_error: float
    velocity_error: float
    stale_time: float
    gain: float
    turn_cosine: float
    turn_sine: float


NO_MARGINS = Margins(0.0, 0.0, 0.0, 1.0, 1.0, 0.0)


def margins_of(uncertainty: Uncertainty, dt: float, omega_max: float) -> Margins:
    """Work out what kernels need.

    A drive that turns has come less far than its way is long, so the same error is a larger part of how far; and its
    heading is as stale as the rest.

    Args:
        uncertainty: The bounds.
        dt: Duration of a step, in s.
        omega_max: Largest turn rate, in rad/s; 0 for robots that do not turn.

    Raises:
        OutOfRange: If a step can turn by half a turn, or movements can be a quarter turn off their command: no
            direction is safe then.
    """
    stale_time = uncertainty.stale_time(dt)
    longest = dt + uncertainty.lateness
    half_turn = 0.5 * omega_max * FASTER * longest
    if half_turn >= math.pi / 2:
        raise OutOfRange(
            f"uncertainty: {omega_max} rad/s for {longest:.3g} s is half a turn or more in one step; "
            "lower actuation_delay or clock_jitter, or omega_max"
        )
    part = uncertainty.actuation_error
    heading = 0.0
    if omega_max > 0.0:
        part *= half_turn / math.sin(half_turn)
        # The turn rate may be off by what that alone adds to the error; see `Uncertainty.actuation_error`.
        fastest = omega_max + 2.0 * uncertainty.actuation_error / longest
        heading = uncertainty.heading_error + fastest * stale_time
    turn = heading + math.asin(min(1.0, part))
    if not turn < math.pi / 2:
        raise OutOfRange(
            f"uncertainty: movements may be {turn:.3g} rad off their commands, and from a quarter turn on nothing is "
            "safe; lower actuation_error, heading_error, the delays, or omega_max"
        )
    if turn <= 0.0:
        return NO_MARGINS._replace(
            position_error=uncertainty.position_error,
            velocity_error=uncertainty.velocity_error,
            stale_time=stale_time,
        )
    return Margins(
        uncertainty.position_error,
        uncertainty.velocity_error,
        stale_time,
        1.0 + part,
        math.cos(turn),
        math.sin(turn),
    )


@formula
def own_error(position_error: float, stale_time: float, limit: float) -> float:
    """How far a robot may be from where it is said to be, when a command begins: it has moved on since."""
    # A limit that is not known is infinite, and infinity times zero is no number.
    if stale_time > 0.0:
        return position_error + limit * stale_time
    return position_error


@formula
def pair_error(error: float, other_error: float) -> float:
    """How far the vector between two robots may be from what is estimated."""
    return error + other_error


@formula
def credited_approach(
    seen: float, speed: float, tilt_sine: float, error: float, dt: float
) -> float:
    """Largest approach of a neighbour that is seen to approach by ``seen``, along any direction that may be e."""
    return max(0.0, seen) + (speed * tilt_sine + error) * dt


@formula
def passive_limit(speed: float, velocity_error: float, passive_speed: float) -> float:
    """Bound on the speed of a robot that does not cooperate."""
    return max(speed + velocity_error, passive_speed)


@formula
def tilt(distance: float, error: float) -> float:
    """Sine of the largest angle between the estimated direction and the true one; 1 where it may be any."""
    if error <= 0.0:
        return 0.0
    if error >= distance:
        return 1.0
    return error / distance


@formula
def wall_tilt(distance: float, kept: float, error: float) -> float:
    """The same for a wall: as long as there is a gap, what counts is the line through the estimated closest point."""
    if distance >= kept:
        return 0.0
    return tilt(distance, error)


@formula
def spread(tilt_sine: float, turn_cosine: float, turn_sine: float) -> tuple[float, float]:
    """Cosine and sine of the sum gamma of the angle of ``tilt`` and that of a turn."""
    tilt_cosine = math.sqrt(1.0 - tilt_sine * tilt_sine)
    return (
        tilt_cosine * turn_cosine - tilt_sine * turn_sine,
        tilt_sine * turn_cosine + tilt_cosine * turn_sine,
    )


@formula
def add_row(
    rows: RowLabels,
    count: int,
    e_x: float,
    e_y: float,
    cosine: float,
    sine: float,
    speed: float,
) -> int:
    """Write ``e' @ v <= speed``, with e' the direction e turned by an angle; returns the new count."""
    rows.array[0, count] = -(cosine * e_x - sine * e_y)
    rows.array[1, count] = -(sine * e_x + cosine * e_y)
    rows.array[2, count] = -speed
    return count + 1


@formula
def add_fence(
    rows: RowLabels,
    count: int,
    e_x: float,
    e_y: float,
    tilt_sine: float,
    turn_cosine: float,
    turn_sine: float,
    speed: float,
) -> int:
    """Write the rows that keep an advance along e, and all that may be e, within a budget; returns the new count.

    Args:
        rows: Where to.
        count: Rows so far.
        e_x: Estimated direction.
        e_y: Estimated direction.
        tilt_sine: See `tilt`.
        turn_cosine: See `Margins`.
        turn_sine: See `Margins`.
        speed: Speed that uses up the budget, ``budget / (gain * dt)``.
    """
    if tilt_sine <= 0.0 and turn_sine <= 0.0:
        rows.array[0, count] = -e_x
        rows.array[1, count] = -e_y
        rows.array[2, count] = -speed
        return count + 1
    cosine, sine = spread(tilt_sine, turn_cosine, turn_sine)
    if cosine > 0.0:
        count = add_row(rows, count, e_x, e_y, cosine, sine, speed * cosine)
        return add_row(rows, count, e_x, e_y, cosine, -sine, speed * cosine)
    count = add_row(rows, count, e_x, e_y, 1.0, 0.0, NEARLY_HALF * speed)
    count = add_row(rows, count, e_x, e_y, THIRD_COSINE, THIRD_SINE, NEARLY_HALF * speed)
    return add_row(rows, count, e_x, e_y, THIRD_COSINE, -THIRD_SINE, NEARLY_HALF * speed)
