"""Who takes how much: shares of the change, and radii that grow by tracking errors."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.priority_orca import grown_radius
from safefilter.constraints.responsibility import responsibility, room, row_offset, share_of_change

speeds = st.floats(-1.5, 1.5)
priorities = st.floats(1e-3, 1e3)


@pytest.mark.parametrize(
    ("change", "has_dual_slack", "expected"),
    [(1.0, True, 0.25), (1.0, False, 0.25), (-1.0, True, 0.75), (-1.0, False, 0.25)],
)
def test_shares_by_hand(change: float, has_dual_slack: bool, expected: float) -> None:
    assert share_of_change(3.0, 1.0, True, change, has_dual_slack) == expected
    assert share_of_change(3.0, 1.0, False, change, has_dual_slack) == 1.0


@given(a=priorities, b=priorities, change=st.floats(-2.0, 2.0), dual=st.booleans())
def test_shares_of_a_pair_sum_to_one(a: float, b: float, change: float, dual: bool) -> None:
    total = share_of_change(a, b, True, change, dual) + share_of_change(b, a, True, change, dual)
    assert total == pytest.approx(1.0, abs=1e-15)


@given(a=priorities, b=priorities, change=st.floats(-2.0, 2.0))
def test_dual_rule_never_makes_the_higher_priority_change_more(
    a: float, b: float, change: float
) -> None:
    # The row is n @ v >= n @ v_opt + share * change: the larger the right side, the more a robot must change.
    high, low = max(a, b), min(a, b)
    demand_high = share_of_change(high, low, True, change, True) * change
    assert demand_high <= share_of_change(low, high, True, change, True) * change


@given(a=priorities, b=priorities)
def test_paper_rule_is_eq_15_on_both_branches(a: float, b: float) -> None:
    for change in (1.0, -1.0):
        assert share_of_change(a, b, True, change, False) == responsibility(a, b)
    assert share_of_change(a, b, True, -1.0, True) == room(a, b)


@given(along=speeds, share=st.floats(0.0, 1.0), change=speeds)
def test_offset_lies_the_share_beyond_v_opt(along: float, share: float, change: float) -> None:
    assert row_offset(along, share, change) - along == pytest.approx(share * change, abs=1e-15)


@given(combined=st.floats(0.01, 2.0), gap=st.floats(-1.0, 5.0), error=st.floats(0.0, 1.0))
def test_radii_grow_by_both_errors_but_never_into_contact(
    combined: float, gap: float, error: float
) -> None:
    grown = grown_radius(combined, combined + gap, error)
    assert combined <= grown <= combined + 2.0 * error + 1e-15
    if gap >= 0.0:
        assert grown <= combined + gap + 1e-15
    else:
        assert grown == combined


def test_radii_grow_by_hand() -> None:
    assert grown_radius(1.0, 3.0, 0.25) == 1.5
    assert grown_radius(1.0, 1.25, 0.25) == 1.25
    assert grown_radius(1.0, 0.5, 0.25) == 1.0
