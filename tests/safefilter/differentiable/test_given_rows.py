from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.differentiable.answer import unit_rows
from safefilter.differentiable.given_rows import (
    ALL_USABLE,
    GivenRows,
    proof_radius,
    take_rows,
)
from safefilter.jit import source_of

Ask = Callable[..., Any]


def taken(rows: GivenRows, k: int = 0) -> tuple[RowLabels, tuple[int, int, int]]:
    """Rows of one decision, by the formula in plain Python."""
    _, num_rows, size = rows.normals.shape
    buffers = row_buffers(1, num_rows, size)
    own = RowLabels(buffers.array[0], buffers.label[0])
    with np.errstate(all="ignore"):
        return own, source_of(take_rows)(rows, k, size, own)


def given_rows(
    normals: list[list[float]],
    offsets: list[float],
    hard: list[bool] | None = None,
    present: list[bool] | None = None,
) -> GivenRows:
    num_rows = len(offsets)
    return GivenRows(
        np.array([normals]),
        np.array([offsets]),
        np.array([hard or [False] * num_rows]),
        np.array([present or [True] * num_rows]),
    )


def test_hard_rows_come_first_and_absent_ones_not_at_all() -> None:
    rows = given_rows(
        [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]],
        [0.1, 0.2, 0.3, 0.4],
        [False, True, False, True],
        [True, True, False, True],
    )
    own, counts = taken(rows)
    assert counts == (3, 2, ALL_USABLE)
    assert own.label[0, :3].tolist() == [1, 3, 0]
    assert own.array[:, :3].T.tolist() == [[0.0, 1.0, 0.2], [0.0, -1.0, 0.4], [1.0, 0.0, 0.1]]


@given(seed=st.integers(0, 10**6), size=st.integers(1, 6), power=st.integers(-9, 9))
@example(seed=0, size=2, power=0)
def test_rows_are_those_of_torch_to_the_bit(ask: Ask, seed: int, size: int, power: int) -> None:
    question = ask(seed, 4, size, 7)
    # Half of the rows are of length one, as they are in a filter.
    question.normals[:, ::2] *= 1.7**power
    expected = unit_rows(question.rows)
    for k in range(4):
        own, (count, num_hard, unusable) = taken(GivenRows(*(f.numpy() for f in question.rows)), k)
        order = own.label[0, :count]
        assert unusable == ALL_USABLE
        assert question.hard[k, order[:num_hard]].all()
        assert not question.hard[k, order[num_hard:]].any()
        assert sorted(order) == np.flatnonzero(question.present[k]).tolist()
        offsets, normals = expected.offsets[k, order].numpy(), expected.normals[k, order].numpy()
        # Above `products.FEW` columns torch sums squares in an order of its own.
        rounding = 0.0 if size <= 4 else 1e-15
        np.testing.assert_allclose(own.array[size, :count], offsets, rtol=rounding)
        np.testing.assert_allclose(own.array[:size, :count].T, normals, rtol=rounding)


@pytest.mark.parametrize(
    ("normal", "offset"),
    [
        ([0.0, 0.0], 0.1),
        ([np.nan, 0.0], 0.1),
        ([np.inf, 0.0], 0.1),
        ([1e200, 0.0], 0.1),
        ([1.0, 0.0], np.nan),
        ([1.0, 0.0], -np.inf),
        ([3.0, 0.0], np.inf),
    ],
)
def test_the_first_row_that_cannot_be_used_is_named_unless_absent(
    normal: list[float], offset: float
) -> None:
    normals, offsets = [[1.0, 0.0], normal, normal], [0.1, offset, offset]
    assert taken(given_rows(normals, offsets))[1] == (3, 0, 1)
    # Hard rows go first in the buffer, and are not the first of the caller's for that.
    assert taken(given_rows(normals, offsets, [False, False, True]))[1] == (3, 1, 1)
    absent = given_rows(normals, offsets, present=[True, False, False])
    assert taken(absent)[1] == (1, 0, ALL_USABLE)


def test_the_proof_of_t_covers_points_a_thousand_times_as_far_as_rows() -> None:
    own, (count, _, _) = taken(given_rows([[1.0], [-1.0]], [0.5, -3.0]))
    assert source_of(proof_radius)(own, 1, count) == pytest.approx(4000.0)
    assert source_of(proof_radius)(own, 1, 0) == pytest.approx(1000.0)
