from __future__ import annotations

import numba
import numpy as np
import pytest

from safefilter.batch.records import LAYOUT, Outcome, empty_results, outcome_of
from safefilter.decision import Decision
from safefilter.jit import source_of

NUM_DECISIONS = 3
DIMENSIONS = sorted(LAYOUT)


def outcome(dimension: int) -> Outcome:
    return source_of(outcome_of)(np.zeros(NUM_DECISIONS, LAYOUT[dimension]))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_every_field_of_a_result_is_the_column_of_its_name(dimension: int) -> None:
    results = np.zeros(NUM_DECISIONS, LAYOUT[dimension])
    named = source_of(outcome_of)(results)
    assert LAYOUT[dimension].names == Outcome._fields
    for name, column in named._asdict().items():
        assert column.__array_interface__ == results[name].__array_interface__


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("num_decisions", [0, 1, NUM_DECISIONS])
def test_room_for_results_is_an_array_of_its_own(dimension: int, num_decisions: int) -> None:
    room, usual = (
        empty_results(num_decisions, dimension),
        np.empty(num_decisions, LAYOUT[dimension]),
    )
    # For another kind every kernel would be compiled once more.
    kind, usual_kind = (numba.typeof(array) for array in (room, usual))  # type: ignore[no-untyped-call]  # numba has none
    assert kind == usual_kind
    assert room.shape == usual.shape
    assert room.flags.writeable
    assert not np.shares_memory(room, empty_results(num_decisions, dimension))


def test_the_names_are_those_of_a_decision() -> None:
    assert set(Outcome._fields) <= set(Decision.__dataclass_fields__)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_each_decision_has_its_row_in_every_column(dimension: int) -> None:
    columns = outcome(dimension)
    assert {len(column) for column in columns} == {NUM_DECISIONS}
    labels = [columns.active.shape[1], columns.proof.shape[1]]
    assert labels == [2 * dimension, 2 * (dimension + 1)]
    weights = [columns.multipliers.shape[1], columns.proof_multipliers.shape[1]]
    assert weights == [dimension, dimension + 1]


def test_flags_are_truth_values() -> None:
    columns = outcome(2)
    for flag in (columns.certified, columns.optimal, columns.capped):
        assert flag.dtype == np.bool_
