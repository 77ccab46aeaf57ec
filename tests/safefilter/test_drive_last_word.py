from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.constraints.row_buffers import Sections
from safefilter.kinematics.arc import chord_velocity
from safefilter.kinematics.drive import NO_DRIVE
from safefilter.kinematics.drive_last_word import (
    drive_last_word,
    is_command_safe,
    speed_cap,
    turn_to_freedom,
)

DT = 0.2
DRIVE = NO_DRIVE._replace(is_used=True, omega_max=2.5, dt=DT, turn_time=0.3, tracking_error=0.02)
ANGLES = st.floats(-math.pi, math.pi)
BUDGETS = st.lists(st.tuples(ANGLES, st.floats(0.0, 0.04)), max_size=6)


def rows_of(budgets: list[tuple[float, float]]) -> tuple[FloatArray, Sections]:
    """Rows for budgets in m along directions in rad."""
    angle = np.array([direction for direction, _ in budgets])
    offsets = np.array([-budget / DT for _, budget in budgets])
    array = np.stack([-np.cos(angle), -np.sin(angle), offsets]) if budgets else np.empty((3, 0))
    size = len(budgets)
    return array, Sections(0, size, size, size, size)


@given(BUDGETS, ANGLES, st.floats(-1.0, 1.0), st.floats(-9.0, 9.0), st.booleans())
def test_no_instant_of_the_arc_passes_a_budget(
    budgets: list[tuple[float, float]],
    heading: float,
    speed: float,
    turn_rate: float,
    is_single: bool,
) -> None:
    rows, sections = rows_of(budgets)
    v, w = drive_last_word(rows, sections, DRIVE, heading, 0.2, speed, turn_rate, is_single)
    assert is_command_safe(rows, sections, DRIVE, heading, 0.2, v, w)
    for direction, budget in budgets:
        for time in np.linspace(0.0, DT, 60):
            x, y = chord_velocity(v, w, heading, float(time))
            advance = (x * math.cos(direction) + y * math.sin(direction)) * time
            assert advance <= budget + 1e-15


@given(ANGLES, st.floats(0.0, 0.2), st.floats(-2.5, 2.5))
def test_a_command_with_nothing_in_the_way_is_kept(heading: float, v: float, w: float) -> None:
    rows, sections = rows_of([])
    assert drive_last_word(rows, sections, DRIVE, heading, 0.2, v, w, False) == (v, w)


@pytest.mark.parametrize("wrong", [(math.nan, 0.0), (0.1, math.inf)])
def test_a_command_that_is_not_finite_stands_still(wrong: tuple[float, float]) -> None:
    rows, sections = rows_of([])
    assert drive_last_word(rows, sections, DRIVE, 0.0, 0.2, *wrong, False) == (0.0, 0.0)


def test_the_cap_ahead_is_the_budget_over_the_step() -> None:
    rows, sections = rows_of([(0.0, 0.01)])
    assert speed_cap(rows, sections, 0.0, 0.0, DT) == pytest.approx(0.05)
    assert speed_cap(rows, sections, math.pi, 0.0, DT) == math.inf


def test_a_nose_in_contact_turns_right_to_where_it_is_free() -> None:
    rows, sections = rows_of([(0.0, 0.0)])
    assert turn_to_freedom(rows, sections, 0.0, 0.002) == pytest.approx(-(math.pi / 2 + 0.02))
    # A robot that has begun to turn left goes on to the left.
    assert turn_to_freedom(rows, sections, 0.5, 0.002) == pytest.approx(math.pi / 2 + 0.02 - 0.5)
    assert turn_to_freedom(rows, sections, 2.0, 0.002) == 0.0


def test_a_robot_held_from_all_sides_has_nowhere_to_turn() -> None:
    rows, sections = rows_of([(angle, 0.0) for angle in (0.0, 1.5, 3.0, 4.6)])
    assert turn_to_freedom(rows, sections, 0.0, 0.002) == 0.0
