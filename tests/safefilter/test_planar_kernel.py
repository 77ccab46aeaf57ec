"""The exact planar solver, against answers by hand and against rational arithmetic.

Rows are ``n_x x + n_y y >= offset``, written (n_x, n_y, offset).
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows, least_violation, project
from safefilter.backends.planar_kernel_checks import is_nearest, is_proof
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest
from safefilter.testing.program_strategies import (
    SIDES,
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
)

TOLERANCE = 1e-9
DIAGONAL = math.sqrt(0.5)
BOX = [(1.0, 0.0, -0.5), (0.0, 1.0, -0.5), (-1.0, 0.0, -0.5), (0.0, -1.0, -0.5)]

Row = tuple[float, float, float]


class Answer(NamedTuple):
    """Both stages for one program; lists hold the rows and their multipliers."""

    status: int
    point: FloatArray
    least: float
    relaxation: float
    active: list[int]
    multipliers: list[float]
    proof: list[int]
    weights: list[float]
    is_nearest: bool
    is_proved: bool


def answer(
    rows: npt.ArrayLike,
    wanted: npt.ArrayLike,
    num_hard: int = 0,
    *,
    radius: float = 4.0,
    tolerance: float = TOLERANCE,
) -> Answer:
    array = np.reshape(np.asarray(rows, dtype=np.float64), (-1, 3)).T.copy()
    system = Rows(array, array.shape[1], num_hard, 0, 0.0)
    wanted_x, wanted_y = (float(part) for part in np.asarray(wanted))
    active, proof = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    multipliers, weights = np.zeros(3), np.zeros(3)
    least, relaxation, proof_count = 0.0, 0.0, 0
    status, x, y, count = project(
        system, 0.0, wanted_x, wanted_y, tolerance, active, multipliers, proof, 0
    )
    if status == CONTRADICTION:
        status, x, y, count, least, relaxation, proof_count = least_violation(
            system, wanted_x, wanted_y, tolerance, active, multipliers, count, proof, weights
        )
    return Answer(
        status=status,
        point=np.array([x, y]),
        least=least,
        relaxation=relaxation,
        active=active[:count].tolist(),
        multipliers=multipliers[:count].tolist(),
        proof=proof[:proof_count].tolist(),
        weights=weights[:proof_count].tolist(),
        is_nearest=is_nearest(
            system, relaxation, wanted_x, wanted_y, x, y, tolerance, active, multipliers, count
        ),
        is_proved=least <= tolerance
        or is_proof(system, least, radius, tolerance, proof, weights, proof_count),
    )


def rows_of(program: ConvexProgram) -> FloatArray:
    return np.column_stack([-program.G, -program.h])


def answer_to(program: ConvexProgram, num_hard: int) -> Answer:
    return answer(rows_of(program), -program.q, num_hard)


def turned(angle: float, offset: float) -> Row:
    return math.cos(angle), math.sin(angle), offset


def distance_of(point: tuple[Fraction, ...] | None, wanted: FloatArray) -> float:
    assert point is not None
    return math.hypot(float(point[0]) - wanted[0], float(point[1]) - wanted[1])


@pytest.mark.parametrize(
    ("rows", "wanted", "point", "active"),
    [
        ([], [0.3, -0.4], [0.3, -0.4], []),
        (BOX, [0.1, 0.2], [0.1, 0.2], []),
        (BOX, [0.5, 0.2], [0.5, 0.2], []),
        (BOX, [0.5, 0.5], [0.5, 0.5], []),
        (BOX, [1.0, 0.2], [0.5, 0.2], [2]),
        (BOX, [1.0, -2.0], [0.5, -0.5], [1, 2]),
        (BOX[:1] * 3, [-1.0, 0.2], [-0.5, 0.2], [0]),
        # The stricter one of two parallel rows holds, whichever comes first.
        ([(1.0, 0.0, 0.1), (1.0, 0.0, 0.3)], [0.0, 0.0], [0.3, 0.0], [1]),
        ([(1.0, 0.0, 0.3), (1.0, 0.0, 0.1)], [0.0, 0.0], [0.3, 0.0], [0]),
        # A strip, a line, a point.
        ([(1.0, 0.0, 0.1), (-1.0, 0.0, -0.2)], [0.9, 0.4], [0.2, 0.4], [1]),
        ([(1.0, 0.0, 0.2), (-1.0, 0.0, -0.2)], [0.9, 0.4], [0.2, 0.4], [1]),
        ([(n_x, n_y, 0.0) for n_x, n_y, _ in BOX], [0.3, 0.4], [0.0, 0.0], None),
        # Three rows through one corner, wanted beyond it and at it.
        ([*BOX, (-DIAGONAL, -DIAGONAL, -DIAGONAL)], [1.0, 1.0], [0.5, 0.5], None),
        ([*BOX, (-DIAGONAL, -DIAGONAL, -DIAGONAL)], [0.5, 0.5], [0.5, 0.5], []),
        ([(1.0, 0.0, -1e6), (0.0, 1.0, 0.1)], [0.3, 0.0], [0.3, 0.1], [1]),
    ],
)
def test_nearest_points_by_hand(
    rows: list[Row], wanted: list[float], point: list[float], active: list[int] | None
) -> None:
    found = answer(rows, wanted)
    assert found.status == SOLVED
    assert found.point == pytest.approx(point, abs=1e-15)
    assert found.is_nearest
    assert active is None or sorted(found.active) == active


@pytest.mark.parametrize(
    ("soft", "wanted", "least", "point"),
    [
        # Head-on: across, the wanted velocity decides.
        ([(1.0, 0.0, 0.1), (-1.0, 0.0, 0.1)], [0.4, 0.2], 0.1, [0.0, 0.2]),
        ([(1.0, 0.0, 0.3), (-1.0, 0.0, -0.1)], [0.4, 0.2], 0.1, [0.2, 0.2]),
        # Against the box itself.
        ([(1.0, 0.0, 0.7)], [0.4, 0.2], 0.2, [0.5, 0.2]),
        ([(DIAGONAL, DIAGONAL, 2.0 * DIAGONAL)], [0.0, 0.0], DIAGONAL, [0.5, 0.5]),
        # Three rows, each two of which meet.
        ([turned(2.0 * math.pi * k / 3.0, 0.1) for k in range(3)], [0.4, 0.2], 0.1, [0.0, 0.0]),
        ([(1.0, 0.0, 0.1), (-1.0, 0.0, -0.1 + 1e-6)], [0.4, 0.2], 5e-7, [0.1 - 5e-7, 0.2]),
    ],
)
def test_least_violations_by_hand(
    soft: list[Row], wanted: list[float], least: float, point: list[float]
) -> None:
    found = answer([*BOX, *soft], wanted, num_hard=4)
    assert found.status == SOLVED
    assert found.least == pytest.approx(least, abs=1e-15)
    assert found.point == pytest.approx(point, abs=3.0 * TOLERANCE)
    assert found.is_nearest
    assert found.is_proved
    assert sum(w for k, w in zip(found.proof, found.weights, strict=True) if k >= 4) == (
        pytest.approx(1.0, abs=1e-15)
    )


def test_hard_rows_that_clash_are_a_contradiction_with_its_proof() -> None:
    found = answer([*BOX, (1.0, 0.0, 0.6), (0.0, 1.0, 0.0)], [0.0, 0.0], num_hard=5)
    assert found.status == CONTRADICTION
    assert found.least == math.inf
    assert sorted(found.active) == [2, 4]
    assert found.multipliers == [1.0, 1.0]


def test_hard_rows_that_clash_only_after_soft_ones_are_found_too() -> None:
    # Soft rows contradict each other first; the hard clash shows once they are relaxed.
    hard = [(0.0, 1.0, 0.5), (0.0, -1.0, 0.5)]
    soft = [(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)]
    found = answer([*hard, *soft], [0.0, 0.0], num_hard=2)
    assert (found.status, found.least) == (CONTRADICTION, math.inf)
    assert sorted(found.active) == [0, 1]


@given(permitted_programs())
def test_the_nearest_point_is_the_exact_one(program: ConvexProgram) -> None:
    found, exact = answer_to(program, SIDES), exact_nearest(program)
    if exact is None or found.least > 0.0:  # a set of the size of rounding can be lost
        assert found.least <= 1e-12
    else:
        assert found.point == pytest.approx([float(x) for x in exact], abs=TOLERANCE)
    assert found.status == SOLVED
    assert program.violation(found.point) <= 3.0 * TOLERANCE


@given(permitted_programs())
def test_multipliers_are_those_of_a_nearest_point(program: ConvexProgram) -> None:
    found = answer_to(program, SIDES)
    assert found.is_nearest
    assert min(found.multipliers, default=0.0) >= 0.0
    assert len(set(found.active)) == len(found.active) <= 2
    rows = rows_of(program)[found.active]
    offsets = rows[:, 2] - np.where(
        np.array(found.active, dtype=np.int64) >= SIDES, found.relaxation, 0.0
    )
    assert rows[:, :2] @ found.point == pytest.approx(offsets, abs=1e-12)
    weights = np.array(found.multipliers)
    assert found.point + program.q == pytest.approx(
        weights @ rows[:, :2], abs=1e-12 * (1.0 + weights.sum())
    )


@given(contradictory_programs())
def test_weights_of_a_contradiction_prove_that_there_is_no_point(
    drawn: tuple[ConvexProgram, FloatArray],
) -> None:
    program, _ = drawn
    assert exact_nearest(program) is None
    found = answer_to(program, program.num_rows)
    assert found.status == CONTRADICTION
    weights = np.array(found.multipliers)
    rows = rows_of(program)[found.active]
    assert weights.min() >= 0.0
    residual = math.hypot(*(weights @ rows[:, :2]))
    # No point within the hard pentagon, whose corners are at 1 / cos(36 degrees), satisfies the sum of the rows.
    assert weights @ rows[:, 2] > residual * 1.24


@given(second_stage_programs())
def test_the_least_violation_is_the_exact_one(stages: SecondStage) -> None:
    found, corner = answer_to(stages.second, SIDES), exact_least_violation(stages.first)
    assert corner is not None
    rows = rows_of(stages.first)[:-1, [0, 1, 3]]
    found = answer(rows, -stages.second.q, stages.num_hard)
    assert found.status == SOLVED
    assert found.least == pytest.approx(float(corner[2]), abs=1e-14)
    assert found.relaxation <= found.least + 2.0 * TOLERANCE
    assert found.is_nearest
    assert found.is_proved
    violation = rows[:, 2] - rows[:, :2] @ found.point
    assert violation[: stages.num_hard].max() <= 1e-12
    assert violation[stages.num_hard :].max() <= found.relaxation + 1e-11


@given(second_stage_programs())
def test_of_all_least_violations_the_nearest_is_chosen(stages: SecondStage) -> None:
    wanted = -stages.second.q
    rows = rows_of(stages.first)[:-1, [0, 1, 3]]
    found = answer(rows, wanted, stages.num_hard)
    apart = math.hypot(*(found.point - wanted))
    soft = np.arange(len(rows)) >= stages.num_hard
    least = stages.second.h - np.where(soft, TOLERANCE, 0.0)
    for slack, is_upper in ((0.0, True), (4.0 * TOLERANCE, False)):
        h = least + np.where(soft, found.relaxation - found.least + slack, slack)
        program = ConvexProgram(stages.second.P, stages.second.q, stages.second.G, h)
        exact = exact_nearest(program)
        if exact is None:  # rounding of t* took the last point
            continue
        if is_upper:
            assert apart <= distance_of(exact, wanted) + 1e-9
        else:
            assert apart >= distance_of(exact, wanted) - 1e-9


@given(permitted_programs(), st.randoms(use_true_random=False))
def test_the_order_of_rows_does_not_matter(program: ConvexProgram, random: object) -> None:
    rows = rows_of(program)
    order = np.arange(len(rows))
    random.shuffle(order)  # type: ignore[attr-defined]  # hypothesis types its Random as object
    one, other = answer(rows, -program.q, len(rows)), answer(rows[order], -program.q, len(rows))
    assert one.status == other.status
    if one.status == SOLVED:
        assert one.point == pytest.approx(other.point, abs=TOLERANCE)


@given(permitted_programs(), st.sampled_from([(0, -1, 1, 0), (-1, 0, 0, -1), (1, 0, 0, -1)]))
def test_turning_and_mirroring_everything_turns_and_mirrors_the_answer(
    program: ConvexProgram, entries: tuple[int, ...]
) -> None:
    # A quarter turn, a half turn and a mirror image, all without rounding.
    matrix = np.array(entries, dtype=np.float64).reshape(2, 2)
    rows = rows_of(program)
    moved = np.column_stack([rows[:, :2] @ matrix.T, rows[:, 2]])
    one = answer(rows, -program.q, SIDES)
    other = answer(moved, matrix @ -program.q, SIDES)
    assert one.least == pytest.approx(other.least, abs=1e-12)
    assert matrix @ one.point == pytest.approx(other.point, abs=TOLERANCE)


@given(second_stage_programs(), st.sampled_from([2.0**-10, 2.0**-3, 2.0**10]))
def test_another_unit_of_speed_changes_nothing_but_the_unit(
    stages: SecondStage, unit: float
) -> None:
    rows = rows_of(stages.first)[:-1, [0, 1, 3]]
    wanted = -stages.second.q
    one = answer(rows, wanted, SIDES)
    other = answer(
        rows * [1.0, 1.0, unit], wanted * unit, SIDES, radius=4.0 * unit, tolerance=TOLERANCE * unit
    )
    assert other.least == pytest.approx(one.least * unit, abs=1e-12 * unit)
    assert other.point == pytest.approx(one.point * unit, abs=TOLERANCE * unit)


@pytest.mark.parametrize("size", [1e3, 1e9, 1e100, 1e300])
def test_a_wanted_point_however_far_away_has_its_nearest_point(size: float) -> None:
    with np.errstate(over="ignore"):  # squares, where kernels are interpreted
        found = answer(BOX, [size, 0.25 * size])
    assert found.status == SOLVED
    assert found.point.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("length", [1.0 - 9e-10, 1.0 + 9e-10])
def test_normals_may_be_as_far_from_unit_length_as_half_spaces_allow(length: float) -> None:
    # `HalfSpaces` lets 1e-9 through; rows then seem violated by that part of the move again.
    far = [(length * n_x, length * n_y, offset) for n_x, n_y, offset in BOX]
    for wanted, point in (([9.0, 0.2], [0.5, 0.2]), ([9.0, -7.0], [0.5, -0.5])):
        found = answer(far, wanted)
        assert (found.status, found.is_nearest) == (SOLVED, True)
        assert found.point == pytest.approx(point, abs=1e-8)
