"""Shares of the change and of the gap sum to one, and go the right way."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.responsibility import responsibility, room, share
from safefilter.jit import source_of
from safefilter.usable_state import MAX_PRIORITY, MIN_PRIORITY

# Units in the last place that a rounded sum of two rounded shares may be off.
ULP = 2.0**-52

priorities = st.floats(MIN_PRIORITY, MAX_PRIORITY)
exact_priorities = st.fractions(min_value=Fraction(1, 10**9), max_value=10**9)


@pytest.mark.parametrize(
    ("own", "other", "expected"),
    [(1.0, 1.0, 0.5), (3.0, 1.0, 0.25), (1.0, 3.0, 0.75), (1e150, 1e-150, 1e-300)],
)
def test_responsibility_by_hand(own: float, other: float, expected: float) -> None:
    assert responsibility(own, other) == expected
    assert room(other, own) == expected


@given(own=exact_priorities, other=exact_priorities)
def test_shares_sum_to_one_exactly(own: Fraction, other: Fraction) -> None:
    plain = source_of(share)
    assert plain(own, other) + plain(other, own) == 1  # type: ignore[arg-type]  # exact numbers


@given(own=priorities, other=priorities)
def test_shares_sum_to_one_in_floats(own: float, other: float) -> None:
    for rule in (responsibility, room):
        assert abs(rule(own, other) + rule(other, own) - 1.0) <= ULP
    assert abs(responsibility(own, other) + room(own, other) - 1.0) <= ULP


@given(own=priorities, other=priorities)
def test_nobody_is_left_without_a_share(own: float, other: float) -> None:
    assert 0.0 < responsibility(own, other) <= 1.0
    assert 0.0 < room(own, other) <= 1.0


@given(own=priorities, other=priorities)
def test_one_robots_responsibility_is_the_others_room(own: float, other: float) -> None:
    assert responsibility(own, other) == room(other, own)


@given(own=priorities, raised=priorities, other=priorities)
def test_higher_priority_takes_less_of_the_change_and_more_of_the_gap(
    own: float, raised: float, other: float
) -> None:
    low, high = sorted((own, raised))
    assert responsibility(high, other) <= responsibility(low, other)
    assert room(high, other) >= room(low, other)


@given(own=st.floats(1e-6, 1e6), other=st.floats(1e-6, 1e6), power=st.integers(-20, 20))
def test_only_ratios_of_priorities_matter(own: float, other: float, power: int) -> None:
    assert responsibility(own * 2.0**power, other * 2.0**power) == responsibility(own, other)
