"""What a differential drive does in one step: a command (v, w) moves its centre along a circular arc.

Heading unit vector d_0 at the start and d_1 at the end of the step, turn rate w with |w| dt < pi. Everything is for
unit speed, because the displacement is linear in the speed v. Lengths in m, angles in rad, times in s.

Source: the kinematics of the unicycle; the cap is the design's last word on arcs, of which the paper has none.
"""

from __future__ import annotations

import math

from safefilter.jit import formula

# Below this angle sin(x) / x is 1 to the last place.
TINY_ANGLE = 1e-8


@formula
def sinc(x: float) -> float:
    """sin(x) / x."""
    if abs(x) < TINY_ANGLE:
        return 1.0
    return math.sin(x) / x


@formula
def chord_velocity(
    speed: float, turn_rate: float, heading: float, dt: float
) -> tuple[float, float]:
    """Mean velocity of a step: the exact displacement of the arc, divided by dt."""
    half = 0.5 * turn_rate * dt
    length = speed * sinc(half)
    return length * math.cos(heading + half), length * math.sin(heading + half)


@formula
def inner_advance_away(start_cosine: float, turned_sine: float, turn_rate: float) -> float:
    """Advance along e, for unit speed, at the instant at which an arc that turns away from e stops advancing.

    It is (1 - turned_sine) / |w|, in the form that loses no digits for turned_sine from 0 up; with
    ``start_cosine = e . d_0``, and ``turned_sine = e x d_0`` counted in the direction of the turn.
    """
    return start_cosine * start_cosine / ((1.0 + turned_sine) * abs(turn_rate))


@formula
def inner_advance_through(turned_sine: float, turn_rate: float) -> float:
    """The same for an arc that first turns towards e, and through it: turned_sine below 0."""
    return (1.0 - turned_sine) / abs(turn_rate)


@formula
def largest_advance(
    start_cosine: float,
    start_sine: float,
    end_cosine: float,
    end_advance: float,
    turn_rate: float,
) -> float:
    """Largest advance along e at any instant of the step, for unit speed; at least 0.

    Args:
        start_cosine: ``e . d_0``.
        start_sine: ``e x d_0``.
        end_cosine: ``e . d_1``.
        end_advance: Advance at the end of the step: ``e . chord``, in m.
        turn_rate: w in rad/s.

    The advance rises while the heading has a positive cosine with e. Within less than half a turn it can stop rising
    only once, and then the instant of turning away is the largest; otherwise one of the ends is.
    """
    if start_cosine > 0.0 and end_cosine < 0.0:
        turned_sine = start_sine if turn_rate > 0.0 else -start_sine
        if turned_sine >= 0.0:
            return inner_advance_away(start_cosine, turned_sine, turn_rate)
        return inner_advance_through(turned_sine, turn_rate)
    return max(0.0, end_advance)
