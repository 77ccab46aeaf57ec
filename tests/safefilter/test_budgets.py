"""Each formula of a budget alone: by hand, and that a pair's budgets fit into its gap."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.constraints.budgets import (
    approach,
    clearance,
    cooperative_budget,
    passive_budget,
    shared_budget,
    spare_budget,
)
from safefilter.constraints.responsibility import room
from safefilter.constraints.separation import direction

# Rounding of a few sums of lengths up to some metres.
ROUNDING = 1e-12
gaps = st.one_of(st.just(0.0), st.floats(0.0, 3.0))


lengths = st.floats(0.0, 3.0)


priorities = st.floats(1e-6, 1e6)


def test_budgets_by_hand() -> None:
    assert clearance(2.0, 0.5, 0.25, 0.25) == 1.0
    assert shared_budget(2.0, 0.25) == 0.5
    assert spare_budget(2.0, 0.5) == 1.5
    # 2 m free: a quarter of it is less than what the other leaves over.
    assert cooperative_budget(2.0, 0.25, 0.5) == 1.5
    assert cooperative_budget(2.0, 0.25, 1.75) == 0.5
    assert passive_budget(2.0, 0.5) == 1.5
    assert passive_budget(2.0, 2.5) == 0.0


def test_approach_counts_along_the_line_of_centres() -> None:
    # The other is to the north-east; what it does across does not count.
    assert approach(0.6, 0.8, -0.6, -0.8, 2.0) == pytest.approx(2.0)
    assert approach(0.6, 0.8, 0.6, 0.8, 2.0) == pytest.approx(-2.0)
    assert approach(0.6, 0.8, -0.8, 0.6, 2.0) == pytest.approx(0.0)


@given(gap=gaps, receding=st.floats(0.0, 10.0))
def test_a_neighbour_that_recedes_is_given_no_credit(gap: float, receding: float) -> None:
    assert passive_budget(gap, -receding) == gap


@given(gap=gaps, credited=st.floats(-5.0, 5.0))
def test_passive_budget_and_credited_approach_fit_into_the_gap(gap: float, credited: float) -> None:
    budget = passive_budget(gap, credited)
    assert 0.0 <= budget <= gap
    assert budget + max(0.0, credited) <= max(gap, credited) + ROUNDING


@given(gap=gaps, a=priorities, b=priorities, reach_a=lengths, reach_b=lengths)
@example(gap=1.0, a=1.0, b=1.0, reach_a=0.1, reach_b=0.1)
@example(gap=1.0, a=1.0, b=3.0, reach_a=0.1, reach_b=3.0)
def test_a_pair_that_keeps_budgets_and_speed_limits_stays_within_the_gap(
    gap: float, a: float, b: float, reach_a: float, reach_b: float
) -> None:
    # Either may take its share or what the other cannot use; nobody exceeds its own reach.
    advance_a = min(cooperative_budget(gap, room(a, b), reach_b), reach_a)
    advance_b = min(cooperative_budget(gap, room(b, a), reach_a), reach_b)
    assert advance_a >= 0.0
    assert advance_b >= 0.0
    assert advance_a + advance_b <= gap + ROUNDING


@given(gap=gaps, own_room=st.floats(0.0, 1.0), reach=lengths, more=lengths)
def test_budgets_grow_with_the_gap_and_shrink_with_the_others_reach(
    gap: float, own_room: float, reach: float, more: float
) -> None:
    budget = cooperative_budget(gap, own_room, reach)
    assert cooperative_budget(gap + more, own_room, reach) >= budget
    assert cooperative_budget(gap, own_room, reach + more) <= budget
    assert budget >= shared_budget(gap, own_room)


@given(angle=st.floats(0.0, 6.3), distance=st.floats(1e-140, 1e3), tie=st.sampled_from((1.0, -1.0)))
def test_direction_has_length_one_and_is_opposite_for_the_other(
    angle: float, distance: float, tie: float
) -> None:
    x, y = distance * math.cos(angle), distance * math.sin(angle)
    e = direction(x, y, math.hypot(x, y), tie)
    assert math.hypot(*e) == pytest.approx(1.0, abs=1e-12)
    assert direction(-x, -y, math.hypot(x, y), -tie) == (-e[0], -e[1])
