"""Small programs in exact rational arithmetic: from a guess of the active rows to the optimum, nothing rounded.

Every float is a rational number, so a program in floats has an exact answer. The steps are those of Goldfarb and
Idnani, A numerically stable dual method for solving strictly convex quadratic programs (1983); without rounding, rows
that are almost parallel are no harder than others. The number of steps is the caller's: this checks and repairs
answers, it is not meant to find them.

Letters: n variables, m rows. Vectors are lists, matrices lists of rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.programs.convex_program import ConvexProgram

Vector = list[Fraction]
Matrix = list[Vector]

ZERO = Fraction(0)

# Rows at an angle with a smaller squared sine are not both taken for active at the start: two that are parallel but
# for rounding meet anywhere, and say nothing of where. The steps still reach their corner if both are needed.
PARALLEL = Fraction(1, 10**12)

# A linear program is solved as the quadratic one that is this flat, around the point given. Its optimum is one of the
# linear program (Mangasarian and Meyer 1979), but for slopes below this times the distance to the point: those come
# from the last bits of normals, and without this they would send the point to the far end of the permitted set.
FLATNESS = Fraction(1, 2**40)


class Outcome(Enum):
    """How the exact steps ended; the value is the sentence to print."""

    OPTIMAL = "the exact optimum was found"
    CONTRADICTION = "the rows contradict each other"
    UNSETTLED = "the exact steps did not settle in the number allowed"


@dataclass(frozen=True, slots=True)
class ExactAnswer:
    """Where the exact steps ended.

    Attributes:
        outcome: How they ended.
        x: Point reached, n numbers.
        multipliers: Of the rows held, all >= 0, the others being 0. For `Outcome.CONTRADICTION` a Farkas proof:
            ``G' multipliers = 0`` and ``h' multipliers < 0``, exactly.
    """

    outcome: Outcome
    x: Vector
    multipliers: dict[int, Fraction]


@dataclass(frozen=True, slots=True)
class RationalProgram:
    """A program in rationals.

    Attributes:
        inverse: Inverse of P, n rows of n numbers; empty if P is not positive definite.
        q: n numbers.
        G: m rows of n numbers.
        h: m numbers.
    """

    inverse: Matrix
    q: Vector
    G: Matrix
    h: Vector

    @classmethod
    def of(cls, program: ConvexProgram) -> RationalProgram:
        """Take over a program as it is."""
        return cls(
            inverse=[] if program.is_linear else inverse_of(program.P),
            q=rational(program.q),
            G=rational_rows(program.G),
            h=rational(program.h),
        )

    def bent_up(self, near: Vector) -> RationalProgram:
        """Add ``FLATNESS / 2 * |x - near|^2`` to a linear program: its optimum, and of several the nearest."""
        size = len(self.q)
        inverse = [[1 / FLATNESS if i == j else ZERO for j in range(size)] for i in range(size)]
        q = [value - FLATNESS * at for value, at in zip(self.q, near, strict=True)]
        return RationalProgram(inverse, q, self.G, self.h)


def rational(values: FloatArray) -> Vector:
    """Turn finite floats into the rationals they are."""
    return [Fraction(value) for value in values.tolist()]


def rational_rows(matrix: FloatArray) -> Matrix:
    """Turn rows of finite floats into the rationals they are."""
    return [[Fraction(value) for value in row] for row in matrix.tolist()]


def dot(left: Vector, right: Vector) -> Fraction:
    """Inner product."""
    return sum((a * b for a, b in zip(left, right, strict=True) if a and b), ZERO)


def times(matrix: Matrix, vector: Vector) -> Vector:
    """Matrix times vector."""
    return [dot(row, vector) for row in matrix]


def combination(rows: Matrix, weights: dict[int, Fraction], size: int) -> Vector:
    """Sum of ``weights[i] * rows[i]``, ``size`` numbers."""
    total = [ZERO] * size
    for row, weight in weights.items():
        total = [value + weight * entry for value, entry in zip(total, rows[row], strict=True)]
    return total


def solve_definite(matrix: Matrix, columns: Matrix) -> Matrix:
    """Solve ``matrix @ solution = column`` for each column, by elimination.

    Args:
        matrix: Symmetric, k rows of k numbers.
        columns: Right-hand sides, k numbers each.

    Returns:
        One solution a column; the empty list if ``matrix`` is not positive definite.
    """
    size = len(matrix)
    table = [row + [column[i] for column in columns] for i, row in enumerate(matrix)]
    for i in range(size):
        # A symmetric matrix is positive definite if and only if elimination in order meets positive pivots only.
        if table[i][i] <= 0:
            return []
        pivot = 1 / table[i][i]
        table[i] = [entry * pivot if entry else entry for entry in table[i]]
        for j in range(size):
            factor = table[j][i]
            if j != i and factor:
                table[j] = [a - factor * b for a, b in zip(table[j], table[i], strict=True)]
    return [[row[size + k] for row in table] for k in range(len(columns))]


def inverse_of(P: FloatArray) -> Matrix:
    """Invert the symmetric part of P exactly; the empty list if it is not positive definite."""
    entries = rational_rows(P)
    size = len(entries)
    symmetric = [[(entries[i][j] + entries[j][i]) / 2 for j in range(size)] for i in range(size)]
    unit = [[Fraction(int(i == j)) for j in range(size)] for i in range(size)]
    return solve_definite(symmetric, unit)


def independent_rows(program: RationalProgram, candidates: Iterable[int]) -> list[int]:
    """Keep candidates that are clearly independent of those kept before, at most n; see `PARALLEL`."""
    chosen: list[int] = []
    for row in candidates:
        if len(chosen) == len(program.q):
            break
        push = times(program.inverse, program.G[row])
        across = [dot(program.G[other], push) for other in chosen]
        size = dot(program.G[row], push)
        shared = solve_definite(_schur(program, chosen), [across])[0] if chosen else []
        if size - dot(across, shared) > PARALLEL * size:
            chosen.append(row)
    return chosen


def settle(
    program: RationalProgram, guess: Iterable[int], max_steps: int, allowed: Fraction = ZERO
) -> ExactAnswer:
    """Step from a guess of the active rows to the exact optimum, or to a proof that there is no point.

    Args:
        program: The program, strictly convex.
        guess: Rows thought active, the surest first; dependent ones are left out.
        max_steps: Most changes of the set of active rows.
        allowed: Violation of rows not held that counts as none; what is reached is then the exact optimum of the
            rows held.

    Returns:
        The answer; `Outcome.UNSETTLED` if it takes more steps.
    """
    x, held = _start(program, independent_rows(program, guess))
    entering, weight = -1, ZERO
    for _ in range(max_steps + 1):
        if entering < 0:
            excess, entering = _most_violated(program, x)
            weight = ZERO
            if excess <= allowed:
                return ExactAnswer(Outcome.OPTIMAL, x, held)
        move, change = _direction(program, list(held), entering)
        towards = dot(program.G[entering], move)
        excess = dot(program.G[entering], x) - program.h[entering]
        limits = [(-held[row] / rate, row) for row, rate in change.items() if rate < 0]
        if not limits and not towards:
            return ExactAnswer(Outcome.CONTRADICTION, x, {**change, entering: Fraction(1)})
        length, leaving = min(limits) if limits else (ZERO, -1)
        # `towards` is <= 0: the row gets less violated, or not at all where it depends on those held.
        full = -excess / towards if towards else None
        if full is not None and (leaving < 0 or full <= length):
            length, leaving = full, -1
        x = [value + length * rate for value, rate in zip(x, move, strict=True)]
        held = {row: value + length * change[row] for row, value in held.items()}
        weight += length
        if leaving < 0:
            held[entering] = weight
            entering = -1
        else:
            del held[leaving]
    return ExactAnswer(Outcome.UNSETTLED, x, held)


def nearest_float(value: Fraction) -> float:
    """Round to a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def _schur(program: RationalProgram, rows: list[int]) -> Matrix:
    spread = [times(program.inverse, program.G[row]) for row in rows]
    return [[dot(program.G[row], column) for column in spread] for row in rows]


def _start(program: RationalProgram, rows: list[int]) -> tuple[Vector, dict[int, Fraction]]:
    """Minimise with rows held as equations, letting go of the worst until no multiplier is negative."""
    free = [-value for value in times(program.inverse, program.q)]
    while True:
        right = [dot(program.G[row], free) - program.h[row] for row in rows]
        values = solve_definite(_schur(program, rows), [right])[0] if rows else []
        if all(value >= 0 for value in values):
            break
        worst = min(range(len(rows)), key=values.__getitem__)
        rows = rows[:worst] + rows[worst + 1 :]
    held = dict(zip(rows, values, strict=True))
    pull = times(program.inverse, combination(program.G, held, len(free)))
    return [a - b for a, b in zip(free, pull, strict=True)], held


def _most_violated(program: RationalProgram, x: Vector) -> tuple[Fraction, int]:
    return max(
        (
            (dot(row, x) - bound, i)
            for i, (row, bound) in enumerate(zip(program.G, program.h, strict=True))
        ),
        default=(ZERO, -1),
    )


def _direction(
    program: RationalProgram, rows: list[int], entering: int
) -> tuple[Vector, dict[int, Fraction]]:
    """Change of x and of the multipliers held while the multiplier of the entering row grows by one."""
    push = times(program.inverse, program.G[entering])
    right = [-dot(program.G[row], push) for row in rows]
    values = solve_definite(_schur(program, rows), [right])[0] if rows else []
    change = dict(zip(rows, values, strict=True))
    pull = times(program.inverse, combination(program.G, change, len(push)))
    return [-a - b for a, b in zip(push, pull, strict=True)], change
