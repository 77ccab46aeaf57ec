"""Which holonomic velocities a differential drive can track: the set S_AHV of NH-ORCA.

To follow a velocity of speed v_H at angle theta from its heading, the robot turns at ``w = theta / T`` for the turn
time T at constant speed ``v* = v_H (theta / 2) cot(theta / 2)``, which makes the error at T smallest:
``E = T v_H sin(|theta| / 2)``. So E <= eps means ``v_H <= eps / (T sin(|theta| / 2))``.

These are the published expressions after half-angle simplification: ``2 (1 - cos) - sin^2 = (1 - cos)^2``, and v* never
exceeds v_H because ``(x / 2) cot(x / 2) <= 1``, so that the published branch for v* > v_max cannot occur below v_max.
Where T is too short to turn (|theta| / T > w_max) the robot turns in place at w_max and is late by |theta| / w_max.

Source: Alonso-Mora, Breitenmoser, Rufli, Beardsley, Siegwart, "Optimal reciprocal collision avoidance for multiple
non-holonomic robots", 2013.
"""

from __future__ import annotations

import math

from safefilter.jit import formula
from safefilter.kinematics.arc import TINY_ANGLE


@formula
def tracked_part(angle: float) -> float:
    """Speed v* for v_H = 1: (theta / 2) cot(theta / 2)."""
    half = 0.5 * abs(angle)
    if half < TINY_ANGLE:
        return 1.0
    return half / math.tan(half)


@formula
def largest_tracked_speed(
    angle: float, v_max: float, omega_max: float, turn_time: float, tracking_error: float
) -> float:
    """Largest speed v_H at an angle in [-pi, pi] that is tracked within the error, in m/s."""
    size = abs(angle)
    if size > omega_max * turn_time:
        return min(v_max, tracking_error * omega_max / size)
    lag = turn_time * math.sin(0.5 * size)
    if lag * v_max <= tracking_error:
        return v_max
    return tracking_error / lag


@formula
def command_towards(
    angle: float, speed: float, omega_max: float, turn_time: float
) -> tuple[float, float]:
    """Command (v, w) that tracks a velocity of this speed at this angle from the heading."""
    if abs(angle) > omega_max * turn_time:
        return 0.0, math.copysign(omega_max, angle)
    return speed * tracked_part(angle), angle / turn_time
