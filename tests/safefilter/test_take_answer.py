from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import safefilter as sf
from safefilter.backend_answer import BackendAnswer
from safefilter.batch.records import Outcome
from safefilter.decision import Case, Fault
from safefilter.take_answer import take_answer, write_rows

TOLERANCE = 1e-9

# Three rows in the plane, the second of them absent: u_0 >= 0 (hard), u_1 >= 1 (soft).
ROWS = sf.HalfSpaces(
    normals=np.array([[[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]),
    offsets=np.array([[0.0, 9.0, 1.0]]),
    hard=np.array([[True, True, False]]),
    present=np.array([[True, False, True]]),
    labels=np.array([[[0, 3], [0, 4], [1, 5]]]),
    sources=("box", "wish"),
)
# Its multipliers belong to the present rows, the first and the third.
ANSWER = BackendAnswer(
    fault=Fault.NONE,
    case=Case.LEAST_VIOLATION,
    velocity=np.array([0.25, 0.5]),
    multipliers=np.array([0.0, 2.0]),
    proof=np.array([0.5, 1.0]),
    build_time=0.0,
    solve_time=0.0,
)


def empty_outcome() -> Outcome:
    codes, flags = np.zeros((1, 2), dtype=np.int8), np.zeros((1, 3), dtype=np.bool_)
    return Outcome(
        action=np.zeros((1, 2)),
        velocity=np.zeros((1, 2)),
        correction=np.zeros(1),
        violation=np.zeros(1),
        multipliers=np.zeros((1, 2)),
        proof_multipliers=np.zeros((1, 3)),
        active=np.zeros((1, 4), dtype=np.int64),
        proof=np.zeros((1, 6), dtype=np.int64),
        case=codes[:, 0],
        fault=codes[:, 1],
        certified=flags[:, 0],
        optimal=flags[:, 1],
        capped=flags[:, 2],
    )


def taken(answer: BackendAnswer) -> sf.Decision:
    outcome = empty_outcome()
    take_answer(outcome, 0, ROWS, answer, TOLERANCE)
    return sf.Decision.of_columns(
        partial(getattr, outcome),
        action=outcome.action,
        wanted=np.zeros((1, 2)),
        index=np.array([7]),
        backend="someone",
        build_time=1.0,
        solve_time=2.0,
    )


def test_an_answer_is_reported_by_label() -> None:
    decision = taken(ANSWER)
    assert decision.case.tolist() == [3]
    assert decision.velocity.tolist() == [[0.25, 0.5]]
    assert decision.violation.tolist() == [0.5]
    assert decision.active.tolist() == [[[1, 5], [-1, -1]]]
    assert decision.multipliers.tolist() == [[2.0, 0.0]]
    assert decision.proof.tolist() == [[[1, 5], [0, 3], [-1, -1]]]
    assert decision.proof_multipliers.tolist() == [[1.0, 0.5, 0.0]]
    assert decision.optimal.tolist() == [True]


def test_a_fault_is_written_beside_what_was_there() -> None:
    outcome = empty_outcome()
    outcome.velocity[0] = [0.1, 0.2]
    take_answer(outcome, 0, ROWS, replace(ANSWER, fault=Fault.BACKEND_REJECTED), TOLERANCE)
    assert outcome.fault.tolist() == [Fault.BACKEND_REJECTED]
    assert outcome.velocity.tolist() == [[0.1, 0.2]]
    assert outcome.optimal.tolist() == [0]


@pytest.mark.parametrize(("smallest", "is_optimal"), [(0.5 * TOLERANCE, True), (1e-6, False)])
def test_a_proof_with_more_multipliers_than_places_is_none_unless_the_rest_is_rounding(
    smallest: float, is_optimal: bool
) -> None:
    rows = replace(ROWS, present=np.ones((1, 3), dtype=np.bool_))
    outcome = empty_outcome()
    many = replace(ANSWER, multipliers=np.array([1.0, smallest, 2.0]), proof=np.zeros(3))
    take_answer(outcome, 0, rows, many, TOLERANCE)
    assert outcome.multipliers.tolist() == [[2.0, 1.0]]
    assert bool(outcome.optimal[0]) is is_optimal


def test_more_places_than_rows_stay_empty() -> None:
    places, weights = np.zeros(6, dtype=np.int64), np.ones(3)
    left_out = write_rows(places, weights, ROWS, 0, np.array([0.25, 0.0]))
    assert left_out == 0.0
    assert places.tolist() == [0, 3, -1, -1, -1, -1]
    assert weights.tolist() == [0.25, 0.0, 0.0]
