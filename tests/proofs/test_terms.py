"""Equal arguments have one variable, different ones never share one."""

from __future__ import annotations

import pytest
import z3

from proofs.terms import canonical, cosine_of, inverse_of, root_of, sine_of

X, Y = z3.Reals("x y")


def test_equal_polynomials_are_written_alike() -> None:
    assert canonical((X + Y) * (X - Y)).eq(canonical(X * X - Y * Y))


@pytest.mark.parametrize("function", [cosine_of, inverse_of, root_of, sine_of])
def test_a_variable_is_named_by_its_argument(function: object) -> None:
    assert callable(function)
    assert function((X + Y) * (X + Y)).eq(function(X * X + 2 * X * Y + Y * Y))
    assert not function(X).eq(function(Y))


def test_one_over_a_known_number_is_known() -> None:
    assert inverse_of(z3.RealVal(4)).eq(z3.RealVal("1/4"))


def test_functions_do_not_share_variables() -> None:
    values = [function(X) for function in (cosine_of, inverse_of, root_of, sine_of)]
    assert len(set(map(str, values))) == len(values)
