from __future__ import annotations

import itertools
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
    PARTING_ANGLE,
    STILL_PART,
    drive_last_word,
    is_command_safe,
    speed_cap,
    tracking_command,
    turn_to_freedom,
    wanted_command,
)
from safefilter.kinematics.holonomic import SPEED_SLACK
from safefilter.kinematics.tracking import command_towards, largest_tracked_speed

DT = 0.2
DRIVE = NO_DRIVE._replace(is_used=True, omega_max=2.5, dt=DT, turn_time=0.3, tracking_error=0.02)
ANGLES = st.floats(-math.pi, math.pi)
BUDGETS = st.lists(st.tuples(ANGLES, st.floats(0.0, 0.04)), max_size=6)


# Not so small that whether an arc comes nearer is a matter of rounding.
ROOM = st.lists(st.tuples(ANGLES, st.floats(1e-6, 0.04)), max_size=6)
HEADINGS = (0.0, 0.7, 2.0, 3.1, -2.5, -1.2)
# Noses in contact turn by so much.
PARTING = 0.5 * math.pi + PARTING_ANGLE


def rows_of(
    budgets: list[tuple[float, float]], num_separated: int | None = None
) -> tuple[FloatArray, Sections]:
    """Rows for budgets in m along directions in rad, the first of them for every instant of the step."""
    angle = np.array([direction for direction, _ in budgets])
    offsets = np.array([-budget / DT for _, budget in budgets])
    array = np.stack([-np.cos(angle), -np.sin(angle), offsets]) if budgets else np.empty((3, 0))
    size = len(budgets)
    first = size if num_separated is None else num_separated
    return array, Sections(0, first, size, size, size)


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


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("turn_rate", [-14.0, -5.0, -0.3, 0.0, 1.0, 8.0, 15.0])
def test_the_cap_is_the_largest_speed_whose_arc_keeps_the_budget(
    heading: float, turn_rate: float
) -> None:
    # Densely driven at 1 m/s: where the arc comes furthest, whether in the middle of the step or at its end.
    times = np.linspace(0.0, DT, 2001)
    way = np.array([np.array(chord_velocity(1.0, turn_rate, heading, t)) * t for t in times])
    for direction in np.linspace(-3.0, 3.0, 25):
        furthest = float((way @ [math.cos(direction), math.sin(direction)]).max())
        cap = speed_cap(*rows_of([(float(direction), 0.03)]), heading, turn_rate, DT)
        assert 0.03 / cap == pytest.approx(furthest, abs=1e-7)


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("turn_rate", [-8.0, 0.0, 3.0])
def test_the_chord_keeps_the_other_rows(heading: float, turn_rate: float) -> None:
    chord = chord_velocity(1.0, turn_rate, heading, DT)
    for direction in np.linspace(-3.0, 3.0, 13):
        rows, sections = rows_of([(float(direction), 0.03)], 0)
        cap = speed_cap(rows, sections, heading, turn_rate, DT)
        along = float(rows[:2, 0] @ chord)
        assert cap == (pytest.approx(rows[2, 0] / along) if along < 0.0 else math.inf)


def test_the_least_cap_of_all_rows_counts_and_none_across_the_way() -> None:
    rows, sections = rows_of([(0.0, 0.02), (0.0, 0.01), (0.0, 0.03), (0.0, 0.04)], 2)
    assert speed_cap(rows, sections, 0.0, 0.0, DT) == pytest.approx(0.05)
    rows[2] = rows[2, ::-1].copy()
    assert speed_cap(rows, sections, 0.0, 0.0, DT) == pytest.approx(0.05)
    across = np.array([[0.0, 0.0], [-1.0, 1.0], [0.0, 0.0]])
    for num_separated in (0, 2):
        sections = Sections(0, num_separated, 2, 2, 2)
        assert speed_cap(across, sections, 0.0, 0.0, DT) == math.inf


@pytest.mark.parametrize(
    ("speed", "turn_rate", "expected"),
    [
        (0.0, 0.0, True),
        (0.2 * (1.0 + SPEED_SLACK), 2.5 * (1.0 + SPEED_SLACK), True),
        (0.2 * (1.0 + SPEED_SLACK), -2.5 * (1.0 + SPEED_SLACK), True),
        (0.2 * (1.0 + 2.0 * SPEED_SLACK), 0.0, False),
        (0.1, 2.5 * (1.0 + 2.0 * SPEED_SLACK), False),
        (0.1, -2.5 * (1.0 + 2.0 * SPEED_SLACK), False),
        (0.3, 0.0, False),
        (0.1, 3.0, False),
        (-1e-9, 0.0, False),
        (math.nan, 0.0, False),
        (0.1, math.nan, False),
    ],
)
def test_limits_of_commands_by_hand(speed: float, turn_rate: float, expected: bool) -> None:
    rows, sections = rows_of([])
    assert is_command_safe(rows, sections, DRIVE, 0.0, 0.2, speed, turn_rate) == expected


def test_a_command_is_not_safe_above_the_cap_nor_outside_its_limits_below_it() -> None:
    rows, sections = rows_of([(0.0, 0.02)])
    assert is_command_safe(rows, sections, DRIVE, 0.0, 0.2, 0.0999, 0.0)
    assert not is_command_safe(rows, sections, DRIVE, 0.0, 0.2, 0.1001, 0.0)
    assert not is_command_safe(rows, sections, DRIVE, 0.0, 0.05, 0.0999, 0.0)


@given(ROOM, ANGLES, st.floats(0.0, 9.0), st.floats(-9.0, 9.0), st.booleans())
def test_no_more_is_cut_than_must_be(
    budgets: list[tuple[float, float]], heading: float, speed: float, wish: float, is_single: bool
) -> None:
    rows, sections = rows_of(budgets)
    v, w = drive_last_word(rows, sections, DRIVE, heading, 0.2, speed, wish, is_single)
    allowed = min(speed, 0.2, speed_cap(rows, sections, heading, w, DT))
    assert v >= allowed * (1.0 - (1e-6 if is_single else 1e-9)) - 1e-40
    assert w == pytest.approx(max(-2.5, min(2.5, wish)), rel=1e-6, abs=1e-30)


@pytest.mark.parametrize("budget", [0.001, 0.003, 0.005, 0.007, 0.011, 0.013, 0.017, 0.019])
def test_rounding_to_single_precision_costs_no_more_than_rounding(budget: float) -> None:
    # About half of these caps round up, and have to be cut once more.
    rows, sections = rows_of([(0.0, budget)])
    v, _ = drive_last_word(rows, sections, DRIVE, 0.0, 0.2, 9.0, 0.0, True)
    assert budget * (1.0 - 1e-6) <= v * DT <= budget


def test_where_no_speed_is_allowed_the_robot_turns_on_the_spot() -> None:
    # A row that standing still breaks should not be here; if it is, nothing moves.
    rows, sections = rows_of([(0.0, -0.01)], 0)
    assert drive_last_word(rows, sections, DRIVE, 0.0, 0.2, 0.1, 0.5, False) == (0.0, 0.5)


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("seen", [-1.4, -0.7, -0.1, 0.1, 0.7, 1.4])
def test_the_smaller_turn_away_from_a_contact_is_taken(heading: float, seen: float) -> None:
    # The contact lies to the left (seen above 0) or to the right; one behind may be in the way, too.
    rows, sections = rows_of([(heading + math.pi, 0.0), (heading + seen, 0.0), (heading, 9.0)])
    turn = turn_to_freedom(rows, sections, heading, 0.002)
    assert turn == pytest.approx(math.copysign(PARTING - abs(seen), -seen))


@pytest.mark.parametrize("sides", [(0.3, -0.3), (-0.3, 0.3)])
def test_ties_of_two_contacts_go_to_the_right(sides: tuple[float, float]) -> None:
    for heading in HEADINGS:
        rows, sections = rows_of([(heading + side, 0.0) for side in sides])
        turn = turn_to_freedom(rows, sections, heading, 0.002)
        assert turn == pytest.approx(-(PARTING + 0.3))


def test_contacts_are_nearer_than_the_bound_and_ahead() -> None:
    bound = 0.002
    ahead = Sections(0, 2, 2, 2, 2)
    # What lies straight aside, or no nearer than the bound, is in nobody's way, and no place to turn along.
    rows = np.array([[0.0, -1.0], [-1.0, 0.0], [0.0, -bound]])
    assert turn_to_freedom(rows, ahead, 0.0, bound) == 0.0
    rows = np.array([[-1.0, -math.cos(0.01)], [0.0, -math.sin(0.01)], [0.0, -bound]])
    assert turn_to_freedom(rows, ahead, 0.0, bound) == pytest.approx(-PARTING)
    rows[2, 1] = -0.9 * bound
    assert turn_to_freedom(rows, ahead, 0.0, bound) == pytest.approx(0.01 - PARTING)


@pytest.mark.parametrize("has_polygon", [False, True])
@pytest.mark.parametrize("angle", [-2.9, -1.0, -0.3, 0.0, 0.2, 0.6, 1.7])
def test_a_velocity_is_tracked_from_any_heading(angle: float, has_polygon: bool) -> None:
    drive = DRIVE._replace(has_polygon=has_polygon, tracking_error=0.005)
    limit = largest_tracked_speed(angle, 0.2, 2.5, 0.3, 0.005)
    for heading, speed in itertools.product(HEADINGS, (0.01, 0.15, 0.9)):
        x, y = speed * math.cos(heading + angle), speed * math.sin(heading + angle)
        found = tracking_command(drive, 0.0, heading, 0.2, x, y)
        # Inside the polygon of what is tracked it is not cut, but for rounding.
        expected = min(speed, 0.2) if has_polygon else min(speed, limit)
        assert found == pytest.approx(command_towards(angle, expected, 2.5, 0.3))


@pytest.mark.parametrize("v_max", [0.2, 2.0])
def test_who_stands_still_turns_as_the_policy_says(v_max: float) -> None:
    still = 0.9 * STILL_PART * v_max
    assert tracking_command(DRIVE, 0.7, 1.0, v_max, -still, 0.0) == (0.0, 0.7)
    creeping = 1.1 * STILL_PART * v_max
    assert tracking_command(DRIVE, 0.7, 0.0, v_max, creeping, 0.0) == pytest.approx((creeping, 0.0))
    assert tracking_command(DRIVE, 0.7, 0.0, v_max, 0.01 * v_max, 0.0) == (0.01 * v_max, 0.0)


def wanted(
    budgets: list[tuple[float, float]],
    velocity: tuple[float, float],
    command: tuple[float, float] = (0.1, 0.0),
) -> tuple[float, float]:
    """What a robot that faces along x goes for; with a v_max of 0.2 m/s contacts are budgets below 0.4 mm."""
    return wanted_command(*rows_of(budgets), DRIVE, *command, 0.0, 0.2, *velocity)


def test_who_is_held_by_a_contact_turns_to_where_it_is_free() -> None:
    assert wanted([(0.0, 0.0)], (0.1, 0.0)) == pytest.approx((0.0, -PARTING / DT))
    assert wanted([(0.0, 0.00039)], (0.1, 0.0)) == pytest.approx((0.0, -PARTING / DT))
    # Near is not held.
    assert wanted([(0.0, 0.00041)], (0.1, 0.0)) == pytest.approx((0.1, 0.0))
    # Nor is a neighbour at 4 mm a contact to turn along.
    near = [(0.0, 0.0), (-1.0, 0.004)]
    assert wanted(near, (0.1, 0.0)) == pytest.approx((0.0, -PARTING / DT))
    assert wanted([], (0.1, 0.0)) == pytest.approx((0.1, 0.0))
    # Nor is one at 0.2 mm that the robot mostly passes: it may still drive at 2.8 mm/s, more than a hundredth.
    assert wanted([(1.2, 0.0002)], (0.1, 0.0)) == pytest.approx((0.1, 0.0))


def test_who_is_held_from_all_sides_does_what_it_would() -> None:
    held = [(angle, 0.0) for angle in (0.0, 1.5, 3.0, 4.6)]
    assert wanted(held, (0.1, 0.0)) == pytest.approx((0.1, 0.0))


def test_who_stands_still_is_turned_only_if_the_policy_wants_to_move() -> None:
    contact = [(0.0, 0.0)]
    assert wanted(contact, (0.0, 0.0), (0.1, 0.7)) == pytest.approx((0.0, -PARTING / DT))
    assert wanted(contact, (0.0, 0.0), (0.0, 0.7)) == (0.0, 0.7)
    assert wanted(contact, (0.0, 0.0), (1e-8, 0.7)) == (0.0, 0.7)
    # A millionth of the top speed is the least that counts.
    assert wanted(contact, (1e-6, 0.0), (0.0, 0.7)) == pytest.approx((0.0, -PARTING / DT))
    # Who turns on the spot to go somewhere is freed at once.
    assert wanted(contact, (-0.1, 0.0)) == pytest.approx((0.0, -PARTING / DT))
    assert wanted([], (-0.1, 0.0)) == (0.0, 2.5)
