"""Running shipped code on unknown numbers: nothing is left out, and each way says what floats would have done."""

from __future__ import annotations

import math
from typing import Any

import pytest
import z3
from hypothesis import given
from hypothesis import strategies as st

from proofs.solver import find, refute
from proofs.symbolic import Number, Outcome, outcome, paths, symbolic, term_of
from safefilter.constraints.velocity_obstacle import norm_boundary
from safefilter.constraints.walls import to_closest_point
from safefilter.jit import source_of

A, B = z3.Reals("a b")
NUMBERS = st.integers(-3, 3)


def test_every_branch_is_found_once() -> None:
    ways = paths(lambda: (max(Number(A), min(Number(B), 1.0)),))
    conditions = [z3.And(*way.conditions) for way in ways]
    assert refute([z3.Not(z3.Or(*conditions))]).verdict == z3.unsat
    for k, condition in enumerate(conditions):
        assert refute([condition, z3.Or(*conditions[:k], *conditions[k + 1 :])]).verdict == z3.unsat
    assert find([z3.And(*conditions[0:1])]).verdict == z3.sat


def test_equal_polynomials_are_one_question_and_one_root() -> None:
    def twice() -> tuple[Any, ...]:
        a, b = Number(A), Number(B)
        first = 1.0 if (a - b) * (a - b) > 1.0 else 0.0
        second = 1.0 if (b - a) * (b - a) > 1.0 else 0.0
        return first, second

    assert sorted(way.result for way in paths(twice)) == [(0.0, 0.0), (1.0, 1.0)]


def test_division_and_root_are_obligations() -> None:
    def formula(x: float, y: float) -> float:
        return math.sqrt(x) / y

    (way,) = paths(lambda: (symbolic(formula)(Number(A), Number(B)),))
    assert find([way.taken, way.is_defined, A == 4, B == 2, term_of(way.result[0]) == 2])
    for missing in (A < 0, B == 0):
        assert refute([way.is_defined, missing]).verdict == z3.unsat


def test_what_is_not_finite_is_no_number() -> None:
    with pytest.raises(TypeError, match="expected a finite number, got nan"):
        term_of(math.nan)
    assert [way.result for way in paths(lambda: (min(math.inf, Number(A)) is math.inf,))] == [
        (False,)
    ]


def test_an_infinite_limit_is_beyond_every_number() -> None:
    def is_in_reach() -> tuple[Any, ...]:
        horizon = Number(A)
        if horizon <= 0:
            return (0,)
        return (1 if Number(B) < math.inf * horizon + Number(B) else 2,)

    assert sorted(way.result for way in paths(is_in_reach)) == [(0,), (1,)]
    with pytest.raises(ArithmeticError, match="infinity times zero"):
        paths(lambda: (math.inf * Number(A),))


def test_unknown_numbers_are_compared_inside_paths_only() -> None:
    with pytest.raises(RuntimeError, match="inside `paths` only"):
        bool(Number(A) > 0)


def values_of(found: Outcome, pinned: dict[Any, float]) -> list[float]:
    """Where the ways lead for known numbers: exactly one is open."""
    pins = [variable == z3.RealVal(value) for variable, value in pinned.items()]
    answers = [find([way, *pins]) for way in found.ways]
    (answer,) = [answer for answer in answers if answer.verdict == z3.sat]
    return [float(eval_number(answer.values[str(value)])) for value in found.values]


def eval_number(text: str) -> float:
    numerator, _, denominator = text.rstrip("?").partition("/")
    return float(numerator) / float(denominator or 1)


CLOSEST_ARGUMENTS = z3.Reals("a_x a_y b_x b_y p_x p_y")
CLOSEST = outcome("c_x c_y", lambda: symbolic(to_closest_point)(*map(Number, CLOSEST_ARGUMENTS)))
BOUNDARY_ARGUMENTS = z3.Reals("p_x p_y o_x o_y R tau T tie kind")
BOUNDARY = outcome(
    "n_x n_y change", lambda: symbolic(norm_boundary)(*map(Number, BOUNDARY_ARGUMENTS))
)


@given(st.tuples(*[NUMBERS] * 6))
def test_the_closest_point_is_what_floats_find(numbers: tuple[int, ...]) -> None:
    pinned = dict(zip(CLOSEST_ARGUMENTS, map(float, numbers), strict=True))
    expected = source_of(to_closest_point)(*map(float, numbers))
    assert values_of(CLOSEST, pinned) == pytest.approx(expected)


@pytest.mark.parametrize("o", [(3.0, 0.0), (1.0, 2.0), (2.0, -1.0), (0.0, 0.0)])
@pytest.mark.parametrize("kind", [-1, 0, 1])
@pytest.mark.parametrize("radius", [3.0, 6.0])
def test_the_boundary_is_what_floats_find(o: tuple[float, float], kind: int, radius: float) -> None:
    numbers = (5.0, 0.0, *o, radius, 2.0, 0.5, 1.0, kind)
    pinned = dict(zip(BOUNDARY_ARGUMENTS, numbers, strict=True))
    expected = source_of(norm_boundary)(*numbers)
    assert values_of(BOUNDARY, pinned) == pytest.approx(expected)
