"""The built-in backend: exact in two dimensions, with multipliers, in microseconds.

It takes the two programs of the paper: a projection in the plane (Eq. 17), and the least violation (Eq. 18) in its
epigraph form with variables (x, y, t). See `planar_kernel` for the method. `SafetyFilter` calls that kernel directly;
this class offers it as a `Backend` like any other.

Letters: m rows.
"""

from __future__ import annotations

from time import perf_counter
from typing import NamedTuple

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray, positive_number
from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows, least_violation, project
from safefilter.errors import UnsupportedProgram
from safefilter.jit import kernel
from safefilter.programs.convex_program import ConvexProgram

# How far a row (n, 1) of an epigraph may be from unit length: rounding of whoever built it.
EPIGRAPH_TOLERANCE = 1e-9
DEFAULT_TOLERANCE = 1e-9


class PlanarRows(NamedTuple):
    """Rows of a program as the kernel takes them.

    Attributes:
        array: Unit rows ``n @ v >= offset``, hard ones first, shape (3, r).
        origin: Row of the program that each comes from, shape (r,).
        length: Length of that row, shape (r,).
        num_hard: How many are hard.
        contradiction: A row ``0 <= h`` with h < 0, or -1.
    """

    array: FloatArray
    origin: IntArray
    length: FloatArray
    num_hard: int
    contradiction: int


class Planar:
    """Exact solver for the two programs of the paper.

    Attributes:
        name: ``planar``.
        capabilities: Projections in the plane, and the epigraph program of Eq. (18).
    """

    name = "planar"
    capabilities = Capabilities(qp=True, lp=True, max_variables=3)

    def __init__(self, tolerance: float | None = None) -> None:
        """Set the accuracy, in the unit of the variables; None: `DEFAULT_TOLERANCE`.

        Raises:
            NotFinite: If the tolerance is NaN or infinite.
            OutOfRange: If it is not above zero.
        """
        self._tolerance = positive_number(
            DEFAULT_TOLERANCE if tolerance is None else tolerance, "tolerance"
        )

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve; see `Backend.solve`.

        Raises:
            UnsupportedProgram: If the program is neither a projection in the plane nor an epigraph program.
        """
        start = perf_counter()
        if program.is_linear:
            return self._solve_epigraph(program, start)
        scale = program.P[0, 0]
        if (
            program.num_variables != 2
            or scale <= 0.0
            or not np.array_equal(program.P, scale * np.eye(2))
        ):
            raise UnsupportedProgram(
                f"planar takes P = c * identity in 2 variables, got P of shape {program.P.shape}: "
                "use another backend, such as 'clarabel'"
            )
        rows = _unit_rows(-program.G, -program.h, np.ones(program.num_rows, dtype=np.bool_))
        built = perf_counter()
        if rows.contradiction >= 0:
            return _contradicted(program, rows, start, built)
        wanted = -program.q / scale
        status, point, _, active, weights = _solve(
            rows.array, rows.num_hard, wanted, self._tolerance, False
        )
        multipliers = np.zeros(program.num_rows)
        factor = scale if status == SOLVED else 1.0
        np.add.at(multipliers, rows.origin[active], factor * weights / rows.length[active])
        return _solution(status, point, multipliers, start, built)

    def _solve_epigraph(self, program: ConvexProgram, start: float) -> Solution:
        floor_row, floor, rows = _epigraph(program)
        built = perf_counter()
        if rows.contradiction >= 0:
            return _contradicted(program, rows, start, built)
        status, point, least, active, weights = _solve(
            rows.array, rows.num_hard, np.zeros(2), self._tolerance, True
        )
        multipliers = np.zeros(program.num_rows)
        if status == SOLVED and least == 0.0:
            multipliers[floor_row] = program.q[2] / -program.G[floor_row, 2]
        else:
            factor = program.q[2] if status == SOLVED else 1.0
            np.add.at(multipliers, rows.origin[active], factor * weights / rows.length[active])
        return _solution(status, np.append(point, floor + least), multipliers, start, built)


def _unit_rows(normals: FloatArray, offsets: FloatArray, is_hard: BoolArray) -> PlanarRows:
    length = np.sqrt((normals**2).sum(axis=1))
    blank = length == 0.0
    broken = np.flatnonzero(blank & (offsets > 0.0))
    origin = np.concatenate([np.flatnonzero(is_hard & ~blank), np.flatnonzero(~is_hard & ~blank)])
    array = np.empty((3, len(origin)))
    array[:2] = (normals[origin] / length[origin, None]).T
    array[2] = offsets[origin] / length[origin]
    contradiction = int(broken[0]) if len(broken) else -1
    num_hard = int((is_hard & ~blank).sum())
    return PlanarRows(array, origin, length[origin], num_hard, contradiction)


def _epigraph(program: ConvexProgram) -> tuple[int, float, PlanarRows]:
    """Take ``min c t`` apart: the row that keeps t from below, that bound, and the rows in the plane.

    Raises:
        UnsupportedProgram: If it is not an epigraph program.
    """
    G, q = program.G, program.q
    is_epigraph = program.num_variables == 3 and q[0] == 0.0 and q[1] == 0.0 and q[2] > 0.0
    if is_epigraph:
        length = np.sqrt((G[:, :2] ** 2).sum(axis=1))
        is_floor = (length == 0.0) & (G[:, 2] < 0.0)
        is_hard = G[:, 2] == 0.0
        is_soft = np.abs(G[:, 2] + length) <= EPIGRAPH_TOLERANCE * length
        is_epigraph = bool(is_floor.any()) and bool((is_floor | is_hard | is_soft).all())
    if not is_epigraph:
        raise UnsupportedProgram(
            "planar takes linear programs min t over rows n @ v + t >= b with unit n, hard rows and t >= b0 only: "
            "use another backend, such as 'clarabel'"
        )
    floors = np.where(is_floor, program.h / np.where(is_floor, G[:, 2], 1.0), -np.inf)
    floor_row = int(np.argmax(floors))
    floor = float(floors[floor_row])
    kept = ~is_floor
    # Counted from its floor, t is a violation from 0 up, which is what the kernel minimises.
    offsets = -program.h - np.where(is_hard, 0.0, floor * length)
    rows = _unit_rows(-G[kept, :2], offsets[kept], is_hard[kept])
    origin = np.flatnonzero(kept)
    contradiction = int(origin[rows.contradiction]) if rows.contradiction >= 0 else -1
    return (
        floor_row,
        floor,
        rows._replace(origin=origin[rows.origin], contradiction=contradiction),
    )


def _contradicted(program: ConvexProgram, rows: PlanarRows, start: float, built: float) -> Solution:
    multipliers = np.zeros(program.num_rows)
    multipliers[rows.contradiction] = 1.0
    point = np.full(program.num_variables, np.nan)
    return Solution(Status.INFEASIBLE, point, multipliers, built - start, perf_counter() - built)


def _solution(
    status: int, point: FloatArray, multipliers: FloatArray, start: float, built: float
) -> Solution:
    words = {SOLVED: Status.OPTIMAL, CONTRADICTION: Status.INFEASIBLE}
    word = words.get(status, Status.FAILED)
    if not word.has_point:
        point = np.full(len(point), np.nan)
    if word is Status.FAILED:
        multipliers = np.full(len(multipliers), np.nan)
    return Solution(word, point, multipliers, built - start, perf_counter() - built)


@kernel
def _solve(
    array: FloatArray, num_hard: int, wanted: FloatArray, tolerance: float, is_epigraph: bool
) -> tuple[int, FloatArray, float, IntArray, FloatArray]:
    """Project, and if asked raise t until that works: (status, point, t*, rows of the proof, their weights).

    Without `is_epigraph` the rows are those that hold the point, or that contradict each other.
    """
    rows = Rows(array, array.shape[1], num_hard, 0, 0.0)
    active, multipliers = np.zeros(3, dtype=np.int64), np.zeros(3)
    proof, weights = np.zeros(3, dtype=np.int64), np.zeros(3)
    least, proof_count = 0.0, 0
    status, x, y, count = project(
        rows, 0.0, wanted[0], wanted[1], tolerance, active, multipliers, proof, 0
    )
    if status == CONTRADICTION and is_epigraph:
        status, x, y, count, least, _, proof_count = least_violation(
            rows, wanted[0], wanted[1], tolerance, active, multipliers, count, proof, weights
        )
    if is_epigraph and status == SOLVED:
        return status, np.array([x, y]), least, proof[:proof_count], weights[:proof_count]
    return status, np.array([x, y]), least, active[:count], multipliers[:count]
