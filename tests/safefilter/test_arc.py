from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.kinematics.arc import (
    chord_velocity,
    inner_advance_away,
    inner_advance_through,
    largest_advance,
    sinc,
)

HEADINGS = st.floats(-math.pi, math.pi)
DT = 0.2


def advance(turn_rate: float, heading: float, e: float, time: float) -> float:
    """Advance along direction e after a time at unit speed, from the definition of the arc."""
    x, y = chord_velocity(1.0, turn_rate, heading, time)
    return (x * math.cos(e) + y * math.sin(e)) * time


def cap_terms(turn_rate: float, heading: float, e: float) -> float:
    return largest_advance(
        math.cos(heading - e),
        math.sin(heading - e),
        math.cos(heading + turn_rate * DT - e),
        advance(turn_rate, heading, e, DT),
        turn_rate,
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("turn_rate", [0.5, 2.0])
def test_an_arc_that_turns_through_a_direction_advances_until_it_turns_away_slowly_or_fast(
    turn_rate: float, side: float
) -> None:
    # From 1 rad on one side of e to 1.6 rad on the other: a radius, and its part behind.
    largest = largest_advance(
        math.cos(1.0), -side * math.sin(1.0), math.cos(1.6), -1.0, side * turn_rate
    )
    assert largest == pytest.approx((1.0 + math.sin(1.0)) / turn_rate)


def test_straight_motion_goes_straight() -> None:
    x, y = chord_velocity(0.2, 0.0, math.pi / 2, DT)
    assert (x, y) == pytest.approx((0.0, 0.2), abs=1e-16)


def test_a_quarter_circle_ends_where_geometry_says() -> None:
    # Radius v / w = 1 m: a quarter turn from (0, 0) heading east ends at (1, 1).
    time = math.pi / 2
    x, y = chord_velocity(1.0, 1.0, 0.0, time)
    assert (x * time, y * time) == pytest.approx((1.0, 1.0))


@given(st.floats(-2.5, 2.5), HEADINGS)
def test_the_chord_equals_a_fine_integration(turn_rate: float, heading: float) -> None:
    middle = (np.arange(20000) + 0.5) * (DT / 20000)
    angle = heading + turn_rate * middle
    x, y = chord_velocity(0.7, turn_rate, heading, DT)
    assert x == pytest.approx(0.7 * float(np.cos(angle).mean()), abs=1e-9)
    assert y == pytest.approx(0.7 * float(np.sin(angle).mean()), abs=1e-9)


@example(turn_rate=11.0, heading=1.5, e=2.0)  # turns towards e first, and through it
@given(st.floats(0.0, 15.0), HEADINGS, HEADINGS)
def test_no_instant_advances_further_than_the_largest_advance(
    turn_rate: float, heading: float, e: float
) -> None:
    instants = np.linspace(0.0, DT, 400)
    seen = max(advance(turn_rate, heading, e, float(time)) for time in instants)
    bound = cap_terms(turn_rate, heading, e)
    assert seen <= bound + 1e-15
    assert bound <= seen + 1e-5 * DT  # and it is reached: 400 instants come this close


@given(st.floats(1e-9, 15.0), HEADINGS, HEADINGS)
def test_mirrored_arcs_advance_alike(turn_rate: float, heading: float, e: float) -> None:
    assert cap_terms(turn_rate, heading, e) == pytest.approx(
        cap_terms(-turn_rate, -heading, -e), abs=1e-15
    )


def test_a_slow_turn_away_loses_no_digits() -> None:
    # Heading a hair inside of square to e, turning out of it: 1 - sin would cancel to nothing here.
    turn_rate, angle = 1e-7, math.pi / 2 - 1e-8
    exact = 0.5e-16 / turn_rate  # (1 - sin) = (1e-8)^2 / 2
    assert inner_advance_away(math.cos(angle), math.sin(angle), turn_rate) == pytest.approx(
        exact, rel=1e-6
    )


def test_sinc_is_one_at_zero() -> None:
    assert sinc(0.0) == 1.0
    assert sinc(1e-9) == 1.0
    assert sinc(math.pi) == pytest.approx(0.0, abs=1e-15)


@given(st.floats(0.0, 1.0))
def test_the_two_forms_of_the_inner_advance_agree(turned_sine: float) -> None:
    cosine = math.sqrt((1.0 - turned_sine) * (1.0 + turned_sine))
    assert inner_advance_away(cosine, turned_sine, 2.0) == pytest.approx(
        inner_advance_through(turned_sine, 2.0), abs=1e-15
    )
