"""Small programs whose answers are known by hand, and random ones, to check backends with.

Letters: n variables, m rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, finite_array, frozen
from safefilter.programs.convex_program import ConvexProgram

DIAGONAL = np.sqrt(0.5)


@dataclass(frozen=True, slots=True, eq=False)
class KnownProgram:
    """A program and an optimal point.

    Attributes:
        name: What is special about it.
        program: The program.
        point: An optimal point, shape (n,), the only one if the program is quadratic; any point where there is none.
    """

    name: str
    program: ConvexProgram
    point: FloatArray

    def __post_init__(self) -> None:
        """Copy and freeze the point."""
        point = finite_array(self.point, "point", (self.program.num_variables,))
        object.__setattr__(self, "point", frozen(point))


def nearest_point(
    name: str,
    target: npt.ArrayLike,
    rows: npt.ArrayLike,
    bounds: npt.ArrayLike,
    point: npt.ArrayLike,
) -> KnownProgram:
    """The point nearest to a target with ``rows @ x <= bounds``: Case-2 of the filter."""
    wanted = np.array(target, dtype=np.float64)
    h = np.array(bounds, dtype=np.float64)
    program = ConvexProgram(
        P=np.eye(len(wanted)), q=-wanted, G=np.reshape(rows, (len(h), len(wanted))), h=h
    )
    return KnownProgram(name, program, np.asarray(point, dtype=np.float64))


def least_violation_of(
    name: str, rows: npt.ArrayLike, bounds: npt.ArrayLike, point: npt.ArrayLike
) -> KnownProgram:
    """The least t >= 0 with ``rows @ v - t <= bounds`` in the box |v| <= 1: Case-3 of the filter."""
    soft = np.array(rows, dtype=np.float64)
    num_rows, dimension = soft.shape
    box, size = _box(dimension, 1.0)
    G = np.zeros((num_rows + 2 * dimension + 1, dimension + 1))
    G[:num_rows, :dimension] = soft
    G[:num_rows, dimension] = -1.0
    G[num_rows:-1, :dimension] = box
    G[-1, dimension] = -1.0
    h = np.concatenate([np.asarray(bounds, dtype=np.float64), size, [0.0]])
    return KnownProgram(name, linear_program(np.eye(dimension + 1)[-1], G, h), np.asarray(point))


def linear_program(q: FloatArray, G: FloatArray, h: FloatArray) -> ConvexProgram:
    """A program with P = 0."""
    return ConvexProgram(P=np.zeros((len(q), len(q))), q=q, G=G, h=h)


def known_programs() -> list[KnownProgram]:
    """Quadratic and linear programs with answers found by hand."""
    return [*_planar_programs(), *_scaled_programs(), *_larger_programs(), *_linear_programs()]


def known_series() -> list[KnownProgram]:
    """Programs in an order that provokes stale workspaces: new data, other sizes, empty sets in between."""
    planar, empty = _planar_programs(), empty_programs()
    order = [*planar, *empty, *planar[::-1], *_linear_programs(), *planar, *_scaled_programs()]
    return [*order, *_larger_programs(), *empty, *order[::-1]]


def empty_programs() -> list[KnownProgram]:
    """Programs whose rows contradict each other."""
    turns = np.deg2rad([90.0, 210.0, 330.0])
    triangle = np.column_stack([np.cos(turns), np.sin(turns)])
    apart = [[1.0, 0.0], [-1.0, 0.0]]
    box, size = _box(3, 1.0)
    nowhere = np.zeros(2)
    return [
        nearest_point("two rows apart", [0.3, 0.1], apart, [-0.1, -0.1], nowhere),
        nearest_point("two rows 1e-3 apart", [0.3, 0.1], apart, [0.2, -0.201], nowhere),
        nearest_point("three rows, each two of which meet", nowhere, triangle, [-0.1] * 3, nowhere),
        nearest_point(
            "rows apart among many",
            nowhere,
            np.vstack([_around(30), apart]),
            [0.5] * 30 + [-0.1, -0.1],
            nowhere,
        ),
        nearest_point(
            "rows apart in space",
            np.ones(3),
            np.vstack([box, -box[:1]]),
            np.append(size, -1.5),
            np.zeros(3),
        ),
        KnownProgram(
            "linear, rows apart",
            linear_program(
                np.array([0.0, 0.0, 1.0]), np.vstack([box, -box[:1]]), np.append(size, -1.5)
            ),
            np.zeros(3),
        ),
    ]


def barely_empty_program() -> KnownProgram:
    """Two rows that miss each other by 1e-6."""
    rows = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]
    return nearest_point("rows 1e-6 apart", [0.1, 0.0], rows, [0.2, -0.2 - 1e-6, 1.0], np.zeros(2))


def unbounded_program() -> KnownProgram:
    """A linear program whose cost falls for ever."""
    program = linear_program(np.array([1.0, 0.0]), np.eye(2), np.ones(2))
    return KnownProgram("no lower bound", program, np.zeros(2))


def random_programs(seed: int = 20240607) -> list[KnownProgram]:
    """Feasible programs of 2 to 13 variables and 0 to 80 rows; their point is only a feasible one."""
    rng = np.random.default_rng(seed)
    programs = []
    for num_variables in (2, 3, 6, 12):
        for num_rows in (0, 1, 2, 5, 10, 20, 40, 80):
            rows = rng.normal(size=(num_rows, num_variables))
            rows /= np.linalg.norm(rows, axis=1)[:, np.newaxis]
            inside = rng.uniform(-0.2, 0.2, num_variables)
            # A third of the rows meet in one point: a degenerate vertex.
            room = np.where(rng.random(num_rows) < 1 / 3, 0.0, rng.exponential(0.1, num_rows))
            target = rng.uniform(-1.0, 1.0, num_variables)
            size = f"{num_variables} variables, {num_rows} rows"
            programs.append(
                nearest_point(f"random, {size}", target, rows, rows @ inside + room, inside)
            )
            if num_rows:
                bounds = rng.normal(scale=0.3, size=num_rows)
                t = max(0.0, float(-bounds.min()))
                programs.append(
                    least_violation_of(
                        f"random, linear, {size}", rows, bounds, [*np.zeros(num_variables), t]
                    )
                )
    return programs


def _box(dimension: int, half_width: float) -> tuple[FloatArray, FloatArray]:
    rows = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return rows, np.full(2 * dimension, half_width)


def _around(num_rows: int) -> FloatArray:
    angle = np.arange(num_rows) * (2.0 * np.pi / num_rows)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _planar_programs() -> list[KnownProgram]:
    box, half = _box(2, 0.5)
    slanted = [[1.0, 0.0], [0.0, 1.0], [DIAGONAL, DIAGONAL]]
    opposite = [[1.0, 0.0], [-1.0, 0.0]]
    skew = np.array([[2.0, 0.5], [0.5, 1.0]])
    return [
        nearest_point("no row", [0.3, -0.4], [], [], [0.3, -0.4]),
        nearest_point("inside", [0.1, 0.2], box, half, [0.1, 0.2]),
        nearest_point("one row", [1.0, 0.0], [[1.0, 0.0]], [0.5], [0.5, 0.0]),
        nearest_point("one side of a box", [1.0, 0.1], box, half, [0.5, 0.1]),
        nearest_point("vertex", [1.0, -2.0], box, half, [0.5, -0.5]),
        nearest_point(
            "the same row three times", [1.0, 0.2], [[1.0, 0.0]] * 3, [0.5] * 3, [0.5, 0.2]
        ),
        nearest_point(
            "three rows through a vertex", [1.0, 1.0], slanted, [0.5, 0.5, DIAGONAL], [0.5, 0.5]
        ),
        nearest_point("target at a vertex", [0.5, 0.5], slanted, [0.5, 0.5, DIAGONAL], [0.5, 0.5]),
        nearest_point("a set without width", [1.0, 0.3], opposite, [0.2, -0.2], [0.2, 0.3]),
        nearest_point("a set of one point", [0.3, 0.4], box, np.zeros(4), [0.0, 0.0]),
        nearest_point("a polygon of 64 sides", [2.0, 0.0], _around(64), [0.2] * 64, [0.2, 0.0]),
        KnownProgram(
            "a skew cost",
            ConvexProgram(
                P=skew,
                q=-skew @ np.array([0.3, -0.2]),
                G=np.array([[1.0, 0.0]]),
                h=np.array([0.1]),
            ),
            np.array([0.1, -0.1]),
        ),
    ]


def _scaled_programs() -> list[KnownProgram]:
    box, half = _box(2, 0.5)
    length = np.array([1e4, 1e-4, 1.0, 1e2])
    vertex = ConvexProgram(
        P=np.eye(2), q=np.array([-1.0, -2.0]), G=box * length[:, np.newaxis], h=half * length
    )
    return [
        KnownProgram("rows of lengths 1e-4 to 1e4", vertex, np.array([0.5, 0.5])),
        KnownProgram(
            "a cost of size 1e3",
            ConvexProgram(P=1e3 * np.eye(2), q=np.array([-1e3, -200.0]), G=box, h=half),
            np.array([0.5, 0.2]),
        ),
        nearest_point(
            "a row of zeros", [1.0, 0.0], [[0.0, 0.0], [1.0, 0.0]], [1.0, 0.5], [0.5, 0.0]
        ),
        nearest_point("slow, 5 mm/s", [0.02, 0.001], box, half * 0.01, [0.005, 0.001]),
    ]


def _larger_programs() -> list[KnownProgram]:
    programs = []
    for dimension in (3, 6, 12):
        box, half = _box(dimension, 0.5)
        target = np.linspace(-1.0, 1.3, dimension)
        point = np.clip(target, -0.5, 0.5)
        programs.append(nearest_point(f"a box, {dimension} variables", target, box, half, point))
        corner = np.full(dimension, 1.0 / np.sqrt(dimension))
        # Target along the diagonal of the box, cut by a row across it.
        programs.append(
            nearest_point(
                f"a cut box, {dimension} variables",
                corner,
                np.vstack([box, corner]),
                np.append(half, 0.25),
                0.25 * corner,
            )
        )
    return programs


def _linear_programs() -> list[KnownProgram]:
    box, half = _box(3, 0.5)
    opposite = [[1.0, 0.0], [-1.0, 0.0]]
    return [
        least_violation_of("head-on: v_y is free", opposite, [-0.1, -0.1], [0.0, 0.0, 0.1]),
        least_violation_of("nothing violated", opposite, [0.1, 0.1], [0.0, 0.0, 0.0]),
        least_violation_of("barely violated", opposite, [0.2, -0.2 - 1e-4], [0.2, 0.0, 5e-5]),
        least_violation_of("the same row twice", [[1.0, 0.0]] * 2, [-2.0] * 2, [-1.0, 0.0, 1.0]),
        least_violation_of("pushed from all sides", _around(40), [-0.2] * 40, [0.0, 0.0, 0.2]),
        least_violation_of(
            "six dimensions",
            np.vstack([np.eye(6)[:1], -np.eye(6)[:1]]),
            [-0.3, 0.1],
            [*(-0.2 * np.eye(6)[0]), 0.1],
        ),
        KnownProgram(
            "a corner",
            linear_program(np.array([-1.0, -2.0, 0.5]), box, half),
            np.array([0.5, 0.5, -0.5]),
        ),
    ]
