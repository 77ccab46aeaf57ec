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
def inner_advance(start_cosine: float, start_sine: float, turn_rate: float) -> float:
    """Advance along e at the instant at which the arc turns away from it, for unit speed.

    ``start_cosine = e . d_0`` and ``start_sine = e x d_0``. It is (1 - |sin|) / |w|, in the form that loses no digits.
    """
    return start_cosine * start_cosine / ((1.0 + abs(start_sine)) * abs(turn_rate))


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
        return inner_advance(start_cosine, start_sine, turn_rate)
    return max(0.0, end_advance)
