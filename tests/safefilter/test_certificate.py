"""Honest answers are certified, altered ones are refused, in floats and exactly."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.certificate import TOLERANCE, Claim, certify
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import (
    Point,
    exact_least_violation,
    exact_multipliers,
    exact_nearest,
)
from safefilter.testing.program_strategies import (
    DELTA,
    SIDES,
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
)

# No point that the programs of `program_strategies` permit is longer, t included.
RADIUS = 4.0

exactness = pytest.mark.parametrize("exact", [False, True], ids=["floats", "exact"])
directions = st.floats(0.0, 6.28).map(lambda angle: np.array([np.cos(angle), np.sin(angle)]))


def answer(x: FloatArray, multipliers: FloatArray, status: Status = Status.OPTIMAL) -> Solution:
    return Solution(status, np.array(x), np.array(multipliers), 0.0, 0.0)


def rounded(program: ConvexProgram, point: Point | None) -> Solution:
    assume(point is not None)  # rounding of h can close a polygon that touches itself
    assert point is not None
    multipliers = exact_multipliers(program, point)
    assert multipliers is not None
    # Rows closer than 1e-9 to parallel carry multipliers that no float residual can confirm.
    assume(max(multipliers, default=0) < 1e7)
    return answer(np.array(point, dtype=np.float64), np.array(multipliers, dtype=np.float64))


def honest(program: ConvexProgram) -> Solution:
    return rounded(program, exact_nearest(program))


def proof(program: ConvexProgram, multipliers: FloatArray) -> Solution:
    return answer(np.full(program.num_variables, np.nan), multipliers, Status.INFEASIBLE)


def box(wanted: tuple[float, float]) -> ConvexProgram:
    """The point of the square |v| <= 1 nearest to the wanted one."""
    G = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    return ConvexProgram(np.eye(2), -np.array(wanted), G, np.ones(4))


def cheapest_multipliers(program: ConvexProgram, x: FloatArray) -> FloatArray:
    """Of all multipliers that leave no residual at x, the ones with the least gap: the best liar's choice."""
    downhill = -(program.P @ x + program.q)
    slack = program.h - program.G @ x
    best, least = np.zeros(program.num_rows), math.inf
    for pair in combinations(range(program.num_rows), 2):
        columns = program.G[list(pair)].T
        if abs(np.linalg.det(columns)) > 1e-12:
            weights = np.linalg.solve(columns, downhill)
            if weights.min() >= 0.0 and weights @ slack[list(pair)] < least:
                least = float(weights @ slack[list(pair)])
                best = np.zeros(program.num_rows)
                best[list(pair)] = weights
    return best


@exactness
@given(program=permitted_programs())
def test_an_honest_case_2_answer_is_certified(program: ConvexProgram, exact: bool) -> None:
    certificate = certify(program, honest(program), exact=exact)
    assert certificate.valid, certificate.reason
    assert certificate.claim is Claim.OPTIMAL
    assert certificate.exact is exact
    assert certificate.reason == ""


@given(stages=second_stage_programs())
def test_an_honest_case_3_answer_is_certified_in_both_stages(stages: SecondStage) -> None:
    first = rounded(stages.first, exact_least_violation(stages.first))
    second = honest(stages.second)
    for exact in (False, True):
        assert certify(stages.first, first, radius=RADIUS, exact=exact), "first stage"
        assert certify(stages.second, second, exact=exact), "second stage"


@exactness
@given(program=permitted_programs(), direction=directions)
def test_a_case_2_answer_moved_by_a_millimetre_a_second_is_refused(
    program: ConvexProgram, direction: FloatArray, exact: bool
) -> None:
    good = honest(program)
    moved = replace(good, x=good.x + 1e-3 * direction)
    assert not certify(program, moved, exact=exact)


@given(stages=second_stage_programs(), row=st.integers(0, 20), sign=st.sampled_from([-1, 1]))
def test_an_answer_moved_along_a_row_is_refused_in_a_tie_too(
    stages: SecondStage, row: int, sign: int
) -> None:
    good = honest(stages.second)
    normal = stages.second.G[row % stages.second.num_rows]
    along = sign * np.array([-normal[1], normal[0]])
    moved = replace(good, x=good.x + 1e-3 * along)
    assert not certify(stages.second, moved)
    assert not certify(stages.second, moved, exact=True)


@given(
    stages=second_stage_programs(),
    direction=directions,
    length=st.sampled_from([1e-3, 1e-5, 1e-6]),
)
def test_the_best_liar_is_refused_exactly(
    stages: SecondStage, direction: FloatArray, length: float
) -> None:
    program = stages.second
    x = honest(program).x + length * direction
    assert not certify(program, answer(x, cheapest_multipliers(program, x)), exact=True)


@given(
    turn=st.integers(5, 175).map(math.radians),
    wanted=directions,
    sign=st.sampled_from([-1, 1]),
    row=st.sampled_from([0, 1]),
)
def test_the_best_liar_is_refused_in_floats_unless_rows_are_nearly_parallel(
    turn: float, wanted: FloatArray, sign: int, row: int
) -> None:
    G = np.array([[1.0, 0.0], [np.cos(turn), np.sin(turn)], [-1.0, 0.0]])
    program = ConvexProgram(np.eye(2), -wanted, G, np.array([DELTA, 0.0, DELTA]))
    along = np.array([-G[row][1], G[row][0]])
    x = honest(program).x + sign * 1e-3 * along
    assert not certify(program, answer(x, cheapest_multipliers(program, x)))


@exactness
@given(program=permitted_programs(), row=st.integers(0, 20))
def test_altered_multipliers_are_refused(program: ConvexProgram, row: int, exact: bool) -> None:
    good = honest(program)
    altered = good.multipliers.copy()
    altered[row % len(altered)] += 1e-3
    assert not certify(program, replace(good, multipliers=altered), exact=exact)


@exactness
@given(program=permitted_programs())
def test_multipliers_on_the_wrong_rows_are_refused(program: ConvexProgram, exact: bool) -> None:
    good = honest(program)
    swapped = np.roll(good.multipliers, 1)
    pull, wrong_pull = good.multipliers @ program.G, swapped @ program.G
    assume(np.abs(pull - wrong_pull).max() > 1e-6)  # equal rows may be swapped
    assert not certify(program, replace(good, multipliers=swapped), exact=exact)


@exactness
@given(program=permitted_programs())
def test_multipliers_of_the_wrong_sign_are_refused(program: ConvexProgram, exact: bool) -> None:
    good = honest(program)
    assume(good.multipliers.max() > 1e-6)
    certificate = certify(program, replace(good, multipliers=-good.multipliers), exact=exact)
    assert certificate.reason.startswith("a multiplier is negative")


@exactness
def test_a_multiplier_that_is_negative_by_rounding_counts_as_zero(exact: bool) -> None:
    multipliers = np.array([1.0, -1e-12, 0.0, 0.0])
    assert certify(box((2.0, 0.0)), answer(np.array([1.0, 0.0]), multipliers), exact=exact)


@exactness
def test_zeroing_a_multiplier_does_not_hide_its_residual(exact: bool) -> None:
    # Taken at its word the multiplier would make the answer exact.
    x = np.array([1.0, 3.0 * TOLERANCE])
    multipliers = np.array([1.0, 0.0, -0.9 * TOLERANCE, 0.9 * TOLERANCE])
    program = box((2.0, 0.0))
    program = ConvexProgram(program.P, program.q, program.G * [1.0, 1.7], np.full(4, 1.0))
    assert not certify(program, answer(x, multipliers), exact=exact)


@exactness
@given(drawn=contradictory_programs())
def test_contradictory_rows_are_proved_contradictory(
    drawn: tuple[ConvexProgram, FloatArray], exact: bool
) -> None:
    program, multipliers = drawn
    certificate = certify(program, proof(program, multipliers), radius=RADIUS, exact=exact)
    assert certificate.valid, certificate.reason
    assert certificate.claim is Claim.INFEASIBLE
    assert certificate.gap < 0.0
    assert math.isnan(certificate.primal_residual)


@exactness
@given(drawn=contradictory_programs())
def test_a_contradictory_program_called_optimal_is_refused(
    drawn: tuple[ConvexProgram, FloatArray], exact: bool
) -> None:
    program, multipliers = drawn
    x = np.array(np.linalg.lstsq(program.G[SIDES:], program.h[SIDES:])[0], dtype=np.float64)
    assert not certify(program, answer(x, multipliers), exact=exact)
    assert not certify(program, answer(x, cheapest_multipliers(program, x)), exact=exact)


@exactness
@given(
    program=permitted_programs(),
    weights=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20),
)
def test_a_permitted_program_is_never_proved_contradictory(
    program: ConvexProgram, weights: list[float], exact: bool
) -> None:
    assume(exact_nearest(program) is not None)
    multipliers = np.resize(np.array(weights), program.num_rows)
    assert not certify(program, proof(program, multipliers), radius=RADIUS, exact=exact)


@exactness
@example(turn=1e-9, gap=1e-10)
@given(turn=st.floats(1e-9, 1e-3), gap=st.floats(1e-12, 1.0))
def test_a_residual_that_fakes_a_contradiction_is_refused_within_the_radius(
    turn: float, gap: float, exact: bool
) -> None:
    # Two rows that are nearly opposite look contradictory near 0, but meet at gap / (2 tan turn).
    meeting = gap / (2.0 * math.sin(turn))
    assume(meeting < 1e3)
    G = np.array([[math.cos(turn), math.sin(turn)], [-math.cos(turn), math.sin(turn)]])
    program = ConvexProgram(np.eye(2), np.zeros(2), G, np.full(2, -0.5 * gap))
    fake = proof(program, np.ones(2))
    assert not certify(program, fake, radius=1.01 * meeting, exact=exact)
    assert not certify(program, fake, exact=exact)


@exactness
def test_rounding_cannot_fake_a_contradiction(exact: bool) -> None:
    # x = 0.1 keeps all rows. In floats (0.1 + 0.1 - 0.2) / 3 comes out below zero, term by term.
    G = np.array([[1.0], [1.0], [-2.0]])
    program = ConvexProgram(np.eye(1), np.zeros(1), G, np.array([0.1, 0.1, -0.2]))
    fake = proof(program, np.ones(3))
    weights = np.ones(3) / 3.0
    assert weights @ program.h < 0.0
    assert not (weights @ program.G).any()
    assert not certify(program, fake, radius=1.0, exact=exact)


@exactness
def test_a_contradiction_needs_no_radius_if_there_is_no_residual(exact: bool) -> None:
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    program = ConvexProgram(np.eye(2), np.zeros(2), G, np.array([-1.0, 0.5]))
    assert certify(program, proof(program, np.ones(2)), exact=exact)
    assert not certify(program, proof(program, np.array([1.0, 0.99])), exact=exact)


def test_rows_that_meet_far_away_contradict_each_other_in_floats_only() -> None:
    G = np.array([[1.0, 1e-12], [-1.0, 1e-12]])
    program = ConvexProgram(np.eye(2), np.zeros(2), G, np.array([-1.0, 0.5]))
    fake = proof(program, np.ones(2))
    assert certify(program, fake)
    assert certify(program, fake, radius=100.0, exact=True)
    refused = certify(program, fake, exact=True)
    assert refused.reason == ("the rows named do not contradict each other exactly: pass a radius")


@given(stages=second_stage_programs())
def test_a_wrong_least_violation_is_refused(stages: SecondStage) -> None:
    good = rounded(stages.first, exact_least_violation(stages.first))
    for shift in (-1e-3, 1e-3, -1e-6, 1e-6):
        moved = replace(good, x=good.x + np.array([0.0, 0.0, shift]))
        assert not certify(stages.first, moved, radius=RADIUS)
        assert not certify(stages.first, moved, radius=RADIUS, exact=True)


def test_an_exact_linear_proof_without_radius_needs_multipliers_that_can_be_made_exact() -> None:
    # min t: t >= 1 - 3 v, t >= v; t* = 1/4. Thirds do not exist in floats: the residual is not zero.
    G = np.array([[-3.0, -1.0], [1.0, -1.0]]) / math.sqrt(3.0)
    program = ConvexProgram(
        np.zeros((2, 2)), np.array([0.0, 1.0]), G, np.array([-1.0, 0.0]) / math.sqrt(3.0)
    )
    good = answer(np.array([0.25, 0.25]), np.array([0.25, 0.75]) * math.sqrt(3.0))
    assert certify(program, good, exact=True)
    flat = ConvexProgram(np.zeros((2, 2)), np.array([1e-12, 1.0]), -np.eye(2)[1:], np.zeros(1))
    refused = certify(flat, answer(np.zeros(2), np.ones(1)), exact=True)
    assert "radius" in refused.reason
    assert certify(flat, answer(np.zeros(2), np.ones(1)), radius=1e3, exact=True)


@exactness
def test_a_program_without_rows_is_checked(exact: bool) -> None:
    program = ConvexProgram(np.eye(3), -np.ones(3), np.empty((0, 3)), np.empty(0))
    assert certify(program, answer(np.ones(3), np.empty(0)), exact=exact)
    assert not certify(program, answer(np.zeros(3), np.empty(0)), exact=exact)
    assert not certify(program, proof(program, np.empty(0)), exact=exact)


@exactness
def test_any_multipliers_that_prove_it_will_do_where_rows_are_repeated(exact: bool) -> None:
    # Three equal rows and one turned by rounding: multipliers may be spread over them at will.
    G = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1e-16], [1.0, 0.0]])
    program = ConvexProgram(np.eye(2), np.array([-2.0, 0.0]), G, np.ones(4))
    spread = answer(np.array([1.0, 0.0]), np.array([0.5, 0.0, 0.25, 0.25]))
    assert certify(program, spread, exact=exact)


def test_rows_that_only_rounding_parts_are_accepted() -> None:
    # x <= 0.1 and x >= 0.1 + 1e-16: no point exactly, one within any tolerance.
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    program = ConvexProgram(
        np.eye(2), np.array([-1.0, 0.0]), G, np.array([0.1, np.nextafter(-0.1, -1)])
    )
    good = answer(np.array([0.1, 0.0]), np.array([0.9, 0.0]))
    assert certify(program, good, exact=True)


@exactness
def test_a_line_that_the_last_bit_closes_is_open(exact: bool) -> None:
    G = np.array([[1.0, 0.0], [-1.0, np.sin(np.pi)]])
    program = ConvexProgram(np.eye(2), np.array([-0.125, -0.25]), G, np.zeros(2))
    good = answer(np.array([0.0, 0.25]), np.array([0.125, 0.0]))
    assert certify(program, good, exact=exact)
    assert not certify(program, replace(good, x=np.array([0.0, 0.249])), exact=exact)


@exactness
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_tolerance_is_a_length_whatever_the_curvature(scale: float, exact: bool) -> None:
    P = scale * np.eye(2)
    program = ConvexProgram(P, P @ [-2.0, 0.0], np.array([[1.0, 0.0]]), np.ones(1))
    good = answer(np.array([1.0, 0.0]), np.array([scale]))
    assert certify(program, good, exact=exact)
    assert not certify(program, replace(good, x=np.array([1.0, 1e-6])), exact=exact)


@exactness
def test_a_curved_program_is_checked_with_its_own_curvature(exact: bool) -> None:
    P = np.array([[2.0, 1.0], [1.0, 3.0]])
    program = ConvexProgram(P, np.array([-3.0, -4.0]), np.eye(2), np.array([5.0, 0.5]))
    # x_2 = 1/2 active: 2 x_1 + 1/2 = 3, multiplier = 4 - x_1 - 3/2.
    good = answer(np.array([1.25, 0.5]), np.array([0.0, 1.25]))
    assert certify(program, good, exact=exact)
    assert not certify(program, replace(good, x=np.array([1.251, 0.5])), exact=exact)
