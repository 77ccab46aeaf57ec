"""Programs are checked and copied once, and judge points by the formulas."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.errors import InvalidInput, NotFinite, ShapeError
from safefilter.programs.convex_program import SYMMETRY_TOLERANCE, ConvexProgram


def fields(n: int = 2, m: int = 3, seed: int = 0) -> dict[str, Any]:
    """Fields of a random program."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    P = root @ root.T
    return {
        "P": (P + P.T) / 2.0,
        "q": rng.normal(size=n),
        "G": rng.normal(size=(m, n)),
        "h": rng.normal(size=m),
    }


def program(n: int = 2, m: int = 3, seed: int = 0) -> ConvexProgram:
    return ConvexProgram(**fields(n, m, seed))


sizes = st.tuples(st.integers(1, 5), st.integers(0, 6), st.integers(0, 99))


def test_objective_and_violation_by_hand() -> None:
    made = ConvexProgram(
        P=np.diag([2.0, 4.0]),
        q=np.array([1.0, -1.0]),
        G=np.array([[1.0, 0.0], [0.0, 1.0]]),
        h=np.array([1.0, 0.5]),
    )
    # 1/2 (2 * 9 + 4 * 1) + 3 - 1
    assert made.objective(np.array([3.0, 1.0])) == 13.0
    assert made.violation(np.array([3.0, 1.0])) == 2.0
    assert made.violation(np.array([1.0, 0.5])) == 0.0
    assert made.violation(np.array([-9.0, -9.0])) == 0.0


@given(size=sizes)
def test_sizes_are_those_of_the_arrays(size: tuple[int, int, int]) -> None:
    made = program(*size)
    assert (made.num_variables, made.num_rows) == size[:2]


@given(size=sizes)
def test_objective_has_the_gradient_that_solvers_use(size: tuple[int, int, int]) -> None:
    made = program(*size)
    rng = np.random.default_rng(size[2] + 1)
    x, step = rng.normal(size=(2, size[0]))
    # A quadratic: the central difference is exact.
    slope = (made.objective(x + step) - made.objective(x - step)) / 2.0
    assert slope == pytest.approx((made.P @ x + made.q) @ step, abs=1e-9)


@given(size=sizes)
def test_violation_is_the_worst_row_and_never_negative(size: tuple[int, int, int]) -> None:
    made = program(*size)
    x = np.random.default_rng(size[2] + 1).normal(size=size[0])
    rows = [float(row @ x - bound) for row, bound in zip(made.G, made.h, strict=True)]
    assert made.violation(x) == pytest.approx(max([0.0, *rows]), abs=1e-12)


@pytest.mark.parametrize(
    ("P", "is_linear"), [([[0.0]], True), ([[-0.0]], True), ([[1e-300]], False)]
)
def test_a_program_is_linear_if_nothing_is_squared(P: list[list[float]], is_linear: bool) -> None:
    made = ConvexProgram(P=np.array(P), q=np.ones(1), G=np.empty((0, 1)), h=np.empty(0))
    assert made.is_linear is is_linear


@pytest.mark.parametrize(
    ("field", "value", "error", "message"),
    [
        ("q", np.zeros((2, 1)), ShapeError, "q: expected shape (n,), got (2, 1)"),
        ("P", np.zeros((3, 3)), ShapeError, "P: expected shape (2, 2), got (3, 3)"),
        ("h", 1.0, ShapeError, "h: expected shape (m,), got ()"),
        ("G", np.zeros((3, 3)), ShapeError, "G: expected shape (3, 2), got (3, 3)"),
        ("G", np.zeros((2, 2)), ShapeError, "G: expected shape (3, 2), got (2, 2)"),
        ("q", [0.0, math.nan], NotFinite, "q of row 1: expected a finite number, got nan"),
        ("h", [0.0, math.inf, 0.0], NotFinite, "h of row 1: expected a finite number, got inf"),
        (
            "P",
            [[1.0, 0.1], [0.0, 1.0]],
            InvalidInput,
            "P: expected a symmetric matrix; pass (P + P.T) / 2",
        ),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(
    field: str, value: object, error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        ConvexProgram(**{**fields(), field: value})
    assert str(caught.value) == message


@pytest.mark.parametrize(("part", "is_taken"), [(0.5, True), (2.0, False)])
@pytest.mark.parametrize("scale", [1.0, 1e6])
def test_only_rounding_may_be_asymmetric(scale: float, part: float, is_taken: bool) -> None:
    P = scale * np.array([[1.0, part * SYMMETRY_TOLERANCE], [0.0, 1.0]])
    if is_taken:
        assert ConvexProgram(**{**fields(), "P": P}).num_variables == 2
    else:
        with pytest.raises(InvalidInput):
            ConvexProgram(**{**fields(), "P": P})


def test_arrays_are_copies_that_cannot_be_altered() -> None:
    arrays = fields()
    made = ConvexProgram(**arrays)
    for field, array in arrays.items():
        own = getattr(made, field)
        assert not np.shares_memory(own, array)
        assert array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            own[:] = 0.0
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(made, field, array)


def test_a_cost_with_any_curvature_is_no_linear_program() -> None:
    for P, is_linear in (
        (np.zeros((2, 2)), True),
        (np.eye(2), False),
        (np.diag([0.0, 1.0]), False),
    ):
        program = ConvexProgram(P=P, q=np.ones(2), G=np.eye(2), h=np.ones(2))
        assert program.is_linear is is_linear
