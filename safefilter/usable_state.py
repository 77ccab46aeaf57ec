"""What states of robots can be worked with: finite, and within bounds that keep squares and sums finite.

Letters: N robots, d dimensions.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray, finite_array, require_positive
from safefilter.errors import OutOfRange
from safefilter.jit import formula, kernel

# Priorities are only ever divided by sums of two: this keeps the sums finite and every share above zero.
MAX_PRIORITY = 1e150
MIN_PRIORITY = 1e-150
# Squares of distances and speeds must stay finite.
MAX_COORDINATE = 1e100


def require_usable(state: FloatArray, heading: FloatArray) -> None:
    """Check all numbers of a scene.

    Args:
        state: In the form of `Scene.state`, shape (N, 3 d + 2).
        heading: Shape (N,), or empty where robots have none.

    Raises:
        NotFinite: If one is NaN or infinite; names field and robot.
        OutOfRange: If a radius or a priority is not above zero, or a value is too large or too small.
    """
    # One look at everything; only where something is wrong it is found out what.
    if not _is_usable(state, heading):
        _refuse(state)
        finite_array(heading, "heading", heading.shape)


@kernel
def _is_usable(state: FloatArray, heading: FloatArray) -> bool:
    """The same for Python: numpy takes 5 us for a few robots."""
    return is_usable(state, heading)


@formula
def is_usable(state: FloatArray, heading: FloatArray) -> bool:
    """Is every number finite and within its bounds? Arguments as for `require_usable`."""
    for angle in heading:
        if not math.isfinite(angle):
            return False
    columns = state.shape[1]
    radius, priority = columns - 2, columns - 1
    for i in range(len(state)):
        # Comparisons with NaN are false.
        for column in range(radius):
            if not abs(state[i, column]) <= MAX_COORDINATE:
                return False
        if not 0.0 < state[i, radius] <= MAX_COORDINATE:
            return False
        if not MIN_PRIORITY <= state[i, priority] <= MAX_PRIORITY:
            return False
    return True


def _refuse(state: FloatArray) -> None:
    size = state.shape[1] // 3
    for number, field in enumerate(("position", "velocity", "wanted")):
        columns = state[:, number * size : (number + 1) * size]
        _bounded(finite_array(columns, field, columns.shape), field)
    radius = finite_array(state[:, -2], "radius", (len(state),))
    _bounded(require_positive(radius, "radius"), "radius")
    _require_priority(finite_array(state[:, -1], "priority", (len(state),)))


def _bounded(array: FloatArray, field: str) -> FloatArray:
    wrong = np.abs(array) > MAX_COORDINATE
    if wrong.any():
        place = int(np.argwhere(wrong)[0][0])
        raise OutOfRange(
            f"{field} of row {place}: expected magnitudes up to {MAX_COORDINATE:g}, got {array[place]}"
        )
    return array


def _require_priority(priority: FloatArray) -> None:
    require_positive(priority, "priority")
    wrong = (priority > MAX_PRIORITY) | (priority < MIN_PRIORITY)
    if wrong.any():
        place = int(np.argmax(wrong))
        raise OutOfRange(
            f"priority of row {place}: expected {MIN_PRIORITY:g} to {MAX_PRIORITY:g}, got {priority[place]}"
        )
