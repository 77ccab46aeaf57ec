"""The right answer to small programs, by trying everything in rational arithmetic.

Slow and simple on purpose: no steps, no rounding, nothing shared with the code it judges. The nearest point of a
polygon is the wanted one, its foot on an edge, or a corner; the least of a linear objective over a polyhedron is at a
corner; multipliers are a combination of at most n active rows (Caratheodory). All of them are tried.

Letters: n variables, m rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from math import lcm

from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram

Point = tuple[Fraction, ...]


def exact_nearest(program: ConvexProgram) -> Point | None:
    """Solve ``min c/2 |v|^2 + q'v`` over half-planes exactly, c > 0: the nearest permitted point to ``-q/c``.

    Takes time of order m^3.

    Args:
        program: Two variables, P a positive multiple of the identity; such as of `nearest_velocity`.

    Returns:
        The point, or None if the rows contradict each other.

    Raises:
        UnsupportedProgram: If the program is another.
    """
    P = program.P
    if P.shape != (2, 2) or P[0, 0] != P[1, 1] or P[0, 1] or P[1, 0] or P[0, 0] <= 0.0:
        raise UnsupportedProgram(
            f"exact_nearest: expected P = c * identity of 2 variables, c > 0, got {P.tolist()}"
        )
    curvature = Fraction(P[0, 0])
    wanted = (-Fraction(program.q[0]) / curvature, -Fraction(program.q[1]) / curvature)
    rows, bounds = _rows(program), [Fraction(value) for value in program.h]
    best: Point | None = None
    for point in _candidates(rows, bounds, wanted):
        closer = best is None or _distance(point, wanted) < _distance(best, wanted)
        if closer and _permits(rows, bounds, point):
            best = point
    return best


def exact_least_violation(program: ConvexProgram) -> Point | None:
    """Solve a `least_violation` program of two velocities and t exactly: ``min t`` over ``G (v, t) <= h``.

    Takes time of order m^4. Every corner is tried, so there must be one: the hard rows bound the velocities.

    Args:
        program: Three variables, P = 0, q = (0, 0, 1).

    Returns:
        A corner (v_x, v_y, t*), or None if the rows contradict each other.

    Raises:
        UnsupportedProgram: If the program is another.
    """
    if not program.is_linear or program.q.tolist() != [0.0, 0.0, 1.0]:
        raise UnsupportedProgram(
            f"exact_least_violation: expected P = 0 and q = (0, 0, 1), got q = {program.q.tolist()}"
        )
    rows = [_whole(*row, bound) for row, bound in zip(program.G, program.h, strict=True)]
    least, scale = (0, 0, 0), 0
    for chosen in combinations(rows, 3):
        *corner, volume = _corner(chosen)
        lower = volume > 0 and (scale == 0 or corner[2] * scale < least[2] * volume)
        if lower and all(
            a * corner[0] + b * corner[1] + c * corner[2] <= bound * volume
            for a, b, c, bound in rows
        ):
            least, scale = (corner[0], corner[1], corner[2]), volume
    return tuple(Fraction(value, scale) for value in least) if scale else None


def exact_multipliers(program: ConvexProgram, point: Point) -> Point | None:
    """Find multipliers >= 0 of the rows active at a point with ``P x + q + G' multipliers = 0``, exactly.

    Args:
        program: Any program with symmetric P, n variables and m rows.
        point: A permitted point, n numbers.

    Returns:
        m numbers, at most n of them not zero; None if there are none: the point is not optimal.
    """
    rows, bounds = _rows(program), [Fraction(value) for value in program.h]
    active = [i for i, row in enumerate(rows) if _dot(row, point) == bounds[i]]
    downhill = tuple(
        -_dot(tuple(map(Fraction, row)), point) - Fraction(linear)
        for row, linear in zip(program.P, program.q, strict=True)
    )
    for size in range(len(point) + 1):
        for chosen in combinations(active, size):
            weights = _combined([rows[i] for i in chosen], downhill)
            if weights is not None and all(weight >= 0 for weight in weights):
                values = dict(zip(chosen, weights, strict=True))
                return tuple(values.get(i, Fraction(0)) for i in range(len(rows)))
    return None


def _rows(program: ConvexProgram) -> list[Point]:
    return [tuple(Fraction(value) for value in row) for row in program.G]


def _candidates(rows: list[Point], bounds: list[Fraction], wanted: Point) -> Iterator[Point]:
    yield wanted
    for row, bound in zip(rows, bounds, strict=True):
        length = row[0] ** 2 + row[1] ** 2
        if length:
            step = (bound - row[0] * wanted[0] - row[1] * wanted[1]) / length
            yield wanted[0] + step * row[0], wanted[1] + step * row[1]
    for (i, a), (j, b) in combinations(enumerate(rows), 2):
        across = a[0] * b[1] - a[1] * b[0]
        if across:
            yield (
                (bounds[i] * b[1] - a[1] * bounds[j]) / across,
                (a[0] * bounds[j] - bounds[i] * b[0]) / across,
            )


def _whole(*row: float) -> tuple[int, ...]:
    """Multiply a row and its bound by the number that makes them whole: the half-space stays the same."""
    values = [Fraction(value) for value in row]
    factor = lcm(*(value.denominator for value in values))
    return tuple(int(value * factor) for value in values)


def _corner(rows: tuple[tuple[int, ...], ...]) -> tuple[int, int, int, int]:
    """Common point of three planes ``(normal, bound)`` by Cramer's rule: numerators and denominator, 0 if none."""
    volume = _determinant(rows, (0, 1, 2))
    sign = -1 if volume < 0 else 1
    return (
        sign * _determinant(rows, (3, 1, 2)),
        sign * _determinant(rows, (0, 3, 2)),
        sign * _determinant(rows, (0, 1, 3)),
        sign * volume,
    )


def _determinant(m: tuple[tuple[int, ...], ...], columns: tuple[int, int, int]) -> int:
    i, j, k = columns
    return (
        m[0][i] * (m[1][j] * m[2][k] - m[1][k] * m[2][j])
        - m[0][j] * (m[1][i] * m[2][k] - m[1][k] * m[2][i])
        + m[0][k] * (m[1][i] * m[2][j] - m[1][j] * m[2][i])
    )


def _combined(rows: list[Point], total: Point) -> list[Fraction] | None:
    """Weights with ``sum of weights_i * rows_i = total``; None if there are none, or many."""
    table = [[row[k] for row in rows] + [total[k]] for k in range(len(total))]
    for i in range(len(rows)):
        pivot = next((k for k in range(i, len(table)) if table[k][i]), None)
        if pivot is None:
            return None
        table[i], table[pivot] = table[pivot], table[i]
        table[i] = [entry / table[i][i] for entry in table[i]]
        for k, line in enumerate(table):
            if k != i:
                table[k] = [a - line[i] * b for a, b in zip(line, table[i], strict=True)]
    if any(line[-1] for line in table[len(rows) :]):
        return None
    return [line[-1] for line in table[: len(rows)]]


def _permits(rows: list[Point], bounds: list[Fraction], point: Point) -> bool:
    return all(_dot(row, point) <= bound for row, bound in zip(rows, bounds, strict=True))


def _dot(left: Point, right: Point) -> Fraction:
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def _distance(point: Point, wanted: Point) -> Fraction:
    return (point[0] - wanted[0]) ** 2 + (point[1] - wanted[1]) ** 2
