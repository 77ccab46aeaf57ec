"""Priority-ORCA asks for what is needed, and no more: its change is the way to the rim of the velocity obstacle.

The oracle drives two discs at a relative velocity for the time horizon, and looks whether they touch: a velocity that
touches is inside the obstacle. The change of a pair is right if all relative velocities nearer than it are on the same
side as the present one, and that at its end is on the rim.

Letters: K relative velocities. m/s, s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, array_code
from safefilter.closest_approach import CONTACT_TOLERANCE, Pairs, closest_approach
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.invariants import orca_rows

DIRECTIONS = 64
# The rim is looked for this far inside and outside of where the change ends, as a part of it, and in m/s.
RIM_PART = 1e-3
RIM_SPEED = 1e-6


class WrongChange(AssertionError):
    """A pair is asked for more, or for less, than keeps it apart."""


def assert_smallest_change(
    safety_filter: SafetyFilter,
    scene: Scene,
    action: npt.ArrayLike,
    *,
    v_opt: FloatArray,
    time_horizon: float,
) -> int:
    """Check that the change of velocity of every cooperating pair that is apart is the smallest that will do.

    Args:
        safety_filter: The filter, with one `PriorityORCA` with ``leg="nearest"`` and without a limit on neighbours,
            for robots without tracking error.
        scene: The robots.
        action: What the cooperating ones ask for, shape (B, 2), in m/s.
        v_opt: Velocities that half-planes are built around, shape (N, 2); see `assert_priority_allocation`.
        time_horizon: tau of the `PriorityORCA`, in s.

    Returns:
        Number of pairs checked.

    Raises:
        WrongChange: If the change of a pair is not.
    """
    parts = orca_rows(safety_filter, scene, action)
    num_pairs = 0
    for (i, j), own in parts.items():
        if i > j or (j, i) not in parts or _gap(scene, i, j) <= CONTACT_TOLERANCE:
            continue
        relative = v_opt[i] - v_opt[j]
        # What one side does not take of the change, the other does.
        change = sum(
            rows.offset - float(rows.normal @ v_opt[robot])
            for robot, rows in ((i, own), (j, parts[j, i]))
        )
        encounter = _Encounter(scene, i, j, time_horizon)
        complaint = _complaint(encounter, relative, change * own.normal, is_effort=change > 0.0)
        if complaint:
            raise WrongChange(
                f"robots {i} and {j}: {complaint}\nto repeat it:\n  scene = {scene!r}\n"
                f"  assert_smallest_change(safety_filter, scene, {array_code(np.asarray(action))}, "
                f"v_opt=np.array({array_code(v_opt)}), time_horizon={time_horizon!r})"
            )
        num_pairs += 1
    return num_pairs


class _Encounter(NamedTuple):
    """A pair of discs, which drive for a time."""

    scene: Scene
    i: int
    j: int
    time_horizon: float

    def touches(self, relative: FloatArray) -> BoolArray:
        """Do they touch at relative velocities, shape (K, 2)?"""
        both, size = [self.i, self.j], len(relative)
        position = np.repeat(self.scene.position[both], size, axis=0)
        moved = np.concatenate([relative * self.time_horizon, np.zeros((size, 2))])
        radius = np.repeat(self.scene.radius[both], size)
        pairs = Pairs(np.arange(size), np.arange(size, 2 * size))
        return np.asarray(closest_approach(position, moved, radius, pairs).least < 0.0)


def _complaint(
    encounter: _Encounter, relative: FloatArray, change: FloatArray, *, is_effort: bool
) -> str:
    meets, size = bool(encounter.touches(relative[None])[0]), float(np.hypot(*change))
    nearer = size * (1.0 - RIM_PART) - RIM_SPEED
    if nearer > 0.0:
        angle = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
        around = relative + nearer * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        if meets != is_effort:
            what = "meet" if meets else "do not meet"
            kind = "a change" if is_effort else "slack"
            return f"they {what} within {encounter.time_horizon} s, but their rows make {kind} of {size:.6g} m/s"
        if (encounter.touches(around) != meets).any():
            return f"less than {size:.6g} m/s leads to the rim of the velocity obstacle"
    beyond = relative + change * (1.0 + RIM_PART + RIM_SPEED / max(size, RIM_SPEED))
    if size > RIM_SPEED and bool(encounter.touches(beyond[None])[0]) == meets:
        return f"{size:.6g} m/s does not reach the rim of the velocity obstacle"
    return ""


def _gap(scene: Scene, i: int, j: int) -> float:
    offset = scene.position[j] - scene.position[i]
    return float(np.hypot(*offset) - scene.radius[i] - scene.radius[j])
