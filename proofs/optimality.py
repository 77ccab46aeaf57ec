"""What the solver's own checks prove: `is_nearest` the optimum, `is_proof` that there is no point.

Both are run as they ship, on two rows (no more can hold a point of the plane; the loops over rows are the same for any
number), with a tolerance of zero and without the allowance for rounding: of real numbers. From the first follows all
that a projection on a fixed set is: nearest, idempotent, non-expansive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import z3

from proofs.prover import TOGETHER, Assumptions, Proof, Values, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.backends.planar_kernel import Rows, most_violated
from safefilter.backends.planar_kernel_checks import is_nearest, is_proof

N_X, N_Y, OFFSET = z3.Reals("n_x n_y offset")
M_X, M_Y, OTHER_OFFSET = z3.Reals("m_x m_y other_offset")
WEIGHT, OTHER_WEIGHT = z3.Reals("lambda mu")
W_X, W_Y, X, Y, U_X, U_Y = z3.Reals("w_x w_y x y u_x u_y")
LEAST, RADIUS, FACTOR, OTHER_FACTOR = z3.Reals("t radius a b")

WORST_ROW, VIOLATION, PASSES = z3.Reals("worst violation passes")
ROW = (N_X, N_Y, OFFSET)
OTHER_ROW = (M_X, M_Y, OTHER_OFFSET)
# A second wish, its answer, and the two rows that hold that one, by what they stand for of the first.
ANSWER = (X, Y, WORST_ROW, VIOLATION)
SECOND_ANSWER = dict(zip(ANSWER, z3.Reals("x' y' worst' violation'"), strict=True))
SECOND = SECOND_ANSWER | dict(
    zip(
        (*ROW, *OTHER_ROW, W_X, W_Y, WEIGHT, OTHER_WEIGHT, PASSES),
        z3.Reals("n'_x n'_y offset' m'_x m'_y other_offset' w'_x w'_y lambda' mu' passes'"),
        strict=True,
    )
)
W2_X, W2_Y, X2, Y2, PASSES2 = (SECOND[name] for name in (W_X, W_Y, X, Y, PASSES))
ROWS = (ROW, OTHER_ROW)
ALL_ROWS = (*ROWS, *(tuple(SECOND[part] for part in row) for row in ROWS))


def _table(rows: Sequence[tuple[z3.ArithRef, ...]], num_hard: int) -> Rows:
    """Rows without sides, which `most_violated` passes over within their circle."""
    lines = [list(map(Number, line)) for line in zip(*rows, strict=True)]
    return Rows(_Columns(lines), len(rows), num_hard, num_sides=0, inner_radius=0.0)  # type: ignore[arg-type]  # stands for an array


class _Columns:
    """A table of unknown numbers that is read as an array is."""

    def __init__(self, lines: list[list[Number]]) -> None:
        self._lines = lines

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, tuple):
            return self._lines[place[0]][place[1]]
        return self._lines[place]


def _is_called_nearest() -> tuple[int]:
    """Is the point called nearest, whatever its largest violation is? 1 or 0."""
    largest: dict[str, Any] = {"ROUNDING": 0, "most_violated": lambda *_: (0, Number(VIOLATION))}
    given = map(Number, (W_X, W_Y, X, Y))
    weights = [Number(WEIGHT), Number(OTHER_WEIGHT)]
    passes = symbolic(is_nearest, largest)(_table(ROWS, 2), 0, *given, 0, [0, 1], weights, 2)
    return (1 if passes else 0,)


CHECK = outcome("passes", _is_called_nearest)
WORST = outcome(
    "worst violation",
    lambda: symbolic(most_violated)(_table(ALL_ROWS, 4), 0, Number(X), Number(Y)),
)
IS_SHIPPED, IS_LARGEST = "the check is the shipped one", "the violation is the shipped one"
CHECKED: Assumptions = {IS_SHIPPED: CHECK.ways, "it passes": PASSES == 1}
IS_PERMITTED: Assumptions = {
    "u keeps row 1": N_X * U_X + N_Y * U_Y >= OFFSET,
    "u keeps row 2": M_X * U_X + M_Y * U_Y >= OTHER_OFFSET,
}


@cache
def product() -> Proof:
    """Two numbers from 0 up."""
    return prove(
        "optimality.product",
        "a >= 0, b >= 0  =>  a b >= 0",
        {"a >= 0": FACTOR >= 0, "b >= 0": OTHER_FACTOR >= 0},
        FACTOR * OTHER_FACTOR >= 0,
    )


@cache
def variational() -> Proof:
    """From a point that passes, no permitted point lies nearer to the wish, not even by a first step."""
    slacks = (N_X * U_X + N_Y * U_Y - OFFSET, M_X * U_X + M_Y * U_Y - OTHER_OFFSET)
    return prove(
        "optimality.variational",
        "is_nearest(x), n_k . u >= offset_k  =>  (x - w) . (u - x) >= 0: the multipliers prove it (KKT)",
        {**CHECKED, **IS_PERMITTED},
        (X - W_X) * (U_X - X) + (Y - W_Y) * (U_Y - Y) >= 0,
        using=[
            product().at({FACTOR: WEIGHT, OTHER_FACTOR: slacks[0]}),
            product().at({FACTOR: OTHER_WEIGHT, OTHER_FACTOR: slacks[1]}),
        ],
    )


@cache
def nearest() -> Proof:
    """Case-2: a point that passes is the nearest permitted one, Eq. (17)."""
    return prove(
        "optimality.nearest",
        "is_nearest(x), n_k . u >= offset_k  =>  |x - w| <= |u - w|  (Eq. 17)",
        {**CHECKED, **IS_PERMITTED},
        (X - W_X) ** 2 + (Y - W_Y) ** 2 <= (U_X - W_X) ** 2 + (U_Y - W_Y) ** 2,
        using=[variational().at()],
        opaque=[IS_SHIPPED],
    )


@cache
def idempotent() -> Proof:
    """A wish that is permitted is its own projection."""
    wish = {
        "w keeps row 1": N_X * W_X + N_Y * W_Y >= OFFSET,
        "w keeps row 2": M_X * W_X + M_Y * W_Y >= OTHER_OFFSET,
    }
    return prove(
        "optimality.idempotent",
        "is_nearest(x), n_k . w >= offset_k  =>  x = w",
        {**CHECKED, **wish},
        z3.And(X == W_X, Y == W_Y),
        using=[variational().at({U_X: W_X, U_Y: W_Y})],
        opaque=[IS_SHIPPED],
    )


@cache
def permitted() -> Proof:
    """Where the largest violation is none, all rows hold."""
    return prove(
        "optimality.permitted",
        "most_violated(x) <= 0  =>  n_k . x >= offset_k",
        {IS_LARGEST: WORST.ways, "it is none": VIOLATION <= 0},
        z3.And(*(n_x * X + n_y * Y >= offset for n_x, n_y, offset in ALL_ROWS)),
    )


@cache
def none_is_violated() -> Proof:
    """A point that passes violates no row."""
    return prove(
        "optimality.none_is_violated",
        "is_nearest(x)  =>  most_violated(x) <= 0",
        CHECKED,
        VIOLATION <= 0,
    )


@cache
def non_expansive() -> Proof:
    """Two wishes are answered no further apart than they are, on a fixed set."""
    second_check, second_largest = "so is the second check", "so is the second violation"
    assumptions: Assumptions = {
        IS_SHIPPED: CHECK.ways,
        "it passes": PASSES == 1,
        IS_LARGEST: WORST.ways,
        second_check: _of_other_terms(CHECK, SECOND),
        "that passes too": PASSES2 == 1,
        second_largest: _of_other_terms(WORST, SECOND_ANSWER),
    }
    facts = [
        (variational, {U_X: X2, U_Y: Y2}),
        (variational, SECOND | {U_X: X, U_Y: Y}),
        (permitted, {}),
        (permitted, SECOND_ANSWER),
        (none_is_violated, {}),
        (none_is_violated, SECOND),
    ]
    return prove(
        "optimality.non_expansive",
        "is_nearest(x; w), is_nearest(x'; w'), the same rows  =>  |x - x'| <= |w - w'|",
        assumptions,
        (X - X2) ** 2 + (Y - Y2) ** 2 <= (W_X - W2_X) ** 2 + (W_Y - W2_Y) ** 2,
        using=[lemma().at(terms) for lemma, terms in facts],
        opaque=[IS_SHIPPED, IS_LARGEST, second_check, second_largest],
        witnesses={
            TOGETHER: _pair(),
            IS_SHIPPED: _pair({X: 5, WORST_ROW: 1}),
            "it passes": _pair({X: 5, WORST_ROW: 1, PASSES: 0}),
            second_check: _pair({X2: 5, SECOND[WORST_ROW]: 1}),
            "that passes too": _pair({X2: 5, SECOND[WORST_ROW]: 1, PASSES2: 0}),
            IS_LARGEST: _pair({X2: 5, SECOND[OFFSET]: 5, SECOND[WEIGHT]: 6, SECOND[WORST_ROW]: 1}),
            second_largest: _pair({X: 5, OFFSET: 5, WEIGHT: 6}),
        },
    )


def _of_other_terms(first: Outcome, terms: Mapping[z3.ArithRef, z3.ArithRef]) -> list[z3.BoolRef]:
    """What the shipped function returns for others."""
    return [z3.substitute(way, *terms.items()) for way in first.ways]


def _pair(changed: Values | None = None) -> Values:
    """Both wish for (-1, -1) and get the corner (0, 0), but for what is changed."""
    first: Values = {
        **dict(zip((*ROW, *OTHER_ROW), (1, 0, 0, 0, 1, 0), strict=True)),
        W_X: -1,
        W_Y: -1,
        X: 0,
        Y: 0,
        WEIGHT: 1,
        OTHER_WEIGHT: 1,
        VIOLATION: 0,
        WORST_ROW: 0,
        PASSES: 1,
    }
    return first | {SECOND[name]: value for name, value in first.items()} | (changed or {})


def _proof() -> tuple[int]:
    check = symbolic(is_proof)
    given = _table(ROWS, 0), Number(LEAST), Number(RADIUS), 0
    passes = check(*given, [0, 1], [Number(WEIGHT), Number(OTHER_WEIGHT)], 2)
    return (1 if passes else 0,)


PROOF = outcome("proves", _proof)


@cache
def contradiction() -> Proof:
    """Case-3: weights that pass prove that no point in reach keeps both rows."""
    slacks = (N_X * U_X + N_Y * U_Y - OFFSET, M_X * U_X + M_Y * U_Y - OTHER_OFFSET)
    return prove(
        "optimality.contradiction",
        "is_proof(t*), t* > 0, |u| <= radius  =>  some row does not hold at u  (Farkas; Eq. 18)",
        {
            "the check is the shipped one": PROOF.ways,
            "it passes": PROOF.values[0] == 1,
            "t* > 0": LEAST > 0,
            "|u| <= radius": z3.And(RADIUS >= 0, U_X * U_X + U_Y * U_Y <= RADIUS * RADIUS),
        },
        z3.Or(slacks[0] < 0, slacks[1] < 0),
        using=[
            product().at({FACTOR: WEIGHT, OTHER_FACTOR: slacks[0]}),
            product().at({FACTOR: OTHER_WEIGHT, OTHER_FACTOR: slacks[1]}),
        ],
    )


LEMMAS = (
    product,
    variational,
    nearest,
    idempotent,
    permitted,
    none_is_violated,
    non_expansive,
    contradiction,
)
