"""Lemmas refuse formulas that are wrong on purpose: the shipped ones are not proved by accident."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import z3

from proofs import boundary, orca_rows
from proofs.apart import supports
from proofs.prover import NotProved, prove
from proofs.symbolic import Number, outcome, symbolic
from safefilter.constraints.budgets import passive_budget
from safefilter.constraints.v_opt import CURRENT, OWN
from safefilter.constraints.velocity_obstacle import norm_boundary
from safefilter.kinematics.arc import largest_advance


def flipped_leg(v_x: Any, v_y: Any, n_x: Any, n_y: Any) -> Any:
    return v_x * n_x + v_y * n_y


def missing_radius(*given: Any) -> Any:
    return -given[2]


def wrong_leg(p_x: Any, p_y: Any, radius: Any, leg: Any, squared: Any) -> Any:
    return (p_x * radius - p_y * leg) / squared, (p_x * leg + p_y * radius) / squared


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("leg_change", flipped_leg),
        ("cutoff_change", missing_radius),
        ("left_leg_normal", wrong_leg),
        ("is_overlapping", lambda *_: False),
        ("faces_cutoff", lambda *_: True),
    ],
)
def test_a_wrong_boundary_supports_nothing(name: str, wrong: Callable[..., Any]) -> None:
    formula = symbolic(norm_boundary, {name: wrong})
    found = outcome("n_x n_y change", lambda: formula(*map(Number, boundary.GIVEN)))
    p_x, p_y, o_x, o_y, radius, horizon, *_ = boundary.GIVEN
    n_x, n_y, change = found.values
    pinned = {"a pair": z3.And(p_x == 5, p_y == 0, radius == 3, horizon == 1)}
    if name == "is_overlapping":
        pinned = {"a pair": z3.And(p_x == 1, p_y == 0, radius == 3, horizon == 1)}
    with pytest.raises(NotProved, match="the claim is false"):
        prove(
            "wrong",
            "",
            {**pinned, "the boundary is a wrong one": found.ways},
            z3.And(
                found.is_defined,
                supports(n_x, n_y, p_x, p_y, radius, horizon, n_x * o_x + n_y * o_y + change),
            ),
        )


def half_of_one(own: Number, other: Number) -> Number:
    is_of_i = own.term.eq(orca_rows.PRIORITY_J)
    return Number(z3.RealVal(1) / 2) if is_of_i else own / (own + other)


def test_half_of_the_change_is_not_enough_for_unequal_priorities(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Robot i takes one half whatever the priorities, j its share: together that is not the whole.
    def with_half(function: Any, stand_ins: Any) -> Any:
        return symbolic(function, {**stand_ins, "share": half_of_one})

    monkeypatch.setattr("proofs.orca_rows.symbolic", with_half)
    rows = orca_rows.rows_of_pair(CURRENT)
    with pytest.raises(NotProved, match="the claim is false"):
        prove(
            "wrong",
            "",
            {
                **orca_rows.POSITIVE_PRIORITIES,
                orca_rows.ARE_SHIPPED: rows.ways,
                "i": orca_rows.kept(rows.values[:3], orca_rows.U_I),
                "j": orca_rows.kept(rows.values[3:], orca_rows.U_J),
            },
            orca_rows.beyond(
                orca_rows.U_I[0] - orca_rows.U_J[0], orca_rows.U_I[1] - orca_rows.U_J[1]
            ),
        )


def test_own_velocities_are_not_one_pair() -> None:
    with pytest.raises(orca_rows.NotOnePair):
        orca_rows.rows_of_pair(OWN)


def test_credit_for_receding_is_refused() -> None:
    gap, approach = z3.Reals("gap approach")
    formula = symbolic(passive_budget, {"max": lambda _, second: second})
    found = outcome("budget", lambda: (formula(Number(gap), Number(approach)),))
    with pytest.raises(NotProved, match="the claim is false"):
        prove("wrong", "", {"gap": gap >= 0, "budget": found.ways}, found.values[0] <= gap)


def test_an_arc_that_ignores_its_middle_is_refused() -> None:
    cosine, sine, end, advance, rate = z3.Reals("c_0 s_0 c_2 end_advance w")
    formula = symbolic(largest_advance, {"inner_advance_away": lambda *_: 0 * Number(rate)})
    found = outcome("largest", lambda: (formula(*map(Number, (cosine, sine, end, advance, rate))),))
    with pytest.raises(NotProved, match="the claim is false"):
        prove(
            "wrong",
            "",
            {
                "w": rate == 1,
                "turns away": z3.And(cosine > 0, end < 0, sine >= 0, sine < 1),
                "f": found.ways,
            },
            found.values[0] >= 1 - sine,
        )
