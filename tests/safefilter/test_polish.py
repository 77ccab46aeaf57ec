"""Polished answers are the exact ones; answers that are wrong stay wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.certificate import TOLERANCE, certify
from safefilter.polish import MAX_MOVE, likely_active, polish
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import (
    exact_least_violation,
    exact_multipliers,
    exact_nearest,
)
from safefilter.testing.program_strategies import (
    SecondStage,
    permitted_programs,
    second_stage_programs,
)

# What a rather bad solver leaves, in m/s.
NOISE = 1e-4

KNOWLEDGE = ("noisy", "missing", "zero")
noises = st.tuples(st.floats(-NOISE, NOISE), st.floats(-NOISE, NOISE))


def answer(x: FloatArray, multipliers: FloatArray, status: Status = Status.OPTIMAL) -> Solution:
    return Solution(status, np.array(x), np.array(multipliers), 1.0, 2.0)


def disturbed(multipliers: FloatArray, known: str, seed: int) -> FloatArray:
    """Multipliers as a solver may leave them."""
    if known == "noisy":
        return multipliers + np.random.default_rng(seed).uniform(0.0, NOISE, len(multipliers))
    return np.full(len(multipliers), np.nan if known == "missing" else 0.0)


def nearest(program: ConvexProgram) -> tuple[FloatArray, FloatArray]:
    point = exact_nearest(program)
    assume(point is not None)
    assert point is not None
    multipliers = exact_multipliers(program, point)
    assert multipliers is not None
    return np.array(point, dtype=np.float64), np.array(multipliers, dtype=np.float64)


@pytest.mark.parametrize("known", KNOWLEDGE)
@given(program=permitted_programs(), noise=noises, seed=st.integers(0, 99))
def test_a_case_2_answer_becomes_the_exact_one(
    program: ConvexProgram, noise: tuple[float, float], seed: int, known: str
) -> None:
    x, multipliers = nearest(program)
    rough = answer(x + noise, disturbed(multipliers, known, seed))
    polished = polish(program, rough, tolerance=TOLERANCE)
    assert np.abs(polished.x - x).max() <= 1e-9
    assert polished.status is Status.OPTIMAL
    assert (polished.build_time, polished.solve_time) == (1.0, 2.0)


@pytest.mark.parametrize("known", KNOWLEDGE)
@given(stages=second_stage_programs(), noise=noises, seed=st.integers(0, 99))
def test_a_case_3_answer_becomes_the_exact_one(
    stages: SecondStage, noise: tuple[float, float], seed: int, known: str
) -> None:
    x, multipliers = nearest(stages.second)
    rough = answer(x + noise, disturbed(multipliers, known, seed))
    polished = polish(stages.second, rough, tolerance=TOLERANCE)
    assert np.abs(polished.x - x).max() <= 1e-9


@given(
    stages=second_stage_programs(),
    noise=st.tuples(*[st.floats(-NOISE, NOISE)] * 3),
    known=st.sampled_from(KNOWLEDGE),
)
def test_the_least_violation_becomes_the_exact_one_with_a_proof(
    stages: SecondStage, noise: tuple[float, float, float], known: str
) -> None:
    corner = exact_least_violation(stages.first)
    assert corner is not None
    multipliers = np.array(exact_multipliers(stages.first, corner), dtype=np.float64)
    x = np.array(corner, dtype=np.float64)
    rough = answer(x + noise, disturbed(multipliers, known, seed=0))
    polished = polish(stages.first, rough, tolerance=TOLERANCE)
    assert abs(polished.x[2] - x[2]) <= 1e-9
    assert np.count_nonzero(polished.multipliers) <= stages.first.num_variables
    certificate = certify(stages.first, polished, radius=4.0, exact=True)
    assert certificate.valid, certificate.reason


@given(program=permitted_programs(), noise=noises)
def test_a_polished_answer_has_multipliers_on_its_active_rows_only(
    program: ConvexProgram, noise: tuple[float, float]
) -> None:
    x, multipliers = nearest(program)
    rough = answer(x + noise, multipliers)
    polished = polish(program, rough, tolerance=TOLERANCE)
    slack = program.h - program.G @ polished.x
    held = polished.multipliers != 0.0
    assert held.sum() <= program.num_variables
    assert np.abs(slack[held]).max(initial=0.0) <= 1e-12
    assert polished.multipliers.min() >= 0.0


@given(program=permitted_programs(), noise=noises)
def test_backends_that_find_the_same_rows_agree_on_every_bit(
    program: ConvexProgram, noise: tuple[float, float]
) -> None:
    x, multipliers = nearest(program)
    assume(multipliers.max(initial=0.0) > 0.01)
    # Both are worse than the polished answer, so neither is returned as it is.
    one = polish(program, answer(x + NOISE, multipliers), tolerance=TOLERANCE)
    other = polish(program, answer(x + noise + 1e-6, multipliers), tolerance=TOLERANCE)
    assume(np.array_equal(one.multipliers > 0.0, other.multipliers > 0.0))
    assert np.array_equal(one.x, other.x)


@example(size=3, seed=0)
@given(size=st.integers(1, 6), seed=st.integers(0, 10_000))
def test_programs_in_any_dimension_are_polished(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(size, size))
    P = root @ root.T + 0.1 * np.eye(size)
    P = 0.5 * (P + P.T)
    G = rng.normal(size=(3 * size, size))
    G /= np.sqrt((G * G).sum(axis=1, keepdims=True))
    x = rng.normal(size=size)
    held = np.arange(3 * size) < size // 2 + 1
    multipliers = np.where(held, rng.uniform(0.1, 1.0, 3 * size), 0.0)
    h = G @ x + np.where(held, 0.0, rng.uniform(0.1, 1.0, 3 * size))
    program = ConvexProgram(P=P, q=-P @ x - multipliers @ G, G=G, h=h)
    rough = answer(x + rng.uniform(-1e-5, 1e-5, size), multipliers + rng.uniform(0, 1e-5, 3 * size))
    polished = polish(program, rough, tolerance=TOLERANCE)
    assert np.abs(polished.x - x).max() <= 1e-9
    assert certify(program, polished, exact=True)


def test_two_rows_back_to_back_leave_a_line_to_slide_along() -> None:
    # Exactly, the last bit of sin(pi) closes the line between the rows everywhere above 0.
    G = np.array([[1.0, 0.0], [-1.0, np.sin(np.pi)]])
    program = ConvexProgram(np.eye(2), np.array([-0.125, -0.25]), G, np.zeros(2))
    for multipliers in (np.array([0.125, 0.0]), np.full(2, np.nan)):
        rough = answer(np.array([1e-5, 0.25 - 1e-5]), multipliers)
        polished = polish(program, rough, tolerance=TOLERANCE)
        assert np.abs(polished.x - [0.0, 0.25]).max() <= 1e-15
        assert certify(program, polished)
        assert certify(program, polished, exact=True)


def test_a_far_point_that_passes_between_nearly_opposite_rows_moves_to_the_optimum() -> None:
    # The corner is at 0; at 0.2 along the first row the second one is violated by 2e-10 only.
    G = np.array([[1.0, 0.0], [-1.0, 1e-9]])
    program = ConvexProgram(np.eye(2), np.array([-0.125, -0.2]), G, np.zeros(2))
    loose = answer(np.array([0.0, 0.2]), np.array([0.125, 0.0]))
    assert certify(program, loose)
    assert not certify(program, loose, exact=True)
    polished = polish(program, loose, tolerance=TOLERANCE)
    assert np.abs(polished.x).max() <= 1e-15
    assert certify(program, polished, exact=True)


@given(
    hundredth=st.integers(0, 628),
    turns=st.lists(st.sampled_from([-1e-16, 0.0, 1e-16]), min_size=2, max_size=4),
    shifts=st.lists(st.sampled_from([-1e-16, 0.0, 1e-16]), min_size=4, max_size=4),
    noise=noises,
)
def test_rows_repeated_but_for_the_last_bit_are_one_row(
    hundredth: int, turns: list[float], shifts: list[float], noise: tuple[float, float]
) -> None:
    angles = 0.01 * hundredth + np.array(turns)
    G = np.column_stack([np.cos(angles), np.sin(angles)])
    h = 0.25 + np.array(shifts[: len(turns)])
    program = ConvexProgram(np.eye(2), -G[0], G, h)
    rough = answer(0.25 * G[0] + noise, np.full(len(turns), 0.75 / len(turns)))
    polished = polish(program, rough, tolerance=TOLERANCE)
    assert np.abs(polished.x - 0.25 * G[0]).max() <= 1e-15
    assert np.count_nonzero(polished.multipliers) == 1
    assert certify(program, polished, exact=True)


@given(hundredth=st.integers(0, 628), turn=st.sampled_from([1e-6, 3e-7, 1e-7]))
def test_the_corner_of_nearly_opposite_rows_is_rounded_once(hundredth: int, turn: float) -> None:
    angles = 0.01 * hundredth + np.array([0.0, np.pi - turn])
    G = np.column_stack([np.cos(angles), np.sin(angles)])
    corner = np.array([0.3, 0.2])
    # The wedge opens to one side of its corner; what is wanted lies on the other.
    wanted = corner + G.sum(axis=0) / np.sqrt((G.sum(axis=0) ** 2).sum())
    program = ConvexProgram(np.eye(2), -wanted, G, G @ corner)
    x, multipliers = nearest(program)
    assert multipliers.min() > 0.0
    polished = polish(program, answer(x + 1e-5, multipliers), tolerance=TOLERANCE)
    assert np.array_equal(polished.x, x)


@given(hundredth=st.integers(0, 628), along=st.floats(-0.5, 0.5))
def test_a_tie_of_a_linear_program_is_left_where_it_is(hundredth: int, along: float) -> None:
    # Head-on: all velocities along the bisector violate equally, but for the last bit of cos(angle + pi).
    sides = 2.0 * np.pi * np.arange(64) / 64
    angles = np.concatenate([sides, 0.01 * hundredth + np.array([0.0, np.pi])])
    soft = np.arange(66) >= 64
    G = np.column_stack([np.cos(angles), np.sin(angles), np.where(soft, -1.0, 0.0)])
    h = np.where(soft, -0.1, 1.0)
    program = ConvexProgram(np.zeros((3, 3)), np.array([0.0, 0.0, 1.0]), G, h)
    x = np.array([-along * G[64, 1], along * G[64, 0], 0.1])
    polished = polish(program, answer(x + 1e-5, np.where(soft, 0.5, 0.0)), tolerance=TOLERANCE)
    assert polished.x[2] == pytest.approx(0.1, abs=1e-15)
    assert np.abs(polished.x - x).max() <= 1e-2
    assert certify(program, polished, radius=2.0, exact=True)


@given(program=permitted_programs())
def test_polishing_again_changes_nothing(program: ConvexProgram) -> None:
    once = polish(program, answer(*nearest(program)), tolerance=TOLERANCE)
    twice = polish(program, once, tolerance=TOLERANCE)
    assert np.array_equal(once.x, twice.x)
    assert np.array_equal(once.multipliers, twice.multipliers)


@given(program=permitted_programs(), angle=st.floats(0.0, 6.28), away=st.floats(2.0, 100.0))
def test_a_wrong_point_stays_wrong(program: ConvexProgram, angle: float, away: float) -> None:
    x, multipliers = nearest(program)
    step = away * MAX_MOVE * max(1.0, float(np.sqrt(x @ x)))
    wrong = answer(x + step * np.array([np.cos(angle), np.sin(angle)]), multipliers)
    # The limit grows with the length of the point given.
    assume(np.sqrt(wrong.x @ wrong.x) * MAX_MOVE < 0.99 * step)
    assert polish(program, wrong, tolerance=TOLERANCE) is wrong


@given(stages=second_stage_programs(), shift=st.floats(0.05, 1.0), sign=st.sampled_from([-1, 1]))
def test_a_wrong_least_violation_stays_wrong(stages: SecondStage, shift: float, sign: int) -> None:
    corner = exact_least_violation(stages.first)
    assert corner is not None
    x = np.array(corner, dtype=np.float64) + np.array([0.0, 0.0, sign * shift])
    wrong = answer(x, np.full(stages.first.num_rows, np.nan))
    assert polish(stages.first, wrong, tolerance=TOLERANCE) is wrong


@pytest.mark.parametrize(
    ("x", "status"),
    [
        ([np.nan, 0.0], Status.OPTIMAL),
        ([np.inf, 0.0], Status.OPTIMAL),
        ([1e200, 0.0], Status.OPTIMAL),
        ([1.0, 0.0, 0.0], Status.OPTIMAL),
        ([1.0, 1e-4], Status.INFEASIBLE),
        ([1.0, 1e-4], Status.TIME_LIMIT),
    ],
)
def test_an_answer_without_a_usable_point_is_returned_itself(
    x: list[float], status: Status
) -> None:
    program = ConvexProgram(np.eye(2), np.array([-2.0, 0.0]), np.eye(2), np.ones(2))
    hopeless = answer(np.array(x), np.array([1.0, 0.0]), status)
    assert polish(program, hopeless, tolerance=TOLERANCE) is hopeless


@pytest.mark.parametrize("curvature", [0.0, -1.0])
def test_a_program_that_is_neither_linear_nor_strictly_convex_is_left_alone(
    curvature: float,
) -> None:
    program = ConvexProgram(np.diag([1.0, curvature]), np.array([-2.0, 0.0]), np.eye(2), np.ones(2))
    rough = answer(np.array([1.0, 1e-4]), np.array([1.0, 0.0]))
    assert polish(program, rough, tolerance=TOLERANCE) is rough


def test_an_inaccurate_answer_becomes_optimal() -> None:
    program = ConvexProgram(np.eye(2), np.array([-2.0, 0.0]), np.eye(2), np.ones(2))
    rough = answer(np.array([1.0, 1e-4]), np.array([1.0, 0.0]), Status.INACCURATE)
    assert polish(program, rough, tolerance=TOLERANCE).status is Status.OPTIMAL


def test_contradictory_rows_are_not_polished_into_an_answer() -> None:
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    program = ConvexProgram(np.eye(2), np.array([-2.0, 0.0]), G, np.array([0.0, -1e-3]))
    claimed = answer(np.array([0.0, 0.0]), np.array([2.0, 0.0]))
    assert polish(program, claimed, tolerance=TOLERANCE) is claimed


def test_the_number_of_steps_is_bounded() -> None:
    # A polygon of a thousand sides around x: nothing is known of the rows, and x sits at a distance where none is near.
    angles = np.linspace(0.0, 2.0 * np.pi, 1001)[:-1]
    G = np.column_stack([np.cos(angles), np.sin(angles)])
    spread = replace(answer(np.zeros(2), np.full(1000, np.nan)), multipliers=np.full(1000, np.nan))
    program = ConvexProgram(np.eye(2), np.array([-3.0, -1.0]), G, np.full(1000, 1e-2))
    assert polish(program, spread, tolerance=TOLERANCE) is spread


def test_rows_are_ordered_by_how_sure_they_are_active() -> None:
    G = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    program = ConvexProgram(np.eye(2), np.array([-2.0, 0.0]), G, np.array([1.0, 1e-3, 1.0]))
    x = np.array([1.0 - 1e-4, 0.0])
    assert likely_active(program, answer(x, np.array([1.0, 0.1, 0.5]))) == [0, 1]
    assert likely_active(program, answer(x, np.array([1.0, 0.0, 0.5]))) == [0]
    assert likely_active(program, answer(x, np.full(3, np.nan))) == [0, 1]
    assert likely_active(program, answer(x, np.zeros(3))) == [0, 1]
