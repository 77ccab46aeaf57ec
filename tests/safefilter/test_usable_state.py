"""States of robots: what is refused, wherever it stands, and nothing else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.errors import NotFinite, OutOfRange
from safefilter.usable_state import (
    MAX_COORDINATE,
    MAX_PRIORITY,
    MIN_PRIORITY,
    require_usable,
)

NUM_ROBOTS = 3
SMALLEST = math.ulp(0.0)
NO_HEADING = np.empty(0)
LARGER = math.nextafter(MAX_COORDINATE, math.inf)


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("coordinate", [MAX_COORDINATE, -MAX_COORDINATE, 0.0])
@pytest.mark.parametrize("radius", [SMALLEST, MAX_COORDINATE])
@pytest.mark.parametrize("priority", [MIN_PRIORITY, MAX_PRIORITY])
def test_the_bounds_themselves_can_be_used(
    size: int, coordinate: float, radius: float, priority: float
) -> None:
    state = np.full((NUM_ROBOTS, 3 * size + 2), coordinate)
    state[:, -2], state[:, -1] = radius, priority
    require_usable(state, NO_HEADING)


@given(
    st.sampled_from([2, 3]),
    st.integers(0, NUM_ROBOTS - 1),
    st.integers(0, 10),
    st.sampled_from([math.nan, math.inf, -math.inf, LARGER, -LARGER, -SMALLEST, 0.0]),
)
def test_one_number_that_cannot_be_used_is_found_and_its_robot_named(
    size: int, robot: int, column: int, wrong: float
) -> None:
    state = np.ones((NUM_ROBOTS, 3 * size + 2))
    place = min(column, 3 * size + 1)
    state[robot, place] = wrong
    field = "radius" if place == 3 * size else "priority" if place > 3 * size else None
    largest = MAX_PRIORITY if field == "priority" else MAX_COORDINATE
    least = -MAX_COORDINATE if field is None else SMALLEST
    if least <= wrong <= largest:
        require_usable(state, NO_HEADING)
        return
    error = OutOfRange if math.isfinite(wrong) else NotFinite
    name = field or ("position", "velocity", "wanted")[place // size]
    with pytest.raises(error, match=rf"{name} of row {robot}: expected"):
        require_usable(state, NO_HEADING)


@pytest.mark.parametrize(
    "priority", [math.nextafter(MAX_PRIORITY, math.inf), math.nextafter(MIN_PRIORITY, 0.0)]
)
def test_priorities_beyond_what_sums_stand_are_refused(priority: float) -> None:
    state = np.ones((NUM_ROBOTS, 8))
    state[1, -1] = priority
    with pytest.raises(OutOfRange, match="priority of row 1: expected 1e-150 to 1e"):
        require_usable(state, NO_HEADING)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("robot", range(NUM_ROBOTS))
def test_a_heading_that_is_no_number_is_found(robot: int, wrong: float) -> None:
    state, heading = np.ones((NUM_ROBOTS, 8)), np.full(NUM_ROBOTS, -1e300)
    require_usable(state, heading)
    heading[robot] = wrong
    with pytest.raises(NotFinite, match=rf"^heading of row {robot}: expected a finite number"):
        require_usable(state, heading)
