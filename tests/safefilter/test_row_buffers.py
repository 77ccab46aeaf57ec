"""Rows written by kernels become the same rows as `HalfSpaces`."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.row_buffers import half_spaces_from_rows, row_buffers


def test_buffers_start_empty() -> None:
    buffers = row_buffers(2, 3)
    assert buffers.array.shape == (2, 3, 3)
    assert buffers.label.shape == (2, 2, 3)
    assert buffers.label.dtype == np.int64
    assert not buffers.array.any()
    assert not buffers.label.any()


def test_no_decision_and_no_row_are_allowed() -> None:
    for batch, capacity in ((0, 3), (2, 0)):
        buffers = row_buffers(batch, capacity)
        nothing = np.zeros(batch, dtype=np.int64)
        rows = half_spaces_from_rows(*buffers, nothing, nothing, ())
        assert (rows.num_decisions, rows.num_rows, rows.dimension) == (batch, capacity, 2)


@given(
    counts=st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), max_size=4),
    seed=st.integers(0, 9),
)
def test_columns_become_rows(counts: list[tuple[int, int]], seed: int) -> None:
    rng, capacity, batch = np.random.default_rng(seed), 5, len(counts)
    angle = rng.uniform(0.0, 6.28, (batch, capacity))
    buffers = row_buffers(batch, capacity)
    buffers.array[:] = np.stack([np.cos(angle), np.sin(angle), angle], axis=1)
    buffers.label[:] = rng.integers(0, 9, buffers.label.shape)
    hard = np.array([min(pair) for pair in counts], dtype=np.int64)
    present = np.array([max(pair) for pair in counts], dtype=np.int64)
    rows = half_spaces_from_rows(*buffers, present, hard, ("a", "b"))
    assert rows.sources == ("a", "b")
    for b in range(batch):
        for m in range(capacity):
            assert rows.normals[b, m].tolist() == [np.cos(angle[b, m]), np.sin(angle[b, m])]
            assert rows.offsets[b, m] == angle[b, m]
            assert rows.labels[b, m].tolist() == buffers.label[b, :, m].tolist()
            assert rows.present[b, m] == (m < present[b])
            assert rows.hard[b, m] == (m < hard[b])
