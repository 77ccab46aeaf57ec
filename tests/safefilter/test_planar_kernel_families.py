"""The exact planar solver on rows made to break active-set methods: each answer comes with its proof.

Rows are ``n_x x + n_y y >= offset``, written (n_x, n_y, offset). Letters: K programs, M rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows, least_violation, project
from safefilter.backends.planar_kernel_checks import is_nearest, is_proof
from safefilter.jit import kernel
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import exact_least_violation, exact_nearest
from safefilter.testing.program_strategies import speeds

TOLERANCE = 1e-9
BOX = [(1.0, 0.0, -0.5), (0.0, 1.0, -0.5), (-1.0, 0.0, -0.5), (0.0, -1.0, -0.5)]

Row = tuple[float, float, float]


class Table(NamedTuple):
    """Answers to K programs: x, y, t* and relaxation, shape (K, 4); status, is it nearest, is t* proved (K, 3)."""

    numbers: FloatArray
    flags: IntArray


@kernel
def solve_all(
    array: FloatArray,
    num_hard: int,
    num_sides: int,
    inner_radius: float,
    wanted: FloatArray,
    radius: float,
    numbers: FloatArray,
    flags: IntArray,
) -> None:
    active, proof = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    multipliers, weights = np.zeros(3), np.zeros(3)
    for k in range(len(array)):
        rows = Rows(array[k], array.shape[2], num_hard, num_sides, inner_radius)
        wanted_x, wanted_y = wanted[k, 0], wanted[k, 1]
        least, relaxation, proof_count = 0.0, 0.0, 0
        status, x, y, count = project(
            rows, 0.0, wanted_x, wanted_y, TOLERANCE, active, multipliers, proof, 0
        )
        if status == CONTRADICTION:
            status, x, y, count, least, relaxation, proof_count = least_violation(
                rows, wanted_x, wanted_y, TOLERANCE, active, multipliers, count, proof, weights
            )
        numbers[k, 0], numbers[k, 1], numbers[k, 2], numbers[k, 3] = x, y, least, relaxation
        flags[k, 0] = status
        flags[k, 1] = is_nearest(
            rows, relaxation, wanted_x, wanted_y, x, y, TOLERANCE, active, multipliers, count
        )
        flags[k, 2] = least <= TOLERANCE or is_proof(
            rows, least, radius, TOLERANCE, proof, weights, proof_count
        )


def answers(
    array: FloatArray,
    wanted: FloatArray,
    num_hard: int,
    radius: float,
    *,
    num_sides: int = 0,
    inner_radius: float = 0.0,
) -> Table:
    table = Table(np.zeros((len(array), 4)), np.zeros((len(array), 3), dtype=np.int64))
    solve_all(array, num_hard, num_sides, inner_radius, wanted, radius, *table)
    return table


class Answer(NamedTuple):
    """Answer to one program of four hard rows and more that are soft."""

    point: FloatArray
    least: float
    relaxation: float
    status: int
    is_nearest: bool
    is_proved: bool


def answer(rows: list[Row], wanted: FloatArray, num_hard: int = 4) -> Answer:
    array = np.array(rows).T[None].copy()
    numbers, flags = answers(array, wanted[None], num_hard=num_hard, radius=1.0)
    status, is_near, is_proved = flags[0].tolist()
    return Answer(
        numbers[0, :2],
        float(numbers[0, 2]),
        float(numbers[0, 3]),
        status,
        bool(is_near),
        bool(is_proved),
    )


def turned(angle: float, offset: float) -> Row:
    return math.cos(angle), math.sin(angle), offset


def relaxed(program: ConvexProgram, slack: float) -> ConvexProgram:
    return ConvexProgram(program.P, program.q, program.G, program.h + slack)


def distance_of(point: tuple[Fraction, ...] | None, wanted: FloatArray) -> float:
    assert point is not None
    return math.hypot(float(point[0]) - wanted[0], float(point[1]) - wanted[1])


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
    found = answer(rows, wanted)
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
@example((
    [
        *BOX,
        (-0.999999999999995, 9.999999995880663e-08, 0.001),
        (1.0, -1e-10, -0.0001),
        (1.0, -1e-09, -0.0001),
    ],
    np.zeros(2),
))
def test_the_least_violation_of_almost_parallel_rows_is_known_to_the_tolerance(
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
    assert answer(rows, wanted).least == pytest.approx(float(corner[2]), abs=TOLERANCE)


def test_a_side_far_along_two_rows_that_are_almost_back_to_back_decides() -> None:
    """From a crossing of two rows of robots: t* on another side is less than the tolerance away, the point 3 mm/s."""
    sides = [
        (math.cos(angle), math.sin(angle), offset)
        for angle, offset in ((-1.8162, -0.19971), (-1.3254, -0.19976))
    ]
    rows = [*BOX, *sides, (1.0, 1.79035006e-07, -0.04374), (-1.0, 8.83191678e-08, 0.044205)]
    found = answer(rows, np.array([-0.2, 0.0]), num_hard=len(rows) - 2)
    assert found.is_proved
    array = np.array(rows)
    hard = np.arange(len(rows)) < len(rows) - 2
    program = ConvexProgram(
        P=np.zeros((3, 3)),
        q=np.array([0.0, 0.0, 1.0]),
        G=np.column_stack([-array[:, :2], np.where(hard, 0.0, -1.0)]),
        h=-array[:, 2],
    )
    corner = exact_least_violation(program)
    assert corner is not None
    assert found.least == pytest.approx(float(corner[2]), abs=1e-16)


@pytest.mark.parametrize("apart", [10.0**-k for k in range(3, 13)])
def test_two_rows_back_to_back_have_half_their_distance_as_least_violation(apart: float) -> None:
    rows = [*BOX, (0.6, 0.8, 0.1), (-0.6, -0.8, apart - 0.1)]
    found = answer(rows, np.array([0.4, 0.1]))
    assert found.status == SOLVED
    assert found.least == pytest.approx(apart / 2.0, abs=1e-12)
    assert np.array([0.6, 0.8]) @ found.point == pytest.approx(0.1, abs=apart + 2.0 * TOLERANCE)


@pytest.mark.parametrize("sine", [10.0**-k for k in range(6, 15)])
def test_a_sharp_wedge_ends_somewhere_on_its_rows(sine: float) -> None:
    # The wedge points up and ends at (0, 0.1): beyond, its rows part by less than `sine` a metre.
    wedge = [turned(sine, 0.1 * sine), (-1.0, 0.0, 0.0)]
    found = answer([*BOX, *wedge], np.array([-0.3, -0.4]))
    assert (found.status, found.is_nearest, found.is_proved) == (SOLVED, True, True)
    assert abs(found.point[0]) <= 2.0 * TOLERANCE + 0.6 * sine


class Draft(NamedTuple):
    """Rows on the way to becoming a family: all of shape (K, M), and what they are drawn with."""

    angle: FloatArray
    offset: FloatArray
    v: float
    rng: np.random.Generator

    def repeated(self) -> Draft:
        """Few different rows, each several times."""
        few = self.rng.integers(0, max(1, self.angle.shape[1] // 3), self.angle.shape)
        programs = np.arange(len(few))[:, None]
        return self._replace(angle=self.angle[programs, few], offset=self.offset[programs, few])

    def small(self, least: float, most: float) -> FloatArray:
        """Powers of ten of either sign, or zero."""
        size = 10.0 ** self.rng.uniform(least, most, self.angle.shape)
        return np.asarray(self.rng.choice([-1.0, 0.0, 1.0], self.angle.shape) * size)

    def turned_round(self) -> Draft:
        """Half of the rows the other way round, on the same line."""
        back = self.rng.integers(0, 2, self.angle.shape)
        return self._replace(
            angle=self.angle + np.pi * back, offset=np.where(back == 1, -self.offset, self.offset)
        )


def back_to_back(draft: Draft) -> Draft:
    lines = draft.repeated().turned_round()
    return lines._replace(offset=lines.offset + draft.small(-13.0, -2.0) * draft.v)


def almost_parallel(draft: Draft) -> Draft:
    lines = draft.repeated().turned_round()
    return lines._replace(
        angle=lines.angle + draft.small(-16.0, -4.0),
        offset=lines.offset + draft.small(-17.0, -2.0) * draft.v,
    )


def through_one_point(draft: Draft) -> Draft:
    point = draft.rng.uniform(-0.7, 0.7, (len(draft.angle), 1, 2)) * draft.v
    offset = np.cos(draft.angle) * point[..., 0] + np.sin(draft.angle) * point[..., 1]
    return draft._replace(offset=offset + draft.small(-17.0, -6.0) * draft.v)


def on_a_grid(draft: Draft) -> Draft:
    shape = draft.angle.shape
    return draft._replace(
        angle=np.multiply(draft.rng.integers(0, 8, shape), np.pi / 4.0),
        offset=np.multiply(draft.rng.integers(-3, 4, shape), draft.v / 4.0),
    )


def far(draft: Draft, part: float, offset: FloatArray) -> Draft:
    is_far = draft.rng.random(draft.angle.shape) < part
    return draft._replace(offset=np.where(is_far, offset, draft.offset))


def head_on(draft: Draft) -> Draft:
    course = draft._replace(angle=np.repeat(draft.angle[:, :1], draft.angle.shape[1], axis=1))
    lines = course.turned_round()
    return lines._replace(angle=lines.angle + draft.small(-9.0, -1.0), offset=draft.offset)


FAMILIES: dict[str, Callable[[Draft], Draft]] = {
    "any": lambda draft: draft,
    "empty": lambda draft: draft._replace(offset=np.abs(draft.offset)),
    "equal": Draft.repeated,
    "parallel": lambda draft: draft._replace(angle=draft.repeated().angle),
    "back to back": back_to_back,
    "almost parallel": almost_parallel,
    "through one point": through_one_point,
    "through the origin": lambda draft: draft._replace(offset=0.0 * draft.offset),
    "on a grid": on_a_grid,
    "far outside": lambda draft: far(draft, 0.5, np.full_like(draft.angle, -1e6)),
    "far inside": lambda draft: far(draft, 0.3, 1e5 * draft.rng.random(draft.angle.shape)),
    "head-on": head_on,
}


def rows_of(name: str, num_programs: int, num_rows: int, v: float) -> tuple[FloatArray, FloatArray]:
    """Soft rows of a family, shape (K, 3, M), and what is wanted: anything, the origin, a point on a row."""
    rng = np.random.default_rng([list(FAMILIES).index(name), num_rows, round(1e3 * v)])
    shape = (num_programs, num_rows)
    draft = Draft(rng.uniform(0.0, 2.0 * np.pi, shape), rng.normal(0.0, 0.5, shape) * v, v, rng)
    drawn = FAMILIES[name](draft)
    soft = np.stack([np.cos(drawn.angle), np.sin(drawn.angle), drawn.offset], axis=1)
    wanted = rng.normal(0.0, 0.7, (num_programs, 2)) * v
    row = soft[np.arange(num_programs), :, rng.integers(0, num_rows, num_programs)]
    short = row[:, 2] - (row[:, :2] * wanted).sum(axis=1)
    kind = rng.integers(0, 4, num_programs)[:, None]
    wanted = np.where(kind == 0, wanted + short[:, None] * row[:, :2], wanted)
    return soft, np.where(kind == 1, 0.0, wanted)


def polygon(num_sides: int, v: float) -> FloatArray:
    angle = (np.arange(num_sides) + 0.5) * (2.0 * np.pi / num_sides)
    inside = np.full(num_sides, -math.cos(math.pi / num_sides) * v)
    return np.stack([-np.cos(angle), -np.sin(angle), inside])


def assert_all_proved(name: str, num_programs: int, num_rows: int, v: float) -> None:
    """Solve programs of a family inside of a polygon of 64 sides for the speed v."""
    soft, wanted = rows_of(name, num_programs, num_rows, v)
    sides = np.broadcast_to(polygon(64, v), (num_programs, 3, 64))
    array = np.concatenate([sides, soft], axis=2)
    radius, inner = 1.000001 * v, v * math.cos(math.pi / 64)
    table = answers(array, wanted, 64, radius, num_sides=64, inner_radius=inner)
    wrong = np.flatnonzero((table.flags != [SOLVED, 1, 1]).any(axis=1))
    assert len(wrong) == 0, (
        f"{len(wrong)} of {num_programs}, such as: {soft[wrong[0]].T.tolist()}, "
        f"wanted {wanted[wrong[0]].tolist()}: status, nearest, proved are {table.flags[wrong[0]]}"
    )
    # The circle inside the polygon spares its sides a look, and changes nothing.
    again = answers(array, wanted, 64, radius)
    np.testing.assert_array_equal(table.numbers, again.numbers)


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
