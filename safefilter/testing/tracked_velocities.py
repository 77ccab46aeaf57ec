"""A differential drive follows every velocity it is allowed, to within the error that it states.

The oracle drives the unicycle: it turns towards the velocity for the turn time, or as far as it can, and is compared
with where a holonomic robot would be. Angles are measured from the heading. m, m/s, rad, s.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.kinematics.differential_drive import DifferentialDrive

CHECKED_ANGLES = 181
# Rounding, and what an inscribed polygon is checked to.
SLACK = 1e-6


class NotTracked(AssertionError):
    """An allowed velocity is followed worse than stated."""


def assert_tracked(drive: DifferentialDrive) -> None:
    """Check that velocities of all directions, as fast as allowed there, are followed within ``drive.tracking_error``.

    With ``mapping="polygon"`` the polygon allows them, with ``"cut"`` the set S_AHV itself.

    Args:
        drive: The kinematics, with one ``v_max`` for all robots.

    Raises:
        NotTracked: If one is followed worse.
    """
    for angle in np.linspace(-math.pi, math.pi, CHECKED_ANGLES).tolist():
        speed = drive.tracked_speed(angle)
        if drive.mapping == "polygon":
            speed = _largest_in(drive.sides, angle) * drive.tracked_speed(0.0)
        error = _tracking_error(drive, angle, speed)
        if error > drive.tracking_error * (1.0 + SLACK):
            raise NotTracked(
                f"a velocity of {speed:.6g} m/s at {math.degrees(angle):.1f} degrees from the heading is allowed, but "
                f"the drive gets {error:.6g} m off its course, not {drive.tracking_error} m\nto repeat it:\n"
                f"  assert_tracked(DifferentialDrive({drive.tracked_speed(0.0)!r}, {drive.omega_max!r}, {drive.dt!r}, "
                f"{drive.tracking_error!r}, {drive.turn_time!r}, mapping={drive.mapping!r}))"
            )


def _largest_in(sides: FloatArray, angle: float) -> float:
    """Largest speed in a direction within a polygon ``normals @ v >= offsets``, of size 1."""
    along = sides[0] * math.cos(angle) + sides[1] * math.sin(angle)
    ahead = along < 0.0
    return float((sides[2, ahead] / along[ahead]).min())


def _tracking_error(drive: DifferentialDrive, angle: float, speed: float) -> float:
    """Distance to a holonomic robot once the drive has turned, in m.

    It drives the circle that ends in the wanted direction, at the speed that brings it nearest; where that takes a
    faster turn than it can, it turns on the spot.
    """
    size = abs(angle)
    if size > drive.omega_max * drive.turn_time:
        return speed * size / drive.omega_max
    target = speed * drive.turn_time * np.array([math.cos(angle), math.sin(angle)])
    if size == 0.0:
        return float(np.hypot(*target)) - speed * drive.turn_time
    per_speed = drive.turn_time / angle * np.array([math.sin(angle), 1.0 - math.cos(angle)])
    best = min(float(target @ per_speed / (per_speed @ per_speed)), drive.tracked_speed(0.0))
    return float(np.hypot(*(target - best * per_speed)))
