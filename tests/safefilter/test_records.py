from __future__ import annotations

import numpy as np
import pytest

from safefilter.batch.records import Outcome, Results, cut_column, outcome_of
from safefilter.decision import Decision
from safefilter.jit import source_of

NUM_DECISIONS = 3


def test_every_number_of_a_result_has_exactly_one_name() -> None:
    results = Results.empty(NUM_DECISIONS)
    outcome = source_of(outcome_of)(results)
    for block in results:
        block[...] = 0
    for column in outcome:
        # One with two names would come to 2, or be turned back to False.
        turn = np.logical_xor if column.dtype == np.bool_ else np.add
        turn(column, 1, out=column)
    for block in results:
        assert (block == 1).all()


def test_the_names_are_those_of_a_decision() -> None:
    assert set(Outcome._fields) <= set(Decision.__dataclass_fields__)


def test_each_decision_has_its_row_in_every_column() -> None:
    outcome = source_of(outcome_of)(Results.empty(NUM_DECISIONS))
    assert {len(column) for column in outcome} == {NUM_DECISIONS}
    assert [outcome.active.shape[1], outcome.proof.shape[1]] == [2 * 2, 2 * 3]
    assert [outcome.multipliers.shape[1], outcome.proof_multipliers.shape[1]] == [2, 3]


def test_flags_are_truth_values() -> None:
    outcome = source_of(outcome_of)(Results.empty(NUM_DECISIONS))
    for flag in (outcome.certified, outcome.optimal, outcome.capped):
        assert flag.dtype == np.bool_


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("field", Outcome._fields)
def test_a_column_cut_out_alone_is_the_one_of_that_name(field: str, dimension: int) -> None:
    results = Results.empty(NUM_DECISIONS, dimension)
    column = cut_column(results, field)
    named = getattr(source_of(outcome_of)(results), field)
    assert column.__array_interface__ == named.__array_interface__
