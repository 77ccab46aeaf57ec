"""The exact planar solver, against answers by hand, against rational arithmetic, and on rows made to break it.

Rows are ``n_x x + n_y y >= offset``, written (n_x, n_y, offset). Letters: K programs, M rows.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.planar_kernel import (
    CONTRADICTION,
    SOLVED,
    Rows,
    is_nearest,
    is_proof,
    least_violation,
    project,
)
from safefilter.jit import kernel
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest
from safefilter.testing.program_strategies import (
    SIDES,
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
    speeds,
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


class Table(NamedTuple):
    """Answers to K programs: numbers (K, 10), labels (K, 11)."""

    numbers: FloatArray
    labels: IntArray


@kernel
def solve_all(
    array: FloatArray,
    num_hard: int,
    num_sides: int,
    inner_radius: float,
    wanted: FloatArray,
    tolerance: float,
    radius: float,
    numbers: FloatArray,
    labels: IntArray,
) -> None:
    for k in range(len(array)):
        rows = Rows(array[k], array.shape[2], num_hard, num_sides, inner_radius)
        active, multipliers = labels[k, :3], numbers[k, :3]
        proof, weights = labels[k, 3:6], numbers[k, 3:6]
        wanted_x, wanted_y = wanted[k, 0], wanted[k, 1]
        least, relaxation, proof_count = 0.0, 0.0, 0
        status, x, y, count = project(
            rows, 0.0, wanted_x, wanted_y, tolerance, active, multipliers
        )
        if status == CONTRADICTION:
            status, x, y, count, least, relaxation, proof_count = least_violation(
                rows, wanted_x, wanted_y, tolerance, active, multipliers, count, proof, weights
            )
        numbers[k, 6], numbers[k, 7], numbers[k, 8], numbers[k, 9] = x, y, least, relaxation
        labels[k, 6], labels[k, 7], labels[k, 8] = status, count, proof_count
        labels[k, 9] = is_nearest(
            rows, relaxation, wanted_x, wanted_y, x, y, tolerance, active, multipliers, count
        )
        labels[k, 10] = least <= tolerance or is_proof(
            rows, least, radius, tolerance, proof, weights, proof_count
        )


def answers(
    array: FloatArray,
    wanted: FloatArray,
    num_hard: int,
    *,
    num_sides: int = 0,
    inner_radius: float = 0.0,
    radius: float = 4.0,
    tolerance: float = TOLERANCE,
) -> Table:
    table = Table(np.zeros((len(array), 10)), np.zeros((len(array), 11), dtype=np.int64))
    solve_all(array, num_hard, num_sides, inner_radius, wanted, tolerance, radius, *table)
    return table


def answer(
    rows: npt.ArrayLike,
    wanted: npt.ArrayLike,
    num_hard: int = 0,
    *,
    radius: float = 4.0,
    tolerance: float = TOLERANCE,
) -> Answer:
    array = np.ascontiguousarray(np.reshape(np.asarray(rows, dtype=np.float64), (1, -1, 3)).swapaxes(1, 2))
    table = answers(
        array,
        np.array([wanted], dtype=np.float64),
        num_hard,
        radius=radius,
        tolerance=tolerance,
    )
    numbers, labels = table.numbers[0], table.labels[0]
    return Answer(
        status=int(labels[6]),
        point=numbers[6:8],
        least=float(numbers[8]),
        relaxation=float(numbers[9]),
        active=labels[: labels[7]].tolist(),
        multipliers=numbers[: labels[7]].tolist(),
        proof=labels[3 : 3 + labels[8]].tolist(),
        weights=numbers[3 : 3 + labels[8]].tolist(),
        is_nearest=bool(labels[9]),
        is_proved=bool(labels[10]),
    )


def rows_of(program: ConvexProgram) -> FloatArray:
    return np.column_stack([-program.G, -program.h])


def answer_to(program: ConvexProgram, num_hard: int) -> Answer:
    return answer(rows_of(program), -program.q, num_hard)


def turned(angle: float, offset: float) -> Row:
    return math.cos(angle), math.sin(angle), offset


def relaxed(program: ConvexProgram, slack: float) -> ConvexProgram:
    return ConvexProgram(program.P, program.q, program.G, program.h + slack)


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
    offsets = rows[:, 2] - np.where(np.array(found.active, dtype=np.int64) >= SIDES, found.relaxation, 0.0)
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
    assert found.least == pytest.approx(float(corner[2]), abs=TOLERANCE)
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


@st.composite
def almost_parallel_rows(draw: st.DrawFn) -> tuple[list[Row], FloatArray]:
    """Rows within 1e-16 ... 1e-4 of one line, in both directions, and what is wanted."""
    angle, offset = draw(st.floats(0.0, 6.28)), draw(speeds(0.2))
    rows = []
    for _ in range(draw(st.integers(2, 4))):
        side = draw(st.sampled_from((0.0, math.pi)))
        turn = draw(st.sampled_from((-1.0, 0.0, 1.0))) * 10.0 ** draw(st.floats(-16.0, -4.0))
        shift = draw(st.sampled_from((-1.0, 0.0, 1.0))) * 10.0 ** draw(st.floats(-17.0, -2.0))
        rows.append(turned(angle + side + turn, (offset if side == 0.0 else -offset) + shift))
    return [*BOX, *rows], np.array([draw(speeds(1.0)), draw(speeds(1.0))])


# The foot on the first row seems outside of the third, which is parallel to 1e-11 and 4e-8 away by Cramer's rule.
@example(
    drawn=(
        [
            *BOX,
            (0.9751524888307088, -0.221534700503723, 0.0720090329455992),
            (0.9751524580349737, -0.2215348360604911, 0.07200903294782632),
            (-0.9751524888223941, 0.2215347005403225, -0.07200903294782703),
        ],
        np.array([-0.02509005361382722, -0.08488329504491647]),
    )
)
# Head-on to 1e-6: the crossing at t* lies on its rows to 2e-12 only by Cramer's rule.
@example(
    drawn=(
        [
            *BOX,
            (-0.9352919290878126, 0.353877107741089, -0.04948911028957855),
            (0.9352929374380625, -0.35387444267491325, 0.1390336263513065),
            (-0.9352923068039026, 0.3538761094414745, 0.05878659948321318),
        ],
        np.array([-0.10541518093760394, 0.04159160398340395]),
    )
)
@given(drawn=almost_parallel_rows())
def test_rows_that_are_almost_parallel_are_answered_as_nearly_as_rows_are_known(
    drawn: tuple[list[Row], FloatArray],
) -> None:
    rows, wanted = drawn
    found = answer(rows, wanted, num_hard=4)
    assert found.status == SOLVED
    assert found.is_nearest
    assert found.is_proved
    apart = math.hypot(*(found.point - wanted))
    array = np.array(rows)
    slack = np.where(np.arange(len(rows)) >= 4, found.relaxation, 0.0)
    program = ConvexProgram(np.eye(2), -wanted, -array[:, :2], -array[:, 2] + slack)
    assert program.violation(found.point) <= 2e-12
    # No farther than with rows drawn in, no nearer than with rows let out by the tolerance.
    assert apart >= distance_of(exact_nearest(relaxed(program, 2e-12)), wanted) - 1e-12
    drawn_in = exact_nearest(relaxed(program, -2.0 * TOLERANCE))
    assert drawn_in is None or apart <= distance_of(drawn_in, wanted) + 1e-12


@given(almost_parallel_rows())
def test_the_least_violation_of_almost_parallel_rows_is_the_exact_one(
    drawn: tuple[list[Row], FloatArray],
) -> None:
    rows, wanted = drawn
    array = np.array(rows)
    lift = np.where(np.arange(len(rows)) < 4, 0.0, -1.0)
    corner = exact_least_violation(
        ConvexProgram(
            P=np.zeros((3, 3)),
            q=np.array([0.0, 0.0, 1.0]),
            G=np.vstack([np.column_stack([-array[:, :2], lift]), [0.0, 0.0, -1.0]]),
            h=np.append(-array[:, 2], 0.0),
        )
    )
    assert corner is not None
    assert answer(rows, wanted, num_hard=4).least == pytest.approx(float(corner[2]), abs=TOLERANCE)


@pytest.mark.parametrize("apart", [10.0**-k for k in range(3, 13)])
def test_two_rows_back_to_back_have_half_their_distance_as_least_violation(apart: float) -> None:
    rows = [*BOX, (0.6, 0.8, 0.1), (-0.6, -0.8, apart - 0.1)]
    found = answer(rows, [0.4, 0.1], num_hard=4)
    assert found.status == SOLVED
    assert found.least == pytest.approx(apart / 2.0, abs=1e-12)
    assert np.array([0.6, 0.8]) @ found.point == pytest.approx(0.1, abs=apart + 2.0 * TOLERANCE)


@pytest.mark.parametrize("sine", [10.0**-k for k in range(6, 15)])
def test_a_sharp_wedge_ends_somewhere_on_its_rows(sine: float) -> None:
    # The wedge points up and ends at (0, 0.1): beyond, its rows part by less than `sine` a metre.
    wedge = [turned(sine, 0.1 * sine), (-1.0, 0.0, 0.0)]
    found = answer([*BOX, *wedge], [-0.3, -0.4], num_hard=4)
    assert (found.status, found.is_nearest, found.is_proved) == (SOLVED, True, True)
    assert abs(found.point[0]) <= 2.0 * TOLERANCE + 0.6 * sine


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


def is_nearest_at(point: list[float], active: list[int], multipliers: list[float]) -> bool:
    """Check a claim about the point of the box nearest to (1, 0.9)."""
    array = np.array(BOX).T.copy()
    return is_nearest(
        Rows(array, 4, 4, 0, 0.0), 0.0, 1.0, 0.9, point[0], point[1], TOLERANCE,
        np.array(active), np.array(multipliers), len(active),
    )  # fmt: skip


def test_is_nearest_believes_nothing() -> None:
    assert is_nearest_at([0.5, 0.5], [2, 3], [0.5, 0.4])
    assert is_nearest_at([0.5, 0.5], [3, 2], [0.4, 0.5])
    assert not is_nearest_at([0.5, 0.5], [2, 3], [0.4, 0.5])
    assert not is_nearest_at([0.5, 0.5], [2], [0.5])
    assert not is_nearest_at([0.5, 0.5], [2, 3], [0.5, math.nan])
    assert not is_nearest_at([0.5, 0.5 + 1e-6], [2, 3], [0.5, 0.4 - 1e-6])
    assert not is_nearest_at([0.5, 0.5 - 1e-6], [2, 3], [0.5, 0.4 + 1e-6])
    assert not is_nearest_at([0.5, 0.9], [2], [0.5])
    assert not is_nearest_at([math.nan, 0.5], [2, 3], [0.5, 0.4])
    # Rows 0 and 2 balance: the sum is right, the sign is not.
    assert not is_nearest_at([0.5, 0.5], [2, 3, 0], [-0.5, 0.4, -1.0])


def is_proof_of(
    least: float, proof: list[int], weights: list[float], rows: list[Row] | None = None
) -> bool:
    """Check a claim about t* of two soft rows 0.2 apart in the box: 0.1."""
    soft = rows or [(1.0, 0.0, 0.1), (-1.0, 0.0, 0.1)]
    array = np.array([*BOX, *soft]).T.copy()
    return is_proof(
        Rows(array, len(BOX) + len(soft), 4, 0, 0.0), least, 1.0, TOLERANCE,
        np.array(proof), np.array(weights), len(proof),
    )  # fmt: skip


def test_is_proof_believes_nothing() -> None:
    assert is_proof_of(0.1, [4, 5], [0.5, 0.5])
    assert is_proof_of(0.05, [4, 5], [0.5, 0.5])
    assert not is_proof_of(0.1 + 1e-8, [4, 5], [0.5, 0.5])
    assert not is_proof_of(0.1, [4, 5], [0.6, 0.4])
    assert not is_proof_of(0.1, [4, 5], [1.0, 1.0])
    assert not is_proof_of(0.1, [4], [1.0])
    assert not is_proof_of(0.1, [4, 5], [0.5, math.nan])
    assert not is_proof_of(0.1, [4, 5], [1.5, -0.5])
    assert not is_proof_of(0.1, [0, 2], [1.0, 1.0])


def family(name: str, shape: tuple[int, int], v: float, rng: np.random.Generator) -> FloatArray:
    """Soft rows of K programs, shape (K, 3, M), of a kind that is hard for active-set methods."""
    angle = rng.uniform(0.0, 2.0 * np.pi, shape)
    offset = rng.normal(0.0, 0.5, shape) * v
    few = rng.integers(0, max(1, shape[1] // 3), shape)
    sides = rng.integers(0, 2, shape)
    signs = np.where(sides == 1, -1.0, 1.0)
    small = rng.choice([-1.0, 0.0, 1.0], shape)
    if name == "empty":
        offset = np.abs(offset)
    elif name == "equal":
        angle, offset = (np.take_along_axis(part, few, 1) for part in (angle, offset))
    elif name == "parallel":
        angle = np.take_along_axis(angle, few, 1)
    elif name == "back to back":
        angle = np.take_along_axis(angle, few, 1) + np.pi * sides
        offset = signs * np.take_along_axis(offset, few, 1)
        offset += small * 10.0 ** rng.uniform(-13.0, -2.0, shape) * v
    elif name == "almost parallel":
        angle = np.take_along_axis(angle, few, 1) + np.pi * sides
        angle += small * 10.0 ** rng.uniform(-16.0, -4.0, shape)
        offset = signs * np.take_along_axis(offset, few, 1)
        offset += rng.choice([-1.0, 0.0, 1.0], shape) * 10.0 ** rng.uniform(-17.0, -2.0, shape) * v
    elif name == "through one point":
        point = rng.uniform(-0.7, 0.7, (shape[0], 1, 2)) * v
        offset = np.cos(angle) * point[..., 0] + np.sin(angle) * point[..., 1]
        offset += small * 10.0 ** rng.uniform(-17.0, -6.0, shape) * v
    elif name == "through the origin":
        offset *= 0.0
    elif name == "on a grid":
        angle = rng.integers(0, 8, shape) * (np.pi / 4.0)
        offset = rng.integers(-3, 4, shape) * (v / 4.0)
    elif name == "far outside":
        offset = np.where(rng.random(shape) < 0.5, -1e6, offset)
    elif name == "far inside":
        offset = np.where(rng.random(shape) < 0.3, 1e6 * rng.random(shape), offset)
    elif name == "head-on":
        angle = rng.uniform(0.0, 2.0 * np.pi, (shape[0], 1)) + np.pi * sides
        angle = angle + small * 10.0 ** rng.uniform(-9.0, -1.0, shape)
    return np.stack([np.cos(angle), np.sin(angle), offset], axis=1)


FAMILIES = [
    "any", "empty", "equal", "parallel", "back to back", "almost parallel", "through one point",
    "through the origin", "on a grid", "far outside", "far inside", "head-on",
]  # fmt: skip


def wanted_points(
    soft: FloatArray, v: float, rng: np.random.Generator
) -> FloatArray:
    """What is wanted: anything, the origin, or a point on a row."""
    num_programs = len(soft)
    wanted = rng.normal(0.0, 0.7, (num_programs, 2)) * v
    row = soft[np.arange(num_programs), :, rng.integers(0, soft.shape[2], num_programs)]
    short = row[:, 2] - (row[:, :2] * wanted).sum(axis=1)
    kind = rng.integers(0, 4, num_programs)[:, None]
    wanted = np.where(kind == 0, wanted + short[:, None] * row[:, :2], wanted)
    return np.where(kind == 1, 0.0, wanted)


def polygon(num_sides: int, v: float) -> FloatArray:
    angle = (np.arange(num_sides) + 0.5) * (2.0 * np.pi / num_sides)
    inside = np.full(num_sides, -math.cos(math.pi / num_sides) * v)
    return np.stack([-np.cos(angle), -np.sin(angle), inside])


def assert_all_proved(name: str, num_programs: int, num_rows: int, v: float) -> None:
    """Solve programs of a family inside of a polygon of 64 sides for the speed v."""
    rng = np.random.default_rng([FAMILIES.index(name), num_rows, round(1e3 * v)])
    soft = family(name, (num_programs, num_rows), v, rng)
    sides = np.broadcast_to(polygon(64, v), (num_programs, 3, 64))
    array = np.concatenate([sides, soft], axis=2)
    wanted = wanted_points(soft, v, rng)
    inner = v * math.cos(math.pi / 64)
    table = answers(array, wanted, 64, num_sides=64, inner_radius=inner, radius=1.000001 * v)
    status, nearest, proved = table.labels[:, 6], table.labels[:, 9], table.labels[:, 10]
    wrong = np.flatnonzero((status != SOLVED) | (nearest == 0) | (proved == 0))
    assert len(wrong) == 0, (
        f"{len(wrong)} of {num_programs}, such as: "
        f"{soft[wrong[0]].T.tolist()}, wanted {wanted[wrong[0]].tolist()}: {table.labels[wrong[0]]}"
    )
    # The circle inside the polygon spares its sides a look, and changes nothing.
    again = answers(array, wanted, 64, radius=1.000001 * v)
    np.testing.assert_array_equal(table.numbers[:, 6:], again.numbers[:, 6:])


@pytest.mark.parametrize("num_rows", [3, 80])
@pytest.mark.parametrize("name", FAMILIES)
def test_hard_families_are_answered_with_proof(name: str, num_rows: int) -> None:
    assert_all_proved(name, 10, num_rows, 0.2)


@pytest.mark.stress
@pytest.mark.parametrize("v", [1e-3, 0.2, 1.0, 30.0, 1e3])
@pytest.mark.parametrize("name", FAMILIES)
def test_a_million_programs_of_hard_families_are_answered_with_proof(name: str, v: float) -> None:
    for num_rows in (3, 10, 80):
        assert_all_proved(name, 6000, num_rows, v)
