"""The solver believes "sat" only after it has put the numbers in, and moves variables one to one only."""

from __future__ import annotations

import z3

from proofs.solver import find, is_origin, parts_of, refute, variables_of

X, Y = z3.Reals("x y")


def test_numbers_are_found_and_fit() -> None:
    answer = find([X * X == 2, X > 0])
    assert answer.verdict == z3.sat
    assert answer.values["x"].startswith("1.41421356")


def test_a_contradiction_is_refuted_wherever_it_is_measured_from() -> None:
    formulas = [X * X + Y * Y < 1, X > 1]
    assert refute(formulas).verdict == z3.unsat
    assert refute(formulas, shifts=[((X, Y),)]).verdict == z3.unsat


def test_a_fact_that_is_left_out_at_first_is_not_forgotten() -> None:
    # The only reason why x is not 3 is a long comparison, which a first attempt leaves out.
    long = sum((X for _ in range(40)), X) < 41
    assert refute([long, X == 3]).verdict == z3.unsat
    assert find([long, X == 0]).verdict == z3.sat


def test_an_origin_does_not_move_with_its_variable() -> None:
    assert is_origin(((X, Y),))
    assert not is_origin(((X, 2 * X),))


def test_formulas_are_taken_apart() -> None:
    assert list(parts_of(z3.And(X > 0, z3.And(Y > 0, X > Y)))) == [X > 0, Y > 0, X > Y]
    assert set(variables_of(z3.Or(X + Y > 0, X > 1))) == {"x", "y"}
